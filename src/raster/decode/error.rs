//! Why a print image could not be decoded.

use crate::domain::{FailureClass, FileKind};

/// Why a print image could not be decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// No bytes at all.
    #[error("the file is empty (0 bytes)")]
    Empty,
    /// The content is of another kind than PNG, JPEG or TIFF.
    #[error("the file is {0}; PNG, JPEG and TIFF images are read")]
    NotAnImage(FileKind),
    /// More bytes than the settings allow.
    #[error("the file has {bytes} bytes; limits.image.max_bytes is {limit}")]
    TooManyBytes {
        /// Size of the file.
        bytes: u64,
        /// The setting.
        limit: u64,
    },
    /// More pixels than the settings allow, by the header.
    #[error("the image is {width} x {height} pixels; limits.image.max_pixels is {limit}")]
    TooManyPixels {
        /// Columns by the header.
        width: u32,
        /// Rows by the header.
        height: u32,
        /// The setting.
        limit: u64,
    },
    /// A side of no length.
    #[error("the image is {width} x {height} pixels: it has no pixels")]
    NoPixels {
        /// Columns by the header.
        width: u32,
        /// Rows by the header.
        height: u32,
    },
    /// The file ends before the image does.
    #[error("the {} is truncated: it ends before the image does", .0.name())]
    Truncated(FileKind),
    /// The file breaks its own format, or uses a part of it that is not read.
    #[error("the {} cannot be decoded: {reason}", .kind.name())]
    Broken {
        /// What the file claims to be.
        kind: FileKind,
        /// The decoder's words.
        reason: String,
    },
}

impl DecodeError {
    /// Decides retry or quarantine: the file is at fault in every case.
    pub const fn class(&self) -> FailureClass {
        FailureClass::BadInput
    }
}
