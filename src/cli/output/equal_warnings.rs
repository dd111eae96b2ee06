//! Collapses warnings that differ only in names, numbers and paths: the first is shown, the others are counted.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Further warnings that are shown in full if there are not more.
const SHOWN_IN_FULL: usize = 2;
/// A warning that comes this long after the last one of its kind is shown at once, because it may be news.
const OLD: Duration = Duration::from_secs(10);
/// Largest number of kinds. Warnings of further kinds are all shown.
const MAX_KINDS: usize = 1000;

/// The warnings of a command.
#[derive(Debug, Default)]
pub(crate) struct EqualWarnings {
    kinds: BTreeMap<String, HeldWarnings>,
    /// The kind of the last line that was shown.
    last: Option<String>,
}

/// Warnings of a kind that are not shown yet.
#[derive(Debug)]
struct HeldWarnings {
    label: String,
    /// The warning of this kind that was shown.
    first: String,
    shown_at: Instant,
    /// The first ones that are held back.
    held: Vec<String>,
    count: usize,
}

impl HeldWarnings {
    /// Returns the lines for what is held back, and holds nothing any more.
    fn take(&mut self, follows: bool) -> Vec<String> {
        let (held, count) = (
            std::mem::take(&mut self.held),
            std::mem::take(&mut self.count),
        );
        let label = &self.label;
        if count <= SHOWN_IN_FULL {
            return held.iter().map(|text| format!("{label}{text}")).collect();
        }
        vec![if follows {
            format!("{label}{count} more like this one; -v shows all")
        } else {
            format!("{label}{count} more like this one: {}", self.first)
        }]
    }
}

impl EqualWarnings {
    /// Adds a warning. Returns the lines to show now.
    pub(crate) fn add(&mut self, label: &str, text: &str, now: Instant) -> Vec<String> {
        let kind = kind_of(text);
        let is_room = self.kinds.len() < MAX_KINDS;
        let line = || format!("{label}{text}");
        match self.kinds.get_mut(&kind) {
            Some(warnings) if now.duration_since(warnings.shown_at) < OLD => {
                if warnings.held.len() < SHOWN_IN_FULL {
                    warnings.held.push(text.to_owned());
                }
                warnings.count += 1;
                Vec::new()
            }
            Some(warnings) => {
                let mut lines = warnings.take(false);
                lines.push(line());
                warnings.shown_at = now;
                lines
            }
            None => {
                if is_room {
                    let warnings = HeldWarnings {
                        label: label.to_owned(),
                        first: text.to_owned(),
                        shown_at: now,
                        held: Vec::new(),
                        count: 0,
                    };
                    self.kinds.insert(kind.clone(), warnings);
                }
                self.last = Some(kind);
                vec![line()]
            }
        }
    }

    /// Returns the lines for all that is held back.
    pub(crate) fn take(&mut self) -> Vec<String> {
        let last = self.last.take();
        let kinds = self.kinds.iter_mut();
        let lines = kinds.flat_map(|(kind, warnings)| warnings.take(last.as_ref() == Some(kind)));
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
    fn a_hundred_equal_warnings_are_one_with_a_count() {
        let (mut warnings, now) = (EqualWarnings::default(), Instant::now());
        let mut add = |text: &str| warnings.add("warning: ", text, now);
        assert_eq!(add(&lost(0)), [format!("warning: {}", lost(0))]);
        for number in 1..100 {
            assert!(add(&lost(number)).is_empty());
        }
        assert_eq!(add("b1 has no page"), ["warning: b1 has no page"]);
        let first = format!("warning: 99 more like this one: {}", lost(0));
        assert_eq!(warnings.take(), [first]);
        assert!(warnings.take().is_empty());
    }

    #[test]
    fn few_equal_warnings_are_all_shown() {
        let (mut warnings, now) = (EqualWarnings::default(), Instant::now());
        for number in 0..3 {
            warnings.add("", &lost(number), now);
        }
        assert_eq!(warnings.take(), [lost(1), lost(2)]);
        for number in 3..7 {
            warnings.add("", &lost(number), now);
        }
        assert_eq!(
            warnings.take(),
            [format!("4 more like this one: {}", lost(0))]
        );
    }

    #[test]
    fn a_warning_after_a_while_is_news() {
        let (mut warnings, now) = (EqualWarnings::default(), Instant::now());
        warnings.add("", &lost(0), now);
        warnings.add("", &lost(1), now + Duration::from_secs(5));
        let later = warnings.add("", &lost(2), now + Duration::from_secs(11));
        assert_eq!(later, [lost(1), lost(2)]);
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
