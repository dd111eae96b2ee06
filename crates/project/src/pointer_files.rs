//! Files of a list in whose place are pointers of Git LFS, because their content was not fetched.

use std::fs::Metadata;
use std::path::Path;

use super::files::kind;
use super::input_paths::SimilarFiles;
use mocban_core::domain::{FileKind, sanitize};

/// Longest pointer in bytes. The specification of Git LFS demands fewer than 1024.
const MAX_POINTER_BYTES: u64 = 1024;
/// Longest path in a message, in characters.
const MAX_PATH_CHARS: usize = 300;

/// What is found out while the files of a list are looked at.
#[derive(Debug, Default)]
pub(crate) struct FileSearches {
    pub(crate) similar: SimilarFiles,
    pub(crate) pointers: PointerFiles,
}

/// Pointers of Git LFS.
#[derive(Debug, Default)]
pub(crate) struct PointerFiles {
    count: usize,
    /// The path of the first one, as a message shows it.
    first: String,
}

impl PointerFiles {
    /// Looks at a file.
    pub(crate) fn add(&mut self, path: &Path, meta: &Metadata) {
        // Inputs are longer, so few files are opened.
        let may_be_pointer = meta.is_file() && meta.len() <= MAX_POINTER_BYTES;
        if may_be_pointer && kind(path) == Some(FileKind::LfsPointer) {
            if self.count == 0 {
                self.first = sanitize(&path.to_string_lossy(), MAX_PATH_CHARS);
            }
            self.count += 1;
        }
    }

    /// Returns a warning, if there are any.
    pub(crate) fn warning(&self) -> Option<String> {
        let Self { count, first } = self;
        (*count > 0).then(|| {
            format!(
                "files that are pointers of Git LFS and do not hold scans, prints or labels: {count}, the first {first}; fetch them with \
                 `git lfs pull` before the run"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::PointerFiles;

    #[test]
    fn pointers_are_counted_with_the_first() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let mut pointers = PointerFiles::default();
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
        let marked = format!("\u{feff}{pointer}");
        for (name, content) in [
            ("a.stl", "solid a"),
            ("b.stl", pointer),
            ("b.png", pointer),
            ("c.png", ""),
            ("c.json", marked.as_str()),
        ] {
            let path = dir.path().join(name);
            std::fs::write(&path, content).expect("written");
            let meta = path.metadata().expect("a file");
            pointers.add(&path, &meta);
        }
        let warning = pointers.warning().expect("three pointers");
        let first = dir.path().join("b.stl");
        let text = format!("labels: 3, the first {}; fetch them", first.display());
        assert!(warning.contains(&text), "{warning}");
        assert_eq!(PointerFiles::default().warning(), None);
    }
}
