//! pdnd
fn main() {}
