//! Where an input file is: at a path, below a named root, or in an object store.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Project;
use super::input_error::InputError;
use super::open_file::regular_metadata;
use super::remote::{Bucket, BucketError, CachedObject, ProjectStorage, Root};
use mocban_core::domain::{ArtifactRef, ContentHash};

/// An input file of a project.
#[derive(Debug, Clone)]
pub struct Input {
    path: PathBuf,
    pub(super) place: InputLocation,
}

/// Where an input file is.
#[derive(Debug, Clone)]
pub(super) enum InputLocation {
    /// At its path.
    File,
    /// At its path, below a root that several machines share. The inode is not compared, because it differs between
    /// copies of the data.
    SharedFile,
    /// In an object store.
    Object(RemoteInput),
    /// In an object store, named by the hash of its content: an artifact that is an object of its own.
    Artifact(RemoteInput, ContentHash),
}

/// An input in an object store.
#[derive(Debug, Clone)]
pub(super) struct RemoteInput {
    storage: Arc<ProjectStorage>,
    bucket: Bucket,
    key: String,
}

impl Input {
    /// Returns the input at a path.
    pub fn file(path: impl Into<PathBuf>) -> Self {
        Self {
            path: path.into(),
            place: InputLocation::File,
        }
    }

    /// Returns the path, or the address of an object, for messages and for the extension of the file name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns whether it is in an object store.
    pub const fn is_remote(&self) -> bool {
        match &self.place {
            InputLocation::File | InputLocation::SharedFile => false,
            InputLocation::Object(_) | InputLocation::Artifact(..) => true,
        }
    }

    /// Returns its length in bytes, or 0 if it cannot be read.
    pub fn size(&self) -> u64 {
        match &self.place {
            InputLocation::File | InputLocation::SharedFile => {
                std::fs::metadata(&self.path).map_or(0, |meta| meta.len())
            }
            InputLocation::Object(object) | InputLocation::Artifact(object, _) => {
                object.open(u64::MAX).map_or(0, |copy| copy.bytes)
            }
        }
    }

    /// Opens the input, or its local copy.
    ///
    /// # Errors
    /// Returns an error if it does not exist, is not a regular file, or cannot be read.
    pub fn open(&self) -> Result<std::fs::File, InputError> {
        match &self.place {
            InputLocation::File | InputLocation::SharedFile => {
                super::open_file::open_regular(&self.path).map(|(file, _)| file)
            }
            InputLocation::Object(object) | InputLocation::Artifact(object, _) => {
                Ok(object.open(u64::MAX)?.file)
            }
        }
    }

    /// Returns whether it exists. Returns `true` if this cannot be found out.
    pub fn exists(&self) -> bool {
        match &self.place {
            InputLocation::File | InputLocation::SharedFile => {
                !matches!(regular_metadata(&self.path), Err(InputError::NotThere(_)))
            }
            InputLocation::Object(object) => {
                !matches!(object.version(), Err(BucketError::NotThere(_)))
            }
            InputLocation::Artifact(object, _) => !matches!(
                object.bucket.stat(&object.key),
                Err(BucketError::NotThere(_))
            ),
        }
    }
}

impl RemoteInput {
    /// Opens a local copy.
    pub(super) fn open(&self, limit: u64) -> Result<CachedObject, BucketError> {
        self.storage.open_input(&self.bucket, &self.key, limit)
    }

    /// Returns the version of the object.
    pub(super) fn version(&self) -> Result<String, BucketError> {
        self.storage.input_version(&self.bucket, &self.key)
    }

    /// Forgets the local copy.
    pub(super) fn forget(&self) {
        self.storage
            .forget_input(&self.bucket.address_of(&self.key));
    }
}

impl Project {
    /// Returns an input by its stored path: relative to the project, absolute, relative to a named root, such as
    /// `scans:1/mesh.obj`, or the path of an artifact, which may be in an object store.
    pub fn input(&self, stored: &str) -> Input {
        let root = self.storage_arc().and_then(|storage| {
            let (root, rest) = storage.root(stored)?;
            Some((storage, root, rest))
        });
        match root {
            Some((_, Root::Folder(folder), rest)) => Input {
                path: folder.join(rest),
                place: InputLocation::SharedFile,
            },
            Some((storage, Root::Bucket(bucket), key)) => Input {
                path: PathBuf::from(bucket.address_of(key)),
                place: InputLocation::Object(RemoteInput {
                    storage: Arc::clone(storage),
                    bucket: bucket.clone(),
                    key: key.to_owned(),
                }),
            },
            None => self
                .artifact_input(stored)
                .unwrap_or_else(|| Input::file(self.dir().join(stored))),
        }
    }

