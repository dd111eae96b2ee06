//! Finds the files of a list under the names that they have on disk.

use std::fs::Metadata;
use std::io;
use std::path::{Component, Path, PathBuf};

use mocban_core::domain::NO_BREAK_SPACES;
use mocban_core::domain::spelling::{composed, edit_distance, plain_form};
use mocban_lists::manifest::{is_named_like_mesh, is_named_like_print};
use mocban_store::Project;
use unicode_normalization::UnicodeNormalization as _;

/// A file that exists.
#[derive(Debug)]
pub(crate) struct FoundFile {
    pub(crate) place: PathBuf,
    /// What the file system says of it. Unknown in an object store.
    pub(crate) meta: Option<Metadata>,
}

/// Looks for a file once: a list may have millions of rows.
pub(crate) fn look_for(path: &mut PathBuf, project: &Project) -> io::Result<Option<FoundFile>> {
    let Some(stored) = path.to_str().filter(|path| project.is_below_root(path)) else {
        let meta = find_on_disk(path)?;
        return Ok(meta.map(|meta| FoundFile {
            place: path.clone(),
            meta: Some(meta),
        }));
    };
    Ok(project.input(stored).exists().then(|| {
        let place = project.input_path(stored);
        let meta = place.metadata().ok();
        FoundFile { place, meta }
    }))
}

/// Replaces the path of a file whose name is written differently in a list by its path on disk: with the other Unicode
/// form of accented letters (macOS writes some names decomposed, Windows and Linux composed), without the backslashes of
/// Windows, or with plain spaces for the no-break spaces of text programs. Returns what the file system says of the file, or
/// `None` if it does not exist.
///
/// # Errors
/// Returns an error if this cannot be found out, such as for a folder that cannot be entered.
pub fn find_on_disk(path: &mut PathBuf) -> io::Result<Option<Metadata>> {
    match path.metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        found => return found.map(Some),
    }
    let Some(found) = written_differently(path) else {
        return Ok(None);
    };
    let meta = found.metadata()?;
    *path = found;
    Ok(Some(meta))
}

/// Returns the path of a file whose name is written differently.
fn written_differently(path: &Path) -> Option<PathBuf> {
    let text = path.to_str()?;
    let slashes = (cfg!(unix) && text.contains('\\')).then(|| text.replace('\\', "/"));
    let mut written: Vec<String> = [Some(text.to_owned()), slashes]
        .into_iter()
        .flatten()
        .collect();
    let spaced = written
        .iter()
        .map(|text| text.replace(NO_BREAK_SPACES, " "));
    let spaced: Vec<String> = spaced.filter(|_| text.contains(NO_BREAK_SPACES)).collect();
    written.extend(spaced);
    written.iter().find_map(|text| in_any_form(Path::new(text)))
}

/// Returns the path of an existing file or folder whose name has another Unicode form, or the path itself.
pub fn in_existing_form(path: &Path) -> PathBuf {
    let is_missing = matches!(path.try_exists(), Ok(false));
    let found = is_missing.then(|| in_any_form(path)).flatten();
    found.unwrap_or_else(|| path.to_owned())
}

/// Returns the existing path whose parts are those of a path, as written, composed or decomposed.
fn in_any_form(path: &Path) -> Option<PathBuf> {
    let mut found = PathBuf::new();
    for part in path.components() {
        let Component::Normal(name) = part else {
            found.push(part);
            continue;
        };
        let name = name.to_str()?;
        let forms = [
            name.to_owned(),
            composed(name).into_owned(),
            name.nfd().collect(),
        ];
        let existing = forms.iter().map(|form| found.join(form));
        found = existing.into_iter().find(|path| path.exists())?;
    }
    Some(found)
}

/// Largest number of entries of a folder that are compared with a name.
const MAX_ENTRIES: usize = 10_000;
/// Largest number of missing files for which a similar one is searched: a search lists folders.
const MAX_SEARCHES: usize = 10;

