//! Input files: reading within a size limit, hashing, and recognizing changes.

use std::fs::File;
use std::io::{self, Read, Take};

use super::input_error::InputError;
use super::input_place::{Input, InputLocation};
use super::open_file::{open_regular, regular_metadata};
use super::remote::BucketError;
use mocban_core::domain::{ContentHash, InputVersion};
use mocban_core::page_vec::PageVec;
use mocban_system::platform::generation;

/// Returns size, modification time and inode of a file as text. If all three are unchanged, the content is assumed to
/// be unchanged.
fn file_stat(meta: &std::fs::Metadata) -> String {
    let modified = meta.modified().ok();
    let modified = modified.and_then(|time| time.duration_since(std::time::UNIX_EPOCH).ok());
    let modified = modified.map_or(0, |since| since.as_nanos());
    format!("{}:{modified}:{}", meta.len(), generation(meta))
}

/// Returns size and modification time of a file below a shared root as text.
fn shared_file_stat(meta: &std::fs::Metadata) -> String {
    let stat = file_stat(meta);
    stat.rsplit_once(':')
        .map_or_else(String::new, |(stat, _)| stat.to_owned())
}

impl Input {
    fn stat(&self, meta: &std::fs::Metadata) -> String {
        match self.place {
            InputLocation::SharedFile => shared_file_stat(meta),
            InputLocation::File | InputLocation::Object(_) | InputLocation::Artifact(..) => {
                file_stat(meta)
            }
        }
    }
}

/// An input file and its content.
#[derive(Debug)]
pub struct InputFile {
    /// The content.
    pub bytes: PageVec<u8>,
    /// Its version.
    pub version: InputVersion,
}

/// An input file that is being read. Each chunk is hashed right after it is read, while it is in the CPU cache.
#[derive(Debug)]
pub struct InputReader {
    input: Input,
    file: Take<File>,
    /// Length of the file in bytes when it was opened.
    len: u64,
    /// Maximum length in bytes, and the name of its setting.
    limit: (u64, &'static str),
    hasher: blake3::Hasher,
    stat: String,
    /// Hash of an object when it was received from the store.
    expected: Option<ContentHash>,
}

/// Maximum number of bytes that are read and hashed in one step. Chunks of this size stay in the CPU cache.
const CHUNK: usize = 1 << 17;

impl Read for InputReader {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let most = into.len().min(CHUNK);
        let count = self.file.read(&mut into[..most])?;
        self.hasher.update(&into[..count]);
        Ok(count)
    }
}

impl InputReader {
    /// Returns the length of the file in bytes when it was opened.
    pub const fn size(&self) -> u64 {
        self.len
    }

    /// Adds the path to an error from reading it.
    pub fn error(&self, source: io::Error) -> InputError {
        InputError::io(self.input.path(), source)
    }

    /// Reads the file to its end. Returns the hash and stat of the whole file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is larger than the limit, or changed after it was opened.
    pub fn finish(mut self) -> Result<InputVersion, InputError> {
        io::copy(&mut self, &mut io::sink()).map_err(|error| self.error(error))?;
        // The limit also holds for a file that grows while it is read.
        let (limit, setting) = self.limit;
        if self.file.limit() == 0 {
            return Err(InputError::TooLarge {
                path: self.input.path().to_owned(),
                bytes: limit.saturating_add(1),
                limit,
                setting,
            });
        }
        let hash = ContentHash::from_bytes(*self.hasher.finalize().as_bytes());
        if self.has_changed(&hash)? {
            return Err(InputError::Changed(self.input.path().to_owned()));
        }
        Ok(InputVersion {
            hash,
            stat: self.stat,
        })
    }

    /// Returns whether the file has changed since it was opened, so that the hash may include bytes that the parser did
    /// not read. A local copy of an object is compared with the content that was received.
    fn has_changed(&self, hash: &ContentHash) -> Result<bool, InputError> {
        if let (
            Some(expected),
            InputLocation::Object(object) | InputLocation::Artifact(object, _),
        ) = (&self.expected, &self.input.place)
        {
            let is_other = expected != hash;
            if is_other {
                object.forget();
            }
            return Ok(is_other);
        }
        let meta = self.file.get_ref().metadata();
        let meta = meta.map_err(|error| self.error(error))?;
        Ok(self.input.stat(&meta) != self.stat)
    }
}

/// Returns size, modification time and inode of a file as text, or the version of an object. Sends no request for an
/// artifact in an object store, because its content never changes.
///
/// # Errors
/// Returns an error if the file does not exist, is not a regular file, or cannot be read.
pub fn stat_input(input: &Input) -> Result<String, InputError> {
    match &input.place {
        InputLocation::Object(object) => Ok(object.version()?),
        InputLocation::Artifact(_, hash) => Ok(hash.to_hex()),
        InputLocation::File | InputLocation::SharedFile => {
            Ok(input.stat(&regular_metadata(input.path())?))
        }
    }
}

