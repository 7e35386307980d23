//! Hand-over between tasks that interrupt each other, and between threads: no lock, no wait.
//!
//! *in* bytes or values of one producer; *out* the same at one consumer, which may run at a higher or a lower priority or on
//! another core; *never* a torn value, a lock, a spin or a masked interrupt; *source* Lamport 1983 (ring); Boehm 2012, "Can
//! seqlocks get along with programming language memory models?" (mailbox).
//!
//! With two producers or two consumers nothing is unsound, but bytes are lost and values mixed: that one rule is the caller's.

mod mailbox;
mod ring;

pub use mailbox::Mailbox;
pub use ring::ByteRing;
