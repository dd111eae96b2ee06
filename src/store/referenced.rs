//! Which artifacts rows name, gathered in little memory, and the files that none of them names.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use super::Project;
use crate::domain::ContentHash;

/// Bytes of a hash that are kept, after the first, which names the bucket. Two hashes that agree in them would keep
/// a file that could go; none would go that must stay.
const KEPT: usize = 8;
/// Hashes of a bucket in memory before they go to a file.
const RECENT: usize = 1024;

type Key = [u8; KEPT];

/// The hashes, in a bucket for each folder of artifacts: a few thousand bytes of memory each, the rest in files
/// without a name, which are gone when this is dropped or the process dies.
#[derive(Debug)]
pub struct ReferencedArtifacts {
    buckets: Vec<Bucket>,
}

#[derive(Debug, Default)]
struct Bucket {
    recent: Vec<Key>,
    spilled: Option<File>,
}

/// A file in the folder of artifacts that no row names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnreferencedFile {
    /// Where it lies.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
    /// What it is.
    pub kind: UnreferencedKind,
}

/// What a file is that no row names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnreferencedKind {
    /// A result's file: of a result that was made again since, or of one that was never stored.
    Orphan,
    /// Half-written, left by a process that was killed.
    Temporary,
    /// Not ours: it is left alone.
    UnknownFile,
}

impl Default for ReferencedArtifacts {
    fn default() -> Self {
        let buckets = (0..256).map(|_| Bucket::default());
        Self {
            buckets: buckets.collect(),
        }
    }
}

impl ReferencedArtifacts {
    /// Adds a hash that a row names.
    ///
    /// # Errors
    /// When a temporary file cannot be written.
    pub fn add(&mut self, hash: &ContentHash) -> std::io::Result<()> {
        let bytes = hash.as_bytes();
        let bucket = &mut self.buckets[usize::from(bytes[0])];
        bucket.recent.push(key(hash));
        if bucket.recent.len() == RECENT {
            bucket.spill()?;
        }
        Ok(())
    }

    /// The keys of a bucket, sorted.
    fn sorted(&mut self, bucket: u8) -> std::io::Result<Vec<Key>> {
        let bucket = &mut self.buckets[usize::from(bucket)];
        let mut keys = bucket.recent.clone();
        if let Some(file) = &mut bucket.spilled {
            let mut bytes = Vec::new();
            file.seek(SeekFrom::Start(0))?;
            file.read_to_end(&mut bytes)?;
            let (whole, _) = bytes.as_chunks::<KEPT>();
            keys.extend_from_slice(whole);
        }
        keys.sort_unstable();
        Ok(keys)
    }

    /// Tells of every file in the project's folder of artifacts that no row names, a folder at a time. Only while
    /// nobody writes artifacts: a file lies there before its row.
    ///
    /// # Errors
    /// When a folder cannot be listed or a temporary file not read.
    pub fn unnamed(
        &mut self,
        project: &Project,
        mut each: impl FnMut(UnreferencedFile),
    ) -> std::io::Result<()> {
        let root = project.artifacts_dir();
        for (path, is_dir, bytes) in entries(&root)? {
            let name = file_name(&path);
            if !is_dir {
                let kind = UnreferencedKind::UnknownFile;
                each(UnreferencedFile { path, bytes, kind });
            } else if path == project.temporary_dir() {
                for (path, _, bytes) in entries(&path)? {
                    let kind = UnreferencedKind::Temporary;
                    each(UnreferencedFile { path, bytes, kind });
                }
            } else {
                self.unnamed_in(&path, bucket_of(&name), &mut each)?;
            }
        }
        Ok(())
    }

    fn unnamed_in(
        &mut self,
        folder: &Path,
        bucket: Option<u8>,
        each: &mut impl FnMut(UnreferencedFile),
    ) -> std::io::Result<()> {
        let named = match bucket {
            Some(bucket) => self.sorted(bucket)?,
            None => Vec::new(),
        };
        for (path, is_dir, bytes) in entries(folder)? {
            let hash = hash_of(&file_name(&path)).filter(|_| !is_dir);
            let kind = match (hash, bucket) {
                (Some(hash), Some(bucket)) if hash.as_bytes()[0] == bucket => {
                    if named.binary_search(&key(&hash)).is_ok() {
                        continue;
                    }
                    UnreferencedKind::Orphan
                }
                _ => UnreferencedKind::UnknownFile,
            };
            each(UnreferencedFile { path, bytes, kind });
        }
        Ok(())
    }
}

