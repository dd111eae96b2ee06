//! Removes unreferenced artifacts while runs may be active: files and packs that no row names and that are older than a
//! given age.
//!
//! A worker stores the row of a new file within the time limit of a stage. If the database server is unavailable, the row is
//! stored within half an hour or never. So an older file without a row will never have one. A pack has a name that is
//! never used again. An object that is named by its content, such as the mesh of a cut character, may be written again
//! at the moment when it is removed, so it is removed only while no run is active. A file in the project's folder is
//! named by its content, and a worker may find that an unreferenced file holds just the bytes that it wants to write.
//! It then sets the file's modification time, and the collector looks at this time again after it has moved the file
//! aside.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::Project;
use super::artifact_error::ArtifactError;
use super::create_folders::create_folders;
use super::referenced::{ReferencedArtifacts, UnreferencedFile, UnreferencedKind};
use super::remote::{Bucket, PACKS, pack_key, pack_number};
use mocban_core::domain::{ARTIFACTS, ArtifactRef};

/// Key of an object whose modification time is the present time of the store.
const MARKER: &str = "collect-marker";

impl ReferencedArtifacts {
    /// Removes unreferenced files and packs that are older than `age` by the clock of their file system or store. Calls
    /// `each` for every unreferenced one, with whether it was removed. With `is_idle`, does the same with objects that
    /// are named by their content; otherwise, these are not listed.
    pub fn collect(
        mut self,
        project: &Project,
        age: Duration,
        is_idle: bool,
        mut each: impl FnMut(&UnreferencedFile, bool),
    ) -> Result<(), ArtifactError> {
        if let Some(bucket) = project.storage().and_then(|storage| storage.artifacts()) {
            self.sort();
            let collected = self.collect_objects(bucket, age, is_idle, &mut each);
            collected.map_err(ArtifactError::Bucket)?;
        }
        let folder = project.artifacts_dir();
        if !folder.try_exists().map_err(ArtifactError::io(&folder))? {
            return Ok(());
        }
        let aside = project.temporary_dir();
        let failed = |source| ArtifactError::Io {
            path: aside.clone(),
            source,
        };
        create_folders(&aside).map_err(failed)?;
        let marker = tempfile::NamedTempFile::new_in(&aside).map_err(failed)?;
        let meta = marker.as_file().metadata().map_err(failed)?;
        let now = meta.modified().map_err(failed)?;
        let cutoff = now.checked_sub(age).unwrap_or(SystemTime::UNIX_EPOCH);
        let listed = self.for_each_unreferenced(project, |file| {
            if file.path == marker.path() {
                return;
            }
            let is_ours = file.kind != UnreferencedKind::UnknownFile;
            let removed = is_ours && remove(&file.path, &aside, cutoff);
            each(&file, removed);
        });
        listed.map_err(failed)
    }

    /// Removes unreferenced packs and, with `is_idle`, unreferenced objects of cut characters.
    fn collect_objects(
        &self,
        bucket: &Bucket,
        age: Duration,
        is_idle: bool,
        each: &mut impl FnMut(&UnreferencedFile, bool),
    ) -> Result<(), super::BucketError> {
        bucket.write(MARKER, Vec::new())?;
        let cutoff = bucket.stat(MARKER)?.modified - age.as_millis() as i64;
        let mut found = Vec::new();
        bucket.list(PACKS, |key, stat| {
            // A project whose place is below this folder has packs that are not ours.
            let name = key.rsplit_once('/').map_or(&*key, |(_, name)| name);
            let number =
                pack_number(&key).filter(|_| pack_key(name.trim_end_matches(".tar")) == key);
            if number.is_none_or(|number| !self.has_pack(number)) {
                found.push((key, stat, number.is_some()));
            }
        })?;
        if is_idle {
            bucket.list(ARTIFACTS, |key, stat| {
                let artifact = ArtifactRef::at_path(&key);
                if artifact
                    .as_ref()
                    .is_none_or(|artifact| !self.has_file(artifact))
                {
                    found.push((key, stat, artifact.is_some()));
                }
            })?;
        }
        for (key, stat, is_ours) in found {
            let is_old = is_ours && stat.modified < cutoff;
            if is_old {
                bucket.remove(&key)?;
            }
            let file = UnreferencedFile {
                path: PathBuf::from(bucket.address_of(&key)),
                bytes: stat.bytes,
                kind: if is_ours {
                    UnreferencedKind::Orphan
                } else {
                    UnreferencedKind::UnknownFile
                },
            };
            each(&file, is_old);
        }
        bucket.remove(MARKER)
    }
}

