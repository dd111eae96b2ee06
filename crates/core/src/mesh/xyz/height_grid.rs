//! Grids of heights, which are text like points but have no x and y.

use crate::mesh::MeshError;

/// Fewest columns of a grid without a header. Points with that number of columns have a title.
const GRID_COLUMNS: usize = 32;
/// First words of the headers of grids: those of ESRI, Surfer and others.
const HEADER_WORDS: [&str; 4] = ["ncols", "nrows", "dsaa", "cellsize"];

/// Refuses a file whose first line without a title is that of a grid of heights, by its first word.
///
/// # Errors
/// Returns an error that names the line.
pub(super) fn check_header(line: u64, content: &[u8]) -> Result<(), MeshError> {
    let content = content.trim_ascii();
    let is_end = |byte: &u8| byte.is_ascii_whitespace() || b",;:=".contains(byte);
    let end = content.iter().position(is_end).unwrap_or(content.len());
    let is_word = |word: &&str| content[..end].eq_ignore_ascii_case(word.as_bytes());
    if HEADER_WORDS.iter().any(is_word) {
        return Err(grid(line));
    }
    Ok(())
}

/// Refuses lines without a title that have more columns than points have.
///
/// # Errors
/// Returns an error that names the first line.
pub(super) fn check_width(line: u64, width: usize) -> Result<(), MeshError> {
    if width >= GRID_COLUMNS {
        return Err(grid(line));
    }
    Ok(())
}

fn grid(line: u64) -> MeshError {
    let reason =
        "a grid of heights begins here; save it as points, with x, y and z of each in a line";
    MeshError::Line {
        line,
        reason: reason.into(),
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::{MeshLimits, read};

    fn refused(text: &str) -> String {
        let read = read(text.as_bytes(), "scan.asc", &MeshLimits::SUGGESTED);
        read.expect_err(text).to_string()
    }

    #[test]
    fn grids_of_heights_are_named() {
        let rows = |separator: &str| {
            let row = |k: usize| {
                let heights = (0..40).map(|x| format!("{}.25", (x * k) % 7));
                heights.collect::<Vec<_>>().join(separator)
            };
            (0..30).map(|k| row(k) + "\n").collect::<String>()
        };
        let said =
            "a grid of heights begins here; save it as points, with x, y and z of each in a line";
        for separator in [" ", ",", ";", "\t", ", "] {
            assert_eq!(
                refused(&rows(separator)),
                format!("line 1: {said}"),
                "{separator:?}"
            );
        }
        let esri = format!(
            "ncols 40\nnrows 30\nxllcorner 0\nyllcorner 0\ncellsize 0.5\nNODATA_value -9999\n{}",
            rows(" ")
        );
        for text in [
            esri.clone(),
            esri.to_uppercase(),
            format!("DSAA\n40 30\n{}", rows(" ")),
        ] {
            assert_eq!(refused(&text), format!("line 1: {said}"), "{text}");
        }
    }
}
