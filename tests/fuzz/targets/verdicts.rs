//! Reads arbitrary bytes as a verdict file or a ground-truth file: gives rows, or an error that names the line.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use mocban::project::{truth_file, verdict_file};

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
