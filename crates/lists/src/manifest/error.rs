//! Problems of a list of pairs, by line.

use std::fmt;
use std::path::Path;

use mocban_core::domain::sanitize;

/// Longest text of a problem, in characters.
const MAX_CHARS: usize = 600;

/// Maximum number of problems, and of the places of each, that are kept and shown; the others are counted.
const MAX_SHOWN: usize = 20;

/// Where a problem is.
#[derive(Debug, Clone, PartialEq, Eq)]
enum ProblemPlace {
    /// A line, counted from 1.
    Line(usize),
    File(String),
    List,
}

/// A problem of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Problem {
    /// The first places with this reason. Never empty.
    places: Vec<ProblemPlace>,
    /// Number of further places.
    more: usize,
    reason: String,
}

impl Problem {
    fn new(place: ProblemPlace, reason: &str) -> Self {
        Self {
            places: vec![place],
            more: 0,
            reason: sanitize(reason, MAX_CHARS),
        }
    }

    /// Adds the places of a problem with the same reason.
    fn merge(&mut self, other: Self) {
        self.more += other.more;
        for place in other.places {
            if self.places.len() < MAX_SHOWN {
                self.places.push(place);
            } else {
                self.more += 1;
            }
        }
    }

    /// Returns the lines if all places are lines.
    fn lines(&self) -> Option<Vec<usize>> {
        let places = self.places.iter();
        let lines = places.map(|place| match place {
            ProblemPlace::Line(line) => Some(*line),
            ProblemPlace::File(_) | ProblemPlace::List => None,
        });
        lines.collect()
    }
}

/// Joins three or more successive lines, such as `2-21`.
fn ranges(lines: &[usize]) -> Vec<String> {
    let runs = lines.chunk_by(|one, next| *next == one + 1);
    let texts = runs.flat_map(|run| match run {
        [first, _, .., last] => vec![format!("{first}-{last}")],
        few => few.iter().map(usize::to_string).collect(),
    });
    texts.collect()
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |place: &ProblemPlace| match place {
            ProblemPlace::Line(line) => Some(line.to_string()),
            ProblemPlace::File(path) => Some(path.clone()),
            ProblemPlace::List => None,
        };
        let names: Vec<String> = match self.lines() {
            Some(lines) => ranges(&lines),
            None => self.places.iter().filter_map(name).collect(),
        };
        match (self.places.as_slice(), self.more) {
            ([ProblemPlace::Line(_)], 0) => f.write_str("line ")?,
            ([ProblemPlace::Line(_), ..], _) => f.write_str("lines ")?,
            _ => {}
        }
        f.write_str(&names.join(", "))?;
        if self.more > 0 {
            write!(f, " and {} more", self.more)?;
        }
        if !names.is_empty() {
            f.write_str(": ")?;
        }
        f.write_str(&self.reason)
    }
}

/// Returns a problem of a line, counted from 1.
pub(super) fn at_line(line: usize, reason: &str) -> Problem {
    Problem::new(ProblemPlace::Line(line), reason)
}

/// Returns a problem of a file of a directory.
pub(super) fn at_file(path: &Path, reason: &str) -> Problem {
    let path = sanitize(&path.to_string_lossy(), 4096);
    Problem::new(ProblemPlace::File(path), reason)
}

/// Returns a problem of the whole list.
pub(super) fn of_list(reason: &str) -> Problem {
    Problem::new(ProblemPlace::List, reason)
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
    /// Adds a problem, or its place if the same reason was given before. Only counts it if there are many already.
    pub(super) fn add(&mut self, problem: Problem) {
        let mut problems = self.problems.iter_mut();
        if let Some(first) = problems.find(|first| first.reason == problem.reason) {
            first.merge(problem);
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
    fn a_reason_is_given_once_with_its_lines() {
        let mut error = ManifestError::default();
        for line in 2..=30 {
            error.add(at_line(line, "no unit"));
            error.add(at_line(line, if line < 5 { "no id" } else { "no mesh" }));
        }
        let text = error.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "lines 2-21 and 9 more: no unit");
        assert_eq!(lines[1], "lines 2-4: no id");
        assert_eq!(lines[2], "lines 5-24 and 6 more: no mesh");
        let mut error = ManifestError::from(at_file("a".as_ref(), "too long"));
        error.add(at_file("b".as_ref(), "too long"));
        assert_eq!(error.to_string(), "a, b: too long");
        assert_eq!(ManifestError::from(of_list("empty")).to_string(), "empty");
    }
}
