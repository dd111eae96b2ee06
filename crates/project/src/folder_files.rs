//! The files of a folder that is imported.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::exit::Refusal;
use super::files::refusal;
use super::input_list::is_inputs_folder;
use mocban_export::EXPORT_MANIFEST;
use mocban_lists::relative_path::SYSTEM_FOLDERS;
use mocban_store::{CATALOG_FILE, Project};

/// Lists the files of a directory and of the folders in it. Leaves out hidden folders, links to folders, exports, scans and
/// prints of backups, and the folder of results of a project.
pub fn list_below(dir: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let (mut files, mut folders) = (Vec::new(), vec![dir.to_owned()]);
    while let Some(folder) = folders.pop() {
        let refuse = |error: std::io::Error| match error.kind() {
            ErrorKind::NotADirectory => {
                Refusal::Usage(format!("{} is not a directory", folder.display()))
            }
            _ => refusal(&folder, &error, "there is no directory", "cannot list"),
        };
        let results = Project::at(&folder).artifacts_dir();
        let is_project = folder.join(CATALOG_FILE).exists();
        if folder != dir && (folder.join(EXPORT_MANIFEST).exists() || is_inputs_folder(&folder)) {
            continue;
        }
        for entry in std::fs::read_dir(&folder).map_err(refuse)? {
            let entry = entry.map_err(refuse)?;
            let (path, name) = (entry.path(), entry.file_name());
            let is_skipped = name.as_encoded_bytes().starts_with(b".")
                || SYSTEM_FOLDERS.iter().any(|skipped| name == *skipped)
                || is_project && path == results;
            // The listing has the type already; only a link must be followed.
            match entry.file_type() {
                Ok(kind) if kind.is_dir() && is_skipped => {}
                Ok(kind) if kind.is_dir() => folders.push(path),
                Ok(kind) if kind.is_symlink() && path.is_dir() => {}
                _ => files.push(path),
            }
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::list_below;

    #[test]
    fn files_in_folders_are_listed_without_hidden_folders_and_results() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for path in [
            "1.stl",
            "b1/stl/1.stl",
            ".git/1.stl",
            "__MACOSX/1.stl",
            "artifacts/1.stl",
            "p/catalog.sqlite",
            "p/artifacts/00/1.png",
            "p/data/1.stl",
            "out/export.json",
            "out/1.png",
        ] {
            let path = dir.path().join(path);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("created");
            std::fs::write(path, "").expect("written");
        }
        let mut found = list_below(dir.path()).expect("listed");
        found.sort();
        let expected = [
            "1.stl",
            "artifacts/1.stl",
            "b1/stl/1.stl",
            "p/catalog.sqlite",
            "p/data/1.stl",
        ];
        assert_eq!(found, expected.map(|path| dir.path().join(path)));
        let refused = list_below(&dir.path().join("1.stl")).expect_err("a file");
        assert!(
            refused.to_string().ends_with("1.stl is not a directory"),
            "{refused}"
        );
    }
}
