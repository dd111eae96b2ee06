//! A folder whose files this program writes all at once, and which it replaces only if it holds nothing else.

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::{ProjectResult, WithContext as _};
use crate::exit::Refusal;
use crate::files;
use crate::own_files::refuse_project_file;
use mocban_export::{CHECKSUMS, refuse_edited, write_checksums};
use mocban_store::{Leftover, ReplacementFolder, create_folders};

/// A folder and what it is for.
#[derive(Debug, Clone, Copy)]
pub struct GeneratedFolder<'a> {
    /// The folder, which need not exist.
    pub dir: &'a Path,
    /// What its files are, such as `documentation`.
    pub content: &'a str,
    /// The file by which an earlier folder is recognized, and a text that it has.
    pub marker: (&'a str, &'a str),
    /// Whether files that somebody changed are kept. The folder then has checksums.
    pub keeps_changes: bool,
}

impl GeneratedFolder<'_> {
    /// Writes files, as paths below the folder, in place of earlier ones. Returns an earlier folder that could not be
    /// removed.
    ///
    /// # Errors
    /// Returns an error like [`Self::refuse_foreign`], or if the folder cannot be replaced, which leaves it as it was.
    pub fn write<P: AsRef<Path>>(self, files: &[(P, Vec<u8>)]) -> ProjectResult<Leftover> {
        let names: Vec<&Path> = files.iter().map(|(path, _)| path.as_ref()).collect();
        let failed = || {
            format!(
                "cannot write the {} to {}",
                self.content,
                self.dir.display()
            )
        };
        self.refuse_foreign(&names)?;
        let folder = ReplacementFolder::begin(self.dir).with_context(failed)?;
        // Under the lock, so that no other process replaces the folder meanwhile.
        self.refuse_changed(folder.target())?;
        for (path, bytes) in files {
            let path = folder.path().join(path);
            let parent = path.parent().unwrap_or(folder.path());
            create_folders(parent).with_context(failed)?;
            fs::write(path, bytes).with_context(failed)?;
        }
        if self.keeps_changes {
            write_checksums(folder.path()).with_context(failed)?;
        }
        // Somebody may have put files there in the meantime.
        self.refuse_foreign(&names)?;
        self.refuse_changed(folder.target())?;
        folder.finish().with_context(failed)
    }

    /// Refuses an earlier folder in which somebody changed a file.
    fn refuse_changed(self, target: &Path) -> ProjectResult<()> {
        if self.keeps_changes {
            refuse_edited(target)?;
        }
        Ok(())
    }

    /// Refuses a folder that holds anything but files with these paths, files of these names without the marker of an earlier
    /// folder, or that belongs to a project.
    ///
    /// # Errors
    /// Returns an error that names a foreign file, or if the folder cannot be read.
    pub fn refuse_foreign(self, names: &[&Path]) -> ProjectResult<()> {
        refuse_project_file(self.dir)?;
        let shown = self.dir.display();
        let exists = self.dir.try_exists();
        if !exists.with_context(|| format!("cannot read {shown}"))? {
            return Ok(());
        }
        if !self.dir.is_dir() {
            return Err(Refusal::Usage(format!("{shown} is not a directory")).into());
        }
        let checksums = self.keeps_changes.then(|| Path::new(CHECKSUMS));
        let names: Vec<&Path> = names.iter().copied().chain(checksums).collect();
        let mut foreign = foreign_file(self.dir, Path::new(""), &names)?;
        if foreign.is_none() && !self.is_marked() {
            // Without a marker, every file is foreign.
            foreign = foreign_file(self.dir, Path::new(""), &[])?;
        }
        let Some(foreign) = foreign else {
            return Ok(());
        };
        let (foreign, content) = (foreign.display(), self.content);
        Err(Refusal::Usage(format!(
            "{shown} holds {foreign}, which is not part of the {content}; name another directory"
        ))
        .into())
    }

    /// Returns whether the folder holds the file by which an earlier one is recognized.
    fn is_marked(self) -> bool {
        let (name, text) = self.marker;
        let head = files::head(&self.dir.join(name)).unwrap_or_default();
        let mut parts = head.windows(text.len());
        parts.any(|part| part == text.as_bytes())
    }
}

/// Returns a file, link or other entry below `dir/inner` that has none of the names, as a path below `dir`.
fn foreign_file(dir: &Path, inner: &Path, names: &[&Path]) -> ProjectResult<Option<PathBuf>> {
    let folder = dir.join(inner);
    let failed = || format!("cannot read {}", folder.display());
    for entry in fs::read_dir(&folder).with_context(failed)? {
        let entry = entry.with_context(failed)?;
        let path = inner.join(entry.file_name());
        let kind = entry.file_type().with_context(failed)?;
        // A generated folder has few levels; a foreign one is not searched.
        let is_folder = kind.is_dir() && names.iter().any(|name| name.starts_with(&path));
        let foreign = if is_folder {
            foreign_file(dir, &path, names)?
        } else if kind.is_file() && names.contains(&&*path) {
            None
        } else {
            Some(path)
        };
        if foreign.is_some() {
            return Ok(foreign);
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::{CHECKSUMS, GeneratedFolder};

    #[test]
    fn files_with_the_names_of_a_generated_folder_are_kept_unless_it_is_marked() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let folder = GeneratedFolder {
            dir: &dir.path().join("out"),
            content: "alignment",
            marker: ("numbers.json", "\"schema\""),
            keeps_changes: true,
        };
        let files = [
            ("numbers.json", b"{\"schema\": 1}".to_vec()),
            ("overlay.png", b"new".to_vec()),
        ];
        for _ in 0..2 {
            folder.write(&files).expect("a new or an earlier folder");
        }
        let overlay = folder.dir.join("overlay.png");
        std::fs::write(&overlay, "mine").expect("written");
        let refused = folder.write(&files).expect_err("a changed file");
        let reason = "overlay.png was changed after it was written";
        assert!(refused.to_string().contains(reason), "{refused}");
        assert_eq!(std::fs::read(&overlay).expect("a file"), b"mine");
        let replaced = GeneratedFolder {
            keeps_changes: false,
            ..folder
        };
        std::fs::remove_file(folder.dir.join(CHECKSUMS)).expect("removed");
        replaced.write(&files).expect("changes are not kept");
        std::fs::remove_file(folder.dir.join("numbers.json")).expect("removed");
        std::fs::write(folder.dir.join("overlay.png"), "mine").expect("written");
        for numbers in [None, Some("[]")] {
            if let Some(numbers) = numbers {
                std::fs::write(folder.dir.join("numbers.json"), numbers).expect("written");
            }
            let refused = folder.write(&files).expect_err("files of somebody else");
            let reason = "which is not part of the alignment";
            assert!(refused.to_string().contains(reason), "{refused}");
            let kept = std::fs::read(folder.dir.join("overlay.png")).expect("a file");
            assert_eq!(kept, b"mine");
        }
    }
}
