//! Collapses warnings that differ only in names, numbers and paths: the first ones are shown, the others are counted.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Warnings of a kind that are shown in full.
const SHOWN_IN_FULL: u64 = 3;
/// A warning that comes this long after the last one of its kind is shown at once, because it may be news.
const OLD: Duration = Duration::from_secs(10);
/// Largest number of kinds. Warnings of further kinds are all shown.
const MAX_KINDS: usize = 1000;

/// The warnings of a command.
#[derive(Debug, Default)]
pub(crate) struct EqualWarnings {
    kinds: BTreeMap<String, WarningKind>,
    /// The kind of the last line that was shown.
    last: Option<String>,
}

/// The warnings of a kind.
#[derive(Debug)]
struct WarningKind {
    label: String,
    /// The first one.
    first: String,
    shown_at: Instant,
    /// Number shown in full.
    shown: u64,
    /// Number only counted since then.
    counted: u64,
}

impl WarningKind {
    /// Returns the line for what was only counted, and counts anew.
    fn take(&mut self, follows: bool) -> Option<String> {
        let (label, counted) = (&self.label, std::mem::take(&mut self.counted));
        (counted > 0).then(|| {
            if follows {
                format!("{label}{counted} more like this one; -v shows all")
            } else {
                format!("{label}{counted} more like this one: {}", self.first)
            }
        })
    }
}

impl EqualWarnings {
    /// Adds a warning. Returns the lines to show now.
    pub(crate) fn add(&mut self, label: &str, text: &str, now: Instant) -> Vec<String> {
        let name = kind_of(text);
        let mut lines = Vec::new();
        if let Some(kind) = self.kinds.get_mut(&name) {
            if now.duration_since(kind.shown_at) >= OLD {
                lines.extend(kind.take(false));
                kind.shown = 0;
            }
            if kind.shown == SHOWN_IN_FULL {
                kind.counted += 1;
                return lines;
            }
            (kind.shown, kind.shown_at) = (kind.shown + 1, now);
        } else if self.kinds.len() < MAX_KINDS {
            let kind = WarningKind {
                label: label.to_owned(),
                first: text.to_owned(),
                shown_at: now,
                shown: 1,
                counted: 0,
            };
            self.kinds.insert(name.clone(), kind);
        }
        self.last = Some(name);
        lines.push(format!("{label}{text}"));
        lines
    }

    /// Returns the lines for all that was only counted.
    pub(crate) fn take(&mut self) -> Vec<String> {
        let last = self.last.take();
        let kinds = self.kinds.iter_mut();
        let lines = kinds.filter_map(|(name, kind)| kind.take(last.as_ref() == Some(name)));
        lines.collect()
    }
}

/// Returns a text with `#` in place of what names one pair, file or number.
fn kind_of(text: &str) -> String {
    let is_name = |word: &str| {
        let inner = word.trim_end_matches([':', ',', ';', '.']);
        let marks = |c: char| c.is_ascii_digit() || !c.is_ascii() || "/\\._".contains(c);
        inner.contains(marks)
    };
    let words = text.split_whitespace();
    let words = words.map(|word| if is_name(word) { "#" } else { word });
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::{EqualWarnings, kind_of};

    fn lost(number: usize) -> String {
        format!("the export has no files of b04-{number:04}: in/{number}.png is not there")
    }

    #[test]
    fn a_hundred_equal_warnings_are_a_few_with_a_count() {
        let (mut warnings, now) = (EqualWarnings::default(), Instant::now());
        let mut add = |text: &str| warnings.add("warning: ", text, now);
        for number in 0..3 {
            assert_eq!(add(&lost(number)), [format!("warning: {}", lost(number))]);
        }
        for number in 3..100 {
            assert!(add(&lost(number)).is_empty());
        }
        assert_eq!(add("b1 has no page"), ["warning: b1 has no page"]);
        let count = format!("warning: 97 more like this one: {}", lost(0));
        assert_eq!(warnings.take(), [count]);
        assert!(warnings.take().is_empty());
    }

    #[test]
    fn a_count_that_follows_its_warnings_does_not_repeat_them() {
        let (mut warnings, now) = (EqualWarnings::default(), Instant::now());
        for number in 0..5 {
            warnings.add("", &lost(number), now);
        }
        assert_eq!(warnings.take(), ["2 more like this one; -v shows all"]);
    }

    #[test]
    fn a_warning_after_a_while_is_news() {
        let (mut warnings, now) = (EqualWarnings::default(), Instant::now());
        for number in 0..5 {
            warnings.add("", &lost(number), now);
        }
        let later = warnings.add("", &lost(5), now + Duration::from_secs(11));
        let count = format!("2 more like this one: {}", lost(0));
        assert_eq!(later, [count, lost(5)]);
        assert!(warnings.take().is_empty());
    }

    #[test]
    fn names_numbers_and_paths_do_not_make_a_kind() {
        let one = "chữ-1 is not drawn completely: d/in/a b.png is not there";
        let other = "b04-0117 is not drawn completely: d/x.png is not there";
        assert_ne!(kind_of(one), kind_of("b1 was drawn"));
        assert_eq!(kind_of(other), "# is not drawn completely: # is not there");
    }
}
