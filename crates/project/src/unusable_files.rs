//! Files of a list that cannot be inputs: pointers of Git LFS, in whose place the content was not fetched, empty files,
//! archives, files of zeros, and files that cannot be read.

use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use super::files::kind;
use super::input_paths::{FoundFile, SimilarFiles};
use super::unread_files::{OneFileRows, archive_kind};
use mocban_core::domain::{FileKind, has_only_zeros, sanitize};
use mocban_store::open_regular;

/// Longest pointer in bytes. The specification of Git LFS demands fewer than 1024.
const MAX_POINTER_BYTES: u64 = 1024;
/// Longest path in a message, in characters.
const MAX_PATH_CHARS: usize = 300;
/// Largest number of files that are opened although they are too long for pointers: a disk may be slow.
const MAX_OPENED: usize = 500;

/// What is found out while the files of a list are looked at.
#[derive(Debug, Default)]
pub(crate) struct FileSearches {
    pub(crate) similar: SimilarFiles,
    pub(crate) unusable: UnusableFiles,
    pub(crate) linked: OneFileRows,
}

impl FileSearches {
    /// Returns warnings about what was found.
    pub(crate) fn warnings(self) -> Vec<String> {
        let mut warnings = self.unusable.warnings();
        warnings.extend(self.linked.warning());
        warnings
    }
}

/// Pointers of Git LFS, and other files that cannot be inputs.
#[derive(Debug, Default)]
pub(crate) struct UnusableFiles {
    pointers: CountedFiles,
    empty: CountedFiles,
    archives: CountedFiles,
    zeros: CountedFiles,
    unreadable: CountedFiles,
    /// Number of longer files that were opened.
    opened: usize,
}

/// Files of a kind.
#[derive(Debug, Default)]
struct CountedFiles {
    count: usize,
    /// The path of the first one, as a message shows it.
    first: String,
}

impl CountedFiles {
    fn add(&mut self, path: &Path) {
        if self.count == 0 {
            self.first = sanitize(&path.to_string_lossy(), MAX_PATH_CHARS);
        }
        self.count += 1;
    }
}

impl UnusableFiles {
    /// Looks at a file.
    pub(crate) fn add(&mut self, file: &FoundFile) {
        let path = file.place.as_path();
        let Some(meta) = file.meta.as_ref().filter(|meta| meta.is_file()) else {
            return;
        };
        if meta.len() == 0 {
            self.empty.add(path);
            return;
        }
        let may_be_pointer = meta.len() <= MAX_POINTER_BYTES;
        if !may_be_pointer {
            if self.opened == MAX_OPENED {
                return;
            }
            self.opened += 1;
        }
        match kind(path) {
            None => self.unreadable.add(path),
            Some(FileKind::LfsPointer) if may_be_pointer => self.pointers.add(path),
            // Those with the name of an archive are named by `unread_files`.
            Some(found) if found.is_archive() && archive_kind(path).is_none() => {
                self.archives.add(path);
            }
            Some(FileKind::Binary) if is_of_zeros(path) => self.zeros.add(path),
            Some(_) => {}
        }
    }

    /// Returns a warning for each kind of files that was found.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let sentence = |files: &CountedFiles, [what, advice]: [&str; 2]| {
            let CountedFiles { count, first } = files;
            (*count > 0).then(|| format!("{what}: {count}, the first {first}; {advice}"))
        };
        let sentences = [
            sentence(
                &self.pointers,
                [
                    "files that are pointers of Git LFS and do not hold scans, prints or labels",
                    "fetch them with `git lfs pull` before the run",
                ],
            ),
            sentence(
                &self.empty,
                ["files that are empty", "replace them before the run"],
            ),
            sentence(
                &self.archives,
                [
                    "files that are archives",
                    "unpack them, and import the files in them",
                ],
            ),
            sentence(
                &self.zeros,
                [
                    "files that have only zeros, as interrupted copies may",
                    "copy them again before the run",
                ],
            ),
            sentence(
                &self.unreadable,
                [
                    "files that may not be read",
                    "allow reading them before the run",
                ],
            ),
        ];
        sentences.into_iter().flatten().collect()
    }
}

/// Bytes at the beginning, in the middle and at the end of a file that are compared with zero. A whole scan may be long.
const PART_BYTES: u64 = 1 << 16;

/// Returns whether a file has only zeros, as far as its parts show. The run reads all of it.
fn is_of_zeros(path: &Path) -> bool {
    let Ok((mut file, meta)) = open_regular(path) else {
        return false;
    };
    let last = meta.len().saturating_sub(PART_BYTES);
    [0, last / 2, last].into_iter().all(|start| {
        let part = file.seek(SeekFrom::Start(start));
        part.is_ok_and(|_| has_only_zeros(&mut (&file).take(PART_BYTES)).unwrap_or(false))
    })
}

#[cfg(test)]
mod tests {
    use super::UnusableFiles;
    use crate::input_paths::FoundFile;

    #[test]
    fn files_that_cannot_be_inputs_are_counted_with_the_first() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let mut found = UnusableFiles::default();
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
        let marked = format!("\u{feff}{pointer}");
        for (name, content) in [
            ("a.stl", "solid a"),
            ("b.stl", pointer),
            ("b.png", pointer),
            ("c.png", ""),
            ("c.json", marked.as_str()),
            ("d.stl", "PK\u{3}\u{4}  "),
            ("e.zip", "PK\u{3}\u{4}  "),
            ("f.stl", &"\0".repeat(9000)),
            ("g.stl", &format!("{}x", "\0".repeat(9000))),
        ] {
            let path = dir.path().join(name);
            std::fs::write(&path, content).expect("written");
            let meta = path.metadata().ok();
            found.add(&FoundFile { place: path, meta });
        }
        let place = |name: &str| dir.path().join(name).display().to_string();
        let [first, empty, archive, zeros] = ["b.stl", "c.png", "d.stl", "f.stl"].map(place);
        assert_eq!(
            found.warnings(),
            [
                format!(
                    "files that are pointers of Git LFS and do not hold scans, prints or labels: 3, the first {first}; fetch them \
                     with `git lfs pull` before the run"
                ),
                format!("files that are empty: 1, the first {empty}; replace them before the run"),
                format!(
                    "files that are archives: 1, the first {archive}; unpack them, and import the files in them"
                ),
                format!(
                    "files that have only zeros, as interrupted copies may: 1, the first {zeros}; copy them again before the run"
                ),
            ]
        );
        assert_eq!(UnusableFiles::default().warnings(), [""; 0]);
    }
}
