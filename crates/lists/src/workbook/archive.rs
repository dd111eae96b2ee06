//! The files of a workbook in its ZIP archive.

use std::io::Cursor;

use super::error::WorkbookError;
use crate::zip::{ZipArchive, ZipError, ZippedFile};

/// Largest size of a file after decompression, in bytes. Less in tests, which are not optimized.
const MAX_PART_BYTES: u64 = if cfg!(test) { 4 << 20 } else { 256 << 20 };
/// Maximum number of files. A workbook has a few for each sheet.
const MAX_FILES: usize = 10_000;

/// The archive of a workbook in memory.
pub(super) struct WorkbookArchive<'a>(ZipArchive<Cursor<&'a [u8]>>);

impl<'a> WorkbookArchive<'a> {
    /// Reads the directory of an archive.
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, WorkbookError> {
        let zip = ZipArchive::open(Cursor::new(bytes), MAX_FILES);
        Ok(Self(zip.map_err(|error| damaged(&error.to_string()))?))
    }

    /// Returns whether there is a file of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.file(name).is_some()
    }

    fn file(&self, name: &str) -> Option<&ZippedFile> {
        let mut files = self.0.files().iter().rev();
        files.find(|file| file.shown_name() == name)
    }

    /// Returns a file as text. `None` if there is none.
    pub(super) fn text(&self, name: &str) -> Result<Option<String>, WorkbookError> {
        let Some(file) = self.file(name) else {
            return Ok(None);
        };
        let mut content = Vec::new();
        let unpacked = self.0.unpack(file, MAX_PART_BYTES, &mut |piece| {
            content.extend_from_slice(piece);
            Ok(())
        });
        unpacked.map_err(|error| match error {
            ZipError::TooLarge(part) => WorkbookError::TooLarge {
                part,
                limit: MAX_PART_BYTES,
            },
            error => damaged(&error.to_string()),
        })?;
        let text = String::from_utf8(content);
        let text = text.map_err(|_error| damaged(&format!("{name} is not UTF-8")))?;
        Ok(Some(text))
    }
}

pub(super) fn damaged(reason: &str) -> WorkbookError {
    WorkbookError::Damaged(reason.to_owned())
}
