//! A folder in a bucket of an S3-compatible store, with blocking calls.
//!
//! The calls may be made on any thread that may wait. The client repeats a request after a reply such as 503 and after a
//! lost connection, with growing pauses.

use std::future::Future;
use std::io::Write;
use std::sync::Arc;
use std::sync::mpsc;

use futures_util::TryStreamExt as _;
use object_store::path::Path;
use object_store::{GetOptions, ObjectStore, ObjectStoreExt as _, PutMode, PutPayload};

use super::bucket_error::BucketError;
use super::client::LazyClient;
use super::object_stat::ObjectStat;
use super::request::start;
use mocban_core::domain::without_password;

/// A folder in a bucket.
#[derive(Debug, Clone)]
pub(crate) struct Bucket {
    client: Arc<LazyClient>,
    /// The folder within the bucket.
    prefix: Path,
    /// The address without a slash at its end, such as `s3://scans/2024`.
    address: String,
}

impl Bucket {
    /// Opens the folder at an address such as `s3://bucket/folder`. Sends no request. Credentials, region and endpoint
    /// are those of the environment (`AWS_ACCESS_KEY_ID`, `AWS_ENDPOINT_URL` and so on), which are read at the first request.
    ///
    /// # Errors
    /// Returns an error if the address has another form.
    pub(super) fn open(address: &str) -> Result<Self, BucketError> {
        let wrong = |reason: String| BucketError::Address {
            address: without_password(address),
            reason,
        };
        let rest = address
            .strip_prefix("s3://")
            .ok_or_else(|| wrong("an address begins with s3://".to_owned()))?;
        let (name, folder) = rest.split_once('/').unwrap_or((rest, ""));
        if name.is_empty() || name.contains(['@', ':', '?', '#']) {
            let form = "the form is s3://BUCKET/FOLDER; keys belong in AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY";
            return Err(wrong(form.to_owned()));
        }
        let prefix = Path::parse(folder.trim_matches('/'))
            .map_err(|error| wrong(format!("the folder cannot be used: {error}")))?;
        Ok(Self::new(LazyClient::new(name), prefix, address))
    }

    fn new(client: LazyClient, prefix: Path, address: &str) -> Self {
        let address = address.trim_end_matches('/').to_owned();
        Self {
            client: Arc::new(client),
            prefix,
            address,
        }
    }

    /// Returns an empty bucket in memory, for tests.
    #[cfg(test)]
    pub(super) fn in_memory() -> Self {
        let store = object_store::memory::InMemory::new();
        Self::new(
            LazyClient::of(Arc::new(store)),
            Path::default(),
            "memory://test",
        )
    }

    /// Stores an object, for tests.
    #[cfg(test)]
    pub(crate) fn put(&self, key: &str, bytes: &[u8]) {
        self.write(key, bytes.to_owned()).expect("stored in memory");
    }

    /// Returns the address of the folder.
    pub(crate) fn address(&self) -> &str {
        &self.address
    }

    /// Returns the address of an object, for messages and as a name.
    pub(crate) fn address_of(&self, key: &str) -> String {
        format!("{}/{key}", self.address)
    }

    /// Reads an object of at most `limit` bytes into memory.
    ///
    /// # Errors
    /// Returns an error if the request fails or the object is larger.
    pub(crate) fn read(&self, key: &str, limit: u64) -> Result<Vec<u8>, BucketError> {
        let copied = self.copy_to(key, limit, None, Vec::new())?;
        let copied = copied.map(|(bytes, _)| bytes);
        copied.ok_or_else(|| BucketError::NotThere(self.address_of(key)))
    }

