//! Sentences of sources and snapshots of other crates: every one that a page shows has a Vietnamese text.

use super::super::source_texts::{code_of, crates, files, literals};
use super::fragments::{FRAGMENTS, SENTENCES};
use super::vietnamese;

/// Sources whose sentences reach pages of imports, blocks and reviews, below `crates`.
const SOURCES: [&str; 28] = [
    "lists/src/columns.rs",
    "lists/src/labels",
    "lists/src/manifest",
    "lists/src/quotes.rs",
    "lists/src/workbook",
    "lists/src/xml.rs",
    "core/src/domain/pair_name.rs",
    "catalog/src/records/verdict_rules.rs",
    "export/src/block_view/block_correction.rs",
    "export/src/block_view/block_error.rs",
    "export/src/block_view/box_edits.rs",
    "pages/src/local_server/work_thread.rs",
    "pages/src/review/answer.rs",
    "pages/src/review/api_error.rs",
    "pages/src/review/image_error.rs",
    "pages/src/review/planted_faults.rs",
    "pages/src/review/review_pages.rs",
    "pages/src/review/unstored.rs",
    "pages/src/view/block_labels.rs",
    "pages/src/view/block_points.rs",
    "pages/src/view/boxes_page.rs",
    "pages/src/view/correction_page.rs",
    "project/src/block_files.rs",
    "project/src/import_blocks.rs",
    "project/src/manifest_file.rs",
    "project/src/missing_files.rs",
    "project/src/renamed_columns.rs",
    "store/src/lock.rs",
];

/// English words that no Vietnamese sentence has.
const ENGLISH: [&str; 32] = [
    "an", "and", "are", "be", "box", "boxes", "column", "files", "has", "have", "is", "it", "its",
    "line", "lines", "not", "of", "or", "row", "rows", "that", "the", "their", "them", "this",
    "to", "was", "were", "will", "with", "would", "you",
];

/// Returns the English words of a text outside quotation marks.
fn english_words(text: &str) -> Vec<&str> {
    let unquoted = text.split('"').step_by(2);
    let words = unquoted.flat_map(str::split_whitespace);
    let words = words.map(|word| word.trim_matches(|c: char| c.is_ascii_punctuation()));
    words.filter(|word| ENGLISH.contains(word)).collect()
}

/// Returns what stays in English of a sentence: all of it if it is not known.
fn untranslated(sentence: &str) -> Option<String> {
    match vietnamese(sentence) {
        None => Some(sentence.to_owned()),
        Some(text) => (!english_words(&text).is_empty()).then_some(text),
    }
}

/// Returns a literal with a number in place of each part that varies, and without clauses that name commands or options.
/// What follows a colon at the end of a line is on lines of its own.
fn sample(literal: &str) -> String {
    let (mut text, mut rest) = (String::new(), literal);
    while let Some((before, after)) = rest.split_once('{') {
        text += before;
        if !before.ends_with(':') {
            text.push('7');
        }
        rest = after.split_once('}').map_or("", |(_, behind)| behind);
    }
    text += rest;
    let clauses = text.trim_start_matches("; ").split("; ");
    let shown = clauses.filter(|clause| !clause.contains('`') && !clause.contains("--"));
    shown.collect::<Vec<_>>().join("; ")
}

/// Returns whether a text has words of a sentence.
fn is_sentence(text: &str) -> bool {
    let is_word = |word: &&str| word.len() > 1 && word.bytes().all(|b| b.is_ascii_lowercase());
    let words = text.split(' ');
    let words = words.map(|word| word.trim_matches(|c: char| c.is_ascii_punctuation()));
    words.filter(is_word).count() > 1
}

/// Returns the sentences of the sources, and the literals that they are made of.
fn sentences() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for code in code_of(&SOURCES) {
        for literal in literals(&code) {
            let text = sample(&literal);
            if is_sentence(&text) {
                found.push((text, literal));
            }
        }
    }
    found
}

#[test]
fn every_sentence_of_a_list_a_label_and_a_block_is_translated() {
    let found = sentences();
    assert!(found.len() > 200, "{}", found.len());
    for (text, literal) in &found {
        // Reasons of labels are parts of a sentence that ends like this.
        let ended = format!("{text}; correct or remove it");
        let is_known = untranslated(text).is_none() || untranslated(&ended).is_none();
        let is_fragment = FRAGMENTS.contains(&literal.as_str());
        assert!(
            is_known || is_fragment,
            "{literal:?} is not in the tables of messages: {:?}",
            vietnamese(text)
        );
    }
    for fragment in FRAGMENTS {
        let mut literals = found.iter().map(|(_, literal)| literal);
        assert!(literals.any(|literal| literal == fragment), "{fragment:?}");
    }
}

#[test]
fn sentences_that_are_made_of_fragments_are_translated() {
    for sentence in SENTENCES {
        assert_eq!(untranslated(sentence), None, "{sentence:?}");
    }
}

#[test]
fn refusals_in_the_snapshots_of_lists_are_translated() {
    let mut count = 0;
    for path in files(crates().join("lists/src"), "snap") {
        let snapshot = std::fs::read_to_string(path).expect("a snapshot");
        // Messages are indented below the names of their cases.
        let messages = snapshot
            .lines()
            .filter_map(|line| line.strip_prefix("    "));
        for message in messages {
            assert_eq!(untranslated(message), None, "{message:?}");
            count += 1;
        }
    }
    assert!(count > 50, "{count}");
}

#[test]
fn faults_of_json_are_translated() {
    for text in [
        "{\"a\": }",
        "{\"a\" 1}",
        "{\"a\": 1 2}",
        "[1 2]",
        "[1,]",
        "{1: 2}",
        "[1] x",
        "[tru]",
        "[01]",
        "[1e999]",
        "[\"\\x\"]",
        "[\"\n\"]",
    ] {
        let fault = serde_json::from_str::<serde_json::Value>(text).expect_err("a fault");
        for message in [fault.to_string(), fault.to_string().replace('`', "")] {
            let sentence = format!("b.json: the JSON is damaged: {message}; save the labels again");
            assert_eq!(untranslated(&sentence), None, "{text:?}");
            let translated = vietnamese(&sentence).unwrap_or_default();
            assert!(!translated.contains("at line"), "{translated:?}");
        }
    }
}
