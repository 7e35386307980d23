//! Model export.
fn main() {}