    /// Writes the content of an object of at most `limit` bytes to `target`. Returns `None` if the object has the entity
    /// tag `unless`.
    ///
    /// # Errors
    /// Returns an error if the request fails, the object is larger, or `target` cannot be written.
    pub(super) fn copy_to<W: Write + Send + 'static>(
        &self,
        key: &str,
        limit: u64,
        unless: Option<String>,
        mut target: W,
    ) -> Result<Option<(W, ObjectStat)>, BucketError> {
        let (store, path) = (self.store()?, self.path(key)?);
        let address = self.address_of(key);
        let request = async move {
            let options = GetOptions {
                if_none_match: unless,
                ..GetOptions::default()
            };
            let failed = |error| BucketError::of(&address, &error);
            let found = match store.get_opts(&path, options).await {
                Err(object_store::Error::NotModified { .. }) => return Ok(None),
                found => found.map_err(failed)?,
            };
            let stat = ObjectStat::from(&found.meta);
            if stat.bytes > limit {
                let bytes = stat.bytes;
                return Err(BucketError::TooLarge {
                    address,
                    bytes,
                    limit,
                });
            }
            let mut stream = found.into_stream();
            while let Some(chunk) = stream.try_next().await.map_err(failed)? {
                target
                    .write_all(&chunk)
                    .map_err(|source| BucketError::Local {
                        path: std::path::PathBuf::from(&address),
                        source,
                    })?;
            }
            Ok(Some((target, stat)))
        };
        start(self.address_of(key), request)?.wait()
    }

    /// Returns length and version of an object.
    ///
    /// # Errors
    /// Returns an error if the request fails or there is no such object.
    pub(crate) fn stat(&self, key: &str) -> Result<ObjectStat, BucketError> {
        self.request(key, |store, path| async move {
            let found = store.head(&path).await?;
            Ok(ObjectStat::from(&found))
        })
    }

    /// Stores an object, in place of an earlier one of this name.
    pub(crate) fn write(&self, key: &str, bytes: Vec<u8>) -> Result<(), BucketError> {
        self.request(key, |store, path| async move {
            store.put(&path, PutPayload::from(bytes)).await.map(drop)
        })
    }

    /// Stores an object unless there is one of this name. Returns whether it was stored. Of several processes that call this at
    /// the same time, one stores its object; a store without conditional requests keeps the last one.
    pub(crate) fn create(&self, key: &str, bytes: Vec<u8>) -> Result<bool, BucketError> {
        self.request(key, |store, path| async move {
            let payload = PutPayload::from(bytes);
            let created = store
                .put_opts(&path, payload.clone(), PutMode::Create.into())
                .await;
            match created {
                Err(object_store::Error::AlreadyExists { .. }) => Ok(false),
                Err(object_store::Error::NotImplemented { .. }) => {
                    store.put(&path, payload).await.map(|_| true)
                }
                created => created.map(|_| true),
            }
        })
    }

    /// Returns whether there is no object below `folder`.
    pub(crate) fn is_empty(&self, folder: &str) -> Result<bool, BucketError> {
        self.request(folder, |store, path| async move {
            let first = store.list(Some(&path)).try_next().await;
            first.map(|first| first.is_none())
        })
    }

    /// Removes an object. Does nothing if there is none.
    pub(crate) fn remove(&self, key: &str) -> Result<(), BucketError> {
        self.request(key, |store, path| async move {
            match store.delete(&path).await {
                Err(object_store::Error::NotFound { .. }) => Ok(()),
                removed => removed,
            }
        })
    }

    /// Calls `each` with the key and stat of every object below `folder`, in any order.
    pub(crate) fn list(
        &self,
        folder: &str,
        mut each: impl FnMut(String, ObjectStat),
    ) -> Result<(), BucketError> {
        let (store, path) = (self.store()?, self.path(folder)?);
        let address = self.address_of(folder);
        let prefix = self.prefix.clone();
        let (sender, found) = mpsc::sync_channel::<(String, ObjectStat)>(4096);
        let request = async move {
            let mut objects = store.list(Some(&path));
            while let Some(meta) = objects
                .try_next()
                .await
                .map_err(|error| BucketError::of(&address, &error))?
            {
                let Some(key) = key_below(&prefix, &meta.location) else {
                    continue;
                };
                // The receiver waits for nothing but this channel.
                let stat = ObjectStat::from(&meta);
                tokio::task::block_in_place(|| sender.send((key, stat))).ok();
            }
            Ok(())
        };
        let listing = start(self.address_of(folder), request)?;
        for (key, stat) in found {
            each(key, stat);
        }
        listing.wait()
    }

    /// Calls `each` with the key and stat of every object in `folder`, without those of its subfolders.
    pub(super) fn list_folder(
        &self,
        folder: &str,
        mut each: impl FnMut(String, ObjectStat),
    ) -> Result<(), BucketError> {
        let found = self.request(folder, |store, path| async move {
            store.list_with_delimiter(Some(&path)).await
        })?;
        for meta in &found.objects {
            if let Some(key) = key_below(&self.prefix, &meta.location) {
                each(key, ObjectStat::from(meta));
            }
        }
        Ok(())
    }

    /// Sends a request that shows whether the bucket exists and may be read.
    pub(crate) fn check(&self) -> Result<(), BucketError> {
        let store = self.client.for_first_request();
        let store = store.map_err(|reason| self.unusable(&reason))?;
        let prefix = self.prefix.clone();
        let address = self.address.clone();
        let request = async move {
            let first = store.list(Some(&prefix)).try_next().await;
            first
                .map(drop)
                .map_err(|error| BucketError::of(&address, &error))
        };
        start(self.address.clone(), request)?.wait()
    }

    fn store(&self) -> Result<Arc<dyn ObjectStore>, BucketError> {
        self.client.get().map_err(|reason| self.unusable(reason))
    }

    fn unusable(&self, reason: &str) -> BucketError {
        BucketError::Address {
            address: self.address.clone(),
            reason: reason.to_owned(),
        }
    }

    fn path(&self, key: &str) -> Result<Path, BucketError> {
        let joined = format!("{}/{key}", self.prefix);
        Path::parse(joined.trim_matches('/')).map_err(|error| BucketError::Address {
            address: self.address_of(key),
            reason: error.to_string(),
        })
    }

    /// Sends a request for an object or folder, and adds its address to an error of the client.
    fn request<T: Send + 'static, F>(
        &self,
        key: &str,
        send: impl FnOnce(Arc<dyn ObjectStore>, Path) -> F,
    ) -> Result<T, BucketError>
    where
        F: Future<Output = object_store::Result<T>> + Send + 'static,
    {
        let (address, reply) = (self.address_of(key), send(self.store()?, self.path(key)?));
        let place = address.clone();
        let outcome = async move { reply.await.map_err(|error| BucketError::of(&place, &error)) };
        start(address, outcome)?.wait()
    }
}

