//! Where a project's artifacts and inputs are, apart from its own folder.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::bucket::Bucket;
use super::bucket_error::BucketError;
use super::cache::{CachedObject, ObjectCache};
use super::listing::FolderLists;
use super::pack::{key, read_pack};
use super::small_cache::SmallCache;
use mocban_core::domain::{ErrorCode, Explained, is_address};

/// The settings of a storage.
#[derive(Debug, Clone, Default)]
pub struct StorageOptions {
    /// Address of the artifacts, such as `s3://bucket/folder`. Empty for the folder `artifacts` of the project.
    pub artifacts: String,
    /// Folders or addresses of inputs by name.
    pub roots: BTreeMap<String, String>,
    /// Folder of local copies of inputs. Empty for the user's cache folder.
    pub cache: String,
    /// Space for local copies, in bytes.
    pub cache_bytes: u64,
}

/// A named root of input paths.
#[derive(Debug, Clone)]
pub(crate) enum Root {
    /// A folder on this machine.
    Folder(PathBuf),
    /// A folder in an object store.
    Bucket(Bucket),
}

/// Where artifacts and inputs are.
#[derive(Debug)]
pub struct ProjectStorage {
    artifacts: Option<Bucket>,
    roots: BTreeMap<String, Root>,
    cache: ObjectCache,
    lists: FolderLists,
    /// Packs read last.
    packs: SmallCache<Arc<Vec<u8>>>,
    /// Lengths in bytes of the packs asked for last.
    lengths: SmallCache<u64>,
}

/// Why a storage cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StorageError {
    /// The name of a root is not usable in paths.
    #[error(
        "storage.roots.{0}: a name of a root has at least two of the signs a-z, 0-9, _ and -, and begins with a letter"
    )]
    RootName(String),
    /// The folder of a root has no absolute path.
    #[error(
        "storage.roots.{name} = {folder:?}: give an absolute path or an address such as s3://bucket/folder"
    )]
    RootFolder {
        /// Its name.
        name: String,
        /// Its value.
        folder: String,
    },
    /// The folder of a root is missing or empty, or cannot be read, as if its disk were not mounted.
    #[error(
        "storage.roots.{name}: {} {reason} on this computer; mount its disk, or correct the setting", folder.display()
    )]
    UnusableRoot {
        /// Its name.
        name: String,
        /// The folder.
        folder: PathBuf,
        /// Why it cannot be used.
        reason: String,
    },
    /// No cache folder is known.
    #[error("no folder for local copies is known; set storage.cache")]
    NoCacheFolder,
    /// An address cannot be used.
    #[error("{setting}: {source}")]
    Bucket {
        /// Name of the setting.
        setting: String,
        /// Why.
        source: BucketError,
    },
}

impl Explained for StorageError {
    fn code(&self) -> ErrorCode {
        if self.is_unavailable() {
            ErrorCode::Unavailable
        } else {
            ErrorCode::Settings
        }
    }
}

impl StorageError {
    /// Returns whether the same settings may work later.
    pub const fn is_unavailable(&self) -> bool {
        let Self::Bucket { source, .. } = self else {
            return false;
        };
        matches!(source, BucketError::Unavailable { .. })
    }
}

impl ProjectStorage {
    /// Opens a storage. Sends no request. Returns `None` if everything is in the project or at a local path.
    ///
    /// # Errors
    /// Returns an error if a setting has an invalid value.
    pub fn open(options: &StorageOptions) -> Result<Option<Self>, StorageError> {
        if options.artifacts.is_empty() && options.roots.is_empty() {
            return Ok(None);
        }
        let open = |setting: &str, address: &str| {
            Bucket::open(address).map_err(|source| StorageError::Bucket {
                setting: setting.to_owned(),
                source,
            })
        };
        let mut roots = BTreeMap::new();
        for (name, place) in &options.roots {
            if !is_root_name(name) {
                return Err(StorageError::RootName(name.clone()));
            }
            let root = if is_address(place) {
                Root::Bucket(open(&format!("storage.roots.{name}"), place)?)
            } else if Path::new(place).is_absolute() {
                Root::Folder(PathBuf::from(place))
            } else {
                return Err(StorageError::RootFolder {
                    name: name.clone(),
                    folder: place.clone(),
                });
            };
            roots.insert(name.clone(), root);
        }
        let artifacts = match &*options.artifacts {
            "" => None,
            address => Some(open("storage.artifacts", address)?),
        };
        let has_remote_inputs = roots.values().any(|root| matches!(root, Root::Bucket(_)));
        let cache = match &*options.cache {
            "" => cache_folder().or(if has_remote_inputs {
                None
            } else {
                Some(PathBuf::new())
            }),
            folder => Some(PathBuf::from(folder)),
        };
        let cache = cache.ok_or(StorageError::NoCacheFolder)?;
        Ok(Some(Self {
            artifacts,
            roots,
            cache: ObjectCache::new(cache, options.cache_bytes),
            lists: FolderLists::default(),
            packs: SmallCache::default(),
            lengths: SmallCache::default(),
        }))
    }

