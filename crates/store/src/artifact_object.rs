//! Artifacts that are objects of their own in an object store: the meshes and prints of characters that were cut from
//! blocks. Pairs read them as inputs, under the paths that they would have in the project's folder.
//!
//! The key of such an object is the path of the artifact, which contains the hash of its content. So an object never
//! changes, its version is known without a request, and the same character cut again is the same object.

use std::path::PathBuf;

use super::Project;
use super::artifact_error::ArtifactError;
use super::artifacts::NewArtifact;
use super::packed::of_bucket;
use super::remote::{Bucket, ProjectStorage};
use mocban_core::domain::{ArtifactRef, ContentHash};

impl Project {
    /// Stores artifacts durably as objects of their own. Replaces objects that exist, so that they do not look old to
    /// `check --collect`.
    ///
    /// # Errors
    /// Returns an error if the settings name no object store, or a request fails. Objects that were stored before the
    /// error stay. No row names them, and `check --collect` removes them.
    pub fn write_objects(&self, files: &[NewArtifact]) -> Result<(), ArtifactError> {
        for file in files {
            let Some(key) = file.reference().stored_path() else {
                continue;
            };
            let (_, bucket) = self.packs(&key)?;
            let written = bucket.write(&key, file.bytes().to_owned());
            written.map_err(ArtifactError::Bucket)?;
        }
        Ok(())
    }

    /// Returns storage, bucket and key of an artifact that is an object of its own. Returns `None` for an artifact in a
    /// pack or in the project's folder, and if the settings name no object store.
    pub(super) fn artifact_object(
        &self,
        artifact: &ArtifactRef,
    ) -> Option<(&ProjectStorage, &Bucket, String)> {
        let storage = self.storage()?;
        let bucket = storage.artifacts()?;
        let key = artifact.stored_path()?;
        // The artifacts of a project that used no object store before stay in its folder. A file that cannot be looked at
        // counts as being there, so that it is reported as unreadable, not as missing in the store.
        let is_in_folder = self.dir().join(&key).try_exists().unwrap_or(true);
        (!is_in_folder).then_some((storage, bucket, key))
    }

    /// Reads an artifact that is an object of its own, past local copies, and checks its hash.
    pub(super) fn read_object(
        bucket: &Bucket,
        key: &str,
        artifact: &ArtifactRef,
    ) -> Result<Vec<u8>, ArtifactError> {
        let bytes = bucket.read(key, artifact.bytes).map_err(of_bucket)?;
        if ContentHash::of(&bytes) == artifact.hash {
            Ok(bytes)
        } else {
            Err(ArtifactError::Changed(PathBuf::from(
                bucket.address_of(key),
            )))
        }
    }

    /// Checks that the object of an artifact exists and, unless `quick` is set, its hash.
    pub(super) fn check_object(
        bucket: &Bucket,
        key: &str,
        artifact: &ArtifactRef,
        quick: bool,
    ) -> Result<(), ArtifactError> {
        if !quick {
            return Self::read_object(bucket, key, artifact).map(drop);
        }
        let found = bucket.stat(key).map_err(of_bucket)?;
        if found.bytes == artifact.bytes {
            Ok(())
        } else {
            Err(ArtifactError::Changed(PathBuf::from(
                bucket.address_of(key),
            )))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use crate::remote::ProjectStorage;
    use crate::{
        ArtifactError, InputError, NewArtifact, Project, hash_input, read_input, stat_input,
    };

    #[test]
    fn a_cut_character_is_an_object_that_other_hosts_read_as_an_input() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (storage, bucket) = ProjectStorage::in_memory(dir.path().join("cache"));
        let project = Project::create(dir.path()).expect("a project");
        let mesh = NewArtifact::new("a.ply", "ply", b"mesh of a".to_vec());
        let artifact = mesh.reference().clone();
        let path = artifact.stored_path().expect("no pack");
        let refused = project.write_objects(std::slice::from_ref(&mesh));
        assert!(matches!(refused, Err(ArtifactError::NoStore(_))));
        let project = project.with_storage(Some(storage));
        for _ in 0..2 {
            let files = std::slice::from_ref(&mesh);
            project.write_objects(files).expect("stored");
        }
        let mut keys = Vec::new();
        bucket.list("", |key, _| keys.push(key)).expect("listed");
        assert_eq!(keys, std::slice::from_ref(&path));
        assert!(!project.artifacts_dir().exists());
        let read = project.read_artifact(&artifact).expect("read");
        assert_eq!(read, b"mesh of a");
        let input = project.input(&path);
        assert!(input.exists() && input.size() == 9);
        let read = read_input(&input, 100, "x").expect("read");
        assert_eq!(read.version, hash_input(&input).expect("known"));
        assert_eq!(read.version.hash, artifact.hash);
        assert_eq!(stat_input(&input).expect("known"), read.version.stat);
        for quick in [false, true] {
            project.check_artifact(&artifact, quick).expect("there");
        }
        bucket.remove(&path).expect("removed");
        assert!(!input.exists());
        for quick in [false, true] {
            let missing = project.check_artifact(&artifact, quick);
            assert!(matches!(missing, Err(ArtifactError::Missing(_))));
        }
    }

    #[test]
    fn an_object_with_other_bytes_is_not_believed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (storage, bucket) = ProjectStorage::in_memory(dir.path().join("cache"));
        let project = Project::create(dir.path()).expect("a project");
        let project = project.with_storage(Some(storage));
        let mesh = NewArtifact::new("a.ply", "ply", b"mesh".to_vec());
        let path = mesh.reference().stored_path().expect("no pack");
        bucket.put(&path, b"mash");
        let changed = project.check_artifact(mesh.reference(), false);
        assert!(matches!(changed, Err(ArtifactError::Changed(_))));
        let input = project.input(&path);
        let changed = read_input(&input, 100, "x");
        assert!(matches!(changed, Err(InputError::Changed(_))));
        project.write_objects(&[mesh]).expect("stored");
        let again = read_input(&input, 100, "x").expect("read again");
        assert_eq!(&again.bytes[..], b"mesh");
    }

    #[test]
    fn an_artifact_in_the_folder_is_read_there() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (storage, _) = ProjectStorage::in_memory(dir.path().join("cache"));
        let project = Project::create(dir.path()).expect("a project");
        let mesh = NewArtifact::new("a.ply", "ply", b"mesh".to_vec());
        let path = mesh.reference().stored_path().expect("no pack");
        let files = std::slice::from_ref(&mesh);
        project.write_artifacts(files, &|| {}).expect("written");
        let project = project.with_storage(Some(storage));
        let mut text = String::new();
        let mut file = project.input(&path).open().expect("opened");
        file.read_to_string(&mut text).expect("read");
        assert_eq!(text, "mesh");
        let read = project.read_artifact(mesh.reference());
        assert_eq!(read.expect("read"), b"mesh");
    }
}
