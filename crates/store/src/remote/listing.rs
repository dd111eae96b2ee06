//! Versions of many objects from lists of their folders, which need one request for a thousand objects.

use std::collections::{BTreeMap, HashMap};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use super::bucket::Bucket;
use super::bucket_error::BucketError;
use mocban_core::locked;

/// Objects of a folder that are asked for one by one before the folder is listed.
const SINGLE_REQUESTS: usize = 20;
/// A list is used for this long.
const VALID: Duration = Duration::from_mins(10);
/// Lists that are kept.
const MAX_LISTS: usize = 8;

/// The lists that were read, by the address of their folder.
#[derive(Debug, Default)]
pub(super) struct FolderLists {
    folders: Mutex<BTreeMap<String, FolderList>>,
}

#[derive(Debug)]
struct FolderList {
    since: Instant,
    /// Number of objects that were asked for one by one.
    asked: usize,
    /// Versions by key, after the folder was listed.
    versions: Option<HashMap<String, String>>,
}

impl FolderLists {
    /// Returns the version of an object, which may be several minutes old.
    ///
    /// # Errors
    /// Returns an error if a request fails or there is no such object.
    pub(super) fn version(&self, bucket: &Bucket, key: &str) -> Result<String, BucketError> {
        let folder = key.rsplit_once('/').map_or("", |(folder, _)| folder);
        let address = bucket.address_of(folder);
        let mut folders = locked(&self.folders);
        folders.retain(|_, list| list.since.elapsed() < VALID);
        if !folders.contains_key(&address) && folders.len() >= MAX_LISTS {
            let oldest = folders.iter().min_by_key(|(_, list)| list.since);
            let oldest = oldest.map(|(address, _)| address.clone());
            oldest.and_then(|address| folders.remove(&address));
        }
        let list = folders.entry(address).or_insert_with(|| FolderList {
            since: Instant::now(),
            asked: 0,
            versions: None,
        });
        if list.versions.is_none() && list.asked >= SINGLE_REQUESTS {
            // Other threads wait for the list, because they ask for objects of the same folder.
            let mut versions = HashMap::new();
            bucket.list_folder(folder, |key, stat| {
                versions.insert(key, stat.version);
            })?;
            list.versions = Some(versions);
        }
        if let Some(versions) = &list.versions {
            let version = versions.get(key).cloned();
            return version.ok_or_else(|| BucketError::NotThere(bucket.address_of(key)));
        }
        list.asked += 1;
        drop(folders);
        Ok(bucket.stat(key)?.version)
    }
}

#[cfg(test)]
mod tests {
    use super::{Bucket, BucketError, FolderLists, SINGLE_REQUESTS};

    #[test]
    fn a_folder_is_listed_after_some_single_requests() {
        let (bucket, lists) = (Bucket::in_memory(), FolderLists::default());
        let keys: Vec<_> = (0..3 * SINGLE_REQUESTS)
            .map(|number| format!("a/{number}.obj"))
            .collect();
        for key in &keys {
            bucket.put(key, key.as_bytes());
        }
        bucket.put("a/deeper/1.obj", b"x");
        for key in &keys {
            let version = lists.version(&bucket, key).expect("there");
            assert_eq!(version, bucket.stat(key).expect("there").version);
        }
        let folders = lists.folders.lock().expect("an unpoisoned lock");
        let listed = folders
            .values()
            .next()
            .and_then(|list| list.versions.as_ref());
        assert_eq!(listed.map(std::collections::HashMap::len), Some(keys.len()));
        drop(folders);
        let missing = lists.version(&bucket, "a/none.obj");
        assert!(matches!(missing, Err(BucketError::NotThere(_))));
    }
}
