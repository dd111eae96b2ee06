//! Finds the files of a list under the names that they have on disk.

use std::io;
use std::path::{Component, Path, PathBuf};

use unicode_normalization::UnicodeNormalization as _;

/// Replaces the path of a file whose name is written differently in a list by its path on disk: with the other Unicode
/// form of accented letters (macOS writes some names decomposed, Windows and Linux composed), or without the
/// backslashes of Windows. Returns whether the file exists.
///
/// # Errors
/// Returns an error if this cannot be found out, such as for a folder that cannot be entered.
pub(super) fn find_on_disk(path: &mut PathBuf) -> io::Result<bool> {
    if path.try_exists()? {
        return Ok(true);
    }
    let found = written_differently(path);
    if let Some(found) = &found {
        path.clone_from(found);
    }
    Ok(found.is_some())
}

/// Returns the path of a file whose name is written differently.
fn written_differently(path: &Path) -> Option<PathBuf> {
    let text = path.to_str()?;
    let slashes = (cfg!(unix) && text.contains('\\')).then(|| text.replace('\\', "/"));
    let mut written = [Some(text.to_owned()), slashes].into_iter().flatten();
    written.find_map(|text| in_any_form(Path::new(&text)))
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
        let forms = [name.to_owned(), name.nfc().collect(), name.nfd().collect()];
        let existing = forms.iter().map(|form| found.join(form));
        found = existing.into_iter().find(|path| path.exists())?;
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::find_on_disk;

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
            assert!(find_on_disk(&mut path).expect("readable"), "{written}");
            assert_eq!(path, file, "{written}");
        }
        let other = dir.path().join("other.stl");
        let mut path = other.clone();
        assert!(!find_on_disk(&mut path).expect("readable"));
        assert_eq!(path, other);
    }
}
