//! Names of copies of inputs, which all file systems can hold.

use std::collections::{HashMap, HashSet};
use std::path::{Component, Path};

use mocban_core::domain::is_device;
use mocban_core::domain::spelling::fold_case;

/// Longest name of a file or folder in bytes.
const MAX_NAME: usize = 255;
/// Characters that Windows allows in no name.
const RESERVED: &str = "<>:\"|?*\\/";
/// Name of a copy whose stored path has no name.
const UNNAMED: &str = "file";

/// Gives copies names below one folder that differ also where upper and lower case, or the Unicode forms of accented
/// letters, are the same.
#[derive(Debug, Default)]
pub(crate) struct InputNames {
    /// Folders of copies, by the folder that they are in and the name in stored paths.
    folders: HashMap<(String, String), String>,
    /// Names in use, by folder, in lower case.
    taken: HashSet<(String, String)>,
    /// Beginning of names that are not given in the upper folder, in lower case.
    hidden: String,
}

impl InputNames {
    /// Gives no name yet. No copy is named like the file `reserved`, or like what is written beside it.
    pub(crate) fn without(reserved: &str) -> Self {
        let mut names = Self {
            hidden: fold_case(&format!(".{reserved}.")),
            ..Self::default()
        };
        names.taken.insert((String::new(), fold_case(reserved)));
        names
    }

    /// Returns a new name for the copy of an input: its stored path below the root, with slashes, as far as all file
    /// systems can hold it.
    pub(crate) fn next(&mut self, stored: &str) -> String {
        let parts = named_parts(stored);
        let (file, folders) = parts.split_last().unwrap_or((&UNNAMED, &[]));
        let mut parent = String::new();
        for folder in folders {
            parent = self.folder(parent, folder);
        }
        let name = self.unused(&parent, file, true);
        joined(&parent, &name)
    }

    /// Keeps the name that an input has in an earlier list. New copies in its folders get other names.
    pub(crate) fn reserve(&mut self, stored: &str, name: &str) {
        let (stored, name) = (named_parts(stored), named_parts(name));
        let is_alike = stored.len() == name.len();
        let mut parent = String::new();
        for (depth, part) in name.iter().enumerate() {
            self.taken.insert((parent.clone(), fold_case(part)));
            let path = joined(&parent, part);
            if is_alike && depth + 1 < name.len() {
                let key = (parent, stored[depth].to_owned());
                self.folders.entry(key).or_insert_with(|| path.clone());
            }
            parent = path;
        }
    }

    /// Returns the folder for stored paths with a folder of this name.
    fn folder(&mut self, parent: String, name: &str) -> String {
        let key = (parent, name.to_owned());
        if let Some(known) = self.folders.get(&key) {
            return known.clone();
        }
        let unused = self.unused(&key.0, name, false);
        let folder = joined(&key.0, &unused);
        self.folders.insert(key, folder.clone());
        folder
    }

    /// Returns a name that nothing else has in a folder, and notes it.
    fn unused(&mut self, parent: &str, name: &str, is_file: bool) -> String {
        let mut plain = portable(name);
        if parent.is_empty() && fold_case(&plain).starts_with(&self.hidden) {
            plain = plain.replacen('.', "_", 1);
        }
        let mut name = plain.clone();
        let mut number = 1_u64;
        while !self.taken.insert((parent.to_owned(), fold_case(&name))) {
            number += 1;
            name = numbered(&plain, number, is_file);
        }
        name
    }
}

/// Returns the folders and the file of a path, without its root and without `.` and `..`.
pub(crate) fn named_parts(path: &str) -> Vec<&str> {
    let parts = Path::new(path).components();
    let parts = parts.filter_map(|part| match part {
        Component::Normal(part) => part.to_str(),
        _ => None,
    });
    parts.collect()
}

fn joined(parent: &str, name: &str) -> String {
    if parent.is_empty() {
        name.to_owned()
    } else {
        format!("{parent}/{name}")
    }
}

