//! The checksum in the last line of a text file, by which changes are found before another text replaces the file.

use super::hash::ContentHash;

/// Hexadecimal digits of a checksum.
const DIGITS: usize = 32;

/// Returns a text for a file, with its checksum in a last line. The line is a comment in the format of the file: `comment` has
/// what stands before and behind the checksum.
///
/// ```
/// use mocban_core::domain::{is_text_changed, with_text_checksum};
///
/// let comment = ["# checksum ", ""];
/// let file = with_text_checksum("alias m=mocban\n", comment);
/// assert_eq!(is_text_changed(file.as_bytes(), &[comment]), Some(false));
/// let edited = file.replace("m=", "n=");
/// assert_eq!(is_text_changed(edited.as_bytes(), &[comment]), Some(true));
/// assert_eq!(is_text_changed(b"alias m=mocban\n", &[comment]), None);
/// ```
pub fn with_text_checksum(text: &str, comment: [&str; 2]) -> String {
    let text = text.trim_end();
    let [before, behind] = comment;
    let checksum = checksum(&text.replace('\r', ""));
    format!("{text}\n{before}{checksum}{behind}\n")
}

/// Returns whether a file has another content than the text that was written to it. The ends of lines do not count. `None` if
/// it has a checksum in none of the comments, as in files of earlier versions.
pub fn is_text_changed(file: &[u8], comments: &[[&str; 2]]) -> Option<bool> {
    let text = String::from_utf8_lossy(file).replace('\r', "");
    let text = text.trim_start_matches('\u{feff}');
    comments.iter().find_map(|[before, behind]| {
        let (content, rest) = text.rsplit_once(&format!("\n{before}"))?;
        Some(rest.trim_end() != format!("{}{behind}", checksum(content)))
    })
}

/// Returns the checksum of a text with the ends of lines of Unix.
fn checksum(text: &str) -> String {
    let mut digits = ContentHash::of(text.as_bytes()).to_hex();
    digits.truncate(DIGITS);
    digits
}

#[cfg(test)]
mod tests {
    use super::{is_text_changed, with_text_checksum};

    const COMMENT: [&str; 2] = ["<!-- checksum ", " -->"];

    #[test]
    fn a_file_that_another_program_saved_is_unchanged_unless_it_says_something_else() {
        let is_changed = |file: &str| is_text_changed(file.as_bytes(), &[["% ", ""], COMMENT]);
        for text in ["one\ntwo\n", "one\r\ntwo\r\n\r\n", "one\ntwo"] {
            let file = with_text_checksum(text, COMMENT);
            for saved in [
                file.clone(),
                file.replace('\n', "\r\n"),
                format!("\u{feff}{file}\n\n"),
            ] {
                assert_eq!(is_changed(&saved), Some(false), "{saved:?}");
            }
            let edited = [
                format!("{file}three\n"),
                format!("three\n{file}"),
                file.replace("checksum ", "checksum x"),
                file.replace(" -->", " -- >"),
                file.replace(" -->", ""),
            ];
            for edited in edited {
                assert_eq!(is_changed(&edited), Some(true), "{edited:?}");
            }
            assert_eq!(is_changed(text), None);
        }
    }
}