    /// Returns a storage with artifacts and one root `scans` in a bucket in memory.
    #[cfg(test)]
    pub(crate) fn in_memory(cache: PathBuf) -> (Self, Bucket) {
        let bucket = Bucket::in_memory();
        let storage = Self {
            artifacts: Some(bucket.clone()),
            roots: BTreeMap::from([("scans".to_owned(), Root::Bucket(bucket.clone()))]),
            cache: ObjectCache::new(cache, 1 << 20),
            lists: FolderLists::default(),
            packs: SmallCache::default(),
            lengths: SmallCache::default(),
        };
        (storage, bucket)
    }

    /// Asks each bucket whether it exists and may be read. May block.
    ///
    /// # Errors
    /// Returns the error of the first bucket that does not answer.
    pub fn check(&self) -> Result<(), StorageError> {
        let failed = |setting: String| move |source| StorageError::Bucket { setting, source };
        if let Some(bucket) = &self.artifacts {
            bucket
                .check()
                .map_err(failed("storage.artifacts".to_owned()))?;
        }
        for (name, root) in &self.roots {
            if let Root::Bucket(bucket) = root {
                bucket
                    .check()
                    .map_err(failed(format!("storage.roots.{name}")))?;
            }
        }
        Ok(())
    }

    /// Returns an error for each local folder of a root that is missing, empty or unreadable. May block.
    pub fn unusable_roots(&self) -> Vec<StorageError> {
        let folders = self.roots.iter().filter_map(|(name, root)| match root {
            Root::Folder(folder) => check_folder(name, folder).err(),
            Root::Bucket(_) => None,
        });
        folders.collect()
    }

    /// Checks that the folder of the root that a stored path begins with can be read and is not empty. May block.
    ///
    /// # Errors
    /// Returns an error if the folder is missing or empty, or cannot be listed although that is permitted.
    pub fn check_root_of(&self, stored: &str) -> Result<(), StorageError> {
        match (self.root(stored), stored.split_once(':')) {
            (Some((Root::Folder(folder), _)), Some((name, _))) => check_folder(name, folder),
            _ => Ok(()),
        }
    }

    /// Returns the bucket of the artifacts.
    pub(crate) const fn artifacts(&self) -> Option<&Bucket> {
        self.artifacts.as_ref()
    }

    /// Returns the root that a stored path such as `scans:1/mesh.obj` begins with, and the rest of the path.
    pub(crate) fn root<'a>(&self, stored: &'a str) -> Option<(&Root, &'a str)> {
        let (name, rest) = stored.split_once(':')?;
        Some((self.roots.get(name)?, rest))
    }

    /// Returns whether some inputs may be in an object store: those below a root, or characters that were cut from blocks.
    pub(crate) fn has_remote_inputs(&self) -> bool {
        let mut roots = self.roots.values();
        self.artifacts.is_some() || roots.any(|root| matches!(root, Root::Bucket(_)))
    }

    /// Opens a local copy of an input.
    ///
    /// # Errors
    /// Returns an error if a request fails, the object is larger than `limit`, or the copy cannot be written.
    pub(crate) fn open_input(
        &self,
        bucket: &Bucket,
        key: &str,
        limit: u64,
    ) -> Result<CachedObject, BucketError> {
        self.cache.open(bucket, key, limit)
    }

    /// Returns the version of an input, which may be several minutes old.
    ///
    /// # Errors
    /// Returns an error if a request fails or there is no such object.
    pub(crate) fn input_version(&self, bucket: &Bucket, key: &str) -> Result<String, BucketError> {
        self.lists.version(bucket, key)
    }

    /// Returns the stored form of a path below a root that is a folder, such as `nas:1/mesh.obj`.
    pub(crate) fn path_below_root(&self, path: &Path) -> Option<String> {
        let below = |(name, root): (&String, &Root)| match root {
            Root::Folder(folder) => {
                let rest = path.strip_prefix(folder).ok()?.to_str()?;
                Some((folder.as_os_str().len(), format!("{name}:{rest}")))
            }
            Root::Bucket(_) => None,
        };
        // Of several roots, the deepest.
        self.roots
            .iter()
            .filter_map(below)
            .max()
            .map(|(_, path)| path)
    }

    /// Forgets a local copy whose content has changed.
    pub(crate) fn forget_input(&self, address: &str) {
        self.cache.forget(address);
    }

    /// Returns a pack, from memory if it was read lately.
    pub(crate) fn pack(&self, bucket: &Bucket, name: &str) -> Result<Arc<Vec<u8>>, BucketError> {
        self.packs
            .get_or_insert(name, || read_pack(bucket, name).map(Arc::new))
    }

    /// Forgets the packs in memory, as another process would know none.
    #[cfg(test)]
    pub(crate) fn forget_packs(&self) {
        self.packs.clear();
        self.lengths.clear();
    }

    /// Returns the length of a pack in bytes.
    pub(crate) fn pack_bytes(&self, bucket: &Bucket, name: &str) -> Result<u64, BucketError> {
        self.lengths
            .get_or_insert(name, || Ok(bucket.stat(&key(name))?.bytes))
    }
}

