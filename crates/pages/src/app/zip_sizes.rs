//! The sizes of the archives of exports, which are worked out beside the pages.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use mocban_core::locked;
use mocban_export::{ExportVersion, zip_size};

/// The sizes of the archives of exports, which are worked out once for each export.
#[derive(Debug, Clone, Default)]
pub(super) struct ZipSizes(Arc<Mutex<BTreeMap<PathBuf, KnownSize>>>);

/// What is known about the size of the archive of an export.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ZipSize {
    /// It is being worked out.
    InWork,
    /// In bytes.
    Bytes(u64),
    /// There is no archive, because the folder has no manifest or its files cannot be listed.
    NoArchive,
}

/// An export, and the size of its archive.
type KnownSize = (ExportVersion, ZipSize);

impl ZipSizes {
    /// Returns the size of the archive of an export. The first call for an export begins to work it out.
    pub(super) fn get(&self, dir: &Path, folder: &str) -> ZipSize {
        let Some(version) = ExportVersion::of(dir) else {
            return ZipSize::NoArchive;
        };
        let mut sizes = locked(&self.0);
        if let Some((_, size)) = sizes.get(dir).filter(|(known, _)| *known == version) {
            return *size;
        }
        sizes.retain(|dir, _| dir.is_dir());
        sizes.insert(dir.to_owned(), (version, ZipSize::InWork));
        let (sizes, dir, folder) = (self.clone(), dir.to_owned(), folder.to_owned());
        tokio::task::spawn_blocking(move || {
            let size = zip_size(&dir, &folder).map_or(ZipSize::NoArchive, ZipSize::Bytes);
            locked(&sizes.0).insert(dir, (version, size));
        });
        ZipSize::InWork
    }
}