/// Largest number of folders with similar names in which a similar file is searched.
const MAX_FOLDERS: usize = 10;

/// Searches files with similar names in place of the first missing ones.
#[derive(Debug, Default)]
pub struct SimilarFiles {
    searches: usize,
}

impl SimilarFiles {
    /// Returns the paths of the files that differ from a missing one only in accents, in upper and lower case, in zeros before
    /// a number, or in the kind of file, each from the first part that differs.
    pub fn find(&mut self, missing: &Path) -> Vec<String> {
        self.searches += 1;
        if self.searches > MAX_SEARCHES {
            return Vec::new();
        }
        // Each with its path from the first part that differs.
        let mut found = vec![(PathBuf::new(), PathBuf::new())];
        for part in missing.components() {
            found.truncate(MAX_FOLDERS);
            let next = found.into_iter().flat_map(|(path, shown)| {
                let exact = path.join(part);
                let differs = shown != Path::new("");
                match part {
                    Component::Normal(name) if differs || !exact.exists() => {
                        let entries = similar_entries(&path, name.to_str().unwrap_or_default());
                        let entries = entries.into_iter();
                        let found = entries.map(|entry| (path.join(&entry), shown.join(entry)));
                        found.collect::<Vec<_>>()
                    }
                    _ => vec![(exact, shown)],
                }
            });
            found = next.collect();
        }
        let shown = found
            .into_iter()
            .filter_map(|(_, shown)| shown.into_os_string().into_string().ok());
        shown.filter(|shown| !shown.is_empty()).collect()
    }
}

/// Returns the entry of a folder with this name, or the entries whose names differ from it in the same way. Names that differ in
/// the fewest letters come first.
fn similar_entries(folder: &Path, name: &str) -> Vec<String> {
    // The folder of a bare file name is empty.
    let Ok(entries) = std::fs::read_dir(Path::new(".").join(folder)) else {
        return Vec::new();
    };
    let names = entries.take(MAX_ENTRIES).flatten();
    let names = names.filter_map(|entry| entry.file_name().into_string().ok());
    let wanted = plain_form(name);
    let rank = |entry: &String| {
        let plain = plain_form(entry);
        let both = [entry.as_str(), name].map(Path::new);
        let is_other_kind = (both.into_iter().all(is_named_like_mesh)
            || both.into_iter().all(is_named_like_print))
            && Path::new(&plain).file_stem() == Path::new(&wanted).file_stem();
        match () {
            () if *entry == name => Some(0),
            () if plain == wanted => Some(1),
            () if is_other_kind => Some(2),
            () => None,
        }
    };
    let ranked = names.filter_map(|entry| {
        let rank = rank(&entry)?;
        Some((rank, edit_distance(&entry, name), entry))
    });
    let mut ranked: Vec<(u8, usize, String)> = ranked.collect();
    ranked.sort();
    let nearest = ranked.first().map(|(rank, _, _)| *rank);
    let ranked = ranked.into_iter();
    let nearest = ranked.take_while(|(rank, _, _)| Some(*rank) == nearest);
    nearest.map(|(_, _, entry)| entry).collect()
}

