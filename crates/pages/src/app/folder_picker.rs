//! Folders of this computer, from which a user chooses: what is in them, and how much of it can be imported.

use std::path::{Path, PathBuf};

use super::exports::exports_dir;
use super::failure::{AppFailure, AppResult};
use super::projects::is_project;
use super::sentence::{Sentence, system_reasons};
use mocban_export::EXPORT_MANIFEST;
use mocban_lists::manifest::{is_named_like_mesh, is_named_like_print};
use mocban_project::input_list::is_inputs_folder;
use mocban_store::{CATALOG_FILE, Project};

/// Most entries of all folders that are counted for one page.
const COUNTED: usize = 20_000;
/// Most folders and lists that a page shows.
const SHOWN: usize = 500;
/// Extensions of lists.
pub(super) const LISTS: [&str; 4] = ["csv", "xlsx", "jsonl", "tsv"];
/// Extensions of files that may be backups.
const BACKUP_EXTENSIONS: [&str; 5] = ["sqlite", "sqlite3", "db", "backup", "bak"];
/// Folders in which other disks appear.
const DISKS: [&str; 4] = ["/media", "/mnt", "/run/media", "/Volumes"];

/// The folders that may be looked at: that of the app, that of the user, and other disks.
#[derive(Debug, Clone)]
pub(super) struct PickerRoots(Vec<PathBuf>);

/// Numbers of files in a folder and the folders in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct FileCounts {
    pub(super) meshes: u64,
    pub(super) prints: u64,
    pub(super) lists: u64,
    pub(super) backups: u64,
    /// Whether there were too many entries to count all.
    pub(super) is_partial: bool,
}

/// A folder as the picker shows it.
#[derive(Debug, Clone)]
pub(super) struct PickedFolder {
    pub(super) path: PathBuf,
    /// The folder above, if it may be looked at.
    pub(super) parent: Option<PathBuf>,
    pub(super) counts: FileCounts,
    pub(super) folders: Vec<(String, FileCounts)>,
    pub(super) lists: Vec<String>,
    /// Files that are named like backups.
    pub(super) backups: Vec<String>,
}

impl PickerRoots {
    /// Returns the roots for an app of a folder.
    pub(super) fn new(folder: &Path) -> Self {
        let home = ["HOME", "USERPROFILE"].map(std::env::var_os);
        let home = home.into_iter().flatten().next().map(PathBuf::from);
        let disks = DISKS.map(PathBuf::from);
        let roots = std::iter::once(folder.to_owned()).chain(home).chain(disks);
        Self::of(roots)
    }

    fn of(roots: impl IntoIterator<Item = PathBuf>) -> Self {
        let mut whole: Vec<PathBuf> = Vec::new();
        for root in roots
            .into_iter()
            .filter_map(|root| root.canonicalize().ok())
        {
            // The root of the file system would allow everything.
            if root.parent().is_some() && !whole.contains(&root) {
                whole.push(root);
            }
        }
        Self(whole)
    }

    /// Returns the roots.
    pub(super) fn all(&self) -> &[PathBuf] {
        &self.0
    }

    /// Returns the path of a file or folder with all links resolved.
    ///
    /// # Errors
    /// Refuses a path that does not exist or leads out of the roots.
    pub(super) fn allowed(&self, path: &Path) -> AppResult<PathBuf> {
        let shown = path.display();
        let whole = path.canonicalize();
        let whole = whole.map_err(|_invalid| {
            AppFailure::refused(Sentence::new(
                format!("{shown} cannot be opened"),
                format!("không mở được {shown}"),
            ))
        })?;
        if self.has(&whole) {
            return Ok(whole);
        }
        Err(AppFailure::refused(Sentence::new(
            format!(
                "{shown} is outside your folders and disks; move or copy the files to one of them"
            ),
            format!(
                "{shown} nằm ngoài các thư mục và ổ đĩa của bạn; hãy chuyển hoặc chép các tệp vào đó"
            ),
        )))
    }

    fn has(&self, whole: &Path) -> bool {
        self.0.iter().any(|root| whole.starts_with(root))
    }

    /// Reads a folder.
    ///
    /// # Errors
    /// Refuses a folder that cannot be read or is outside the roots.
    pub(super) fn read(&self, path: &Path) -> AppResult<PickedFolder> {
        let path = self.allowed(path)?;
        let shown = path.display().to_string();
        let failed = |error: std::io::Error| {
            let [english, vietnamese] = system_reasons(&error);
            AppFailure::refused(Sentence::new(
                format!("{shown} cannot be read: {english}"),
                format!("không đọc được {shown}: {vietnamese}"),
            ))
        };
        let mut budget = COUNTED;
        let (mut folders, mut lists, mut backups) = (Vec::new(), Vec::new(), Vec::new());
        let mut counts = FileCounts::default();
        for entry in std::fs::read_dir(&path).map_err(failed)?.flatten() {
            let Ok(name) = entry.file_name().into_string() else {
                continue;
            };
            if name.starts_with('.') {
                continue;
            }
            let entry = entry.path();
            if entry.is_dir() {
                if holds_results(&path, &entry) {
                    continue;
                }
                if folders.len() < SHOWN && entry.canonicalize().is_ok_and(|path| self.has(&path)) {
                    folders.push((name, FileCounts::below(&entry, &mut budget)));
                }
                continue;
            }
            counts.add(&entry);
            if is_list(&entry) && lists.len() < SHOWN {
                lists.push(name);
            } else if is_named_like_backup(&entry) && backups.len() < SHOWN {
                backups.push(name);
            }
        }
        for (_, below) in &folders {
            counts.meshes += below.meshes;
            counts.prints += below.prints;
            counts.lists += below.lists;
            counts.backups += below.backups;
            counts.is_partial |= below.is_partial;
        }
        folders.sort_by(|(a, _), (b, _)| a.cmp(b));
        lists.sort();
        backups.sort();
        let parent = path.parent().filter(|parent| self.has(parent));
        Ok(PickedFolder {
            parent: parent.map(Path::to_owned),
            path,
            counts,
            folders,
            lists,
            backups,
        })
    }
}

