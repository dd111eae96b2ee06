//! Pairs from two directories. Files with the same stem form a pair, such as `stl/12.stl` and `print/12.png`, also in
//! folders of the same name, such as `stl/block-4/12.stl` and `print/block-4/12.png`. A person may change that.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::{ManifestError, at_file, of_list};
use super::folder_file::FolderFile;
use super::row::ManifestRow;
use super::similar_files::{SimilarPairs, no_equal_name};
use mocban_core::domain::PairName;
use mocban_core::domain::spelling::{fold_case, quoted};

/// Extensions of meshes.
pub const MESH_EXTENSIONS: [&str; 6] = ["obj", "ply", "stl", "xyz", "pts", "ptx"];
/// Extensions of prints.
pub const PRINT_EXTENSIONS: [&str; 5] = ["png", "jpg", "jpeg", "tif", "tiff"];

/// Returns whether the extension of a path is that of a mesh.
pub fn is_named_like_mesh(path: &Path) -> bool {
    has_extension(path, &MESH_EXTENSIONS)
}

/// Returns whether the extension of a path is that of a print.
pub fn is_named_like_print(path: &Path) -> bool {
    has_extension(path, &PRINT_EXTENSIONS)
}

/// Returns whether the extension of a path is that of a mesh or of a print.
pub fn is_named_like_input(path: &Path) -> bool {
    is_named_like_mesh(path) || is_named_like_print(path)
}

/// A directory with the files in it and in its folders.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedFolder {
    /// The directory.
    pub root: PathBuf,
    /// Its files.
    pub files: Vec<PathBuf>,
}

/// What a person changes in the pairs of two directories. First pairs are left out, then other files are joined.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PairingChanges {
    /// Ids of pairs of files with equal names that are left out. Their files are then without a partner.
    pub left_out: Vec<String>,
    /// Meshes and prints without a partner that become pairs, by their paths below the directories.
    pub joined: Vec<(String, String)>,
}

impl PairingChanges {
    /// Takes back a pair that was left out. Its files are not joined to others any more.
    pub fn take_back(&mut self, id: &str) {
        self.left_out.retain(|known| known != id);
        let folded = fold_case(id);
        let is_of_pair = |path: &str| {
            let file = FolderFile::new(Path::new(path), Path::new(""));
            file.is_some_and(|file| fold_case(&file.id()) == folded)
        };
        self.joined
            .retain(|(mesh, print)| !is_of_pair(mesh) && !is_of_pair(print));
    }
}

/// The content of two directories.
#[derive(Debug, Clone, PartialEq)]
pub struct FolderPairs {
    /// Pairs in the order of their folders and stems; numbers are ordered by value.
    pub rows: Vec<ManifestRow>,
    /// Meshes without a print.
    pub meshes_alone: Vec<PathBuf>,
    /// Prints without a mesh.
    pub prints_alone: Vec<PathBuf>,
    /// Files with other extensions.
    pub ignored: Vec<PathBuf>,
    /// Meshes and prints whose names differ only in accents or in zeros before a number: the first ones and the number of
    /// the others, as text.
    pub similar: Vec<String>,
    /// Says why there is no pair.
    pub no_pair: Option<ManifestError>,
}

/// Pairs mesh files with print files of the same folder and stem; upper and lower case are equal. The id of a pair in
/// folders is `FOLDER_STEM`, and the folder is its block. Then changes the pairs. There may be no pair.
///
/// Hidden files are skipped. The format of a file is detected later, from its content. The result does not depend on
/// the order of `meshes` and `prints`.
///
/// # Errors
/// Returns an error if two meshes or two prints have the same id, the id of a pair is not valid, or the files of a change
/// are not there.
pub fn pair_folders(
    meshes: &ListedFolder,
    prints: &ListedFolder,
    changes: &PairingChanges,
) -> Result<FolderPairs, ManifestError> {
    let mut problems = ManifestError::default();
    let is_same = meshes.root == prints.root;
    let roots = [&meshes.root, &prints.root];
    let (meshes, other_meshes) = by_id(meshes, is_named_like_mesh, "meshes", &mut problems);
    let (prints, other_prints) = by_id(prints, is_named_like_print, "prints", &mut problems);
    let are_empty = [meshes.is_empty(), prints.is_empty()];
    let mut matched = matched(meshes, prints);
    matched.change(changes, roots, &mut problems);
    let Matched {
        mut pairs,
        mut meshes_alone,
        mut prints_alone,
    } = matched;
    pairs.sort_by_key(|(mesh, _)| mesh.place());
    let mut rows = Vec::new();
    for (mesh, print) in pairs {
        match PairName::new(&mesh.id()) {
            Ok(name) => rows.push(row(rows.len() + 1, name, mesh, print)),
            Err(error) => problems.add(at_file(&mesh.path, &error.to_string())),
        }
    }
    problems.check(false)?;
    let is_swapped = other_meshes.iter().any(|path| is_named_like_print(path))
        && other_prints.iter().any(|path| is_named_like_mesh(path));
    let similar = SimilarPairs::of(&meshes_alone, &prints_alone);
    let no_pair = rows.is_empty().then(|| {
        let is_swapped = is_swapped && meshes_alone.is_empty();
        let without = without_files(roots, are_empty);
        let reason = if is_swapped {
            "the folder of meshes holds images, and that of prints holds meshes; swap the two"
                .to_owned()
        } else if let Some(without) = without {
            without
        } else if changes.left_out.is_empty() {
            no_equal_name(&meshes_alone, &prints_alone, &similar)
        } else {
            "all pairs are left out, so there is nothing to import".to_owned()
        };
        of_list(&reason).into()
    });
    for alone in [&mut meshes_alone, &mut prints_alone] {
        alone.sort_by_key(FolderFile::place);
    }
    let paths = |files: Vec<FolderFile>| files.into_iter().map(|file| file.path).collect();
    Ok(FolderPairs {
        rows,
        meshes_alone: paths(meshes_alone),
        prints_alone: paths(prints_alone),
        ignored: if is_same {
            let is_other = |path: &PathBuf| !is_named_like_input(path);
            other_meshes.into_iter().filter(is_other).collect()
        } else {
            [other_meshes, other_prints].concat()
        },
        similar: similar.warnings(),
        no_pair,
    })
}

