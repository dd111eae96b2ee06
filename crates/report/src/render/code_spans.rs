//! Commands in sentences, which stand in backticks.

/// A part of a sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SentencePart<'a> {
    /// Words.
    Words(&'a str),
    /// A command, without its backticks.
    Command(&'a str),
}

/// Returns the parts of a sentence, in order.
pub(super) fn parts(sentence: &str) -> impl Iterator<Item = SentencePart<'_>> {
    let parts = sentence.split('`').enumerate();
    parts.map(|(i, text)| match i % 2 {
        0 => SentencePart::Words(text),
        _ => SentencePart::Command(text),
    })
}

#[cfg(test)]
mod tests {
    use super::SentencePart::{Command, Words};
    use super::parts;

    #[test]
    fn commands_are_between_backticks() {
        let found: Vec<_> = parts("Use `mocban run` now.").collect();
        assert_eq!(
            found,
            [Words("Use "), Command("mocban run"), Words(" now.")]
        );
    }
}