    /// Returns the input at a stored path that is the key of an artifact in the object store.
    fn artifact_input(&self, stored: &str) -> Option<Input> {
        let storage = self.storage_arc()?;
        let artifact = ArtifactRef::at_path(stored)?;
        let (_, bucket, key) = self.artifact_object(&artifact)?;
        let object = RemoteInput {
            storage: Arc::clone(storage),
            bucket: bucket.clone(),
            key,
        };
        Some(Input {
            path: PathBuf::from(bucket.address_of(&object.key)),
            place: InputLocation::Artifact(object, artifact.hash),
        })
    }

    /// Returns the path of an input, or its address in an object store, for messages.
    pub fn input_path(&self, stored: &str) -> PathBuf {
        self.input(stored).path
    }

    /// Returns whether a stored path is relative to a named root.
    pub fn is_below_root(&self, stored: &str) -> bool {
        self.storage()
            .is_some_and(|storage| storage.root(stored).is_some())
    }

    /// Returns whether the artifacts are in an object store, so that other computers need not share the project folder.
    pub fn has_remote_artifacts(&self) -> bool {
        let storage = self.storage();
        storage.is_some_and(|storage| storage.artifacts().is_some())
    }

    /// Returns whether inputs may be read from an object store.
    pub fn has_remote_inputs(&self) -> bool {
        self.storage()
            .is_some_and(ProjectStorage::has_remote_inputs)
    }
}

#[cfg(test)]
mod tests {
    use crate::remote::ProjectStorage;
    use crate::{InputError, Project, hash_input, read_input, stat_input};
    use mocban_core::domain::ContentHash;

    #[test]
    fn an_object_is_an_input_and_its_changes_are_noticed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (storage, bucket) = ProjectStorage::in_memory(dir.path().join("cache"));
        let project = Project::create(dir.path()).expect("a project");
        let project = project.with_storage(Some(storage));
        bucket.put("a/1.obj", b"v 0 0 0");
        let input = project.input("scans:a/1.obj");
        assert!(input.exists() && !project.input("scans:a/2.obj").exists());
        assert!(input.is_remote() && !project.input("a/1.obj").is_remote());
        assert_eq!(input.size(), 7);
        let read = read_input(&input, 100, "x").expect("read");
        assert_eq!(&read.bytes[..], b"v 0 0 0");
        assert_eq!(read.version.hash, ContentHash::of(b"v 0 0 0"));
        assert_eq!(hash_input(&input).expect("hashed"), read.version);
        assert_eq!(stat_input(&input).expect("there"), read.version.stat);
        bucket.put("a/1.obj", b"v 1 1 1 1");
        assert_ne!(stat_input(&input).expect("there"), read.version.stat);
        let missing = read_input(&project.input("scans:a/2.obj"), 100, "x");
        assert!(matches!(missing, Err(InputError::NotThere(_))));
        let large = read_input(&input, 3, "limits.mesh.max_bytes").expect_err("too large");
        assert!(
            large.to_string().contains("limits.mesh.max_bytes"),
            "{large}"
        );
    }

    /// A disk may return other bytes than were written to it.
    #[test]
    fn a_local_copy_with_other_bytes_is_not_believed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let cache = dir.path().join("cache");
        let (storage, bucket) = ProjectStorage::in_memory(cache.clone());
        let project = Project::create(dir.path()).expect("a project");
        let project = project.with_storage(Some(storage));
        bucket.put("1.obj", b"v 0 0 0");
        let input = project.input("scans:1.obj");
        assert!(read_input(&input, 100, "x").is_ok());
        for entry in walk(&cache) {
            if entry.extension().is_some_and(|ext| ext == "data") {
                std::fs::write(entry, b"v 9 9 9").expect("written");
            }
        }
        let changed = read_input(&input, 100, "x");
        assert!(matches!(changed, Err(InputError::Changed(_))));
        let again = read_input(&input, 100, "x").expect("read from the store");
        assert_eq!(&again.bytes[..], b"v 0 0 0");
    }

    fn walk(folder: &std::path::Path) -> Vec<std::path::PathBuf> {
        let entries = std::fs::read_dir(folder).expect("a folder").flatten();
        let inside = entries.flat_map(|entry| {
            if entry.path().is_dir() {
                walk(&entry.path())
            } else {
                vec![entry.path()]
            }
        });
        inside.collect()
    }
}
