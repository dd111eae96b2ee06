//! An export as one ZIP archive, which is written as a stream. Lists of files are on disk; only the names of one folder on
//! each level are in memory.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read as _, Seek as _, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::manifest::MANIFEST;
use super::zip_error::{FolderZipError, file_error, temporary_error};
use super::zip_listing::list_files;
use mocban_core::zip_records::{ArchiveLayout, Crc, StoredFile};
use mocban_system::platform::{FileId, stat};

/// Files up to this length are read once; longer ones twice, first for their checksum, which stands before them.
const READ_ONCE: u64 = 1 << 20;
/// Bytes that are read at a time.
const BUFFER: usize = 128 * 1024;

/// Which export a folder holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExportVersion {
    manifest: FileId,
    modified: Option<SystemTime>,
}

impl ExportVersion {
    /// Returns which export a folder holds. `None` if there is none.
    pub fn of(dir: &Path) -> Option<Self> {
        let path = dir.join(MANIFEST);
        let modified = fs::metadata(&path).ok()?.modified();
        Some(Self {
            manifest: stat(&path).ok()?.id,
            modified: modified.ok(),
        })
    }
}

/// An export whose archive can be written.
#[derive(Debug)]
pub struct FolderZip {
    dir: PathBuf,
    version: ExportVersion,
    /// Path and length of each file.
    list: BufReader<File>,
    layout: ArchiveLayout,
}

/// Returns the size of the archive of an export in bytes. `folder` is the folder in the archive.
///
/// # Errors
/// Returns an error if there is no export or a name cannot be stored.
pub fn zip_size(dir: &Path, folder: &str) -> Result<u64, FolderZipError> {
    let mut layout = ArchiveLayout::default();
    list_files(dir, folder, &mut layout, &mut io::sink())?;
    Ok(layout.size())
}

impl FolderZip {
    /// Lists the files of an export. `folder` is the folder in the archive that has them.
    ///
    /// # Errors
    /// Returns an error if there is no export or a name cannot be stored.
    pub fn begin(dir: &Path, folder: &str) -> Result<Self, FolderZipError> {
        let version = ExportVersion::of(dir);
        let version = version.ok_or_else(|| FolderZipError::NoExport(dir.to_owned()))?;
        let mut list = BufWriter::new(temporary_file()?);
        let mut layout = ArchiveLayout::default();
        list_files(dir, folder, &mut layout, &mut list)?;
        Ok(Self {
            dir: dir.to_owned(),
            version,
            list: reread(list)?,
            layout,
        })
    }

    /// Returns the length of the archive in bytes.
    pub fn size(&self) -> u64 {
        self.layout.size()
    }

    /// Writes the archive, which has exactly [`Self::size`] bytes.
    ///
    /// # Errors
    /// Returns an error if a file is missing, has another length or changes, or if the export was replaced. What was written
    /// is then no archive, because its directory is missing.
    pub fn write(mut self, out: &mut dyn Write) -> Result<(), FolderZipError> {
        let mut layout = ArchiveLayout::default();
        let mut directory = BufWriter::new(temporary_file()?);
        let mut buffer = Vec::new();
        for _ in 0..self.layout.files() {
            let (name, size) = self.next_file()?;
            let crc = self.write_file(&name, size, &mut buffer, out)?;
            let name = name.as_str();
            let entry = layout.add(&StoredFile { name, size, crc });
            directory.write_all(&entry).map_err(temporary_error)?;
        }
        if ExportVersion::of(&self.dir) != Some(self.version) {
            return Err(FolderZipError::Changed(self.dir));
        }
        let mut directory = reread(directory)?;
        buffer.resize(BUFFER, 0);
        loop {
            let read = directory.read(&mut buffer).map_err(temporary_error)?;
            if read == 0 {
                break;
            }
            let part = &buffer[..read];
            out.write_all(part).map_err(FolderZipError::Output)?;
        }
        out.write_all(&layout.end())
            .map_err(FolderZipError::Output)?;
        out.flush().map_err(FolderZipError::Output)
    }

    /// Reads the next file of the list.
    fn next_file(&mut self) -> Result<(String, u64), FolderZipError> {
        let (mut length, mut size) = ([0; 4], [0; 8]);
        self.list.read_exact(&mut length).map_err(temporary_error)?;
        self.list.read_exact(&mut size).map_err(temporary_error)?;
        let size = u64::from_le_bytes(size);
        let mut name = vec![0; u32::from_le_bytes(length) as usize];
        self.list.read_exact(&mut name).map_err(temporary_error)?;
        let name = String::from_utf8(name);
        let name = name.map_err(|error| temporary_error(io::Error::other(error)))?;
        Ok((name, size))
    }

