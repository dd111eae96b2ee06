//! Says once per 3D format, instead of once per file, that it is not read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mocban_core::domain::FileKind;

/// Returns the 3D format that a path is named like, if that format is not read.
pub(crate) fn mesh_kind(path: &Path) -> Option<FileKind> {
    FileKind::of_unread_mesh_extension(path.extension()?.to_str()?)
}

/// Returns one sentence for all files of each 3D format that is not read.
pub(crate) fn unread_meshes(paths: &[PathBuf]) -> Vec<String> {
    let mut found: BTreeMap<&'static str, Vec<&PathBuf>> = BTreeMap::new();
    for path in paths {
        if let Some(kind) = mesh_kind(path) {
            found.entry(kind.description()).or_default().push(path);
        }
    }
    let sentence = |(kind, mut paths): (&str, Vec<&PathBuf>)| {
        paths.sort();
        let more = match paths.len() - 1 {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let first = paths[0].display();
        format!(
            "ignored, {kind} is not read: {first}{more}; open them in MeshLab, Blender or CloudCompare and export them as \
             PLY"
        )
    };
    found.into_iter().map(sentence).collect()
}

#[cfg(test)]
mod tests {
    use super::unread_meshes;

    #[test]
    fn all_scans_of_a_format_share_a_sentence() {
        let paths = ["m/b.glb", "m/c.off", "m/a.GLTF", "m/d.stl", "m/notes.txt"].map(Into::into);
        let advice = "open them in MeshLab, Blender or CloudCompare and export them as PLY";
        assert_eq!(
            unread_meshes(&paths),
            [
                format!("ignored, a glTF scene is not read: m/a.GLTF and 1 more; {advice}"),
                format!("ignored, an OFF mesh is not read: m/c.off; {advice}"),
            ]
        );
    }
}
