//! Signed models: keys in files, and the trailer behind a model file.
//!
//! *in* a model file and a private key; *out* the same bytes with a trailer ([`trailer`]) behind them; *never* a private key that
//! others may read, or a key file replaced: who loses a key cannot sign for the vehicles that trust it; *source* Ed25519
//! (RFC 8032) by `ed25519-compact`, which the firmware checks with.
//!
//! A key file is one line of text, what it is and 64 hexadecimal digits: of the private key its seed.

use std::{
    fs::{self, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
};

use ed25519_compact::{KeyPair, PublicKey, Seed, Signature};
use impromptu_firmware::model::trailer::{self, SignedFile};

/// First word of a file with a private key.
pub const PRIVATE: &str = "impromptu-private-key";
/// First word of a file with a public key.
pub const PUBLIC: &str = "impromptu-public-key";

/// Why keys are not made or read, or a model is not signed.
#[derive(Debug, thiserror::Error)]
pub enum SigningError {
    /// The operating system refused.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A key file would be replaced.
    #[error("{0}: exists, and a key is never replaced: give another name, or move the file away")]
    Exists(PathBuf),
    /// No key of the kind that is needed.
    #[error("{path}: holds no Ed25519 {wanted} key: give NAME of `keygen NAME` for the private one, NAME.pub for the public one")]
    NotAKey {
        /// The file.
        path: PathBuf,
        /// `private` or `public`.
        wanted: &'static str,
    },
    /// The operating system has no random numbers.
    #[error("the operating system gives no random numbers: make the key on another machine")]
    NoRandomness,
    /// There is a trailer already.
    #[error("the model is signed already, as version {0}: sign the file that export wrote")]
    Signed(u32),
    /// The file has no trailer.
    #[error("the model is not signed: sign it with model-export sign")]
    Unsigned,
    /// The signature is of another key or of other bytes.
    #[error("this key has not signed the model as it is: give the signer's public key, or copy the model again")]
    Wrong,
}

/// The private key: signs.
pub struct PrivateKey(KeyPair);

/// The name of the public key's file beside the private one's.
pub fn public_path(private: &Path) -> PathBuf {
    let mut name = private.as_os_str().to_owned();
    name.push(".pub");
    name.into()
}

/// The first word and the key of a file's only line.
fn parse(text: &str, word: &str) -> Option<[u8; 32]> {
    let digits = text.trim().strip_prefix(word)?.strip_prefix(' ')?;
    if digits.len() != 64 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let mut key = [0; 32];
    for (index, byte) in key.iter_mut().enumerate() {
        *byte = u8::from_str_radix(digits.get(2 * index..2 * index + 2)?, 16).ok()?;
    }
    Some(key)
}

fn read_key(path: &Path, word: &str, wanted: &'static str) -> Result<[u8; 32], SigningError> {
    // Whatever is given, not more of it than a key has; it need not be text.
    let mut bytes = Vec::new();
    let file = fs::File::open(path).map_err(|source| SigningError::Io { path: path.into(), source })?;
    io::Read::read_to_end(&mut io::Read::take(file, 256), &mut bytes)
        .map_err(|source| SigningError::Io { path: path.into(), source })?;
    let key = str::from_utf8(&bytes).ok().and_then(|text| parse(text, word));
    key.ok_or(SigningError::NotAKey { path: path.into(), wanted })
}

/// Writes a file that was not there, at once with the mode that it shall have.
fn create(path: &Path, mode: u32, text: &str) -> Result<(), SigningError> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode);
    #[cfg(not(unix))]
    let _ = mode;
    let mut file = options.open(path).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => SigningError::Exists(path.into()),
        _ => SigningError::Io { path: path.into(), source },
    })?;
    let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all());
    written.map_err(|source| {
        // It is ours, and half a key is none.
        let _ = fs::remove_file(path);
        SigningError::Io { path: path.into(), source }
    })
}

impl PrivateKey {
    /// A new key, of what the operating system gives.
    ///
    /// # Errors
    /// If it gives nothing.
    pub fn generate() -> Result<Self, SigningError> {
        let mut seed = [0; 32];
        getrandom::fill(&mut seed).map_err(|_| SigningError::NoRandomness)?;
        Self::from_seed(seed).ok_or(SigningError::NoRandomness)
    }

    /// The key of this seed; none of zeros, which nobody has drawn.
    pub fn from_seed(seed: [u8; 32]) -> Option<Self> {
        KeyPair::try_from_seed(Seed::new(seed)).ok().map(Self)
    }

    /// Reads a private key.
    ///
    /// # Errors
    /// If the file cannot be read or holds no private key.
    pub fn read(path: &Path) -> Result<Self, SigningError> {
        let seed = read_key(path, PRIVATE, "private")?;
        Self::from_seed(seed).ok_or_else(|| SigningError::NotAKey { path: path.into(), wanted: "private" })
    }