/// Files with a partner and without.
struct Matched {
    pairs: Vec<(FolderFile, FolderFile)>,
    meshes_alone: Vec<FolderFile>,
    prints_alone: Vec<FolderFile>,
}

/// Matches files with equal ids.
fn matched(
    meshes: BTreeMap<String, FolderFile>,
    mut prints: BTreeMap<String, FolderFile>,
) -> Matched {
    let (mut pairs, mut meshes_alone) = (Vec::new(), Vec::new());
    for (id, mesh) in meshes {
        match prints.remove(&id) {
            Some(print) => pairs.push((mesh, print)),
            None => meshes_alone.push(mesh),
        }
    }
    Matched {
        pairs,
        meshes_alone,
        prints_alone: prints.into_values().collect(),
    }
}

impl Matched {
    /// Leaves pairs out and joins files. Records changes whose files are not there.
    fn change(
        &mut self,
        changes: &PairingChanges,
        [meshes, prints]: [&PathBuf; 2],
        problems: &mut ManifestError,
    ) {
        let mut left_out: BTreeSet<&str> = changes.left_out.iter().map(String::as_str).collect();
        if !left_out.is_empty() {
            for (mesh, print) in std::mem::take(&mut self.pairs) {
                let name = PairName::new(&mesh.id());
                if name.is_ok_and(|name| left_out.remove(name.as_str())) {
                    self.meshes_alone.push(mesh);
                    self.prints_alone.push(print);
                } else {
                    self.pairs.push((mesh, print));
                }
            }
        }
        for id in left_out {
            let id = quoted(id);
            problems.add(of_list(&format!("there is no pair {id} to leave out")));
        }
        for (mesh, print) in &changes.joined {
            let (mesh, print) = (meshes.join(mesh), prints.join(print));
            match (
                position(&self.meshes_alone, &mesh),
                position(&self.prints_alone, &print),
            ) {
                (Some(mesh), Some(print)) => self.pairs.push((
                    self.meshes_alone.swap_remove(mesh),
                    self.prints_alone.swap_remove(print),
                )),
                (None, _) => problems.add(at_file(&mesh, "there is no such mesh without a print")),
                (_, None) => problems.add(at_file(&print, "there is no such print without a mesh")),
            }
        }
    }
}

fn position(files: &[FolderFile], path: &Path) -> Option<usize> {
    files.iter().position(|file| file.path == path)
}

/// Says which folder has no files of its kind, such as `scans holds no meshes`.
fn without_files(roots: [&PathBuf; 2], are_empty: [bool; 2]) -> Option<String> {
    let [meshes, prints] = roots.map(|root| root.display());
    match are_empty {
        [true, true] if roots[0] == roots[1] => {
            Some(format!("{meshes} holds no meshes and no images"))
        }
        [true, true] => Some(format!("{meshes} holds no meshes, and {prints} no images")),
        [true, false] => Some(format!("{meshes} holds no meshes")),
        [false, true] => Some(format!("{prints} holds no images")),
        [false, false] => None,
    }
}

fn row(line: usize, name: PairName, mesh: FolderFile, print: FolderFile) -> ManifestRow {
    ManifestRow {
        line,
        name,
        block: mesh.block().or_else(|| print.block()),
        mesh: mesh.path,
        print: print.path,
        character: None,
        unit: None,
        scanned_face_down: None,
        meta: BTreeMap::new(),
    }
}

/// Splits the files into a map of those of a kind, keyed by id as Windows and macOS compare it, and a list of the others.
/// Skips hidden files. Adds a problem for each file with the same id as an earlier file.
fn by_id(
    listed: &ListedFolder,
    is_of_kind: impl Fn(&Path) -> bool,
    kind: &str,
    problems: &mut ManifestError,
) -> (BTreeMap<String, FolderFile>, Vec<PathBuf>) {
    let mut sorted = listed.files.clone();
    sorted.sort();
    let mut found: BTreeMap<String, FolderFile> = BTreeMap::new();
    let mut others = Vec::new();
    for path in sorted.into_iter().filter(|path| !is_hidden(path)) {
        let file = FolderFile::new(&path, &listed.root);
        let Some(file) = file.filter(|_| is_of_kind(&path)) else {
            others.push(path);
            continue;
        };
        match found.entry(fold_case(&file.id())) {
            Entry::Vacant(free) => {
                free.insert(file);
            }
            Entry::Occupied(first) => {
                let shown = first.get().path.display();
                let reason = if first.get().id() == file.stem {
                    format!("{shown} has the same stem; {kind} are paired by stem")
                } else {
                    let id = quoted(&first.get().id());
                    format!(
                        "{shown} has the same id {id} (upper and lower case are equal); rename one of the {kind}"
                    )
                };
                problems.add(at_file(&path, &reason));
            }
        }
    }
    (found, others)
}

fn is_hidden(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension()
        .and_then(|extension| extension.to_str())
        .is_some_and(|extension| extensions.iter().any(|e| e.eq_ignore_ascii_case(extension)))
}

#[cfg(test)]
mod tests;