impl Bucket {
    fn spill(&mut self) -> std::io::Result<()> {
        let file = match &mut self.spilled {
            Some(file) => file,
            none => none.insert(tempfile::tempfile()?),
        };
        file.write_all(self.recent.as_flattened())?;
        self.recent.clear();
        Ok(())
    }
}

fn key(hash: &ContentHash) -> Key {
    let mut key = [0; KEPT];
    key.copy_from_slice(&hash.as_bytes()[1..=KEPT]);
    key
}

/// The byte that a folder of artifacts is named by.
fn bucket_of(name: &str) -> Option<u8> {
    let plain = name.len() == 2 && !name.contains(|c: char| c.is_ascii_uppercase() || c == '+');
    u8::from_str_radix(name, 16).ok().filter(|_| plain)
}

/// The hash an artifact is named by.
fn hash_of(name: &str) -> Option<ContentHash> {
    name.split_once('.')?.0.parse().ok()
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Path, whether it is a folder, and length of what lies in a folder, sorted; nothing when there is no such folder.
fn entries(folder: &Path) -> std::io::Result<Vec<(PathBuf, bool, u64)>> {
    let listed = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        listed => listed?,
    };
    let mut found = Vec::new();
    for entry in listed {
        let path = entry?.path();
        // What goes away meanwhile is not there.
        if let Ok(meta) = std::fs::symlink_metadata(&path) {
            found.push((path, meta.is_dir(), meta.len()));
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::{RECENT, ReferencedArtifacts, UnreferencedKind};
    use crate::domain::ContentHash;
    use crate::store::{NewArtifact, Project};

    fn file(bytes: &[u8]) -> NewArtifact {
        NewArtifact::new("depth.png", "png", bytes.to_owned())
    }

    #[test]
    fn only_files_that_no_row_names_are_told() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut named = ReferencedArtifacts::default();
        for text in ["kept", "left"] {
            let written = project.write_artifacts(&[file(text.as_bytes())]);
            let artifact = &written.expect("written")["depth.png"];
            if text == "kept" {
                named.add(&artifact.hash).expect("added");
            }
        }
        let artifacts = project.artifacts_dir();
        std::fs::write(artifacts.join("tmp/77-0"), "half").expect("a file");
        std::fs::write(artifacts.join("notes.txt"), "mine").expect("a file");
        std::fs::create_dir(artifacts.join("mine")).expect("a folder");
        std::fs::write(artifacts.join("mine/1.txt"), "mine").expect("a file");
        let mut kinds = Vec::new();
        named
            .unnamed(&project, |unnamed| {
                kinds.push((unnamed.kind, unnamed.bytes));
            })
            .expect("listed");
        kinds.sort_by_key(|(kind, _)| *kind as u8);
        let stranger = (UnreferencedKind::UnknownFile, 4);
        assert_eq!(
            kinds,
            [
                (UnreferencedKind::Orphan, 4),
                (UnreferencedKind::Temporary, 4),
                stranger,
                stranger
            ]
        );
    }

    #[test]
    fn hashes_beyond_what_memory_keeps_are_found_again() {
        let mut named = ReferencedArtifacts::default();
        let mut bytes = [0; 32];
        for number in 0..3 * RECENT + 5 {
            bytes[1..9].copy_from_slice(&(number as u64).wrapping_mul(0x9e37_79b9).to_be_bytes());
            named.add(&ContentHash::from_bytes(bytes)).expect("added");
        }
        assert!(named.buckets[0].recent.len() < RECENT);
        let keys = named.sorted(0).expect("read");
        assert_eq!(keys.len(), 3 * RECENT + 5);
        assert!(keys.is_sorted());
        assert!(named.sorted(1).expect("read").is_empty());
    }
}
