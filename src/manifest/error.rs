//! Problems of a list of pairs, by line.

use std::fmt;
use std::path::Path;

use crate::domain::sanitize;

/// Longest text of a problem, in characters.
const MAX_CHARS: usize = 300;

/// Maximum number of problems that are kept and shown; the others are counted.
const MAX_SHOWN: usize = 20;

/// A problem of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Problem {
    /// The line or file, unless the problem concerns the whole list.
    place: Option<String>,
    reason: String,
    /// Number of further places with the same reason.
    repeats: usize,
}

impl Problem {
    fn new(place: Option<String>, reason: &str) -> Self {
        Self {
            place,
            reason: sanitize(reason, MAX_CHARS),
            repeats: 0,
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.reason)?;
        match self.repeats {
            0 => Ok(()),
            repeats => write!(f, " ({repeats} more like this)"),
        }
    }
}

/// Returns a problem of a line, counted from 1.
pub(super) fn at_line(line: usize, reason: &str) -> Problem {
    Problem::new(Some(format!("line {line}")), reason)
}

/// Returns a problem of a file of a directory.
pub(super) fn at_file(path: &Path, reason: &str) -> Problem {
    Problem::new(Some(sanitize(&path.to_string_lossy(), 4096)), reason)
}

/// Returns a problem of the whole list.
pub(super) fn of_list(reason: &str) -> Problem {
    Problem::new(None, reason)
}

/// The problems of a refused list. They are displayed one per line.
#[derive(Debug, Clone, Default, PartialEq, Eq, thiserror::Error)]
pub struct ManifestError {
    /// The first problems. Never empty.
    problems: Vec<Problem>,
    /// Number of further problems. Their texts are dropped, because every row of a long list may have one.
    more: usize,
}

impl ManifestError {
    /// Adds a problem. Only counts it if the same reason was given before, or if there are many problems already.
    pub(super) fn add(&mut self, problem: Problem) {
        let mut problems = self.problems.iter_mut();
        if let Some(first) = problems.find(|first| first.reason == problem.reason) {
            first.repeats += 1;
        } else if self.problems.len() < MAX_SHOWN {
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

impl From<Problem> for ManifestError {
    fn from(problem: Problem) -> Self {
        Self {
            problems: vec![problem],
            more: 0,
        }
    }
}

impl Extend<Problem> for ManifestError {
    fn extend<T: IntoIterator<Item = Problem>>(&mut self, problems: T) {
        problems.into_iter().for_each(|problem| self.add(problem));
    }
}

impl fmt::Display for ManifestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, problem) in self.problems.iter().enumerate() {
            let separator = if at == 0 { "" } else { "\n" };
            write!(f, "{separator}{problem}")?;
        }
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
                assert!(!text.to_string().contains(&rude), "{text:?}");
            }
        }
    }

    #[test]
    fn twenty_problems_are_shown_and_the_rest_counted() {
        let mut error = ManifestError::default();
        error.extend((1..=23).map(|line| at_line(line, &format!("no id {line}"))));
        let text = error.to_string();
        assert_eq!(text.lines().count(), 21);
        assert!(text.starts_with("line 1: no id 1\nline 2: no id 2\n"));
        assert!(text.ends_with("line 20: no id 20\nand 3 more"));
    }

    #[test]
    fn a_reason_is_given_once_with_the_number_of_lines() {
        let mut error = ManifestError::default();
        for line in 2..=30 {
            error.add(at_line(line, "no unit"));
            error.add(at_line(line, if line < 5 { "no id" } else { "no mesh" }));
        }
        assert_eq!(
            error.to_string(),
            "line 2: no unit (28 more like this)\nline 2: no id (2 more like this)\n\
             line 5: no mesh (25 more like this)"
        );
    }
}
