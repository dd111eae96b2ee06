//! Finds the files of a list under the names that they have on disk.

use std::path::{Component, Path, PathBuf};

use unicode_normalization::UnicodeNormalization as _;

/// Returns the path of a file whose name is written differently in a list: with the other Unicode form of accented
/// letters (macOS writes some names decomposed, Windows and Linux composed), or with the backslashes of Windows.
/// Returns `None` if the path exists as written, or under no such name.
pub(super) fn on_disk(path: &Path) -> Option<PathBuf> {
    // An error, such as a folder that cannot be entered, is reported with the path as written.
    if !matches!(path.try_exists(), Ok(false)) {
        return None;
    }
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

    use super::on_disk;

    #[test]
    fn other_unicode_forms_and_backslashes_are_found() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [composed, decomposed] = ["chữ", "chu\u{31b}\u{303}"];
        fs::create_dir(dir.path().join(decomposed)).expect("a folder");
        let file = dir.path().join(decomposed).join(format!("{composed}.stl"));
        fs::write(&file, "").expect("written");
        let written = dir.path().join(format!("{composed}\\{decomposed}.stl"));
        assert_eq!(on_disk(&written), Some(file.clone()));
        let composed = dir.path().join(composed).join(format!("{composed}.stl"));
        assert_eq!(on_disk(&composed), Some(file.clone()));
        assert_eq!(on_disk(&file), None);
        assert_eq!(on_disk(&dir.path().join("other.stl")), None);
    }
}