/// Returns whether a part of a path begins like an absolute path of Windows, such as `C:\scans\1.stl`, on another system.
/// The path of a list's folder may stand before it.
pub fn is_windows_path(path: &Path) -> bool {
    let mut parts = path
        .components()
        .map(|part| part.as_os_str().as_encoded_bytes());
    let is_absolute = |part: &[u8]| {
        matches!(part, [letter, b':'] | [letter, b':', b'\\', ..] if letter.is_ascii_alphabetic())
            || part.starts_with(br"\\")
    };
    cfg!(not(windows)) && parts.any(is_absolute)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::{SimilarFiles, find_on_disk};

    fn similar_files(path: &Path) -> Vec<String> {
        SimilarFiles::default().find(path)
    }

    fn similar_file(path: &Path) -> Option<String> {
        let mut found = similar_files(path);
        assert!(found.len() < 2, "{found:?}");
        found.pop()
    }

    #[test]
    fn other_unicode_forms_and_backslashes_are_found() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [composed, decomposed] = ["chữ", "chu\u{31b}\u{303}"];
        fs::create_dir(dir.path().join(decomposed)).expect("a folder");
        let file = dir.path().join(decomposed).join(format!("{composed}.stl"));
        fs::write(&file, "").expect("written");
        for written in [
            format!("{composed}\\{decomposed}.stl"),
            format!("{composed}/{composed}.stl"),
            format!("{decomposed}/{composed}.stl"),
        ] {
            let mut path = dir.path().join(&written);
            assert!(
                find_on_disk(&mut path).expect("readable").is_some(),
                "{written}"
            );
            assert_eq!(path, file, "{written}");
        }
        fs::write(dir.path().join("tờ 3.stl"), "").expect("written");
        let mut path = dir.path().join("tờ\u{a0}3.stl");
        assert!(find_on_disk(&mut path).expect("readable").is_some());
        assert_eq!(path, dir.path().join("tờ 3.stl"));
        let other = dir.path().join("other.stl");
        let mut path = other.clone();
        assert!(find_on_disk(&mut path).expect("readable").is_none());
        assert_eq!(path, other);
    }

    #[test]
    fn a_file_with_other_accents_or_zeros_is_similar() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        fs::write(dir.path().join("chữ số 1.stl"), "").expect("written");
        let similar = |name: &str| similar_file(&dir.path().join(name));
        assert_eq!(similar("Chu so 1.stl").as_deref(), Some("chữ số 1.stl"));
        assert_eq!(similar_file(Path::new("SRC")).as_deref(), Some("src"));
        assert_eq!(similar("Chu so 001.stl").as_deref(), Some("chữ số 1.stl"));
        assert_eq!(similar("chu so 2.stl"), None);
        assert_eq!(similar("missing/chu so 1.stl"), None);
        fs::create_dir(dir.path().join("STL")).expect("a folder");
        fs::write(dir.path().join("STL/Nét 7.PLY"), "").expect("written");
        assert_eq!(similar("stl/nét 7.ply").as_deref(), Some("STL/Nét 7.PLY"));
        assert_eq!(similar("stl/nét 07.stl").as_deref(), Some("STL/Nét 7.PLY"));
        assert_eq!(similar("stl/nét 7.txt"), None);
        let mut many = SimilarFiles::default();
        let found = (0..12).flat_map(|_| many.find(&dir.path().join("CHU SO 1.STL")));
        assert_eq!(found.count(), 10);
    }

    #[test]
    fn all_files_that_differ_in_the_same_way_are_similar_and_the_nearest_is_first() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for name in ["0117.stl", "00117.stl", "117.ply", "118.stl"] {
            fs::write(dir.path().join(name), "").expect("written");
        }
        let similar = |name: &str| similar_files(&dir.path().join(name));
        assert_eq!(similar("117.stl"), ["0117.stl", "00117.stl"]);
        assert_eq!(similar("117.obj"), ["117.ply", "0117.stl", "00117.stl"]);
        assert_eq!(similar("0118.stl"), ["118.stl"]);
        for folder in ["7", "07"] {
            fs::create_dir(dir.path().join(folder)).expect("a folder");
            fs::write(dir.path().join(folder).join("a.stl"), "").expect("written");
        }
        fs::write(dir.path().join("07/à.stl"), "").expect("written");
        for name in ["000017.stl", "00017.stl", "0017.stl", "017.stl"] {
            fs::write(dir.path().join(name), "").expect("written");
        }
        let nearest_first = ["017.stl", "0017.stl", "00017.stl", "000017.stl"];
        assert_eq!(similar("17.stl"), nearest_first);
        assert_eq!(similar("007/a.stl"), ["07/a.stl", "7/a.stl"]);
        assert_eq!(similar("07/á.stl"), ["a.stl", "à.stl"]);
        assert_eq!(similar("007/b.stl"), [""; 0]);
    }
}
