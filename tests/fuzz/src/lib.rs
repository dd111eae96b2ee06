//! Helpers of the fuzz targets, shared with the integration tests.
#![allow(dead_code, reason = "the integration tests use the other functions")]

#[path = "../../it/sample_files.rs"]
mod sample_files;
#[path = "../../it/tiff_file.rs"]
mod tiff_file;

/// Asserts that a message is one readable line.
pub fn one_sentence(message: &str) {
    sample_files::assert_one_sentence(message);
}

/// Returns valid images of every kind.
pub fn images() -> Vec<Vec<u8>> {
    sample_files::images()
        .into_iter()
        .map(|(_, bytes)| bytes)
        .collect()
}