/// Opens a file of at most `limit` bytes. `setting` is the name of the limit in error messages.
///
/// # Errors
/// Returns an error if the file does not exist, is not a regular file, cannot be read, or is too large.
pub fn open_input(
    input: &Input,
    limit: u64,
    setting: &'static str,
) -> Result<InputReader, InputError> {
    let too_large = |bytes| InputError::TooLarge {
        path: input.path().to_owned(),
        bytes,
        limit,
        setting,
    };
    let of_object = |error| match error {
        BucketError::TooLarge { bytes, .. } => too_large(bytes),
        error => error.into(),
    };
    let (file, len, stat, expected) = match &input.place {
        InputLocation::Object(object) => {
            let copy = object.open(limit).map_err(of_object)?;
            (copy.file, copy.bytes, copy.version, Some(copy.hash))
        }
        InputLocation::Artifact(object, hash) => {
            let copy = object.open(limit).map_err(of_object)?;
            (copy.file, copy.bytes, hash.to_hex(), Some(*hash))
        }
        InputLocation::File | InputLocation::SharedFile => {
            let (file, meta) = open_regular(input.path())?;
            (file, meta.len(), input.stat(&meta), None)
        }
    };
    if len > limit {
        return Err(too_large(len));
    }
    Ok(InputReader {
        input: input.clone(),
        file: file.take(limit.saturating_add(1)),
        len,
        limit: (limit, setting),
        hasher: blake3::Hasher::new(),
        stat,
        expected,
    })
}

/// Reads a file of at most `limit` bytes. `setting` is the name of the limit in error messages.
///
/// # Errors
/// Returns an error if the file does not exist, is not a regular file, cannot be read, is too large, or changes.
pub fn read_input(
    input: &Input,
    limit: u64,
    setting: &'static str,
) -> Result<InputFile, InputError> {
    let mut file = open_input(input, limit, setting)?;
    let about = file.size() as usize;
    let bytes = PageVec::read(&mut file, about).map_err(|error| file.error(error))?;
    Ok(InputFile {
        bytes,
        version: file.finish()?,
    })
}

/// Hashes a file without reading it into memory. Does not read an artifact in an object store: its name contains the
/// hash, which is compared when a stage reads the artifact.
///
/// # Errors
/// Returns an error if the file does not exist, is not a regular file, or cannot be read.
pub fn hash_input(input: &Input) -> Result<InputVersion, InputError> {
    if let InputLocation::Object(object) = &input.place {
        let copy = object.open(u64::MAX)?;
        return Ok(InputVersion {
            hash: copy.hash,
            stat: copy.version,
        });
    }
    if let InputLocation::Artifact(_, hash) = &input.place {
        return Ok(InputVersion {
            hash: *hash,
            stat: hash.to_hex(),
        });
    }
    let (file, meta) = open_regular(input.path())?;
    let mut hasher = blake3::Hasher::new();
    hasher
        .update_reader(file)
        .map_err(|error| InputError::io(input.path(), error))?;
    Ok(InputVersion {
        hash: ContentHash::from_bytes(*hasher.finalize().as_bytes()),
        stat: input.stat(&meta),
    })
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write as _};

    use super::{hash_input, open_input, read_input, stat_input};
    use crate::{Input, InputError};
    use mocban_core::domain::{ContentHash, FailureClass};

    #[test]
    fn a_file_over_the_limit_is_bad_input_and_names_the_setting() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.stl");
        std::fs::write(&path, [0; 11]).expect("a file");
        let path = Input::file(path);
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
    fn a_missing_file_and_a_directory_are_permanent_io_errors() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let missing =
            read_input(&Input::file(dir.path().join("none")), 10, "x").expect_err("not there");
        assert!(matches!(missing, InputError::NotThere(_)));
        let directory = read_input(&Input::file(dir.path()), 10, "x").expect_err("a directory");
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
    fn a_file_that_changes_while_it_is_read_is_a_transient_error() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.obj");
        std::fs::write(&path, "v 0 0 0\n").expect("a file");
        let mut reader = open_input(&Input::file(&path), 100, "x").expect("a file");
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).expect("it is read");
        // The file grows after its end was reached.
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
        let again = open_input(&Input::file(&path), 100, "x").expect("a file");
        let digest = again.finish().expect("it stays the same");
        assert_eq!(digest.hash, ContentHash::of(b"v 0 0 0\nv 1 0 0\n"));
    }

    #[test]
    fn both_ways_of_hashing_agree() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.png");
        std::fs::write(&path, b"print").expect("a file");
        let path = Input::file(path);
        let read = read_input(&path, 10, "x").expect("a file");
        let hashed = hash_input(&path).expect("a file");
        assert_eq!(read.version, hashed);
        assert_eq!(hashed.hash, ContentHash::of(b"print"));
        assert_eq!(stat_input(&path).expect("a file"), hashed.stat);
    }
}
