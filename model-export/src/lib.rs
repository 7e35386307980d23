//! Model export.
