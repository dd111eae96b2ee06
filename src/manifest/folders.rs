//! Pairs from two folders: files of the same stem belong together, as in `stl/12.stl` and `print/12.png`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{ManifestError, ManifestRow, Place, Problem};
use crate::domain::PairName;

const MESH_ENDINGS: [&str; 5] = ["obj", "ply", "stl", "xyz", "pts"];
const PRINT_ENDINGS: [&str; 5] = ["png", "jpg", "jpeg", "tif", "tiff"];

/// What two folders hold.
#[derive(Debug, Clone, PartialEq)]
pub struct FolderPairs {
    /// Pairs in the order of their stems, numbers by value.
    pub rows: Vec<ManifestRow>,
    /// Meshes without a print.
    pub meshes_alone: Vec<PathBuf>,
    /// Prints without a mesh.
    pub prints_alone: Vec<PathBuf>,
    /// Files whose ending is neither a mesh's nor a print's.
    pub ignored: Vec<PathBuf>,
}

/// Pairs the files of a listing of meshes with those of a listing of prints by stem.
///
/// Only files with a known ending count, hidden ones never; what is in them is told by content later. The result
/// does not depend on the order of the listings.
///
/// # Errors
/// When two meshes or two prints have the same stem, a stem of a pair is no id, or there is no pair at all.
pub fn pair_folders(meshes: &[PathBuf], prints: &[PathBuf]) -> Result<FolderPairs, ManifestError> {
    let mut problems = Vec::new();
    let (meshes, mut ignored) = by_stem(meshes, &MESH_ENDINGS, "meshes", &mut problems);
    let (mut prints, more) = by_stem(prints, &PRINT_ENDINGS, "prints", &mut problems);
    ignored.extend(more);
    let mut rows = Vec::new();
    let mut meshes_alone = Vec::new();
    for (stem, mesh) in meshes {
        let Some(print) = prints.remove(&stem) else {
            meshes_alone.push(mesh);
            continue;
        };
        match PairName::new(&stem.text) {
            Ok(name) => rows.push(row(rows.len() + 1, name, mesh, print)),
            Err(error) => problems.push(at_file(&mesh, error.to_string())),
        }
    }
    ManifestError::unless_none(rows.is_empty(), problems)?;
    Ok(FolderPairs {
        rows,
        meshes_alone,
        prints_alone: prints.into_values().collect(),
        ignored,
    })
}

fn row(line: usize, name: PairName, mesh: PathBuf, print: PathBuf) -> ManifestRow {
    ManifestRow {
        line,
        name,
        mesh,
        print,
        character: None,
        block: None,
        unit: None,
        scanned_face_down: None,
        meta: BTreeMap::new(),
    }
}

/// A stem that sorts by value when it is a number, before all others.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Stem {
    rank: (bool, u64),
    text: String,
}

impl Stem {
    fn of(path: &Path) -> Option<Self> {
        let text = path.file_stem()?.to_string_lossy().into_owned();
        let number = text.parse().ok();
        Some(Self {
            rank: (number.is_none(), number.unwrap_or(0)),
            text,
        })
    }
}

/// Files of these endings by stem, and the others.
fn by_stem(
    listing: &[PathBuf],
    endings: &[&str],
    what: &str,
    problems: &mut Vec<Problem>,
) -> (BTreeMap<Stem, PathBuf>, Vec<PathBuf>) {
    let mut sorted = listing.to_vec();
    sorted.sort();
    let mut found: BTreeMap<Stem, PathBuf> = BTreeMap::new();
    let mut ignored = Vec::new();
    for path in sorted.into_iter().filter(|path| !is_hidden(path)) {
        match Stem::of(&path).filter(|_| has_ending(&path, endings)) {
            None => ignored.push(path),
            Some(stem) => {
                if let Some(first) = found.get(&stem) {
                    problems.push(same_stem(first, &path, what));
                } else {
                    found.insert(stem, path);
                }
            }
        }
    }
    (found, ignored)
}

fn is_hidden(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension()
        .and_then(|ending| ending.to_str())
        .is_some_and(|ending| endings.iter().any(|e| e.eq_ignore_ascii_case(ending)))
}

fn same_stem(first: &Path, second: &Path, what: &str) -> Problem {
    let reason = format!("{} has the same stem; {what} pair by stem", first.display());
    at_file(second, reason)
}

fn at_file(path: &Path, reason: String) -> Problem {
    Problem {
        place: Place::File(path.to_owned()),
        reason,
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::pair_folders;

    fn files(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn files_pair_by_stem_in_the_order_of_their_numbers() {
        let meshes = files(&[
            "m/10.stl",
            "m/2.PLY",
            "m/a.obj",
            "m/a.mtl",
            "m/.DS_Store",
            "m/9.stl",
        ]);
        let prints = files(&["p/a.jpeg", "p/2.png", "p/10.tif", "p/77.png"]);
        let found = pair_folders(&meshes, &prints).expect("pairs");
        let names: Vec<_> = found.rows.iter().map(|row| row.name.as_str()).collect();
        assert_eq!(names, ["2", "10", "a"]);
        assert_eq!(found.rows[1].print, PathBuf::from("p/10.tif"));
        assert_eq!(found.meshes_alone, files(&["m/9.stl"]));
        assert_eq!(found.prints_alone, files(&["p/77.png"]));
        assert_eq!(found.ignored, files(&["m/a.mtl"]));
        let turned: Vec<_> = meshes.into_iter().rev().collect();
        assert_eq!(pair_folders(&turned, &prints).expect("pairs"), found);
    }

    #[test]
    fn two_files_of_one_stem_are_both_named() {
        let error = pair_folders(&files(&["a.stl", "a.ply"]), &files(&["a.png"]));
        assert_eq!(
            error.expect_err("twice").to_string(),
            "a.stl: a.ply has the same stem; meshes pair by stem"
        );
    }

    #[test]
    fn stems_that_are_no_ids_are_named_by_file() {
        let error = pair_folders(&files(&["x y.stl", "b.stl"]), &files(&["x y.png", "b.png"]));
        assert_eq!(
            error.expect_err("space").to_string(),
            "x y.stl: id \"x y\" holds ' '; an id is made of letters A-Z, digits, _ and -"
        );
        let none = pair_folders(&files(&["a.stl"]), &files(&["b.png"]));
        assert_eq!(
            none.expect_err("no pair").to_string(),
            "the list holds no pairs"
        );
    }
}
