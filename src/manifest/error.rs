//! Problems of a list of pairs, by line.

use std::fmt;
use std::path::Path;

use crate::domain::sanitize;

/// Longest text of a problem, in characters.
const MAX_CHARS: usize = 300;

/// Maximum number of problems that are kept and shown; the others are counted.
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

/// The problems of a refused list. They are displayed one per line.
#[derive(Debug, Clone, Default, PartialEq, Eq, thiserror::Error)]
pub struct ManifestError {
    /// The first problems, each with its line or file unless it concerns the whole list. Never empty.
    pub problems: Vec<String>,
    /// Number of further problems. Their texts are dropped, because every row of a long list may have one.
    pub more: usize,
}

impl ManifestError {
    /// Adds a problem. Only counts it if there are many already.
    pub(super) fn add(&mut self, problem: String) {
        if self.problems.len() < MAX_SHOWN {
            self.problems.push(problem);
        } else {
            self.more += 1;
        }
    }

    /// Refuses a list that has problems, or no pairs.
    pub(super) fn check(self, is_empty: bool) -> Result<(), Self> {
        if !self.problems.is_empty() {
            return Err(self);
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
            more: 0,
        }
    }
}

impl Extend<String> for ManifestError {
    fn extend<T: IntoIterator<Item = String>>(&mut self, problems: T) {
        problems.into_iter().for_each(|problem| self.add(problem));
    }
}

impl fmt::Display for ManifestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.problems.join("\n"))?;
        match self.more {
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
        let mut error = ManifestError::default();
        error.extend((1..=23).map(|line| at_line(line, "no id")));
        assert_eq!(error.problems.len(), 20);
        let text = error.to_string();
        assert_eq!(text.lines().count(), 21);
        assert!(text.starts_with("line 1: no id\nline 2: no id\n"));
        assert!(text.ends_with("line 20: no id\nand 3 more"));
    }
}
