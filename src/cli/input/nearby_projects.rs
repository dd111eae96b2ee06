//! Projects near a folder that holds none, for a mistyped or forgotten `-C`.

use std::path::{Path, PathBuf};

use mocban_core::domain::spelling::{nearest, plain_form};
use mocban_store::CATALOG_FILE;

/// Largest number of entries of a folder that are read.
const MAX_ENTRIES: usize = 1000;
/// Largest number of projects that are suggested.
const MAX_SUGGESTED: usize = 3;

/// Returns the projects below `dir`, or, if there is no such folder, those beside it with a similar name. Accents do not
/// count.
pub(crate) fn nearby_projects(dir: &Path) -> Vec<PathBuf> {
    if dir.is_dir() {
        // The paths are typed in commands, where `./` is not needed.
        let here = dir.strip_prefix(".").unwrap_or(dir);
        let mut found = projects_in(here);
        found.truncate(MAX_SUGGESTED);
        return found;
    }
    let Some(typed) = dir.file_name() else {
        return Vec::new();
    };
    let beside = projects_in(dir.parent().unwrap_or(Path::new("")));
    let name = |path: &Path| plain_form(&path.file_name().unwrap_or_default().to_string_lossy());
    let names: Vec<String> = beside.iter().map(|path| name(path)).collect();
    let typed = plain_form(&typed.to_string_lossy());
    let similar = nearest(&typed, names.iter().map(String::as_str), MAX_SUGGESTED);
    // Two names may have the same plain letters.
    let found = similar.iter().flat_map(|similar| {
        let named = names.iter().zip(&beside);
        named
            .filter(move |(name, _)| *name == similar)
            .map(|(_, path)| path.clone())
    });
    found.take(MAX_SUGGESTED).collect()
}

/// Returns the folders in a folder that hold a catalog, by name.
fn projects_in(folder: &Path) -> Vec<PathBuf> {
    // The parent of a bare name is empty.
    let Ok(entries) = std::fs::read_dir(Path::new(".").join(folder)) else {
        return Vec::new();
    };
    let names = entries.take(MAX_ENTRIES).flatten();
    let paths = names.map(|entry| folder.join(entry.file_name()));
    let mut projects: Vec<PathBuf> = paths
        .filter(|path| path.join(CATALOG_FILE).is_file())
        .collect();
    projects.sort();
    projects
}

#[cfg(test)]
mod tests {
    use super::nearby_projects;
    use mocban_store::CATALOG_FILE;

    #[test]
    fn projects_with_a_similar_name_or_below_are_found() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let root = dir.path();
        for project in ["khối-4", "khơi-4", "đình-1"] {
            std::fs::create_dir(root.join(project)).expect("a folder");
            std::fs::write(root.join(project).join(CATALOG_FILE), "").expect("written");
        }
        std::fs::create_dir(root.join("khối-5")).expect("a folder without a catalog");
        assert_eq!(
            nearby_projects(&root.join("Khoi-4")),
            [root.join("khơi-4"), root.join("khối-4")]
        );
        assert_eq!(nearby_projects(&root.join("dinh1")), [root.join("đình-1")]);
        assert_eq!(nearby_projects(&root.join("zzzz")).len(), 0);
        assert_eq!(nearby_projects(root).len(), 3);
        assert_eq!(nearby_projects(&root.join("missing/x")).len(), 0);
    }
}