/// Returns the key of an object relative to a folder, or `None` if it is not below the folder.
fn key_below(folder: &Path, object: &Path) -> Option<String> {
    let parts = object.prefix_match(folder)?;
    let parts: Vec<_> = parts.map(|part| part.as_ref().to_owned()).collect();
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::{Bucket, BucketError};

    #[test]
    fn objects_are_written_read_listed_and_removed() {
        let bucket = Bucket::in_memory();
        for key in ["packs/ab/1.zip", "packs/cd/chữ 2.zip", "other/3"] {
            bucket.write(key, key.as_bytes().to_vec()).expect("written");
        }
        let bytes = bucket.read("packs/cd/chữ 2.zip", 100).expect("read");
        assert_eq!(bytes, "packs/cd/chữ 2.zip".as_bytes());
        let copied = bucket.copy_to("packs/cd/chữ 2.zip", 100, None, vec![]);
        let (_, stat) = copied.expect("read").expect("an object");
        assert_eq!(bucket.stat("packs/cd/chữ 2.zip").expect("there"), stat);
        let same = bucket.copy_to(
            "other/3",
            100,
            bucket.stat("other/3").expect("there").tag,
            vec![],
        );
        assert!(same.expect("the same object").is_none());
        let large = bucket.read("other/3", 3);
        assert!(matches!(
            large,
            Err(BucketError::TooLarge {
                bytes: 7,
                limit: 3,
                ..
            })
        ));
        let mut found = Vec::new();
        bucket
            .list("packs", |key, stat| found.push((key, stat.bytes)))
            .expect("listed");
        found.sort();
        assert_eq!(
            found,
            [
                ("packs/ab/1.zip".to_owned(), 14),
                ("packs/cd/chữ 2.zip".to_owned(), 20)
            ]
        );
        let create = |bytes: &[u8]| bucket.create("owner", bytes.to_vec()).expect("created");
        assert!(bucket.is_empty("owner").expect("known"));
        assert!(create(b"one") && !create(b"two"));
        assert_eq!(bucket.read("owner", 100).expect("read"), b"one");
        assert!(!bucket.is_empty("packs").expect("known"));
        bucket.remove("packs/ab/1.zip").expect("removed");
        bucket.remove("packs/ab/1.zip").expect("nothing to remove");
        let gone = bucket.read("packs/ab/1.zip", 100);
        assert!(matches!(gone, Err(BucketError::NotThere(_))));
    }

    #[test]
    fn an_address_with_keys_or_another_scheme_is_refused_without_quoting_the_keys() {
        for address in ["s3://AKIA:secret@bucket/x", "s3:///x", "https://bucket"] {
            let error = Bucket::open(address).expect_err("refused").to_string();
            assert!(
                !error.contains("secret") && !error.contains("AKIA"),
                "{error}"
            );
        }
    }
}
