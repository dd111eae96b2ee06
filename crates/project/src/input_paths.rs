//! Finds the files of a list under the names that they have on disk.

use std::io;
use std::path::{Component, Path, PathBuf};

use mocban_core::domain::spelling::plain_form;
use unicode_normalization::UnicodeNormalization as _;

/// Replaces the path of a file whose name is written differently in a list by its path on disk: with the other Unicode
/// form of accented letters (macOS writes some names decomposed, Windows and Linux composed), or without the
/// backslashes of Windows. Returns whether the file exists.
///
/// # Errors
/// Returns an error if this cannot be found out, such as for a folder that cannot be entered.
pub fn find_on_disk(path: &mut PathBuf) -> io::Result<bool> {
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

/// Largest number of entries of a folder that are compared with the name of a missing file.
const MAX_ENTRIES: usize = 10_000;

/// Returns the name of a file in the folder of a missing file that differs from it only in accents, in upper and lower case,
/// or in zeros before a number.
pub fn similar_file(missing: &Path) -> Option<String> {
    let wanted = plain_form(missing.file_name()?.to_str()?);
    // The parent of a bare file name is empty.
    let folder = Path::new(".").join(missing.parent()?);
    let entries = std::fs::read_dir(folder).ok()?;
    let names = entries.take(MAX_ENTRIES).flatten();
    let mut names = names.filter_map(|entry| entry.file_name().into_string().ok());
    names.find(|name| plain_form(name) == wanted)
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

    use super::{find_on_disk, similar_file};

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
    }
}
