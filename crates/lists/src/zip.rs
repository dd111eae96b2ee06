//! ZIP archives in memory or in a file: their directory, and their files one by one. Stored and deflated files of archives
//! below 4 GiB are read.

use std::borrow::Cow;
use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom};

use flate2::read::DeflateDecoder;

use mocban_core::zip_records::{Crc, END, END_BYTES, ENTRY, ENTRY_BYTES, FILE, FILE_BYTES};

/// Longest comment at the end of an archive, in bytes.
const MAX_COMMENT: u64 = u16::MAX as u64;
/// Longest name of a file, in bytes. No system has longer paths.
const MAX_NAME_BYTES: usize = 4096;
/// Most bytes of all names.
const MAX_NAMES_BYTES: usize = 32 << 20;
/// Bytes that are unpacked at once.
const PIECE_BYTES: usize = 64 << 10;
/// Systems whose archives have the kind of a file in its attributes: Unix and macOS.
const UNIX_SYSTEMS: [u8; 2] = [3, 19];
/// The kinds in these attributes, and that of a link.
const KIND: u32 = 0o170_000;
const LINK: u32 = 0o120_000;

/// Why an archive, or a file in it, cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ZipError {
    /// There is no end of an archive.
    #[error("its end is missing")]
    NoEnd,
    /// There are more files than allowed.
    #[error("it has too many files")]
    TooManyFiles,
    /// The names of all files are longer than allowed.
    #[error("the names of its files are too long")]
    LongNames,
    /// The directory ends early or names no file.
    #[error("its directory is incomplete")]
    Directory,
    /// The archive ends within a file.
    #[error("it ends early")]
    Truncated,
    /// The archive has the format for more than 4 GiB or 65,535 files.
    #[error("it is an archive of more than 4 GiB")]
    Large,
    /// The directory names a place where no file begins.
    #[error("{0} is not where its directory says")]
    Misplaced(String),
    /// The file is neither stored nor deflated.
    #[error("{0} is compressed in an unusual way")]
    Method(String),
    /// The file needs a password.
    #[error("{0} is encrypted")]
    Encrypted(String),
    /// The unpacked file is longer than allowed.
    #[error("{0} is larger than its directory says")]
    TooLarge(String),
    /// The packed bytes are damaged.
    #[error("{0} cannot be unpacked")]
    Damaged(String),
    /// The archive cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The unpacked bytes cannot be written.
    #[error("the unpacked bytes cannot be written: {0}")]
    Write(io::Error),
}

/// An archive and its directory.
#[derive(Debug)]
pub struct ZipArchive<R> {
    reader: R,
    len: u64,
    files: Vec<ZippedFile>,
}

/// A file of an archive: where it is, and how it is packed.
#[derive(Debug, Clone)]
pub struct ZippedFile {
    name: Vec<u8>,
    /// Start of its record.
    at: u64,
    /// Length as packed, in bytes.
    packed: u64,
    /// Length after unpacking as the directory says, in bytes.
    size: u64,
    method: u16,
    checksum: u32,
    is_encrypted: bool,
    is_link: bool,
}

impl ZippedFile {
    /// Returns the name with replacements for bytes that are not UTF-8.
    pub fn shown_name(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.name)
    }

    /// Returns the name if it is UTF-8.
    pub fn name(&self) -> Option<&str> {
        str::from_utf8(&self.name).ok()
    }

    /// Returns the length after unpacking as the directory says, in bytes.
    pub const fn size(&self) -> u64 {
        self.size
    }

    /// Returns whether this is a symbolic link.
    pub const fn is_link(&self) -> bool {
        self.is_link
    }

    /// Returns whether this is a folder.
    pub fn is_folder(&self) -> bool {
        self.name.ends_with(b"/")
    }

    /// Refuses a file that cannot be unpacked, without reading it.
    ///
    /// # Errors
    /// Returns an error if the file is encrypted or packed by another method.
    pub fn check(&self) -> Result<(), ZipError> {
        let name = || self.shown_name().into_owned();
        match self.method {
            _ if self.is_encrypted => Err(ZipError::Encrypted(name())),
            0 | 8 => Ok(()),
            _ => Err(ZipError::Method(name())),
        }
    }
}

impl<R: Read + Seek + Clone> ZipArchive<R> {
    /// Reads the directory of an archive of at most `max_files` files.
    pub fn open(mut reader: R, max_files: usize) -> Result<Self, ZipError> {
        let len = reader.seek(SeekFrom::End(0))?;
        let tail_at = len.saturating_sub(END_BYTES as u64 + MAX_COMMENT);
        reader.seek(SeekFrom::Start(tail_at))?;
        let mut tail = Vec::new();
        reader
            .by_ref()
            .take(END_BYTES as u64 + MAX_COMMENT)
            .read_to_end(&mut tail)?;
        let end_at = tail.windows(END.len()).rposition(|bytes| bytes == END);
        let end_at = end_at.ok_or(ZipError::NoEnd)?;
        let end = tail.get(end_at..end_at + END_BYTES);
        let end = end.ok_or(ZipError::Truncated)?;
        let count = number16(end, 10);
        if count == u16::MAX {
            return Err(ZipError::Large);
        }
        if usize::from(count) > max_files {
            return Err(ZipError::TooManyFiles);
        }
        reader.seek(SeekFrom::Start(offset(end, 16)?))?;
        let mut directory = BufReader::new(reader.clone());
        let (mut files, mut names) = (Vec::new(), 0);
        for _ in 0..count {
            let file = entry(&mut directory)?;
            names += file.name.len();
            if names > MAX_NAMES_BYTES {
                return Err(ZipError::LongNames);
            }
            files.push(file);
        }
        Ok(Self { reader, len, files })
    }

