//! Local copies of input files in an object store. The oldest copies are removed when they take too much space.
//!
//! A copy has a name made of the object's address and version, so it is never changed. A small file beside it holds the
//! newest known version. A conditional request then shows whether the object has changed. Processes may share the folder.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant, SystemTime};

use serde::{Deserialize, Serialize};

use super::bucket::Bucket;
use super::bucket_error::BucketError;
use super::cache_files;
use crate::create_folders::create_folders;
use mocban_core::domain::ContentHash;
use mocban_core::locked;
use mocban_system::failpoint::time_scale;
use mocban_system::platform::rename;

/// The store is not asked again whether an object has changed within this time.
const FRESH: Duration = Duration::from_mins(1);

/// Returns whether a copy that was confirmed at this time counts as current.
fn is_fresh(confirmed: Instant) -> bool {
    confirmed.elapsed() < FRESH * time_scale("MOCBAN_STORE_FACTOR")
}

/// A folder of copies.
#[derive(Debug)]
pub(crate) struct ObjectCache {
    folder: PathBuf,
    max_bytes: u64,
    state: Mutex<CacheState>,
}

#[derive(Debug, Default)]
struct CacheState {
    /// When the store last confirmed a copy, by address.
    confirmed: BTreeMap<String, Instant>,
    /// Length of all copies when they were last counted, and what this process has added since. `None` before the first
    /// count.
    bytes: Option<u64>,
}

/// A copy that is open for reading.
#[derive(Debug)]
pub(crate) struct CachedObject {
    /// The open file.
    pub(crate) file: File,
    /// Length in bytes.
    pub(crate) bytes: u64,
    /// Version of the object.
    pub(crate) version: String,
    /// Hash of the content when it was received.
    pub(crate) hash: ContentHash,
}

/// The newest known version of an object.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Known {
    version: String,
    tag: Option<String>,
    bytes: u64,
    hash: ContentHash,
}

/// Writes to a file and hashes what is written.
struct HashingFile {
    file: File,
    hasher: blake3::Hasher,
}

