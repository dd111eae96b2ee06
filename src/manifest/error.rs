//! Problems of a list of pairs, by line.

use std::fmt;
use std::path::Path;

use crate::domain::sanitize;

/// Longest text of a problem, in characters.
const MAX_CHARS: usize = 300;

/// Maximum number of problems shown; the others are counted.
const MAX_SHOWN: usize = 20;

/// Returns a problem of a line, counted from 1.
pub(super) fn at_line(line: usize, reason: &str) -> String {
    format!("line {line}: {}", of_list(reason))
}

/// Returns a problem of a file of a directory.
pub(super) fn at_file(path: &Path, reason: &str) -> String {
    format!("{}: {reason}", sanitize(&path.to_string_lossy(), 4096))
}

/// Returns a problem of the whole list.
pub(super) fn of_list(reason: &str) -> String {
    sanitize(reason, MAX_CHARS)
}

/// All problems of a refused list. They are displayed one per line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct ManifestError {
    /// The problems, each with its line or file unless it concerns the whole list. Never empty.
    pub problems: Vec<String>,
}

impl ManifestError {
    /// Refuses a list that has problems, or no pairs.
    pub(super) fn check(is_empty: bool, problems: Vec<String>) -> Result<(), Self> {
        if !problems.is_empty() {
            return Err(Self { problems });
        }
        if is_empty {
            return Err(of_list("the list contains no pairs").into());
        }
        Ok(())
    }
}

impl From<String> for ManifestError {
    fn from(problem: String) -> Self {
        Self {
            problems: vec![problem],
        }
    }
}

impl fmt::Display for ManifestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = self.problems.len().min(MAX_SHOWN);
        f.write_str(&self.problems[..shown].join("\n"))?;
        match self.problems.len() - shown {
            0 => Ok(()),
            more => write!(f, "\nand {more} more"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ManifestError, at_file, at_line, of_list};

    #[test]
    fn quoted_text_is_sanitized_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(5000)] {
            for text in [
                at_line(1, &rude),
                of_list(&rude),
                at_file(rude.as_ref(), "reason"),
            ] {
                assert!(!text.contains(&rude), "{text:?}");
            }
        }
    }

    #[test]
    fn twenty_problems_are_shown_and_the_rest_counted() {
        let problems = (1..=23).map(|line| at_line(line, "no id")).collect();
        let text = ManifestError { problems }.to_string();
        assert_eq!(text.lines().count(), 21);
        assert!(text.starts_with("line 1: no id\nline 2: no id\n"));
        assert!(text.ends_with("line 20: no id\nand 3 more"));
    }
}