/// Returns a name with `_` for what some file system cannot hold.
fn portable(name: &str) -> String {
    let replaced = |c: char| {
        if c.is_control() || RESERVED.contains(c) {
            '_'
        } else {
            c
        }
    };
    let plain: String = name.chars().map(replaced).collect();
    let plain = plain.trim_end_matches(['.', ' ']);
    if plain.is_empty() || is_device(plain) {
        format!("_{plain}")
    } else {
        plain.to_owned()
    }
}

/// Returns a name with a number, before the extension of a file.
fn numbered(name: &str, number: u64, is_file: bool) -> String {
    let (stem, extension) = match name.rfind('.') {
        Some(at) if is_file && at > 0 => name.split_at(at),
        _ => (name, ""),
    };
    let number = format!(" ({number})");
    let most = MAX_NAME.saturating_sub(number.len() + extension.len());
    let stem = &stem[..stem.floor_char_boundary(most)];
    format!("{stem}{number}{extension}")
}

#[cfg(test)]
mod tests {
    use super::InputNames;

    #[test]
    fn names_differ_without_upper_and_lower_case_and_in_both_unicode_forms() {
        let mut names = InputNames::without("list.json");
        for (stored, name) in [
            ("data/meshes/chữ 1.stl", "data/meshes/chữ 1.stl"),
            ("data/meshes/CHỮ 1.STL", "data/meshes/CHỮ 1 (2).STL"),
            (
                "data/meshes/chu\u{31b}\u{303} 1.stl",
                "data/meshes/chu\u{31b}\u{303} 1 (3).stl",
            ),
            ("Data/meshes/2.stl", "Data (2)/meshes/2.stl"),
            ("Data/meshes/3.stl", "Data (2)/meshes/3.stl"),
            ("/data/meshes/chữ 1.stl", "data/meshes/chữ 1 (4).stl"),
            ("data", "data (3)"),
            ("List.json", "List (2).json"),
            ("list.json/1.stl", "list.json (2)/1.stl"),
            (".list.json.1-2/new", "_list.json.1-2/new"),
            (".LIST.json.1", "_LIST.json.1"),
            ("a/.list.json.1", "a/.list.json.1"),
        ] {
            assert_eq!(names.next(stored), name, "{stored}");
        }
    }

    #[test]
    fn a_reserved_name_and_its_folders_stay() {
        let mut names = InputNames::without("list.json");
        names.reserve("Data/1.stl", "Data (2)/1.stl");
        names.reserve("/", "file");
        for (stored, name) in [
            ("Data/1.stl", "Data (2)/1 (2).stl"),
            ("Data/2.stl", "Data (2)/2.stl"),
            ("data/1.stl", "data/1.stl"),
            ("", "file (2)"),
        ] {
            assert_eq!(names.next(stored), name, "{stored}");
        }
    }

    #[test]
    fn names_that_windows_cannot_hold_are_changed() {
        let mut names = InputNames::without("list.json");
        for (stored, name) in [
            ("scans:1/a?.ply", "scans_1/a_.ply"),
            ("nul.png", "_nul.png"),
            ("COM0.png", "_COM0.png"),
            ("folder./1.png ", "folder/1.png"),
            (".hidden/1.png", ".hidden/1.png"),
            ("../..", "file"),
            ("", "file (2)"),
        ] {
            assert_eq!(names.next(stored), name, "{stored}");
        }
    }

    #[test]
    fn a_numbered_name_is_not_too_long() {
        let mut names = InputNames::without("list.json");
        let long = |letter: &str| format!("{}.stl", letter.repeat(83));
        let first = names.next(&long("ữ"));
        let second = names.next(&long("Ữ"));
        assert_eq!(first.len(), 253);
        assert!(
            second.len() <= 255 && second.ends_with(" (2).stl"),
            "{second}"
        );
    }
}
