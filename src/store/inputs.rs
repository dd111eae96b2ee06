//! Input files: read whole within a limit, hashed, and told apart from what they were.

use std::fs::File;
use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use crate::domain::{ContentHash, FailureClass};
use crate::large::Large;

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
    pub bytes: Large<u8>,
    /// Their hash.
    pub hash: ContentHash,
    /// What the file looked like when it was opened.
    pub stat: FileStat,
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
            Self::NotThere(_) | Self::NotAFile { .. } | Self::Denied(_) | Self::Io { .. } => {
                FailureClass::Io
            }
            Self::TooLarge { .. } => FailureClass::BadInput,
        }
    }

    /// Whether trying again by itself may help. A file that is not there is told at once instead: whoever brings
    /// it says `retry`.
    pub const fn may_pass(&self) -> bool {
        matches!(self, Self::Io { .. })
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

/// Reads a file that must not be larger than `limit` bytes; `setting` names that limit to the user.
///
/// # Errors
/// When it is not there, no file, not to be read, or too large.
pub fn read_input(path: &Path, limit: u64, setting: &'static str) -> Result<InputFile, InputError> {
    let too_large = |bytes| InputError::TooLarge {
        path: path.to_owned(),
        bytes,
        limit,
        setting,
    };
    let (file, meta) = open(path)?;
    if meta.len() > limit {
        return Err(too_large(meta.len()));
    }
    // A file that grows while it is read must not get past the limit either.
    let file = file.take(limit.saturating_add(1));
    let bytes =
        Large::read(file, meta.len() as usize).map_err(|error| InputError::io(path, error))?;
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(InputFile {
        hash: ContentHash::of(&bytes),
        bytes,
        stat: FileStat::of(&meta),
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
    use super::{InputError, hash_input, read_input, stat_input};
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
            assert!(!error.may_pass());
        }
    }

    #[test]
    fn both_ways_of_hashing_agree() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.png");
        std::fs::write(&path, b"print").expect("a file");
        let read = read_input(&path, 10, "x").expect("a file");
        let (hash, stat) = hash_input(&path).expect("a file");
        assert_eq!((read.hash, &read.stat), (hash, &stat));
        assert_eq!(hash, ContentHash::of(b"print"));
        assert_eq!(stat_input(&path).expect("a file"), stat);
    }
}
