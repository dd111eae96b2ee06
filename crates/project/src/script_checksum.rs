//! The checksum in the file of a script for a shell, by which changes are found before another script replaces the file.

use mocban_core::domain::ContentHash;

/// What stands before the checksum, in the last line.
const START: &str = "\n# checksum ";
/// Hexadecimal digits of a checksum.
const DIGITS: usize = 32;

/// Returns a script for a file, with a checksum in a comment at its end.
pub fn with_checksum(script: &str) -> String {
    let text = script.trim_end();
    format!("{text}{START}{}\n", checksum(text))
}

/// Returns whether the file of a script has another content than the script had. The ends of lines do not count. A file of an
/// earlier version, without a checksum, counts as unchanged.
pub(crate) fn is_changed(file: &[u8]) -> bool {
    let text = String::from_utf8_lossy(file).replace('\r', "");
    let Some((script, rest)) = text.rsplit_once(START) else {
        return false;
    };
    rest.trim_end() != checksum(script)
}

fn checksum(text: &str) -> String {
    let mut digits = ContentHash::of(text.as_bytes()).to_hex();
    digits.truncate(DIGITS);
    digits
}

#[cfg(test)]
mod tests {
    use super::{is_changed, with_checksum};

    #[test]
    fn added_lines_are_found_at_any_place() {
        let script = "# place\ncomplete -F _mocban mocban\n";
        let file = with_checksum(script);
        assert!(file.starts_with(script), "{file}");
        for same in [file.clone(), file.replace('\n', "\r\n"), script.to_owned()] {
            assert!(!is_changed(same.as_bytes()), "{same}");
        }
        for changed in [
            format!("{file}alias m=mocban\n"),
            format!("alias m=mocban\n{file}"),
            file.replace("-F", "-o default -F"),
        ] {
            assert!(is_changed(changed.as_bytes()), "{changed}");
        }
    }
}
