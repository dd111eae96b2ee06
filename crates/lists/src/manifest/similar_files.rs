//! Meshes and prints without each other whose names are similar, or equal in other folders.

use super::folder_file::{FolderFile, grouped};
use mocban_core::domain::spelling::{fold_case, plain_form, quoted};

/// Longest list of similar files in a message.
const MAX_SIMILAR: usize = 5;

/// Says that no names are equal, or that only the folders of files with equal names differ.
pub(super) fn no_equal_name(
    meshes: &[FolderFile],
    prints: &[FolderFile],
    similar: &[String],
) -> String {
    let reason = "no mesh has the same file name as a print";
    if let Some(first) = similar.first() {
        return format!("{reason}; {first}");
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

/// Describes meshes and prints without each other whose ids differ only in accents or in zeros before a number.
pub(super) fn similar(meshes: &[FolderFile], prints: &[FolderFile]) -> Vec<String> {
    let prints = grouped(prints, |print| plain_form(&print.id()));
    let similar = meshes.iter().flat_map(|mesh| {
        let prints = prints.get(&plain_form(&mesh.id())).into_iter().flatten();
        prints.map(move |print| {
            let (mesh, print) = (mesh.path.display(), print.path.display());
            format!("{mesh} and {print} have similar names; rename one if they are a pair")
        })
    });
    similar.take(MAX_SIMILAR).collect()
}
