//! The promises of the project live in `tests/`; this library is empty.
