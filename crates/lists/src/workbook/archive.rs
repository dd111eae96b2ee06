//! Files in a ZIP archive in memory. Only what workbooks use is read: stored and deflated files below 4 GiB.

use std::collections::BTreeMap;
use std::io::Read as _;

use flate2::read::DeflateDecoder;

use super::error::WorkbookError;
use mocban_core::zip_records::{Crc, END, END_BYTES, ENTRY, ENTRY_BYTES, FILE, FILE_BYTES};

/// Largest size of a file after decompression, in bytes. Less in tests, which are not optimized.
const MAX_PART_BYTES: u64 = if cfg!(test) { 4 << 20 } else { 256 << 20 };
/// Maximum number of files. A workbook has a few for each sheet.
const MAX_FILES: usize = 10_000;

/// Longest comment at the end of an archive, in bytes.
const MAX_COMMENT: usize = u16::MAX as usize;

/// An archive and its directory.
pub(super) struct Archive<'a> {
    bytes: &'a [u8],
    files: BTreeMap<String, ArchivedFile>,
}

/// Where a file is, and how it is packed.
struct ArchivedFile {
    /// Start of its record.
    at: usize,
    /// Length as packed, in bytes.
    packed: usize,
    method: u16,
    checksum: u32,
}

impl<'a> Archive<'a> {
    /// Reads the directory of an archive.
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, WorkbookError> {
        let last = bytes.len().saturating_sub(END_BYTES + MAX_COMMENT);
        let end = bytes[last..]
            .windows(END.len())
            .rposition(|bytes| bytes == END);
        let end = end.ok_or_else(|| damaged("its end is missing"))? + last;
        let count = usize::from(number16(bytes, end + 10)?);
        let mut at = offset(bytes, end + 16)?;
        if count > MAX_FILES {
            return Err(damaged("it has too many files"));
        }
        let mut files = BTreeMap::new();
        for _ in 0..count {
            if !bytes.get(at..).is_some_and(|rest| rest.starts_with(ENTRY)) {
                return Err(damaged("its directory is incomplete"));
            }
            let lengths = [28, 30, 32].map(|field| number16(bytes, at + field).map(usize::from));
            let [name_len, extra, comment] = lengths;
            let name_len = name_len?;
            let name = part(bytes, at + ENTRY_BYTES, name_len)?;
            let file = ArchivedFile {
                at: offset(bytes, at + 42)?,
                packed: offset(bytes, at + 20)?,
                method: number16(bytes, at + 10)?,
                checksum: number32(bytes, at + 16)?,
            };
            files.insert(String::from_utf8_lossy(name).into_owned(), file);
            at += ENTRY_BYTES + name_len + extra? + comment?;
        }
        Ok(Self { bytes, files })
    }

    /// Returns whether there is a file of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    /// Returns a file as text. `None` if there is none.
    pub(super) fn text(&self, name: &str) -> Result<Option<String>, WorkbookError> {
        let Some(file) = self.files.get(name) else {
            return Ok(None);
        };
        let start = file.at;
        if !self
            .bytes
            .get(start..)
            .is_some_and(|rest| rest.starts_with(FILE))
        {
            return Err(damaged(&format!("{name} is not where its directory says")));
        }
        let names = [26, 28].map(|field| number16(self.bytes, start + field).map(usize::from));
        let [name_len, extra] = names;
        let packed = part(
            self.bytes,
            start + FILE_BYTES + name_len? + extra?,
            file.packed,
        )?;
        let mut content = Vec::new();
        let read = match file.method {
            0 => packed.take(MAX_PART_BYTES + 1).read_to_end(&mut content),
            8 => DeflateDecoder::new(packed)
                .take(MAX_PART_BYTES + 1)
                .read_to_end(&mut content),
            _ => return Err(damaged(&format!("{name} is compressed in an unusual way"))),
        };
        if content.len() as u64 > MAX_PART_BYTES {
            return Err(WorkbookError::TooLarge {
                part: name.to_owned(),
                limit: MAX_PART_BYTES,
            });
        }
        let mut checksum = Crc::new();
        checksum.update(&content);
        if read.is_err() || checksum.sum() != file.checksum {
            return Err(damaged(&format!("{name} cannot be unpacked")));
        }
        let text = String::from_utf8(content);
        let text = text.map_err(|_error| damaged(&format!("{name} is not UTF-8")))?;
        Ok(Some(text))
    }
}

pub(super) fn damaged(reason: &str) -> WorkbookError {
    WorkbookError::Damaged(reason.to_owned())
}

/// Returns a part of the archive.
fn part(bytes: &[u8], at: usize, len: usize) -> Result<&[u8], WorkbookError> {
    let end = at.checked_add(len);
    end.and_then(|end| bytes.get(at..end))
        .ok_or_else(|| damaged("it ends early"))
}

fn number16(bytes: &[u8], at: usize) -> Result<u16, WorkbookError> {
    let bytes = part(bytes, at, 2)?;
    Ok(u16::from_le_bytes([bytes[0], bytes[1]]))
}

fn number32(bytes: &[u8], at: usize) -> Result<u32, WorkbookError> {
    let bytes = part(bytes, at, 4)?;
    Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
}

/// Returns a length or an offset. In archives of 4 GiB and more, it is stored elsewhere.
fn offset(bytes: &[u8], at: usize) -> Result<usize, WorkbookError> {
    match number32(bytes, at)? {
        u32::MAX => Err(damaged("it is an archive of more than 4 GiB")),
        number => Ok(number as usize),
    }
}

#[cfg(test)]
mod tests {
    use mocban_core::zip_records::{ArchiveLayout, Crc, StoredFile};

    use super::Archive;

    #[test]
    fn a_stored_archive_is_read_back() {
        let long = format!("{}/chữ số 1.csv", "x".repeat(300));
        let files = [("a.txt", ""), ("b/ể.json", "{}"), (long.as_str(), "1,2\n")];
        let mut layout = ArchiveLayout::default();
        let (mut bytes, mut directory) = (Vec::new(), Vec::new());
        for (name, content) in files {
            let mut crc = Crc::new();
            crc.update(content.as_bytes());
            let (size, crc) = (content.len() as u64, crc.sum());
            let file = StoredFile { name, size, crc };
            bytes.extend(file.record());
            bytes.extend(content.as_bytes());
            directory.extend(layout.add(&file));
        }
        bytes.extend(directory);
        bytes.extend(layout.end());
        assert_eq!(layout.size(), bytes.len() as u64);
        let read = Archive::open(&bytes).expect("an archive");
        for (name, content) in files {
            let found = read.text(name).expect("readable");
            assert_eq!(found.as_deref(), Some(content), "{name}");
        }
    }
}
