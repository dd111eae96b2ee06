//! Problems of a list of pairs, by line.

use std::fmt;
use std::path::PathBuf;

use crate::domain::sanitize;

/// Longest text of a problem, in characters.
const MAX_CHARS: usize = 300;

/// Maximum number of problems shown; the others are counted.
const MAX_SHOWN: usize = 20;

/// Where a problem is in a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProblemLocation {
    /// A line, counted from 1.
    Line(usize),
    /// A file of a directory.
    File(PathBuf),
    /// The whole list.
    List,
}

impl fmt::Display for ProblemLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}: "),
            Self::File(path) => write!(f, "{}: ", sanitize(&path.to_string_lossy(), 4096)),
            Self::List => Ok(()),
        }
    }
}

/// One problem of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Where it is.
    pub location: ProblemLocation,
    /// A lower-case fragment with the values in it.
    pub reason: String,
}

impl Problem {
    /// Creates a problem of a line.
    pub(super) fn at_line(line: usize, reason: impl Into<String>) -> Self {
        Self {
            location: ProblemLocation::Line(line),
            reason: sanitize(&reason.into(), MAX_CHARS),
        }
    }

    /// Creates a problem of the whole list.
    pub(super) fn of_list(reason: impl Into<String>) -> Self {
        Self {
            location: ProblemLocation::List,
            reason: sanitize(&reason.into(), MAX_CHARS),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.location, self.reason)
    }
}

/// A list that is refused as a whole, with all its problems; displayed as one problem per line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct ManifestError {
    /// In the order of the list; never empty.
    pub problems: Vec<Problem>,
}

impl ManifestError {
    /// Refuses a list that has problems, or no pairs.
    pub(super) fn check(is_empty: bool, problems: Vec<Problem>) -> Result<(), Self> {
        if !problems.is_empty() {
            return Err(Self { problems });
        }
        if is_empty {
            return Err(Problem::of_list("the list contains no pairs").into());
        }
        Ok(())
    }
}

impl From<Problem> for ManifestError {
    fn from(problem: Problem) -> Self {
        Self {
            problems: vec![problem],
        }
    }
}

impl fmt::Display for ManifestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, problem) in self.problems.iter().take(MAX_SHOWN).enumerate() {
            let separator = if number == 0 { "" } else { "\n" };
            write!(f, "{separator}{problem}")?;
        }
        match self.problems.len().saturating_sub(MAX_SHOWN) {
            0 => Ok(()),
            more => write!(f, "\nand {more} more"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ManifestError, Problem, ProblemLocation};

    #[test]
    fn quoted_text_is_sanitized_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(5000)] {
            let location = ProblemLocation::File(rude.as_str().into());
            for text in [
                Problem::at_line(1, rude.as_str()).to_string(),
                Problem::of_list(rude.as_str()).to_string(),
                location.to_string(),
            ] {
                assert!(!text.contains(&rude), "{text:?}");
            }
        }
    }

    #[test]
    fn twenty_problems_are_shown_and_the_rest_counted() {
        let problems = (1..=23)
            .map(|line| Problem::at_line(line, "no id"))
            .collect();
        let text = ManifestError { problems }.to_string();
        assert_eq!(text.lines().count(), 21);
        assert!(text.starts_with("line 1: no id\nline 2: no id\n"));
        assert!(text.ends_with("line 20: no id\nand 3 more"));
    }
}
