//! A file of a directory by its name and the folders above it.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use crate::columns::plain_name;
use mocban_core::domain::spelling::{composed, fold_case};

/// Folders that name a kind of file, such as `stl` in `block-4/stl/12.stl`, as [`plain_name`] writes them. They are no part
/// of ids.
const KIND_FOLDERS: [&str; 24] = [
    "image",
    "images",
    "img",
    "jpeg",
    "jpg",
    "mesh",
    "meshes",
    "obj",
    "ply",
    "png",
    "print",
    "prints",
    "scan",
    "scans",
    "stl",
    "tif",
    "tiff",
    "quet",
    "ban_quet",
    "luoi",
    "in",
    "ban_in",
    "anh_in",
    "anh_ban_in",
];

/// A file with the folders between it and the root.
#[derive(Debug, Clone)]
pub(super) struct FolderFile {
    pub(super) path: PathBuf,
    /// Names of the folders, without those of kinds of files.
    pub(super) folders: Vec<String>,
    pub(super) stem: String,
}

/// Part of a path for sorting: numbers are ordered by value, before all others.
pub(super) type SortedPart = (bool, u64, String);

impl FolderFile {
    /// Splits a path below a root into its parts, in composed letters: a mesh named on macOS and a print named on Windows
    /// may have different forms of the same letters.
    pub(super) fn new(path: &Path, root: &Path) -> Option<Self> {
        let text =
            |name: &std::ffi::OsStr| -> String { composed(&name.to_string_lossy()).into_owned() };
        let below = path.strip_prefix(root).unwrap_or(path);
        let folders = below.parent().into_iter().flat_map(Path::components);
        let folders = folders.filter_map(|part| match part {
            Component::Normal(name) => Some(text(name)),
            _ => None,
        });
        let is_kind = |name: &String| KIND_FOLDERS.contains(&plain_name(name).as_str());
        Some(Self {
            folders: folders.filter(|name| !is_kind(name)).collect(),
            stem: text(path.file_stem()?),
            path: path.to_owned(),
        })
    }

    /// Returns the block: the folders.
    pub(super) fn block(&self) -> Option<String> {
        (!self.folders.is_empty()).then(|| self.folders.join("_"))
    }

    /// Returns the id: the folders and the stem.
    pub(super) fn id(&self) -> String {
        let block = self.block().map_or_else(String::new, |block| block + "_");
        block + &self.stem
    }

    /// Returns how many folders of another file have the name of one of this file.
    pub(super) fn shared_folders(&self, other: &Self) -> usize {
        let is_shared = |folder: &&String| {
            let folded = fold_case(folder);
            self.folders.iter().any(|own| fold_case(own) == folded)
        };
        other.folders.iter().filter(is_shared).count()
    }

    /// Returns what files are sorted by: folders and stem.
    pub(super) fn place(&self) -> Vec<SortedPart> {
        let parts = self.folders.iter().chain([&self.stem]);
        let sorted = parts.map(|part| {
            let number = part.parse().ok();
            (number.is_none(), number.unwrap_or(0), part.clone())
        });
        sorted.collect()
    }
}

/// Returns files by a key.
pub(super) fn grouped(
    files: &[FolderFile],
    key: impl Fn(&FolderFile) -> String,
) -> BTreeMap<String, Vec<&FolderFile>> {
    let mut groups: BTreeMap<String, Vec<&FolderFile>> = BTreeMap::new();
    for file in files {
        groups.entry(key(file)).or_default().push(file);
    }
    groups
}
