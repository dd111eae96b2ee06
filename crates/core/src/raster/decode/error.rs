//! Errors of the print image decoder.

use crate::domain::{FailureClass, FileKind, ONLY_ZEROS, sanitize};

/// Why a print image could not be decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The file has no bytes.
    #[error("the file is empty (0 bytes)")]
    Empty,
    /// All bytes of the file are zero.
    #[error("the file {ONLY_ZEROS}")]
    OnlyZeros,
    /// The content is of another kind than PNG, JPEG or TIFF.
    #[error("{}", not_an_image(*.0))]
    NotAnImage(FileKind),
    /// More bytes than the settings allow.
    #[error("the file has {bytes} bytes; limits.image.max_bytes is {limit}")]
    TooManyBytes {
        /// Size of the file.
        bytes: u64,
        /// The setting.
        limit: u64,
    },
    /// More pixels than the settings allow, according to the header.
    #[error("the image is {width} x {height} pixels; limits.image.max_pixels is {limit}")]
    TooManyPixels {
        /// Columns in the header.
        width: u32,
        /// Rows in the header.
        height: u32,
        /// The setting.
        limit: u64,
    },
    /// A side of zero pixels.
    #[error("the image is {width} x {height} pixels: it has no pixels")]
    NoPixels {
        /// Columns in the header.
        width: u32,
        /// Rows in the header.
        height: u32,
    },
    /// A TIFF of several pages, of which not exactly one is a full page.
    #[error(
        "the TIFF image has {count} pages, {full} of them of full size; a print is one page: save it as its own file"
    )]
    Pages {
        /// Pages that are not marked as a reduced copy or a mask of another page.
        full: usize,
        /// All pages.
        count: usize,
    },
    /// The file ends before the image does.
    #[error("the {} is truncated: it ends before the image does", .0.name())]
    Truncated(FileKind),
    /// The content of the file was changed, as by a disk or a copy that failed.
    #[error(
        "the {} is damaged; copy it again, or open it in another program and save it as PNG (the decoder found: {found})",
        .kind.name()
    )]
    Damaged {
        /// The kind of file by its signature.
        kind: FileKind,
        /// What the decoder found.
        found: String,
    },
    /// The file violates its format, or uses an unsupported part of it.
    #[error("the {} cannot be decoded: {reason}", .kind.name())]
    Broken {
        /// The kind of file by its signature.
        kind: FileKind,
        /// The decoder's message.
        reason: String,
    },
}

impl DecodeError {
    /// Returns the failure class: the file is at fault in every case.
    pub const fn class(&self) -> FailureClass {
        FailureClass::BadInput
    }
}

/// Wraps a decoder's message, sanitised and on one line.
pub(super) fn broken(kind: FileKind, reason: &str) -> DecodeError {
    DecodeError::Broken {
        kind,
        reason: sanitize(reason, 160),
    }
}

/// Says what a decoder found in a damaged file, sanitised and on one line.
pub(super) fn damaged(kind: FileKind, found: &str) -> DecodeError {
    let found = found.trim_end_matches('.').replace("; ", ", ");
    DecodeError::Damaged {
        kind,
        found: sanitize(&found, 160),
    }
}

fn not_an_image(kind: FileKind) -> String {
    kind.refusal(
        "image",
        "PNG, JPEG and TIFF images",
        kind.image_content_advice(),
    )
}
