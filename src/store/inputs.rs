//! Input files: read within a limit, at once or bit by bit, hashed, and told apart from what they were.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Take};
use std::path::{Path, PathBuf};

use crate::domain::{ContentHash, FailureClass};
use crate::page_vec::PageVec;

/// Size, modification time and number of a file: when all are as they were, the content is taken to be too.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileStat(String);

impl FileStat {
    /// As the catalog keeps it.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    fn of(meta: &std::fs::Metadata) -> Self {
        let modified = meta
            .modified()
            .ok()
            .and_then(|time| time.duration_since(std::time::UNIX_EPOCH).ok())
            .map_or(0, |since| since.as_nanos());
        Self(format!("{}:{modified}:{}", meta.len(), inode(meta)))
    }
}

#[cfg(unix)]
fn inode(meta: &std::fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(meta)
}

#[cfg(not(unix))]
const fn inode(_meta: &std::fs::Metadata) -> u64 {
    0
}

/// An input file as read.
#[derive(Debug)]
pub struct InputFile {
    /// All its bytes.
    pub bytes: PageVec<u8>,
    /// What was seen of it.
    pub seen: InputDigest,
}

/// What was seen of an input file that was read to its end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputDigest {
    /// Hash of its bytes.
    pub hash: ContentHash,
    /// What it looked like when it was opened.
    pub stat: FileStat,
}

/// An input file that is being read; its bytes are hashed while they are at hand.
#[derive(Debug)]
pub struct InputReader {
    path: PathBuf,
    file: Take<File>,
    /// How many bytes it had when it was opened.
    len: u64,
    /// How many it may have, and the name of the setting that says so.
    limit: (u64, &'static str),
    hasher: blake3::Hasher,
    stat: FileStat,
}

/// Bytes that are read and hashed at a time at most: they stay in the cache meanwhile.
const AT_HAND: usize = 1 << 17;

impl Read for InputReader {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let most = into.len().min(AT_HAND);
        let count = self.file.read(&mut into[..most])?;
        self.hasher.update(&into[..count]);
        Ok(count)
    }
}

impl InputReader {
    /// How many bytes it had when it was opened.
    pub const fn size(&self) -> u64 {
        self.len
    }

    /// The error that reading it gave.
    pub fn error(&self, source: io::Error) -> InputError {
        InputError::io(&self.path, source)
    }

    /// Reads what is left, and says what was seen.
    ///
    /// # Errors
    /// When it cannot be read, is larger than the limit by now, or has changed since it was opened.
    pub fn finish(mut self) -> Result<InputDigest, InputError> {
        io::copy(&mut self, &mut io::sink()).map_err(|error| self.error(error))?;
        // A file that grows while it is read must not get past the limit either.
        let (limit, setting) = self.limit;
        if self.file.limit() == 0 {
            return Err(InputError::TooLarge {
                path: self.path,
                bytes: limit.saturating_add(1),
                limit,
                setting,
            });
        }
        // Else the hash might be of bytes that were not there yet when the others were taken for the whole.
        let meta = self.file.get_ref().metadata();
        let now = FileStat::of(&meta.map_err(|error| self.error(error))?);
        if now != self.stat {
            return Err(InputError::Changed(self.path));
        }
        Ok(InputDigest {
            hash: ContentHash::from_bytes(*self.hasher.finalize().as_bytes()),
            stat: self.stat,
        })
    }
}

/// Why an input file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// There is no such file.
    #[error("{0} is not there")]
    NotThere(PathBuf),
    /// It is a directory or another thing that is no file.
    #[error("{path} is {kind}, not a file")]
    NotAFile {
        /// Which path.
        path: PathBuf,
        /// What it is.
        kind: &'static str,
    },
    /// We may not read it.
    #[error("{0} may not be read: permission denied")]
    Denied(PathBuf),
    /// It is larger than the settings allow.
    #[error("{path} has {bytes} bytes, over the limit of {limit} ({setting})")]
    TooLarge {
        /// Which file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// The limit.
        limit: u64,
        /// Name of the setting.
        setting: &'static str,
    },
    /// It is being written.
    #[error("{0} changed while it was read")]
    Changed(PathBuf),
    /// Reading failed half-way; it may go well another time.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl InputError {
    fn io(path: &Path, source: std::io::Error) -> Self {
        match source.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => Self::NotThere(path.to_owned()),
            ErrorKind::PermissionDenied => Self::Denied(path.to_owned()),
            ErrorKind::IsADirectory => Self::NotAFile {
                path: path.to_owned(),
                kind: "a directory",
            },
            _ => Self::Io {
                path: path.to_owned(),
                source,
            },
        }
    }

    /// What the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::NotThere(_)
            | Self::NotAFile { .. }
            | Self::Denied(_)
            | Self::Changed(_)
            | Self::Io { .. } => FailureClass::Io,
            Self::TooLarge { .. } => FailureClass::BadInput,
        }
    }

    /// Whether trying again by itself may help. A file that is not there is told at once instead: whoever brings
    /// it says `retry`.
    pub const fn is_transient(&self) -> bool {
        matches!(self, Self::Changed(_) | Self::Io { .. })
    }
}

/// What a file looks like now.
///
/// # Errors
/// When it is not there, no file, or not to be read.
pub fn stat_input(path: &Path) -> Result<FileStat, InputError> {
    let meta = std::fs::metadata(path).map_err(|error| InputError::io(path, error))?;
    Ok(FileStat::of(&check_file(path, meta)?))
}

