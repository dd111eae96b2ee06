//! Meshes and prints without each other whose names are similar, or equal in other folders.

use super::folder_file::{FolderFile, grouped};
use mocban_core::domain::spelling::{fold_case, plain_form, quoted};

/// Maximum number of pairs with similar names that a message or the warnings name; the others are counted.
const MAX_SIMILAR: usize = 3;

/// Meshes and prints without each other whose ids differ only in accents or in zeros before a number.
#[derive(Debug, Default)]
pub(super) struct SimilarPairs {
    /// The first ones, each as a clause.
    first: Vec<String>,
    /// Number of all.
    count: usize,
}

/// What to do about similar names.
const RENAME: &str = "rename one if they are a pair";

impl SimilarPairs {
    /// Finds the pairs.
    pub(super) fn of(meshes: &[FolderFile], prints: &[FolderFile]) -> Self {
        let prints = grouped(prints, |print| plain_form(&print.id()));
        let mut found = Self::default();
        for mesh in meshes {
            for print in prints.get(&plain_form(&mesh.id())).into_iter().flatten() {
                found.count += 1;
                if found.first.len() < MAX_SIMILAR {
                    let (mesh, print) = (mesh.path.display(), print.path.display());
                    let clause = format!("{mesh} and {print} have similar names");
                    found.first.push(clause);
                }
            }
        }
        found
    }

    /// Returns a warning for each of the first pairs, and one for the others.
    pub(super) fn warnings(&self) -> Vec<String> {
        let first = self.first.iter();
        let mut warnings: Vec<String> = first.map(|clause| format!("{clause}; {RENAME}")).collect();
        match self.more() {
            0 => {}
            1 => warnings.push("1 more mesh and print have similar names".to_owned()),
            more => warnings.push(format!("{more} more meshes and prints have similar names")),
        }
        warnings
    }

    /// Returns the first pairs as clauses of a sentence, the number of the others and what to do. `None` if there are none.
    fn clauses(&self) -> Option<String> {
        let more = match self.more() {
            0 => String::new(),
            more => format!("; and {more} more"),
        };
        let first = self.first.join("; ");
        (self.count > 0).then(|| format!("{first}{more}; {RENAME}"))
    }

    const fn more(&self) -> usize {
        self.count - self.first.len()
    }
}

/// Says that no names are equal, or that only the folders of files with equal names differ.
pub(super) fn no_equal_name(
    meshes: &[FolderFile],
    prints: &[FolderFile],
    similar: &SimilarPairs,
) -> String {
    let reason = "no mesh has the same file name as a print";
    if let Some(similar) = similar.clauses() {
        return format!("{reason}; {similar}");
    }
    let prints = grouped(prints, |print| fold_case(&print.stem));
    let other_folder = meshes.iter().find_map(|mesh| {
        let prints = prints.get(&fold_case(&mesh.stem))?.iter().copied();
        // Of equally near ones the first.
        let print = prints.rev().max_by_key(|print| mesh.shared_folders(print))?;
        let [mesh_folder, print_folder] = [mesh, print].map(|file| quoted(&file.folders.join("/")));
        let (mesh, print) = (mesh.path.display(), print.path.display());
        Some(format!(
            "{mesh} and {print} have the same name, but their folders {mesh_folder} and {print_folder} differ; give both one name, or name them scans and prints, or quét and in"
        ))
    });
    other_folder.unwrap_or_else(|| reason.to_owned())
}
