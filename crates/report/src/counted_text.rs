//! Sentences with counts of pairs, each with the pairs that it counts.

use std::fmt;
use std::ops::{Deref, Range};

use serde::{Serialize, Serializer};

use mocban_catalog::JointVerdict;
use mocban_core::domain::ThresholdMetric;
use mocban_results::number_format::format_count;

/// Pairs that a sentence counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CountedPairs {
    /// All pairs that are not retired.
    All,
    /// Pairs that finished all stages.
    Aligned,
    /// Aligned pairs whose result of the default metric has a low confidence.
    LowConfidence,
    /// Pairs that failed until somebody retries them.
    Failed,
    /// Pairs that wait, run or back off.
    Unfinished,
    /// Retired pairs.
    Retired,
    /// Pairs with a joint verdict on the result of a metric.
    Judged(ThresholdMetric, JointVerdict),
}

/// A part of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextPart<'t> {
    /// Words, or numbers of other things.
    Words(&'t str),
    /// A count with the pairs that it counts, or with several lists of pairs that all have this count.
    Count(&'t str, &'t [CountedPairs]),
}

/// Sentences with counts of pairs. Its JSON form is the text.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CountedText {
    text: String,
    /// Where the counts are, in order, with the pairs that they count.
    counts: Vec<(Range<usize>, Vec<CountedPairs>)>,
}

impl CountedText {
    /// Makes a text of a pattern with a count for each `{}`.
    pub(super) fn filled(pattern: &str, counts: &[(u64, CountedPairs)]) -> Self {
        let mut words = pattern.split("{}");
        let mut text = Self::from(words.next().unwrap_or_default());
        for ((count, pairs), words) in counts.iter().zip(words) {
            text.push_count(*count, vec![*pairs]);
            text.push(words);
        }
        text
    }

    /// Lists the counts that are not 0, each with the words behind it. Returns an empty text if all counts are 0.
    pub(super) fn listed<const N: usize>(
        counts: [(u64, CountedPairs, &str); N],
        separator: &str,
    ) -> Self {
        let mut list = Self::default();
        for (count, pairs, words) in counts.into_iter().filter(|(count, ..)| *count > 0) {
            if !list.is_empty() {
                list.push(separator);
            }
            list.push_count(count, vec![pairs]);
            list.push(words);
        }
        list
    }

    /// Adds words.
    pub(super) fn push(&mut self, words: &str) {
        self.text.push_str(words);
    }

    /// Adds a count. No pairs belong to it if it is 0 or if `pairs` is empty.
    pub(super) fn push_count(&mut self, count: u64, pairs: Vec<CountedPairs>) {
        let pairs = if count == 0 { Vec::new() } else { pairs };
        self.push_text_of_count(&format_count(count), pairs);
    }

    /// Adds a count with its noun, such as `1 pair` and `2,000 pairs`.
    pub(super) fn push_counted(&mut self, count: u64, noun: &str, pairs: Vec<CountedPairs>) {
        self.push_count(count, pairs);
        let plural = if count == 1 { "" } else { "s" };
        self.push(&format!(" {noun}{plural}"));
    }

    /// Adds the text of a count.
    pub(super) fn push_text_of_count(&mut self, count: &str, pairs: Vec<CountedPairs>) {
        let start = self.text.len();
        self.text.push_str(count);
        if !pairs.is_empty() {
            self.counts.push((start..self.text.len(), pairs));
        }
    }

    /// Adds another text.
    pub(super) fn append(&mut self, other: Self) {
        let start = self.text.len();
        self.text.push_str(&other.text);
        let moved = other.counts.into_iter();
        let moved = moved.map(|(place, pairs)| (place.start + start..place.end + start, pairs));
        self.counts.extend(moved);
    }

    /// Returns the parts of the text, in order.
    pub fn parts(&self) -> Vec<TextPart<'_>> {
        let (mut parts, mut end) = (Vec::new(), 0);
        for (place, pairs) in &self.counts {
            parts.push(TextPart::Words(&self.text[end..place.start]));
            parts.push(TextPart::Count(&self.text[place.clone()], pairs));
            end = place.end;
        }
        parts.push(TextPart::Words(&self.text[end..]));
        parts
    }
}

impl Deref for CountedText {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl fmt::Display for CountedText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Serialize for CountedText {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

impl From<String> for CountedText {
    fn from(text: String) -> Self {
        Self {
            text,
            counts: Vec::new(),
        }
    }
}

impl From<&str> for CountedText {
    fn from(text: &str) -> Self {
        Self::from(text.to_owned())
    }
}

impl PartialEq<&str> for CountedText {
    fn eq(&self, other: &&str) -> bool {
        self.text == *other
    }
}

impl PartialEq<String> for CountedText {
    fn eq(&self, other: &String) -> bool {
        self.text == *other
    }
}

#[cfg(test)]
mod tests {
    use super::{CountedPairs, CountedText, TextPart};

    #[test]
    fn counts_know_their_pairs_and_the_text_is_plain() {
        let counts = [(1_234, CountedPairs::Aligned), (0, CountedPairs::Failed)];
        let mut text = CountedText::filled("{} are aligned, {} failed; ", &counts);
        text.append(CountedText::filled(
            "{} in all",
            &[(1_240, CountedPairs::All)],
        ));
        text.push(".");
        assert_eq!(text, "1,234 are aligned, 0 failed; 1,240 in all.");
        assert_eq!(
            text.parts(),
            [
                TextPart::Words(""),
                TextPart::Count("1,234", &[CountedPairs::Aligned]),
                TextPart::Words(" are aligned, 0 failed; "),
                TextPart::Count("1,240", &[CountedPairs::All]),
                TextPart::Words(" in all."),
            ]
        );
        let json = serde_json::to_value(&text).expect("JSON");
        assert_eq!(json, "1,234 are aligned, 0 failed; 1,240 in all.");
    }

    #[test]
    fn counts_are_listed_unless_they_are_0() {
        let list = |failed, rest| {
            let counts = [
                (failed, CountedPairs::Failed, " failed"),
                (rest, CountedPairs::Unfinished, " not finished"),
            ];
            CountedText::listed(counts, " and ")
        };
        assert_eq!(list(2, 1_000), "2 failed and 1,000 not finished");
        assert_eq!(list(0, 1), "1 not finished");
        assert_eq!(list(0, 0), CountedText::default());
        let mut text = CountedText::default();
        for count in [1, 2] {
            text.push_counted(count, "pair", vec![CountedPairs::All]);
        }
        assert_eq!(text, "1 pair2 pairs");
    }
}