    /// Writes a file with the record before it. Returns its checksum.
    fn write_file(
        &self,
        name: &str,
        size: u64,
        buffer: &mut Vec<u8>,
        out: &mut dyn Write,
    ) -> Result<u32, FolderZipError> {
        // The first part of the name is the folder in the archive.
        let below = name.split_once('/').map_or(name, |(_, below)| below);
        let path = self.dir.join(below);
        let failed = |source| file_error(&path, source);
        let changed = || FolderZipError::Changed(path.clone());
        let mut file = File::open(&path).map_err(failed)?;
        let mut crc = Crc::new();
        if size <= READ_ONCE {
            buffer.clear();
            let read = (&mut file).take(size + 1).read_to_end(buffer);
            if read.map_err(failed)? as u64 != size {
                return Err(changed());
            }
            crc.update(buffer);
            let crc = crc.sum();
            let record = StoredFile { name, size, crc }.record();
            out.write_all(&record).map_err(FolderZipError::Output)?;
            out.write_all(buffer).map_err(FolderZipError::Output)?;
            return Ok(crc);
        }
        buffer.resize(BUFFER, 0);
        let mut pass = |crc: &mut Crc, out: &mut dyn Write| -> Result<u64, FolderZipError> {
            let mut total = 0;
            file.seek(SeekFrom::Start(0)).map_err(failed)?;
            loop {
                let read = file.read(buffer).map_err(failed)?;
                total += read as u64;
                if read == 0 || total > size {
                    return Ok(total);
                }
                crc.update(&buffer[..read]);
                out.write_all(&buffer[..read])
                    .map_err(FolderZipError::Output)?;
            }
        };
        if pass(&mut crc, &mut io::sink())? != size {
            return Err(changed());
        }
        let crc = crc.sum();
        let record = StoredFile { name, size, crc }.record();
        out.write_all(&record).map_err(FolderZipError::Output)?;
        let mut again = Crc::new();
        let total = pass(&mut again, out)?;
        if total != size || again.sum() != crc {
            return Err(changed());
        }
        Ok(crc)
    }
}

/// Opens a file without a name, so that nothing stays if the process is killed.
fn temporary_file() -> Result<File, FolderZipError> {
    tempfile::tempfile().map_err(temporary_error)
}

/// Returns a file that was written, from its start.
fn reread(written: BufWriter<File>) -> Result<BufReader<File>, FolderZipError> {
    let file = written.into_inner();
    let mut file = file.map_err(|error| temporary_error(error.into_error()))?;
    file.seek(SeekFrom::Start(0)).map_err(temporary_error)?;
    Ok(BufReader::new(file))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::{FolderZip, FolderZipError, READ_ONCE, zip_size};
    use crate::manifest::MANIFEST;

    fn export() -> tempfile::TempDir {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let write = |name: &str, bytes: &[u8]| {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
            fs::write(path, bytes).expect("written");
        };
        write(MANIFEST, b"{}");
        write("pairs/chữ số 1/overlay.png", b"abc");
        write("large.bin", &vec![7; READ_ONCE as usize + 5]);
        write(".hidden", b"");
        dir
    }

    fn begin(dir: &Path) -> FolderZip {
        FolderZip::begin(dir, "p-web").expect("an export")
    }

    #[test]
    fn an_archive_has_the_forecast_size_and_no_hidden_file() {
        let dir = export();
        let zip = begin(dir.path());
        let mut bytes = Vec::new();
        let size = zip.size();
        assert_eq!(zip_size(dir.path(), "p-web").expect("a size"), size);
        zip.write(&mut bytes).expect("written");
        assert_eq!(bytes.len() as u64, size);
        let has = |text: &str| {
            let text = text.as_bytes();
            bytes
                .windows(text.len())
                .filter(|part| *part == text)
                .count()
        };
        assert_eq!(has("p-web/pairs/chữ số 1/overlay.png"), 2);
        assert_eq!(has(".hidden"), 0);
        let place = |name: &str| {
            let mut parts = bytes.windows(name.len());
            parts.position(|part| part == name.as_bytes())
        };
        let places = [MANIFEST, "large.bin", "pairs/"].map(place);
        assert!(places.is_sorted() && places[0].is_some(), "{places:?}");
    }

    #[test]
    fn a_file_that_is_gone_or_changed_ends_the_archive() {
        let overlay = "pairs/chữ số 1/overlay.png";
        let change: [&dyn Fn(&Path); 5] = [
            &|dir| fs::remove_file(dir.join(overlay)).expect("removed"),
            &|dir| fs::write(dir.join(overlay), "abcd").expect("written"),
            &|dir| fs::write(dir.join("large.bin"), "abcd").expect("written"),
            &|dir| fs::remove_file(dir.join(MANIFEST)).expect("removed"),
            &|dir| {
                fs::rename(dir.join(MANIFEST), dir.join("old")).expect("renamed");
                fs::write(dir.join(MANIFEST), "{}").expect("written");
            },
        ];
        for (index, change) in change.iter().enumerate() {
            let dir = export();
            let zip = begin(dir.path());
            change(dir.path());
            let mut bytes = Vec::new();
            let failed = zip.write(&mut bytes);
            assert!(failed.is_err(), "{index}");
            assert!(
                !bytes.windows(4).any(|part| part == b"PK\x05\x06"),
                "{index}"
            );
        }
    }

    #[test]
    fn folders_that_are_nested_too_deeply_are_refused() {
        let dir = export();
        let deep = dir.path().join("a/".repeat(17));
        fs::create_dir_all(&deep).expect("folders");
        let found = zip_size(dir.path(), "p-web");
        assert!(matches!(found, Err(FolderZipError::TooDeep(_))));
    }

    #[test]
    fn a_folder_without_an_export_has_no_archive() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        fs::write(dir.path().join("a"), "x").expect("written");
        let found = FolderZip::begin(dir.path(), "a");
        assert!(matches!(found, Err(FolderZipError::NoExport(_))));
        assert!(zip_size(dir.path(), "a").is_err());
    }
}
