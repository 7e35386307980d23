//! Table of contents of the promises.