    /// Returns the files in the order of the directory.
    pub fn files(&self) -> &[ZippedFile] {
        &self.files
    }

    /// Returns the length of the archive in bytes.
    pub const fn packed_len(&self) -> u64 {
        self.len
    }

    /// Unpacks a file of at most `limit` bytes, and passes it on in pieces.
    ///
    /// # Errors
    /// Returns an error if the file cannot be unpacked, has more bytes, or `write` fails. Pieces may then have been passed on.
    pub fn unpack(
        &self,
        file: &ZippedFile,
        limit: u64,
        write: &mut dyn FnMut(&[u8]) -> io::Result<()>,
    ) -> Result<(), ZipError> {
        file.check()?;
        let name = || file.shown_name().into_owned();
        let mut reader = self.reader.clone();
        reader.seek(SeekFrom::Start(file.at))?;
        let mut head = [0; FILE_BYTES];
        let is_file = reader.read_exact(&mut head).is_ok() && head.starts_with(FILE);
        if !is_file {
            return Err(ZipError::Misplaced(name()));
        }
        let names = u64::from(number16(&head, 26)) + u64::from(number16(&head, 28));
        let start = file.at + FILE_BYTES as u64 + names;
        if start + file.packed > self.len {
            return Err(ZipError::Truncated);
        }
        reader.seek(SeekFrom::Start(start))?;
        let packed = reader.take(file.packed);
        let mut content: Box<dyn Read> = match file.method {
            0 => Box::new(packed),
            _ => Box::new(DeflateDecoder::new(packed)),
        };
        let (mut checksum, mut piece, mut size) = (Crc::new(), vec![0; PIECE_BYTES], 0);
        loop {
            let read = content.read(&mut piece);
            let read = read.map_err(|error| match error.kind() {
                ErrorKind::InvalidInput | ErrorKind::InvalidData | ErrorKind::UnexpectedEof => {
                    ZipError::Damaged(name())
                }
                _ => ZipError::Io(error),
            })?;
            if read == 0 {
                break;
            }
            size += read as u64;
            if size > limit {
                return Err(ZipError::TooLarge(name()));
            }
            checksum.update(&piece[..read]);
            write(&piece[..read]).map_err(ZipError::Write)?;
        }
        if checksum.sum() == file.checksum {
            Ok(())
        } else {
            Err(ZipError::Damaged(name()))
        }
    }
}

/// Reads the next entry of a directory.
fn entry(directory: &mut impl Read) -> Result<ZippedFile, ZipError> {
    let mut head = [0; ENTRY_BYTES];
    let is_entry = directory.read_exact(&mut head).is_ok() && head.starts_with(ENTRY);
    let name_len = usize::from(number16(&head, 28));
    if !is_entry || name_len > MAX_NAME_BYTES {
        return Err(ZipError::Directory);
    }
    let mut name = vec![0; name_len];
    let ended = |_error| ZipError::Truncated;
    directory.read_exact(&mut name).map_err(ended)?;
    let rest = u64::from(number16(&head, 30)) + u64::from(number16(&head, 32));
    io::copy(&mut directory.take(rest), &mut io::sink())?;
    let attributes = number32(&head, 38) >> 16;
    Ok(ZippedFile {
        name,
        at: offset(&head, 42)?,
        packed: offset(&head, 20)?,
        size: offset(&head, 24)?,
        method: number16(&head, 10),
        checksum: number32(&head, 16),
        is_encrypted: number16(&head, 8) & 1 == 1,
        is_link: UNIX_SYSTEMS.contains(&head[5]) && attributes & KIND == LINK,
    })
}

fn number16(record: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([record[at], record[at + 1]])
}

fn number32(record: &[u8], at: usize) -> u32 {
    u32::from(number16(record, at)) | u32::from(number16(record, at + 2)) << 16
}