/// Opens a file that must not be larger than `limit` bytes; `setting` names that limit to the user.
///
/// # Errors
/// When it is not there, no file, not to be read, or too large.
pub fn open_input(
    path: &Path,
    limit: u64,
    setting: &'static str,
) -> Result<InputReader, InputError> {
    let (file, meta) = open(path)?;
    if meta.len() > limit {
        return Err(InputError::TooLarge {
            path: path.to_owned(),
            bytes: meta.len(),
            limit,
            setting,
        });
    }
    Ok(InputReader {
        path: path.to_owned(),
        file: file.take(limit.saturating_add(1)),
        len: meta.len(),
        limit: (limit, setting),
        hasher: blake3::Hasher::new(),
        stat: FileStat::of(&meta),
    })
}

/// Reads a file that must not be larger than `limit` bytes; `setting` names that limit to the user.
///
/// # Errors
/// When it is not there, no file, not to be read, or too large.
pub fn read_input(path: &Path, limit: u64, setting: &'static str) -> Result<InputFile, InputError> {
    let mut file = open_input(path, limit, setting)?;
    let about = file.size() as usize;
    let bytes = PageVec::read(&mut file, about).map_err(|error| file.error(error))?;
    Ok(InputFile {
        bytes,
        seen: file.finish()?,
    })
}

/// Hash of a file's content and what the file looked like, without holding it in memory.
///
/// # Errors
/// When it is not there, no file, or not to be read.
pub fn hash_input(path: &Path) -> Result<(ContentHash, FileStat), InputError> {
    let (file, meta) = open(path)?;
    let mut hasher = blake3::Hasher::new();
    hasher
        .update_reader(file)
        .map_err(|error| InputError::io(path, error))?;
    let hash = ContentHash::from_bytes(*hasher.finalize().as_bytes());
    Ok((hash, FileStat::of(&meta)))
}

fn open(path: &Path) -> Result<(File, std::fs::Metadata), InputError> {
    // Looked at before it is opened: opening a pipe would wait for its writer.
    let meta = std::fs::metadata(path).map_err(|error| InputError::io(path, error))?;
    check_file(path, meta)?;
    let file = File::open(path).map_err(|error| InputError::io(path, error))?;
    let meta = file
        .metadata()
        .map_err(|error| InputError::io(path, error))?;
    Ok((file, meta))
}

fn check_file(path: &Path, meta: std::fs::Metadata) -> Result<std::fs::Metadata, InputError> {
    if meta.is_file() {
        return Ok(meta);
    }
    let kind = if meta.is_dir() {
        "a directory"
    } else {
        "a device or a pipe"
    };
    Err(InputError::NotAFile {
        path: path.to_owned(),
        kind,
    })
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write as _};

    use super::{InputError, hash_input, open_input, read_input, stat_input};
    use crate::domain::{ContentHash, FailureClass};

    #[test]
    fn a_file_over_the_limit_is_bad_input_and_names_the_setting() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.stl");
        std::fs::write(&path, [0; 11]).expect("a file");
        let error = read_input(&path, 10, "limits.mesh.max_bytes").expect_err("too large");
        assert_eq!(error.class(), FailureClass::BadInput);
        let text = error.to_string();
        assert!(
            text.contains("11 bytes") && text.contains("limits.mesh.max_bytes"),
            "{text}"
        );
        assert!(read_input(&path, 11, "limits.mesh.max_bytes").is_ok());
    }

    #[test]
    fn missing_file_and_directory_are_io_and_do_not_pass_by_themselves() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let missing = read_input(&dir.path().join("none"), 10, "x").expect_err("not there");
        assert!(matches!(missing, InputError::NotThere(_)));
        let directory = read_input(dir.path(), 10, "x").expect_err("a directory");
        assert!(
            directory
                .to_string()
                .ends_with("is a directory, not a file")
        );
        for error in [missing, directory] {
            assert_eq!(error.class(), FailureClass::Io);
            assert!(!error.is_transient());
        }
    }

    #[test]
    fn a_file_that_changes_while_it_is_read_is_told_and_may_be_tried_again() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.obj");
        std::fs::write(&path, "v 0 0 0\n").expect("a file");
        let mut reader = open_input(&path, 100, "x").expect("a file");
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).expect("it is read");
        // All was read, as far as the reader knows.
        let mut file = std::fs::OpenOptions::new().append(true).open(&path);
        let more = file.as_mut().map(|file| file.write_all(b"v 1 0 0\n"));
        more.expect("opened").expect("written");
        let error = reader.finish().expect_err("it grew");
        assert!(
            error
                .to_string()
                .ends_with("1.obj changed while it was read")
        );
        assert!(error.is_transient());
        let again = open_input(&path, 100, "x").expect("a file");
        let seen = again.finish().expect("it stays as it is");
        assert_eq!(seen.hash, ContentHash::of(b"v 0 0 0\nv 1 0 0\n"));
    }

    #[test]
    fn both_ways_of_hashing_agree() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.png");
        std::fs::write(&path, b"print").expect("a file");
        let read = read_input(&path, 10, "x").expect("a file");
        let (hash, stat) = hash_input(&path).expect("a file");
        assert_eq!((read.seen.hash, &read.seen.stat), (hash, &stat));
        assert_eq!(hash, ContentHash::of(b"print"));
        assert_eq!(stat_input(&path).expect("a file"), stat);
    }
}
