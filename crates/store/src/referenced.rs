//! Finds the files in the artifacts folder that are unreferenced: no row of the catalog names them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::Project;
use super::owner_record::is_owner_record;
use super::remote::pack_number;
use mocban_core::domain::{ArtifactRef, ContentHash};

/// The artifacts that rows of the catalog name. Only the first 64 bits of each hash are stored. An unreferenced file is
/// not reported if a referenced file has the same 64 bits. A referenced file is never reported.
///
/// For 8 million artifacts (a million pairs), a sorted vector needs 61 MiB, and looking up every artifact takes 0.8 s.
/// A `HashSet<u64>` needs 146 MiB (217 MiB while it grows) and 6 s.
#[derive(Debug, Default)]
pub struct ReferencedArtifacts {
    prefixes: Vec<u64>,
    /// The random numbers in the names of packs.
    packs: BTreeSet<u64>,
}

/// An unreferenced file in the artifacts folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnreferencedFile {
    /// Its path.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
    /// What it is.
    pub kind: UnreferencedKind,
}

/// What an unreferenced file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnreferencedKind {
    /// An artifact of a result that was replaced or never stored.
    Orphan,
    /// A partial file of a process that was killed.
    Temporary,
    /// Not a file of this program; it is left alone.
    UnknownFile,
}

impl ReferencedArtifacts {
    /// Adds an artifact that a row names.
    pub fn add(&mut self, artifact: &ArtifactRef) {
        match &artifact.pack {
            Some(pack) => self.packs.extend(pack_number(&pack.name)),
            None => self.prefixes.push(prefix(&artifact.hash)),
        }
    }

    /// Returns whether a row names an artifact of this pack.
    pub(super) fn has_pack(&self, number: u64) -> bool {
        self.packs.contains(&number)
    }

    /// Sorts what was added, for [`Self::has_file`].
    pub(super) fn sort(&mut self) {
        self.prefixes.sort_unstable();
    }

    /// Returns whether a row names an artifact that is a file or an object of its own.
    pub(super) fn has_file(&self, artifact: &ArtifactRef) -> bool {
        self.prefixes.binary_search(&prefix(&artifact.hash)).is_ok()
    }

    /// Calls `each` for every unreferenced file in the artifacts folder. Call this only while no process writes
    /// artifacts, because a new file exists before the row that names it.
    pub fn for_each_unreferenced(
        mut self,
        project: &Project,
        mut each: impl FnMut(UnreferencedFile),
    ) -> std::io::Result<()> {
        self.sort();
        for entry in Entry::list(&project.artifacts_dir())? {
            if is_owner_record(entry.name().as_ref()) {
                continue;
            }
            if !entry.is_dir {
                each(entry.unreferenced(UnreferencedKind::UnknownFile));
            } else if entry.path == project.temporary_dir() {
                for entry in Entry::list(&entry.path)? {
                    each(entry.unreferenced(UnreferencedKind::Temporary));
                }
            } else {
                for inside in Entry::list(&entry.path)? {
                    if let Some(kind) = self.kind(&entry.name(), &inside) {
                        each(inside.unreferenced(kind));
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns the kind of an unreferenced file or folder. Returns `None` if a row names the artifact.
    fn kind(&self, folder: &str, entry: &Entry) -> Option<UnreferencedKind> {
        let name = entry.name();
        let hash: Option<ContentHash> =
            name.split_once('.').and_then(|(hash, _)| hash.parse().ok());
        match hash {
            Some(hash) if !entry.is_dir && hash.to_hex()[..2] == *folder => {
                let is_named = self.prefixes.binary_search(&prefix(&hash)).is_ok();
                (!is_named).then_some(UnreferencedKind::Orphan)
            }
            _ => Some(UnreferencedKind::UnknownFile),
        }
    }
}

fn prefix(hash: &ContentHash) -> u64 {
    let [a, b, c, d, e, f, g, h, ..] = *hash.as_bytes();
    u64::from_be_bytes([a, b, c, d, e, f, g, h])
}

/// An entry of a folder.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    path: PathBuf,
    is_dir: bool,
    bytes: u64,
}

impl Entry {
    /// Lists a folder, sorted by name. Returns an empty list if the folder does not exist.
    fn list(folder: &Path) -> std::io::Result<Vec<Self>> {
        let listed = match std::fs::read_dir(folder) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            listed => listed?,
        };
        let mut entries = Vec::new();
        for entry in listed {
            let path = entry?.path();
            // A file may be removed while the folder is listed.
            if let Ok(meta) = std::fs::symlink_metadata(&path) {
                let (is_dir, bytes) = (meta.is_dir(), meta.len());
                entries.push(Self {
                    path,
                    is_dir,
                    bytes,
                });
            }
        }
        entries.sort();
        Ok(entries)
    }

    fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    fn unreferenced(self, kind: UnreferencedKind) -> UnreferencedFile {
        let Self { path, bytes, .. } = self;
        UnreferencedFile { path, bytes, kind }
    }
}

#[cfg(test)]
mod tests {
    use super::{ReferencedArtifacts, UnreferencedKind};
    use crate::{NewArtifact, Project};

    #[test]
    fn files_that_no_row_names_are_found_and_told_apart() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut referenced = ReferencedArtifacts::default();
        for text in ["kept", "gone"] {
            let file = NewArtifact::new("depth.png", "png", text.into());
            let artifact = file.reference().clone();
            project.write_artifacts(&[file], &|| {}).expect("written");
            if text == "kept" {
                referenced.add(&artifact);
            }
        }
        let artifacts = project.artifacts_dir();
        let misplaced = format!("mine/{}.png", "0".repeat(64));
        std::fs::create_dir(artifacts.join("mine")).expect("a folder");
        for path in ["tmp/77-0", "notes.txt", "mine/1.txt", &misplaced] {
            std::fs::write(artifacts.join(path), "mine").expect("a file");
        }
        let mut kinds = Vec::new();
        let listed = referenced.for_each_unreferenced(&project, |file| {
            kinds.push((file.kind, file.bytes));
        });
        listed.expect("listed");
        kinds.sort_by_key(|(kind, _)| *kind as u8);
        let unknown = (UnreferencedKind::UnknownFile, 4);
        let orphan = (UnreferencedKind::Orphan, 4);
        let temporary = (UnreferencedKind::Temporary, 4);
        assert_eq!(kinds, [orphan, temporary, unknown, unknown, unknown]);
    }
}
