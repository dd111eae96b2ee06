//! What is wrong with a list of pairs, by line.

use std::fmt;
use std::path::PathBuf;

use crate::domain::sanitize;

/// Characters of a problem that are shown.
const LONGEST: usize = 300;

/// Problems shown at most; the rest are counted.
const SHOWN: usize = 20;

/// Where in a list a problem is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// A line, counted from 1.
    Line(usize),
    /// A file of a folder.
    File(PathBuf),
    /// The list as a whole.
    Whole,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}: "),
            Self::File(path) => write!(f, "{}: ", sanitize(&path.to_string_lossy(), 4096)),
            Self::Whole => Ok(()),
        }
    }
}

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Where.
    pub place: Place,
    /// A lower-case fragment with the values in it.
    pub reason: String,
}

impl Problem {
    /// A problem of a line.
    pub(super) fn line(line: usize, reason: impl Into<String>) -> Self {
        Self {
            place: Place::Line(line),
            reason: sanitize(&reason.into(), LONGEST),
        }
    }

    /// A problem of the whole list.
    pub(super) fn whole(reason: impl Into<String>) -> Self {
        Self {
            place: Place::Whole,
            reason: sanitize(&reason.into(), LONGEST),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.place, self.reason)
    }
}

/// A list that is refused as a whole, and all that is wrong with it; shown a problem a line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct ManifestError {
    /// In the order of the list; never empty.
    pub problems: Vec<Problem>,
}

impl ManifestError {
    /// Refuses a list with anything wrong in it, or without pairs.
    pub(super) fn unless_none(is_empty: bool, problems: Vec<Problem>) -> Result<(), Self> {
        if !problems.is_empty() {
            return Err(Self { problems });
        }
        if is_empty {
            return Err(Problem::whole("the list holds no pairs").into());
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
        for (number, problem) in self.problems.iter().take(SHOWN).enumerate() {
            let separator = if number == 0 { "" } else { "\n" };
            write!(f, "{separator}{problem}")?;
        }
        match self.problems.len().saturating_sub(SHOWN) {
            0 => Ok(()),
            more => write!(f, "\nand {more} more"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ManifestError, Place, Problem};

    #[test]
    fn words_of_a_list_come_plain_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(5000)] {
            let place = Place::File(rude.as_str().into());
            for said in [
                Problem::line(1, rude.as_str()).to_string(),
                Problem::whole(rude.as_str()).to_string(),
                place.to_string(),
            ] {
                assert!(!said.contains(&rude), "{said:?}");
            }
        }
    }

    #[test]
    fn twenty_problems_are_shown_and_the_rest_counted() {
        let problems = (1..=23).map(|line| Problem::line(line, "no id")).collect();
        let text = ManifestError { problems }.to_string();
        assert_eq!(text.lines().count(), 21);
        assert!(text.starts_with("line 1: no id\nline 2: no id\n"));
        assert!(text.ends_with("line 20: no id\nand 3 more"));
    }
}
