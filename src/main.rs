//! The `mocban` program.

fn main() {}
