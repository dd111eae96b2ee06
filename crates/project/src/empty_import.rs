//! Notes in the folder of a project when an import added no pair. The catalog has a time only of imports that added pairs,
//! so without the note, the undo of the newest import would undo an earlier one. Folders that share a catalog have a note
//! each: an empty import there does not keep people here from the undo of theirs.

use std::path::PathBuf;

use crate::files;
use mocban_core::domain::UnixMillis;
use mocban_store::{Project, write_atomic};

/// Name of the file with the time.
pub(crate) const EMPTY_IMPORT_FILE: &str = "empty-import.txt";

fn place(project: &Project) -> PathBuf {
    project.dir().join(EMPTY_IMPORT_FILE)
}

/// Notes an import that added no pair. Returns a warning if the note cannot be written.
pub(crate) fn note(project: &Project, at: UnixMillis) -> Option<String> {
    let file = place(project);
    let error = write_atomic(&file, at.to_string().as_bytes()).err()?;
    let shown = file.display();
    Some(format!(
        "cannot write {shown}, so `retire --last-import` will not know of this import, which added no pair: {error}"
    ))
}

/// Returns the time of the newest import that added no pair, or `None` if there is no readable note.
pub(crate) fn noted(project: &Project) -> Option<UnixMillis> {
    let bytes = files::small(&place(project)).ok()??;
    std::str::from_utf8(&bytes).ok()?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::{EMPTY_IMPORT_FILE, note, noted};
    use mocban_store::Project;

    #[test]
    fn the_newest_note_is_read_and_what_is_no_time_is_none() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(dir.path());
        assert_eq!(noted(&project), None);
        for at in [5, 1_795_219_200_000] {
            assert_eq!(note(&project, at), None);
            assert_eq!(noted(&project), Some(at));
        }
        let other = tempfile::tempdir().expect("a temporary directory");
        let other = Project::at(other.path());
        assert_eq!(noted(&other), None, "notes are of their folder");
        std::fs::write(dir.path().join(EMPTY_IMPORT_FILE), "x").expect("written");
        assert_eq!(noted(&project), None);
        let gone = Project::at(&dir.path().join("gone"));
        let warning = note(&gone, 5).expect("there is no such folder");
        let file = gone.dir().join(EMPTY_IMPORT_FILE).display().to_string();
        assert!(warning.contains(&file), "{warning}");
    }
}