/// Returns a length or an offset. In archives of 4 GiB and more, it is stored elsewhere.
fn offset(record: &[u8], at: usize) -> Result<u64, ZipError> {
    match number32(record, at) {
        u32::MAX => Err(ZipError::Large),
        number => Ok(u64::from(number)),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Write as _};

    use mocban_core::zip_records::{ArchiveLayout, Crc, StoredFile};

    use super::{ZipArchive, ZipError};
    use crate::workbook::test_helpers::archive;

    /// Changes bytes at a distance from the first record of the directory.
    fn changed(bytes: &[u8], at: usize, new: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        let entry = bytes.windows(4).position(|four| four == b"PK\x01\x02");
        let at = entry.expect("a directory") + at;
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    }

    fn unpacked(bytes: &[u8]) -> Result<Vec<u8>, ZipError> {
        let zip = ZipArchive::open(Cursor::new(bytes), 10)?;
        let file = &zip.files()[0];
        let mut content = Vec::new();
        zip.unpack(file, file.size(), &mut |piece| content.write_all(piece))?;
        Ok(content)
    }

    #[test]
    fn files_are_listed_and_unpacked() {
        let text = "chữ ".repeat(50_000);
        for is_deflated in [true, false] {
            let bytes = archive(&[("quét/chữ 1.stl", &text), ("b/", "")], is_deflated);
            assert_eq!(unpacked(&bytes).expect("whole"), text.as_bytes());
            let zip = ZipArchive::open(Cursor::new(&*bytes), 2).expect("a directory");
            let [first, second] = zip.files() else {
                unreachable!("two files");
            };
            assert_eq!(first.name(), Some("quét/chữ 1.stl"));
            assert!(second.is_folder() && !first.is_folder());
            assert_eq!(zip.packed_len(), bytes.len() as u64);
            assert_eq!(first.size(), text.len() as u64);
        }
    }

    #[test]
    fn what_cannot_be_unpacked_is_refused_with_the_reason() {
        let bytes = archive(&[("1.stl", &"x".repeat(1000))], true);
        let says = |bytes: &[u8]| match unpacked(bytes) {
            Ok(_) => "unpacked".to_owned(),
            Err(error) => error.to_string(),
        };
        let large = [0xff; 4];
        for (bytes, expected) in [
            (bytes.clone(), "unpacked"),
            (changed(&bytes, 8, &[1, 0]), "1.stl is encrypted"),
            (
                changed(&bytes, 10, &[14, 0]),
                "1.stl is compressed in an unusual way",
            ),
            (
                changed(&bytes, 24, &[9, 0, 0, 0]),
                "1.stl is larger than its directory says",
            ),
            (changed(&bytes, 16, &[0; 4]), "1.stl cannot be unpacked"),
            (changed(&bytes, 20, &[0xff, 0xff, 0, 0]), "it ends early"),
            (
                changed(&bytes, 20, &large),
                "it is an archive of more than 4 GiB",
            ),
            (
                changed(&bytes, 42, &[7, 0, 0, 0]),
                "1.stl is not where its directory says",
            ),
            (bytes[..bytes.len() - 30].to_vec(), "its end is missing"),
        ] {
            assert_eq!(says(&bytes), expected);
        }
        let many = archive(&[("a", ""); 11], false);
        assert_eq!(says(&many), "it has too many files");
        let end = bytes.windows(4).rposition(|four| four == b"PK\x05\x06");
        let end = end.expect("an end");
        // The place of a larger directory, which is not needed.
        let locator = [&b"PK\x06\x07"[..], &[0; 16]].concat();
        let with_locator = [&bytes[..end], &locator, &bytes[end..]].concat();
        assert_eq!(says(&with_locator), "unpacked");
        let mut large = bytes;
        large[end + 10..end + 12].copy_from_slice(&[0xff; 2]);
        assert_eq!(says(&large), "it is an archive of more than 4 GiB");
    }

    #[test]
    fn an_export_as_archive_is_read_back() {
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
        let zip = ZipArchive::open(Cursor::new(&*bytes), 3).expect("an archive");
        for (file, (name, content)) in zip.files().iter().zip(files) {
            assert_eq!(file.name(), Some(name));
            let mut found = Vec::new();
            let unpacked = zip.unpack(file, file.size(), &mut |piece| found.write_all(piece));
            unpacked.expect("unpacked");
            assert_eq!(found, content.as_bytes(), "{name}");
        }
    }

    #[test]
    fn links_of_unix_are_known() {
        let bytes = archive(&[("a.stl", "/etc/passwd")], false);
        let link = changed(&changed(&bytes, 5, &[3]), 38, &[0, 0, 0xff, 0xa1]);
        let zip = ZipArchive::open(Cursor::new(&*link), 10).expect("a directory");
        assert!(zip.files()[0].is_link());
        let zip = ZipArchive::open(Cursor::new(&*bytes), 10).expect("a directory");
        assert!(!zip.files()[0].is_link());
    }

    #[test]
    fn names_of_more_than_32_mib_in_all_are_refused() {
        let name = |number: usize| format!("{number:0>4096}");
        let with_names = |count: usize| {
            let names: Vec<String> = (0..count).map(name).collect();
            let files: Vec<(&str, &str)> = names.iter().map(|name| (&**name, "")).collect();
            archive(&files, false)
        };
        let most = super::MAX_NAMES_BYTES / super::MAX_NAME_BYTES;
        let opened = |count: usize| {
            let bytes = with_names(count);
            ZipArchive::open(Cursor::new(&*bytes), count).map(|zip| zip.files().len())
        };
        assert_eq!(opened(most).expect("names at the limit"), most);
        let refused = opened(most + 1).expect_err("longer names");
        assert!(matches!(refused, ZipError::LongNames), "{refused}");
    }
}
