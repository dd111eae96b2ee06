//! The checksum in the file of a script for a shell, by which changes are found before another script replaces the file.

use mocban_core::domain::{is_text_changed, with_text_checksum};

/// What stands before and behind the checksum, in the last line.
const COMMENT: [&str; 2] = ["# checksum ", ""];

/// Returns a script for a file, with a checksum in a comment at its end.
pub fn with_checksum(script: &str) -> String {
    with_text_checksum(script, COMMENT)
}

/// Returns whether the file of a script has another content than the script had. The ends of lines do not count. A file of an
/// earlier version, without a checksum, counts as unchanged.
pub(crate) fn is_changed(file: &[u8]) -> bool {
    is_text_changed(file, &[COMMENT]) == Some(true)
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
