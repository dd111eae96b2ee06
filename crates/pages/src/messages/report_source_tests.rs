//! Checks that the program still says every sentence of the report that is translated.

use super::report_answers::REPORT_ANSWERS;
use super::report_captions::REPORT_CAPTIONS;
use super::report_table::{REPORT_COUNTED, REPORT_FRAME, REPORT_TERMS};
use super::source_texts::{code_of, joined};

/// Files and folders of all crates that have the words of the report.
const SOURCES: [&str; 6] = [
    "report/src",
    "results/src",
    "core/src/domain",
    "catalog/src/records/model.rs",
    "catalog/src/records/set_apart.rs",
    "export/src/gallery_selection.rs",
];
/// Most phrases of the sources that are joined to a part of a sentence.
const MAX_PHRASES: usize = 2;
/// Names of tests that are one phrase more in a sentence.
const NAMES: [&str; 2] = ["mcnemar exact two-sided", "percentile bootstrap"];

/// Returns the sources without comments and tests. Strings that go on in the next line are joined.
fn sources() -> String {
    let code = code_of(&SOURCES).join("\n");
    let lines = code.lines();
    let lines: Vec<&str> = lines
        .filter(|line| !line.trim_start().starts_with("//"))
        .collect();
    joined(&lines.join("\n")).replace("\\u{b0}", "°")
}

/// Returns the words of a text in lower case between single blanks, without punctuation and what stands in braces.
fn words(text: &str) -> String {
    let mut parts = text.split('{');
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        plain.push(' ');
        let inside = part.find(['}', '"', '\n']);
        let after = inside.and_then(|end| part[end..].strip_prefix('}'));
        plain += after.unwrap_or(part);
    }
    let is_of_word = |c: char| c.is_alphanumeric() || "%°'-".contains(c);
    let plain = plain.to_lowercase().replace(|c: char| !is_of_word(c), " ");
    let words: Vec<&str> = plain.split_whitespace().collect();
    words.join(" ")
}

/// Returns the smallest number of phrases that are joined to a text if each is as long as possible. `None` if the program has
/// not even one of its words.
fn phrases(program: &str, text: &str) -> Option<usize> {
    let words: Vec<&str> = text.split(' ').collect();
    let (mut start, mut count) = (0, 0);
    while start < words.len() {
        let mut ends = (start + 1..=words.len()).rev();
        let is_said =
            |end: &usize| program.contains(&format!(" {} ", words[start..*end].join(" ")));
        start = ends.find(is_said)?;
        count += 1;
    }
    Some(count)
}

/// Returns whether the program may say a sentence with `{}` for each part that varies.
fn is_said(program: &str, sentence: &str) -> bool {
    let mut parts = sentence.split("{}").map(words);
    parts.all(|part| {
        let has_name = NAMES.iter().any(|name| part.contains(name));
        let most = MAX_PHRASES + usize::from(has_name);
        part.is_empty() || phrases(program, &part).is_some_and(|count| count <= most)
    })
}

#[test]
fn the_report_still_says_what_is_translated() {
    let sources = sources();
    let program = format!(" {} ", words(&sources));
    let sentences = [
        REPORT_FRAME,
        REPORT_ANSWERS,
        REPORT_CAPTIONS,
        REPORT_COUNTED,
    ];
    for (english, _) in sentences.into_iter().flatten() {
        assert!(is_said(&program, english), "{english:?}");
    }
    for (term, _) in REPORT_TERMS {
        assert!(sources.contains(&format!("{term:?}")), "{term:?}");
    }
    // Their words and some of their phrases are said, but not the sentences.
    for other in [
        "Reviewers skipped every result of this block.",
        "No pair was judged by two reviewers.",
    ] {
        assert!(!is_said(&program, other), "{other}");
    }
}
