//! The files of an export, in the order of the archive: sorted by name in each folder.

use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::path::Path;

use super::manifest::MANIFEST;
use super::zip_error::{FolderZipError, file_error, temporary_error};
use mocban_core::zip_records::{ArchiveLayout, MAX_NAME, StoredFile};

/// How deep the folders of an export are at most.
const MAX_DEPTH: usize = 16;

/// Lists the files below a folder, without hidden ones and links.
pub(super) fn list_files(
    dir: &Path,
    folder: &str,
    layout: &mut ArchiveLayout,
    list: &mut dyn Write,
) -> Result<(), FolderZipError> {
    if !dir.join(MANIFEST).is_file() {
        return Err(FolderZipError::NoExport(dir.to_owned()));
    }
    let mut walk = FolderWalk { layout, list };
    walk.add_folder(dir, folder, MAX_DEPTH)?;
    list.flush().map_err(temporary_error)
}

/// Collects files.
struct FolderWalk<'l> {
    layout: &'l mut ArchiveLayout,
    list: &'l mut dyn Write,
}

impl FolderWalk<'_> {
    fn add_folder(&mut self, dir: &Path, name: &str, depth: usize) -> Result<(), FolderZipError> {
        for own in sorted_names(dir)? {
            let path = dir.join(&own);
            let meta = fs::symlink_metadata(&path).map_err(|source| file_error(&path, source))?;
            let Some(own) = own.to_str() else {
                return Err(FolderZipError::Name(path));
            };
            if own.starts_with('.') {
                continue;
            }
            let name = format!("{name}/{own}");
            if name.len() > MAX_NAME {
                return Err(FolderZipError::Name(path));
            }
            if meta.is_dir() {
                if depth == 1 {
                    return Err(FolderZipError::TooDeep(path));
                }
                self.add_folder(&path, &name, depth - 1)?;
            } else if meta.is_file() {
                self.add_file(&name, meta.len())?;
            }
        }
        Ok(())
    }

    fn add_file(&mut self, name: &str, size: u64) -> Result<(), FolderZipError> {
        self.layout.add(&StoredFile { name, size, crc: 0 });
        let length = (name.len() as u32).to_le_bytes();
        let parts = [&length[..], &size.to_le_bytes(), name.as_bytes()];
        self.list
            .write_all(&parts.concat())
            .map_err(temporary_error)
    }
}

/// Returns the names in a folder. `read_dir` gives them in an order that differs between equal folders.
fn sorted_names(dir: &Path) -> Result<Vec<OsString>, FolderZipError> {
    let failed = |source| file_error(dir, source);
    let mut names = Vec::new();
    for entry in fs::read_dir(dir).map_err(failed)? {
        names.push(entry.map_err(failed)?.file_name());
    }
    names.sort();
    Ok(names)
}
