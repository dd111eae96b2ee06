//! Artifacts in an object store: one pack for the stages of a pair that are stored together.

use std::path::PathBuf;

use super::Project;
use super::artifact_error::ArtifactError;
use super::artifacts::NewArtifact;
use super::remote::{Bucket, BucketError, Pack, ProjectStorage, pack_key, read_from_pack};
use mocban_core::domain::{ArtifactRef, PackLocation};

impl Project {
    /// Returns whether new artifacts are stored in an object store, in packs.
    pub fn has_packs(&self) -> bool {
        self.storage()
            .is_some_and(|storage| storage.artifacts().is_some())
    }

    /// Returns the folder or the address of new artifacts, for messages.
    pub fn artifacts_place(&self) -> PathBuf {
        match self.storage().and_then(ProjectStorage::artifacts) {
            Some(bucket) => bucket.address().into(),
            None => self.artifacts_dir(),
        }
    }

    /// Stores artifacts in one new pack, durably. Returns where each of them is, in the same order. Stores nothing if
    /// there are no artifacts.
    ///
    /// # Errors
    /// Returns an error if the settings name no object store, or the request fails. A pack of a failed request may
    /// exist. No row names it, and `check --collect` removes it.
    pub fn write_pack(&self, files: &[NewArtifact]) -> Result<Vec<PackLocation>, ArtifactError> {
        if files.is_empty() {
            return Ok(Vec::new());
        }
        let (_, bucket) = self.packs("the new pack")?;
        let contents = files.iter().map(|file| (file.reference(), file.bytes()));
        let pack = Pack::of(contents).map_err(|source| ArtifactError::Io {
            path: PathBuf::from(bucket.address()),
            source,
        })?;
        let locations = pack.locations().to_vec();
        pack.store(bucket).map_err(ArtifactError::Bucket)?;
        Ok(locations)
    }

    /// Reads an artifact from its pack and checks its hash.
    pub(super) fn read_packed(
        &self,
        artifact: &ArtifactRef,
        location: &PackLocation,
    ) -> Result<Vec<u8>, ArtifactError> {
        let (storage, bucket) = self.packs(&location.name)?;
        let pack = storage.pack(bucket, &location.name).map_err(of_bucket)?;
        let bytes = read_from_pack(&pack, location.offset, artifact);
        let changed =
            || ArtifactError::Changed(bucket.address_of(&pack_key(&location.name)).into());
        bytes.map(<[u8]>::to_vec).ok_or_else(changed)
    }

    /// Checks that the pack of an artifact exists and, unless `quick` is set, the artifact's hash.
    pub(super) fn check_packed(
        &self,
        artifact: &ArtifactRef,
        location: &PackLocation,
        quick: bool,
    ) -> Result<(), ArtifactError> {
        if !quick {
            return self.read_packed(artifact, location).map(drop);
        }
        let (storage, bucket) = self.packs(&location.name)?;
        let found = storage.pack_bytes(bucket, &location.name);
        if found.map_err(of_bucket)? >= location.offset.saturating_add(artifact.bytes) {
            Ok(())
        } else {
            Err(ArtifactError::Changed(self.pack_path(&location.name)))
        }
    }

    /// Returns the address of a pack, for messages.
    pub(super) fn pack_path(&self, name: &str) -> PathBuf {
        let key = pack_key(name);
        match self.packs(name) {
            Ok((_, bucket)) => bucket.address_of(&key).into(),
            Err(_) => key.into(),
        }
    }

    /// Returns the storage and the bucket of the packs.
    pub(super) fn packs(&self, name: &str) -> Result<(&ProjectStorage, &Bucket), ArtifactError> {
        let storage = self.storage();
        let found = storage.and_then(|storage| Some((storage, storage.artifacts()?)));
        found.ok_or_else(|| ArtifactError::NoStore(name.to_owned()))
    }
}

/// Converts an error of a bucket. A missing object is a missing artifact, and a larger one is a changed one.
pub(super) fn of_bucket(error: BucketError) -> ArtifactError {
    match error {
        BucketError::NotThere(address) => ArtifactError::Missing(address.into()),
        BucketError::TooLarge { address, .. } => ArtifactError::Changed(address.into()),
        error => ArtifactError::Bucket(error),
    }
}

#[cfg(test)]
mod tests {
    use crate::remote::{ProjectStorage, pack_key};
    use crate::{ArtifactError, NewArtifact, Project};

    #[test]
    fn artifacts_of_a_pair_are_one_object_and_are_checked() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (storage, bucket) = ProjectStorage::in_memory(dir.path().join("cache"));
        let project = Project::create(dir.path()).expect("a project");
        let files = ["depth", "mask"].map(|text| NewArtifact::new(text, "png", text.into()));
        let refused = project.write_pack(&files);
        assert!(matches!(refused, Err(ArtifactError::NoStore(_))));
        let project = project.with_storage(Some(storage));
        let locations = project.write_pack(&files).expect("stored");
        assert!(project.write_pack(&[]).expect("nothing").is_empty());
        assert_eq!(locations[0].name, locations[1].name);
        let mut found = Vec::new();
        bucket.list("", |key, _| found.push(key)).expect("listed");
        let key = pack_key(&locations[0].name);
        assert_eq!(found, std::slice::from_ref(&key));
        let mut packed = files.iter().zip(&locations).map(|(file, location)| {
            let mut artifact = file.reference().clone();
            artifact.pack = Some(location.clone());
            artifact
        });
        let (depth, mask) = (packed.next().expect("two"), packed.next().expect("two"));
        assert_eq!(project.read_artifact(&depth).expect("read"), b"depth");
        assert_eq!(project.read_artifact(&mask).expect("read"), b"mask");
        project.check_artifact(&mask, true).expect("long enough");
        bucket.remove(&key).expect("removed");
        let (storage, _) = project.packs("any").expect("a storage");
        storage.forget_packs();
        let quick = project.check_artifact(&mask, true);
        assert!(matches!(quick, Err(ArtifactError::Missing(_))));
    }
}
