//! The files of a folder that is imported.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::exit::Refusal;
use super::files::refusal;
use super::input_list::is_inputs_folder;
use mocban_core::domain::first_names;
use mocban_export::EXPORT_MANIFEST;
use mocban_lists::relative_path::SYSTEM_FOLDERS;
use mocban_store::{CATALOG_FILE, Project};

/// Largest number of links that a sentence names.
const MAX_LINKS: usize = 5;

/// The files of a directory and of the folders in it.
#[derive(Debug, Default)]
pub(crate) struct FolderFiles {
    pub(crate) files: Vec<PathBuf>,
    /// Links to folders elsewhere, whose files are left out.
    pub(crate) links: Vec<PathBuf>,
}

/// Lists the files of a directory and of the folders in it. Leaves out hidden folders, links to folders, exports, scans and
/// prints of backups, and the folder of results of a project.
pub fn list_below(dir: &Path) -> Result<Vec<PathBuf>, Refusal> {
    list_with_links(dir).map(|found| found.files)
}

/// Lists files like [`list_below`], and links to folders elsewhere.
pub(crate) fn list_with_links(dir: &Path) -> Result<FolderFiles, Refusal> {
    let (mut found, mut folders) = (FolderFiles::default(), vec![dir.to_owned()]);
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
                Ok(kind) if kind.is_symlink() && path.is_dir() => {
                    if !is_skipped && !is_below(&path, dir) {
                        found.links.push(path);
                    }
                }
                _ => found.files.push(path),
            }
        }
    }
    Ok(found)
}

/// Returns whether a link leads to a folder below another one, in which its files are found anyway.
fn is_below(link: &Path, dir: &Path) -> bool {
    let places = [link, dir].map(Path::canonicalize);
    matches!(&places, [Ok(link), Ok(dir)] if link.starts_with(dir))
}

/// Returns a sentence about links to folders whose files are left out, if there are any.
pub(crate) fn links_sentence(mut links: Vec<PathBuf>) -> Option<String> {
    links.sort();
    links.dedup();
    let names: Vec<String> = links
        .iter()
        .map(|link| link.display().to_string())
        .collect();
    (!names.is_empty()).then(|| {
        let names = first_names(&names, MAX_LINKS);
        format!("ignored, links to folders: {names}; import the folders from their own place")
    })
}

#[cfg(test)]
mod tests {
    use super::{links_sentence, list_below, list_with_links};

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

    #[cfg(unix)]
    #[test]
    fn links_to_folders_elsewhere_are_named() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [root, real] = ["root", "real"].map(|name| dir.path().join(name));
        for folder in [root.join("b1"), root.join(".git"), real.join("b2")] {
            std::fs::create_dir_all(folder).expect("created");
        }
        std::fs::write(root.join("b1/1.stl"), "").expect("written");
        for (target, link) in [
            (real.join("b2"), "b2"),
            (root.join("b1"), "newest"),
            (real.join("b2"), ".hidden"),
        ] {
            std::os::unix::fs::symlink(target, root.join(link)).expect("a link");
        }
        let found = list_with_links(&root).expect("listed");
        assert_eq!(found.files, [root.join("b1/1.stl")]);
        assert_eq!(found.links, [root.join("b2")]);
        let sentence = links_sentence([found.links.clone(), found.links].concat());
        let expected = format!(
            "ignored, links to folders: {}; import the folders from their own place",
            root.join("b2").display()
        );
        assert_eq!(sentence, Some(expected));
        assert_eq!(links_sentence(Vec::new()), None);
    }
}