/// Removes a file that was not changed since `before`. Returns whether it was removed.
fn remove(path: &Path, aside: &Path, before: SystemTime) -> bool {
    let is_old = |path: &Path| {
        let modified = std::fs::metadata(path).and_then(|meta| meta.modified());
        modified.is_ok_and(|modified| modified < before)
    };
    if !is_old(path) {
        return false;
    }
    let Some(name) = path.file_name() else {
        return false;
    };
    let mut moved = name.to_owned();
    moved.push(".collected");
    let moved = aside.join(moved);
    if std::fs::rename(path, &moved).is_err() {
        return false;
    }
    if is_old(&moved) {
        return std::fs::remove_file(&moved).is_ok();
    }
    // A worker wants to use it, and may have written it again meanwhile, with the same bytes.
    let _ = std::fs::rename(&moved, path);
    false
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::time::{Duration, Instant, SystemTime};

    use crate::remote::ProjectStorage;
    use crate::{NewArtifact, Project, ReferencedArtifacts, UnreferencedKind};

    const DAY: Duration = Duration::from_hours(24);

    fn make_old(path: &std::path::Path) {
        let old = SystemTime::now() - 2 * DAY;
        let file = File::options().append(true).open(path);
        file.and_then(|file| file.set_modified(old))
            .expect("changed");
    }

    #[test]
    fn only_old_files_without_a_row_are_removed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let [kept, old, new, used] = ["kept", "old", "new", "used"].map(|text| {
            let file = NewArtifact::new("depth.png", "png", text.into());
            let artifact = file.reference().clone();
            project.write_artifacts(&[file], &|| {}).expect("written");
            artifact
        });
        for artifact in [&kept, &old, &used] {
            make_old(&project.artifact_path(artifact));
        }
        // A worker computes the same bytes again.
        let again = NewArtifact::new("depth.png", "png", b"used".to_vec());
        project.write_artifacts(&[again], &|| {}).expect("written");
        let mut referenced = ReferencedArtifacts::default();
        referenced.add(&kept);
        let mut seen = Vec::new();
        let collected = referenced.collect(&project, DAY, false, |file, removed| {
            assert_eq!(file.kind, UnreferencedKind::Orphan);
            seen.push(removed);
        });
        collected.expect("collected");
        seen.sort_unstable();
        assert_eq!(seen, [false, false, true]);
        assert!(project.read_artifact(&old).is_err());
        for artifact in [&kept, &new, &used] {
            project
                .check_artifact(artifact, false)
                .expect("still there");
        }
    }

    /// Waits for a condition: objects have the same time until the clock of the store advances.
    #[track_caller]
    fn until(mut is_true: impl FnMut() -> bool) {
        let begun = Instant::now();
        while !is_true() {
            assert!(begun.elapsed() < Duration::from_mins(10), "never true");
            std::thread::yield_now();
        }
    }

    #[test]
    fn packs_without_a_row_are_removed_when_they_are_old() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (storage, bucket) = ProjectStorage::in_memory(dir.path().join("cache"));
        let project = Project::create(dir.path()).expect("a project");
        let project = project.with_storage(Some(storage));
        let file = || NewArtifact::new("depth.png", "png", b"same".to_vec());
        let artifacts = [0; 2].map(|_| {
            let location = project.write_pack(&[file()]).expect("stored").remove(0);
            let mut artifact = file().reference().clone();
            artifact.pack = Some(location);
            artifact
        });
        bucket.put("packs/notes.txt", b"mine");
        let nested = format!("packs/packs/ab/{}-{:016x}.tar", "ab".repeat(32), 7);
        bucket.put(&nested, b"a pack of a project in a folder of this one");
        let collect = |age| {
            let mut referenced = ReferencedArtifacts::default();
            referenced.add(&artifacts[0]);
            let mut seen = Vec::new();
            let collected = referenced.collect(&project, age, false, |file, removed| {
                seen.push((file.kind, removed));
            });
            collected.expect("collected");
            seen.sort_by_key(|(kind, _)| *kind as u8);
            seen
        };
        let unknown = (UnreferencedKind::UnknownFile, false);
        let kept = (UnreferencedKind::Orphan, false);
        assert_eq!(collect(DAY), [kept, unknown, unknown]);
        let removed = (UnreferencedKind::Orphan, true);
        until(|| collect(Duration::ZERO) == [removed, unknown, unknown]);
        assert_eq!(project.read_artifact(&artifacts[0]).expect("kept"), b"same");
        assert!(bucket.stat("packs/notes.txt").is_ok() && bucket.stat(&nested).is_ok());
    }

    #[test]
    fn objects_of_characters_are_removed_only_while_no_run_is_active() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (storage, bucket) = ProjectStorage::in_memory(dir.path().join("cache"));
        let project = Project::create(dir.path()).expect("a project");
        let project = project.with_storage(Some(storage));
        let files = ["kept", "gone"].map(|text| NewArtifact::new("a", "ply", text.into()));
        project.write_objects(&files).expect("stored");
        let collect = |is_idle| {
            let mut referenced = ReferencedArtifacts::default();
            referenced.add(files[0].reference());
            let mut seen = Vec::new();
            let collected = referenced.collect(&project, Duration::ZERO, is_idle, |_, removed| {
                seen.push(removed);
            });
            collected.expect("collected");
            seen
        };
        assert!(collect(false).is_empty());
        until(|| collect(true) == [true]);
        assert!(project.check_artifact(files[0].reference(), false).is_ok());
        let gone = files[1].reference().stored_path().expect("no pack");
        assert!(bucket.stat(&gone).is_err());
    }
}