    /// Writes the private key, readable by its owner only, and the public one beside it ([`public_path`]).
    ///
    /// # Errors
    /// If one of them exists or cannot be written; then neither is left.
    pub fn write(&self, path: &Path) -> Result<(), SigningError> {
        let beside = public_path(path);
        create(&beside, 0o644, &format!("{PUBLIC} {}\n", hex(&self.public())))?;
        let private = format!("{PRIVATE} {}\n", hex(self.0.sk.seed().as_ref()));
        create(path, 0o600, &private).inspect_err(|_| {
            let _ = fs::remove_file(&beside);
        })
    }

    /// The public key's bytes.
    pub fn public(&self) -> [u8; 32] {
        *self.0.pk
    }

    /// The file with a trailer behind it. Whoever stores it takes no lower version afterwards.
    ///
    /// # Errors
    /// If the file is signed already.
    pub fn sign(&self, file: &[u8], version: u32) -> Result<Vec<u8>, SigningError> {
        if let Some(signed) = trailer::split(file) {
            return Err(SigningError::Signed(signed.version));
        }
        let mut bytes = file.to_vec();
        bytes.extend(trailer::signed_part(version, file.len() as u32));
        // Deterministic: the same key, file and version give the same bytes.
        let signature = self.0.sk.sign(&bytes, None);
        bytes.extend(*signature);
        Ok(bytes)
    }
}

/// The digits of a key.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads a public key.
///
/// # Errors
/// If the file cannot be read or holds no public key.
pub fn read_public(path: &Path) -> Result<[u8; 32], SigningError> {
    read_key(path, PUBLIC, "public")
}

/// The model file within signed bytes, and its version, if this public key's owner has signed them.
///
/// # Errors
/// If they are not signed, or not by this key.
pub fn verify<'a>(bytes: &'a [u8], public: &[u8; 32]) -> Result<SignedFile<'a>, SigningError> {
    let signed = trailer::split(bytes).ok_or(SigningError::Unsigned)?;
    let signature = Signature::new(*signed.signature);
    PublicKey::new(*public).verify(signed.message, &signature).map_err(|_| SigningError::Wrong)?;
    Ok(signed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signature_is_that_of_rfc_8032() {
        // Section 7.1, test 2: the key pair; the signature is over one byte there, so only the key is compared.
        let seed = "4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb";
        let public = "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c";
        let key = PrivateKey::from_seed(parse(&format!("{PRIVATE} {seed}"), PRIVATE).unwrap()).unwrap();
        assert_eq!(hex(&key.public()), public);
        let signature = key.0.sk.sign([0x72], None);
        assert!(hex(&*signature).starts_with("92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da"));
    }

    #[test]
    fn keys_are_written_once_and_for_their_owner_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key");
        let key = PrivateKey::generate().unwrap();
        key.write(&path).unwrap();
        let text = fs::read(&path).unwrap();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        assert!(matches!(PrivateKey::generate().unwrap().write(&path), Err(SigningError::Exists(_))));
        assert_eq!(fs::read(&path).unwrap(), text);
        assert_eq!(PrivateKey::read(&path).unwrap().public(), key.public());
        assert_eq!(read_public(&public_path(&path)).unwrap(), key.public());
        // The one for the other is said so; a private key that is in the way leaves no public one behind.
        for (refused, wanted) in [
            (PrivateKey::read(&public_path(&path)).map(|_| ()), "private key"),
            (read_public(&path).map(|_| ()), "public key"),
            (read_public(folder.path()).map(|_| ()), "directory"),
        ] {
            let words = refused.unwrap_err().to_string();
            assert!(words.contains(wanted), "{words}");
        }
        fs::remove_file(public_path(&path)).unwrap();
        assert!(matches!(key.write(&path), Err(SigningError::Exists(_))));
        assert!(!public_path(&path).exists() && fs::read(&path).unwrap() == text);
    }

    #[test]
    fn every_flipped_bit_is_refused() {
        let (key, file) = (PrivateKey::from_seed([7; 32]).unwrap(), [3; 40]);
        let signed = key.sign(&file, 5).unwrap();
        let found = verify(&signed, &key.public()).unwrap();
        assert_eq!((found.file, found.version), (&file[..], 5));
        assert!(matches!(key.sign(&signed, 6), Err(SigningError::Signed(5))));
        assert!(matches!(verify(&file, &key.public()), Err(SigningError::Unsigned)));
        assert!(matches!(verify(&signed, &PrivateKey::from_seed([8; 32]).unwrap().public()), Err(SigningError::Wrong)));
        for bit in 0..8 * signed.len() {
            let mut flipped = signed.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(verify(&flipped, &key.public()).is_err(), "bit {bit}");
        }
    }
}
