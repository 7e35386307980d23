//! What can be meant in two ways.
//!
//! *in* a message that names the option which settles it; *out* an error that the program tells from other ones by its exit code.

/// The message.
#[derive(Debug)]
pub(super) struct Ambiguous(pub(super) String);

impl std::fmt::Display for Ambiguous {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Ambiguous {}
