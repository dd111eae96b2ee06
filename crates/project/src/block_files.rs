//! Checks that the files of blocks are a mesh, an image and labels, by their first bytes and their names.

use std::path::Path;

use crate::exit::Refusal;
use crate::files::{self, listed};
use crate::missing_files::{MAX_PATH_CHARS, place_of};
use mocban_core::domain::{FileKind, sanitize};
use mocban_lists::manifest::{BlockRow, is_named_like_mesh, is_named_like_print};
use mocban_store::Project;

/// Largest number of files that a refusal names.
const MAX_SHOWN: usize = 10;

/// Refuses blocks with files that are of another kind. A file that cannot be read is left to the run, which says why.
pub(crate) fn check(rows: &[BlockRow], label: &str, project: &Project) -> Result<(), Refusal> {
    let faults = rows.iter().flat_map(|row| {
        let faults = faults(row, project).into_iter();
        faults.map(move |fault| format!("{label} {}: {fault}", row.line))
    });
    let faults: Vec<String> = faults.collect();
    if faults.is_empty() {
        return Ok(());
    }
    let shown = listed(&faults, faults.len(), MAX_SHOWN);
    Err(Refusal::Usage(format!(
        "files of other kinds, nothing was imported:{shown}"
    )))
}

/// Returns what is wrong with the files of a block.
fn faults(row: &BlockRow, project: &Project) -> Vec<String> {
    let kind = |path: &Path| files::kind(&place_of(path, project));
    let (mesh, page) = (kind(&row.mesh), kind(&row.page));
    let may_be_image =
        |kind, path: &Path| is_image(kind) || kind.is_none() && is_named_like_print(path);
    if may_be_image(mesh, &row.mesh) && is_mesh(page, &row.page) {
        return vec!["mesh names an image and page names a mesh; swap the two".to_owned()];
    }
    let mut faults = Vec::new();
    let mut add = |column: &str, path: &Path, what: &str| {
        let path = sanitize(&path.to_string_lossy(), MAX_PATH_CHARS);
        faults.push(format!("{column} {path} of {} is {what}", row.name));
    };
    if let Some(kind) = mesh.filter(|kind| is_no_mesh(*kind)) {
        let advice = kind.mesh_advice().map(|advice| format!("; {advice}"));
        add(
            "mesh",
            &row.mesh,
            &format!("{kind}{}", advice.unwrap_or_default()),
        );
    }
    if is_mesh(page, &row.page) {
        let kind = page.filter(|kind| !matches!(kind, FileKind::Text | FileKind::Binary));
        let kind = kind.map_or("a mesh", FileKind::description);
        add("page", &row.page, kind);
    }
    if let Some(labels) = &row.labels
        && let Some(kind) = kind(labels)
        && is_no_text(kind)
    {
        add("labels", labels, kind.description());
    }
    faults
}

const fn is_image(kind: Option<FileKind>) -> bool {
    matches!(
        kind,
        Some(FileKind::Png | FileKind::Jpeg | FileKind::Tiff | FileKind::OtherImage(_))
    )
}

/// Returns whether a file is a mesh. OBJ, STL and XYZ have no signature, so their names decide.
fn is_mesh(kind: Option<FileKind>, path: &Path) -> bool {
    match kind {
        Some(FileKind::Ply | FileKind::OtherMesh(_)) => true,
        Some(FileKind::Text | FileKind::Binary) => is_named_like_mesh(path),
        _ => false,
    }
}

/// Returns whether a file cannot be a mesh that is read.
const fn is_no_mesh(kind: FileKind) -> bool {
    is_image(Some(kind)) || matches!(kind, FileKind::OtherMesh(_))
}

/// Returns whether a file is an image, a mesh or binary data. Others, such as text in UTF-16, are left to the run.
const fn is_no_text(kind: FileKind) -> bool {
    is_image(Some(kind))
        || matches!(
            kind,
            FileKind::OtherMesh(_) | FileKind::Ply | FileKind::Binary
        )
}

#[cfg(test)]
mod tests {
    use super::check;
    use mocban_lists::manifest::parse_blocks;
    use mocban_store::Project;

    #[test]
    fn files_of_other_kinds_and_swapped_ones_are_named() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for (name, bytes) in [
            ("b.ply", &b"ply\nformat ascii 1.0\n"[..]),
            ("b.stl", b"solid a"),
            ("b.jpg", b"\xff\xd8\xff\xe0"),
            ("b.png", b"no image"),
            ("b.json", b"[]"),
            ("b.bin", b"\0\x01\x02"),
        ] {
            std::fs::write(dir.path().join(name), bytes).expect("written");
        }
        let swap = Some("mesh names an image and page names a mesh; swap the two");
        for (mesh, page, labels, expected) in [
            ("b.ply", "b.jpg", "b.json", None),
            ("b.stl", "b.png", "", None),
            ("b.jpg", "b.ply", "", swap),
            ("b.jpg", "b.stl", "b.json", swap),
            ("b.jpg", "b.png", "", Some("b.jpg of x is a JPEG image")),
            ("b.ply", "b.stl", "", Some("b.stl of x is a mesh")),
            (
                "b.ply",
                "b.jpg",
                "b.jpg",
                Some("b.jpg of x is a JPEG image"),
            ),
            (
                "b.ply",
                "b.jpg",
                "b.bin",
                Some("b.bin of x is binary data of unknown kind"),
            ),
        ] {
            let list = format!("block,mesh,page,labels\nx,{mesh},{page},{labels}\n");
            let mut rows = parse_blocks(list.as_bytes()).expect("a list");
            for row in &mut rows {
                let paths = [&mut row.mesh, &mut row.page].into_iter();
                for path in paths.chain(row.labels.as_mut()) {
                    *path = dir.path().join(&*path);
                }
            }
            let found = check(&rows, "line", &Project::at(dir.path())).err();
            let found = found.map(|refused| refused.to_string());
            assert_eq!(found.is_some(), expected.is_some(), "{list} {found:?}");
            if let Some((found, expected)) = found.zip(expected) {
                assert!(found.ends_with(expected), "{found}");
            }
        }
    }
}
