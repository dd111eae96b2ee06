//! Reads arbitrary bytes as a verdict file or a ground-truth file: gives rows, or an error that names the line.

#![no_main]
#![allow(
    dead_code,
    reason = "the parsers are compiled from the command line's files, which use everything"
)]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use mocban::{catalog, config, domain, manifest, report};

#[path = "../../../src/cli/time_text.rs"]
mod time_text;
#[path = "../../../src/cli/truth_file.rs"]
mod truth_file;
#[path = "../../../src/cli/verdict_file.rs"]
mod verdict_file;

fuzz_target!(|bytes: &[u8]| {
    for is_jsonl in [false, true] {
        let list = verdict_file::VerdictList::new(bytes.to_vec(), is_jsonl);
        if let Err(error) = list.and_then(|list| list.rows().try_for_each(|row| row.map(|_| ()))) {
            mocban_fuzz::one_sentence(&error.to_string());
        }
    }
    if let Ok(text) = std::str::from_utf8(bytes)
        && let Err(error) = truth_file::parse(Path::new("truth.jsonl"), text)
    {
        mocban_fuzz::one_sentence(&error.to_string());
    }
});