impl Write for HashingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.file.write(bytes)?;
        self.hasher.update(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl ObjectCache {
    /// Returns the cache in `folder`, which is created when the first copy is written.
    pub(super) fn new(folder: PathBuf, max_bytes: u64) -> Self {
        Self {
            folder,
            max_bytes,
            state: Mutex::default(),
        }
    }

    /// Opens a copy of the object, and reads the object from the store if there is no copy or if it has changed.
    ///
    /// # Errors
    /// Returns an error if a request fails, the object is larger than `limit`, or the copy cannot be written.
    pub(super) fn open(
        &self,
        bucket: &Bucket,
        key: &str,
        limit: u64,
    ) -> Result<CachedObject, BucketError> {
        let address = bucket.address_of(key);
        let known = self.known(&address);
        let copy = known.as_ref().and_then(|known| self.copy(&address, known));
        if let Some(copy) = copy {
            if copy.bytes > limit {
                return Err(BucketError::TooLarge {
                    address,
                    bytes: copy.bytes,
                    limit,
                });
            }
            let tag = known.and_then(|known| known.tag);
            if self.is_confirmed(&address) {
                return Ok(copy);
            }
            if tag.is_some() {
                let fetched = self.fetch(bucket, key, limit, tag)?;
                return Ok(fetched.unwrap_or(copy));
            }
        }
        let fetched = self.fetch(bucket, key, limit, None)?;
        fetched.ok_or(BucketError::NotThere(address))
    }

    /// Forgets the copy of an object, because its content is not what was received.
    pub(super) fn forget(&self, address: &str) {
        let _ = std::fs::remove_file(self.tag_path(address));
    }

    /// Reads the object unless it has the entity tag `unless`.
    fn fetch(
        &self,
        bucket: &Bucket,
        key: &str,
        limit: u64,
        unless: Option<String>,
    ) -> Result<Option<CachedObject>, BucketError> {
        let address = bucket.address_of(key);
        let local = |source| BucketError::Local {
            path: self.folder.clone(),
            source,
        };
        if self.folder.as_os_str().is_empty() {
            let text = "no folder for local copies is known; set storage.cache";
            return Err(local(io::Error::new(ErrorKind::NotFound, text)));
        }
        create_folders(&self.folder).map_err(local)?;
        let temporary =
            tempfile::NamedTempFile::with_prefix_in("tmp-", &self.folder).map_err(local)?;
        let target = HashingFile {
            file: temporary.reopen().map_err(local)?,
            hasher: blake3::Hasher::new(),
        };
        let copied = bucket.copy_to(key, limit, unless, target);
        let copied = copied.map_err(|error| match error {
            // The disk of the copies failed, not the store.
            BucketError::Local { source, .. } => local(source),
            error => error,
        })?;
        let Some((target, stat)) = copied else {
            self.confirm(address);
            return Ok(None);
        };
        let known = Known {
            version: stat.version,
            tag: stat.tag,
            bytes: stat.bytes,
            hash: ContentHash::from_bytes(*target.hasher.finalize().as_bytes()),
        };
        let copy = self.copy_path(&address, &known.version);
        self.make_folder(&copy).map_err(local)?;
        let opened = File::open(temporary.path()).map_err(local)?;
        let temporary = temporary.into_temp_path();
        rename(&temporary, &copy).map_err(|source| BucketError::Local {
            path: copy.clone(),
            source,
        })?;
        // The file has its new name, so there is nothing to remove.
        let _ = temporary.keep();
        self.write_known(&address, &known).map_err(local)?;
        self.confirm(address);
        self.added(known.bytes);
        Ok(Some(known.opened(opened)))
    }

    fn known(&self, address: &str) -> Option<Known> {
        let text = std::fs::read(self.tag_path(address)).ok()?;
        serde_json::from_slice(&text).ok()
    }

    fn write_known(&self, address: &str, known: &Known) -> io::Result<()> {
        let mut file = tempfile::NamedTempFile::with_prefix_in("tmp-", &self.folder)?;
        serde_json::to_writer(&mut file, known)?;
        let temporary = file.into_temp_path();
        let path = self.tag_path(address);
        self.make_folder(&path)?;
        rename(&temporary, &path)?;
        let _ = temporary.keep();
        Ok(())
    }

    /// Opens a copy, and marks it as used.
    fn copy(&self, address: &str, known: &Known) -> Option<CachedObject> {
        let file = File::open(self.copy_path(address, &known.version)).ok()?;
        if file.metadata().ok()?.len() != known.bytes {
            return None;
        }
        let _ = file.set_modified(SystemTime::now());
        Some(known.opened(file))
    }

    fn tag_path(&self, address: &str) -> PathBuf {
        self.path(&ContentHash::of(address.as_bytes()), "json")
    }

    fn copy_path(&self, address: &str, version: &str) -> PathBuf {
        let name = format!("{address}\n{version}");
        self.path(&ContentHash::of(name.as_bytes()), "data")
    }

    fn path(&self, hash: &ContentHash, extension: &str) -> PathBuf {
        let hex = hash.to_hex();
        self.folder
            .join(&hex[..2])
            .join(format!("{hex}.{extension}"))
    }

    /// Creates the folder of a file.
    fn make_folder(&self, file: &Path) -> io::Result<()> {
        create_folders(file.parent().unwrap_or(&self.folder))
    }

    fn is_confirmed(&self, address: &str) -> bool {
        let state = locked(&self.state);
        let confirmed = state.confirmed.get(address);
        confirmed.is_some_and(|at| is_fresh(*at))
    }

    fn confirm(&self, address: String) {
        let mut state = locked(&self.state);
        if state.confirmed.len() > 10_000 {
            state.confirmed.retain(|_, at| is_fresh(*at));
        }
        state.confirmed.insert(address, Instant::now());
    }

    /// Counts a new copy, and removes the oldest copies if there is no space left for more.
    fn added(&self, bytes: u64) {
        let mut state = locked(&self.state);
        let total = match state.bytes {
            Some(before) => before + bytes,
            None => cache_files::list(&self.folder)
                .iter()
                .map(|file| file.bytes)
                .sum(),
        };
        // Copies of other processes are counted only here.
        state.bytes = Some(if total > self.max_bytes {
            cache_files::remove_oldest(&self.folder, self.max_bytes)
        } else {
            total
        });
    }
}

impl Known {
    fn opened(&self, file: File) -> CachedObject {
        CachedObject {
            file,
            bytes: self.bytes,
            version: self.version.clone(),
            hash: self.hash,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::super::bucket::Bucket;
    use super::super::cache_files::list;
    use super::{BucketError, ObjectCache};

    fn text(cache: &ObjectCache, bucket: &Bucket, key: &str) -> String {
        let mut object = cache.open(bucket, key, 1000).expect("an object");
        let mut text = String::new();
        object.file.read_to_string(&mut text).expect("UTF-8");
        text
    }

    #[test]
    fn an_object_is_read_once_and_again_after_it_has_changed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let bucket = Bucket::in_memory();
        bucket.write("1.obj", b"old".to_vec()).expect("written");
        let open = || ObjectCache::new(dir.path().join("cache"), 1000);
        let cache = open();
        assert_eq!(text(&cache, &bucket, "1.obj"), "old");
        bucket.write("1.obj", b"new!".to_vec()).expect("written");
        assert_eq!(text(&cache, &bucket, "1.obj"), "old", "confirmed just now");
        assert_eq!(text(&open(), &bucket, "1.obj"), "new!");
        let small = open().open(&bucket, "1.obj", 3);
        assert!(matches!(small, Err(BucketError::TooLarge { .. })));
        bucket.remove("1.obj").expect("removed");
        let gone = open().open(&bucket, "1.obj", 1000);
        assert!(matches!(gone, Err(BucketError::NotThere(_))));
    }

    #[test]
    fn the_oldest_copies_are_removed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let bucket = Bucket::in_memory();
        let cache = ObjectCache::new(dir.path().to_owned(), 3000);
        for number in 0..20 {
            let key = format!("{number}.png");
            bucket.write(&key, vec![number; 500]).expect("written");
            drop(cache.open(&bucket, &key, 1000).expect("an object"));
        }
        let left: u64 = list(&cache.folder).iter().map(|file| file.bytes).sum();
        assert!((500..=3500).contains(&left), "{left}");
        assert_eq!(text(&cache, &bucket, "19.png").as_bytes(), [19; 500]);
    }

    #[test]
    fn a_copy_that_was_cut_is_read_again() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let bucket = Bucket::in_memory();
        bucket.write("1.obj", b"whole".to_vec()).expect("written");
        let cache = ObjectCache::new(dir.path().to_owned(), 1000);
        assert_eq!(text(&cache, &bucket, "1.obj"), "whole");
        for file in list(&cache.folder) {
            if file.bytes == 5 {
                std::fs::write(&file.path, b"wh").expect("cut");
            }
        }
        assert_eq!(text(&cache, &bucket, "1.obj"), "whole");
    }
}
