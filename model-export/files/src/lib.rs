//! Files and texts that somebody else made, or that shall survive a failure.
//!
//! *in* paths, bytes, texts; *out* bytes within a limit, files that are whole, texts that can be printed; *never* a file replaced
//! that is no file, an input overwritten, a set of files of which some are old and some are new after an error or Ctrl-C, or a
//! control character on a terminal; *source* OWASP's notes on CSV injection; Unicode TR 36 on bidirectional text.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `text` | texts that are seen and not obeyed |
//! | 1 | `reading`, `interruption` | regular files within a limit; what is removed when a signal ends the program |
//! | 2 | `name` | names that are plain file names |
//! | 2 | `place` | what stands where a file shall be written, and whether it is an input |
//! | 3 | `replacement` | files written whole or not at all, one or a set |

pub mod interruption;
pub mod name;
pub mod place;
pub mod reading;
pub mod replacement;
pub mod text;
