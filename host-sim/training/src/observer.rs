//! Who watches a run that takes long.

/// Watches the run.
pub trait Observer: Sync {
    /// A stage begins or ends.
    fn stage(&self, text: &str);
    /// Steps done, of all.
    fn steps(&self, done: u64, of: u64);
}
