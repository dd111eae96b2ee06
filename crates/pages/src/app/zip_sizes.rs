//! The sizes of the archives of exports, which are worked out beside the pages.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use mocban_export::{ExportVersion, zip_size};

/// The sizes of the archives of exports, which are worked out once for each export.
#[derive(Debug, Clone, Default)]
pub(super) struct ZipSizes(Arc<Mutex<BTreeMap<PathBuf, KnownSize>>>);

/// The size of the archive of an export in bytes; `None` while it is worked out, or if it has none.
type KnownSize = (ExportVersion, Option<u64>);

impl ZipSizes {
    /// Returns the size of the archive of an export in bytes. The first call for an export begins to work it out.
    pub(super) fn get(&self, dir: &Path, folder: &str) -> Option<u64> {
        let version = ExportVersion::of(dir)?;
        let mut sizes = self.lock();
        if let Some((_, size)) = sizes.get(dir).filter(|(known, _)| *known == version) {
            return *size;
        }
        sizes.retain(|dir, _| dir.is_dir());
        sizes.insert(dir.to_owned(), (version, None));
        let (sizes, dir, folder) = (self.clone(), dir.to_owned(), folder.to_owned());
        tokio::task::spawn_blocking(move || {
            let size = zip_size(&dir, &folder).ok();
            sizes.lock().insert(dir, (version, size));
        });
        None
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<PathBuf, KnownSize>> {
        // Each change is a single insertion or removal.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
