//! What the targets share with the tests of the package.
#![allow(dead_code, reason = "the tests use the rest")]

#[path = "../../it/seeds.rs"]
mod seeds;
#[path = "../../it/tiff_file.rs"]
mod tiff_file;

/// Fails unless a message is one a user may see.
pub fn one_sentence(message: &str) {
    seeds::assert_one_sentence(message);
}

/// Whole images of every kind.
pub fn images() -> Vec<Vec<u8>> {
    seeds::images()
        .into_iter()
        .map(|(_, bytes)| bytes)
        .collect()
}