impl FileCounts {
    /// Counts the files below a folder, without following links, while `budget` lasts.
    fn below(folder: &Path, budget: &mut usize) -> Self {
        let (mut counts, mut open) = (Self::default(), vec![folder.to_owned()]);
        while let Some(folder) = open.pop() {
            for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
                if *budget == 0 {
                    counts.is_partial = true;
                    return counts;
                }
                *budget -= 1;
                let is_hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
                match entry.file_type() {
                    _ if is_hidden => {}
                    Ok(kind) if kind.is_dir() => {
                        if !holds_results(&folder, &entry.path()) {
                            open.push(entry.path());
                        }
                    }
                    Ok(_) => counts.add(&entry.path()),
                    Err(_) => {}
                }
            }
        }
        counts
    }

    fn add(&mut self, file: &Path) {
        if is_named_like_mesh(file) {
            self.meshes += 1;
        } else if is_named_like_print(file) {
            self.prints += 1;
        } else if is_list(file) {
            self.lists += 1;
        } else if is_named_like_backup(file) {
            self.backups += 1;
        }
    }
}

/// Returns whether a folder in another one has results of a project, is an export, or has the scans and prints of a backup.
pub(super) fn holds_results(parent: &Path, folder: &Path) -> bool {
    let is_named_so =
        folder == exports_dir(parent) || folder == Project::at(parent).artifacts_dir();
    is_named_so && is_project(parent)
        || folder.join(EXPORT_MANIFEST).exists()
        || is_inputs_folder(folder)
}

/// Returns whether a file may be a backup by its name. The catalog of a project is none.
pub(super) fn is_named_like_backup(file: &Path) -> bool {
    let extension = file.extension().and_then(|extension| extension.to_str());
    let is_known =
        |extension: &str| BACKUP_EXTENSIONS.contains(&extension.to_ascii_lowercase().as_str());
    extension.is_some_and(is_known) && file.file_name().is_some_and(|name| name != CATALOG_FILE)
}

fn is_list(file: &Path) -> bool {
    let extension = file.extension().and_then(|extension| extension.to_str());
    extension.is_some_and(|extension| LISTS.contains(&extension.to_ascii_lowercase().as_str()))
}

#[cfg(test)]
mod tests {
    use super::{EXPORT_MANIFEST, FileCounts, PickerRoots, is_named_like_backup};
    use std::path::Path;

    #[test]
    fn a_folder_is_counted_and_nothing_outside_the_roots_is_read() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let root = dir.path().join("allowed");
        for folder in [
            "allowed/scans/b1",
            "allowed/.hidden",
            "allowed/p/artifacts/00",
            "allowed/p/exports/excel",
            "allowed/table",
            "secret",
        ] {
            std::fs::create_dir_all(dir.path().join(folder)).expect("a folder");
        }
        for file in [
            "scans/b1/1.stl",
            "scans/2.ply",
            "3.png",
            "pairs.csv",
            "x.txt",
            "blocks.sqlite",
            ".hidden/4.stl",
            "p/catalog.sqlite",
            "p/artifacts/00/5.png",
            "p/exports/excel/6.png",
            "table/7.png",
        ] {
            std::fs::write(root.join(file), "x").expect("written");
        }
        std::fs::write(root.join("table").join(EXPORT_MANIFEST), "{}").expect("written");
        std::fs::write(dir.path().join("secret/5.stl"), "x").expect("written");
        let roots = PickerRoots::of([root.clone()]);
        let read = roots.read(&root).expect("a folder");
        assert_eq!(
            (read.counts.meshes, read.counts.prints, read.counts.lists),
            (2, 1, 1)
        );
        let names: Vec<&str> = read.folders.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(
            names,
            ["p", "scans"],
            "no exports, and no results in a project"
        );
        assert_eq!(read.folders[0].1, FileCounts::default());
        assert_eq!(
            read.folders[1].1,
            FileCounts {
                meshes: 2,
                ..FileCounts::default()
            }
        );
        assert_eq!(read.lists, ["pairs.csv"]);
        assert_eq!((read.counts.backups, read.backups.len()), (1, 1));
        assert_eq!(read.parent, None);
        for path in [
            "../secret",
            "scans/../../secret",
            "scans/b1/../../../secret/5.stl",
        ] {
            roots.allowed(&root.join(path)).expect_err("outside");
        }
        #[cfg(unix)]
        {
            let link = root.join("link");
            std::os::unix::fs::symlink(dir.path().join("secret"), &link).expect("a link");
            roots.read(&link).expect_err("a link that leads outside");
            assert_eq!(roots.read(&root).expect("a folder").folders.len(), 2);
        }
        roots
            .allowed(Path::new("/etc/passwd"))
            .expect_err("outside");
        assert!(is_named_like_backup(Path::new("x/OLD.DB")));
        assert!(!is_named_like_backup(Path::new("x/catalog.sqlite")));
        assert!(PickerRoots::of(["/".into()]).all().is_empty());
    }
}
