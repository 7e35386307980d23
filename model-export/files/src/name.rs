//! Names from files and arguments that become part of a path.
//!
//! *in* a name; *out* the same, if it is a plain file name; *never* a separator, a name that leads elsewhere, a hidden file, or a
//! character that acts on a terminal; *source* POSIX, and the names that Windows reserves.

use crate::text;

/// Longest name, bytes: systems take 255, with room for endings.
pub const LONGEST: usize = 200;

/// A name that is no plain file name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NameError {
    name: String,
    reason: &'static str,
}

impl std::fmt::Display for NameError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shown: String = self.name.chars().take(64).collect();
        write!(f, "`{}` is no plain file name: {}", text::line(&shown), self.reason)
    }
}

impl std::error::Error for NameError {}

/// The name, if a file in any folder can be called so on every system.
///
/// # Errors
/// Says what is wrong with it.
pub fn plain(name: &str) -> Result<&str, NameError> {
    let refuse = |reason| Err(NameError { name: name.into(), reason });
    let stem = name.split('.').next().unwrap_or_default().to_ascii_uppercase();
    let numbered =
        |prefix: &str| stem.strip_prefix(prefix).is_some_and(|rest| rest.len() == 1 && rest.as_bytes()[0].is_ascii_digit());
    if name.is_empty() {
        refuse("it is empty")
    } else if name.len() > LONGEST {
        refuse("it is longer than 200 bytes")
    } else if name.contains(['/', '\\', ':']) {
        refuse("it holds a separator of folders")
    } else if name.starts_with('.') {
        refuse("it begins with a dot")
    } else if name.chars().any(text::acts) {
        refuse("it holds a character that cannot be seen")
    } else if name.contains(['<', '>', '"', '|', '?', '*']) || name.ends_with(['.', ' ']) || name.starts_with([' ', '-']) {
        refuse("it holds <, >, \", |, ? or *, begins with a space or hyphen, or ends with a dot or space")
    } else if matches!(stem.as_str(), "CON" | "PRN" | "AUX" | "NUL") || numbered("COM") || numbered("LPT") {
        refuse("a device is called so")
    } else {
        Ok(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_leads_elsewhere_is_refused() {
        for name in
            ["", ".", "..", "x/../..", "/etc/passwd", "a\\b", "C:x", "a\0b", "a\nb", ".hidden", "nul.csv", "-rf", "a\u{202e}b"]
        {
            assert!(plain(name).is_err(), "{name:?}");
        }
        for name in ["model", "crazyflie-stock-lab-seed1", "draws-crazyflie_stock_lab-3-of-16", "a b", "größer", "v1.2"] {
            assert_eq!(plain(name), Ok(name));
        }
        assert_eq!(plain("x/../..").unwrap_err().to_string(), "`x/../..` is no plain file name: it holds a separator of folders");
    }

    proptest! {
        #[test]
        fn a_plain_name_stays_in_its_folder(name in any::<String>()) {
            if let Ok(name) = plain(&name) {
                let joined = std::path::Path::new("out").join(name);
                prop_assert_eq!(joined.parent(), Some(std::path::Path::new("out")));
                prop_assert_eq!(joined.file_name().and_then(|last| last.to_str()), Some(name));
            }
        }
    }
}