fn is_root_name(name: &str) -> bool {
    let is_allowed =
        |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"_-".contains(&byte);
    name.len() >= 2 && name.as_bytes()[0].is_ascii_lowercase() && name.bytes().all(is_allowed)
}

/// Returns the folder for copies in the user's cache folder.
fn cache_folder() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let base = variable("XDG_CACHE_HOME")
        .or_else(|| variable("LOCALAPPDATA"))
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(variable("HOME")?).join(".cache")))?;
    Some(base.join("mocban"))
}

/// Refuses a folder of a root that is missing or empty, or that cannot be listed. A folder that may not be listed is not
/// refused, because its files may be readable.
fn check_folder(name: &str, folder: &Path) -> Result<(), StorageError> {
    let first = std::fs::read_dir(folder).map(|mut entries| entries.next().transpose());
    let reason = match first.and_then(|first| first) {
        Ok(Some(_)) => return Ok(()),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => return Ok(()),
        Ok(None) => "is empty".to_owned(),
        Err(error) if error.kind() == ErrorKind::NotFound => "does not exist".to_owned(),
        Err(error) => format!("cannot be read ({error})"),
    };
    Err(StorageError::UnusableRoot {
        name: name.to_owned(),
        folder: folder.to_owned(),
        reason,
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::{ProjectStorage, Root, StorageOptions};

    fn options(roots: &[(&str, &str)]) -> StorageOptions {
        let roots = roots
            .iter()
            .map(|(name, place)| ((*name).to_owned(), (*place).to_owned()));
        StorageOptions {
            roots: roots.collect::<BTreeMap<_, _>>(),
            cache: "/nonexistent".to_owned(),
            ..StorageOptions::default()
        }
    }

    #[test]
    fn a_path_begins_with_the_name_of_its_root() {
        let root = std::env::temp_dir();
        let root = root.to_str().expect("UTF-8");
        let storage = ProjectStorage::open(&options(&[("nas", root)]))
            .expect("valid")
            .expect("one root");
        let (found, rest) = storage.root("nas:a/chữ 1.obj").expect("a root");
        assert!(matches!(found, Root::Folder(folder) if folder.to_str() == Some(root)));
        assert_eq!(rest, "a/chữ 1.obj");
        for path in ["a/1.obj", "other:1.obj", "nas/1.obj", "/nas:1.obj"] {
            assert!(storage.root(path).is_none(), "{path}");
        }
        assert!(
            ProjectStorage::open(&StorageOptions::default())
                .expect("valid")
                .is_none()
        );
    }

    #[test]
    fn names_and_folders_that_would_be_ambiguous_are_refused() {
        for (name, place) in [
            ("c", "/mnt"),
            ("Nas", "/mnt"),
            ("nas", "mnt"),
            ("a:b", "/mnt"),
            ("nas", "ftp://x"),
        ] {
            let error = ProjectStorage::open(&options(&[(name, place)])).expect_err("refused");
            assert!(error.to_string().contains("storage.roots."), "{error}");
        }
    }

    #[test]
    fn a_root_that_is_not_mounted_is_noticed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [full, empty, missing] = ["full", "empty", "missing"].map(|name| dir.path().join(name));
        for folder in [&full, &empty] {
            std::fs::create_dir(folder).expect("a folder");
        }
        std::fs::write(full.join("1.stl"), "x").expect("a file");
        let text = |folder: &Path| folder.to_str().expect("UTF-8").to_owned();
        let folders = [text(&full), text(&empty), text(&missing)];
        let roots = ["full", "empty", "missing"].into_iter().zip(&folders);
        let roots: Vec<(&str, &str)> = roots.map(|(name, folder)| (name, &**folder)).collect();
        let storage = ProjectStorage::open(&options(&roots));
        let storage = storage.expect("valid").expect("a storage");
        assert!(storage.check_root_of("full:2.stl").is_ok());
        assert!(storage.check_root_of("data/2.stl").is_ok());
        for name in ["empty", "missing"] {
            let refused = storage.check_root_of(&format!("{name}:2.stl"));
            let refused = refused.expect_err("no files").to_string();
            assert!(
                refused.starts_with(&format!("storage.roots.{name}: ")),
                "{refused}"
            );
        }
        assert!(storage.check().is_ok(), "a root may be unused");
    }
}
