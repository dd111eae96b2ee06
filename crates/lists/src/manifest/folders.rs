//! Pairs from two directories. Files with the same stem form a pair, such as `stl/12.stl` and `print/12.png`.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};

use unicode_normalization::UnicodeNormalization as _;

use super::error::{ManifestError, at_file, of_list};
use super::row::ManifestRow;
use mocban_core::domain::PairName;

const MESH_EXTENSIONS: [&str; 5] = ["obj", "ply", "stl", "xyz", "pts"];
const PRINT_EXTENSIONS: [&str; 5] = ["png", "jpg", "jpeg", "tif", "tiff"];

/// Returns whether the extension of a path is that of a mesh.
pub(super) fn is_named_like_mesh(path: &Path) -> bool {
    has_extension(path, &MESH_EXTENSIONS)
}

/// Returns whether the extension of a path is that of a print.
pub(super) fn is_named_like_print(path: &Path) -> bool {
    has_extension(path, &PRINT_EXTENSIONS)
}

/// Returns whether the extension of a path is that of a mesh or of a print.
pub fn is_named_like_input(path: &Path) -> bool {
    is_named_like_mesh(path) || is_named_like_print(path)
}

/// The content of two directories.
#[derive(Debug, Clone, PartialEq)]
pub struct FolderPairs {
    /// Pairs in the order of their stems; numbers are ordered by value.
    pub rows: Vec<ManifestRow>,
    /// Meshes without a print.
    pub meshes_alone: Vec<PathBuf>,
    /// Prints without a mesh.
    pub prints_alone: Vec<PathBuf>,
    /// Files with other extensions.
    pub ignored: Vec<PathBuf>,
}

/// Pairs mesh files with print files of the same stem.
///
/// Hidden files are skipped. The format of a file is detected later, from its content. The result does not depend on
/// the order of `meshes` and `prints`.
///
/// # Errors
/// Returns an error if two meshes or two prints have the same stem, the stem of a pair is not a valid id, or there is
/// no pair.
pub fn pair_folders(meshes: &[PathBuf], prints: &[PathBuf]) -> Result<FolderPairs, ManifestError> {
    let mut problems = ManifestError::default();
    let (meshes, mut ignored) = by_stem(meshes, &MESH_EXTENSIONS, "meshes", &mut problems);
    let (mut prints, more) = by_stem(prints, &PRINT_EXTENSIONS, "prints", &mut problems);
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
            Err(error) => problems.add(at_file(&mesh, &error.to_string())),
        }
    }
    problems.check(false)?;
    if rows.is_empty() {
        let is_swapped = ignored.iter().any(|path| is_named_like_print(path))
            && ignored.iter().any(|path| is_named_like_mesh(path));
        let reason = if is_swapped {
            "--meshes holds images and --prints holds meshes; swap the two"
        } else {
            "no mesh has the same file name as a print"
        };
        return Err(of_list(reason).into());
    }
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

/// A file stem; numbers are ordered by value, before all other stems.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Stem {
    rank: (bool, u64),
    text: String,
}

impl Stem {
    fn of(path: &Path) -> Option<Self> {
        // A mesh named on macOS and a print named on Windows may have different forms of the same letters.
        let text: String = path.file_stem()?.to_string_lossy().nfc().collect();
        let number = text.parse().ok();
        Some(Self {
            rank: (number.is_none(), number.unwrap_or(0)),
            text,
        })
    }
}

/// Splits the files into a map of those with one of the extensions, keyed by stem, and a list of the others. Skips
/// hidden files. Adds a problem for each file with the same stem as an earlier file.
fn by_stem(
    listing: &[PathBuf],
    extensions: &[&str],
    kind: &str,
    problems: &mut ManifestError,
) -> (BTreeMap<Stem, PathBuf>, Vec<PathBuf>) {
    let mut sorted = listing.to_vec();
    sorted.sort();
    let mut found: BTreeMap<Stem, PathBuf> = BTreeMap::new();
    let mut ignored = Vec::new();
    for path in sorted.into_iter().filter(|path| !is_hidden(path)) {
        let Some(stem) = Stem::of(&path).filter(|_| has_extension(&path, extensions)) else {
            ignored.push(path);
            continue;
        };
        match found.entry(stem) {
            Entry::Vacant(free) => {
                free.insert(path);
            }
            Entry::Occupied(first) => {
                let first = first.get().display();
                let reason = format!("{first} has the same stem; {kind} are paired by stem");
                problems.add(at_file(&path, &reason));
            }
        }
    }
    (found, ignored)
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
        let vietnamese = pair_folders(
            &files(&["m/chữ số 1.stl"]),
            &files(&["p/chu\u{31b}\u{303} so\u{302}\u{301} 1.png"]),
        );
        let vietnamese = vietnamese.expect("a pair");
        assert_eq!(vietnamese.rows[0].name.as_str(), "chữ số 1");
        let reversed: Vec<_> = meshes.into_iter().rev().collect();
        assert_eq!(pair_folders(&reversed, &prints).expect("pairs"), found);
    }

    #[test]
    fn two_files_of_one_stem_are_both_named() {
        let error = pair_folders(&files(&["a.stl", "a.ply"]), &files(&["a.png"]));
        assert_eq!(
            error.expect_err("twice").to_string(),
            "a.stl: a.ply has the same stem; meshes are paired by stem"
        );
    }

    #[test]
    fn stems_that_are_not_valid_ids_are_reported_by_file() {
        let error = pair_folders(
            &files(&["x\ty.stl", "b.stl"]),
            &files(&["x\ty.png", "b.png"]),
        );
        assert_eq!(
            error.expect_err("a tab").to_string(),
            "x y.stl: id \"x y\" holds '\\t'; an id has no slashes, control or invisible characters"
        );
        // There is no pair either, but the reason is the id.
        let only = pair_folders(&files(&["x\ty.stl"]), &files(&["x\ty.png"]));
        let only = only.expect_err("a tab").to_string();
        assert!(
            only.starts_with("x y.stl: id ") && only.lines().count() == 1,
            "{only}"
        );
        let none = pair_folders(&files(&["a.stl"]), &files(&["b.png"]));
        assert_eq!(
            none.expect_err("no pair").to_string(),
            "no mesh has the same file name as a print"
        );
    }
}
