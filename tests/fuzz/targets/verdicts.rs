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
    for parsed in [verdict_file::parse_csv(bytes), verdict_file::parse_jsonl(bytes)] {
        if let Err(error) = parsed {
            mocban_fuzz::one_sentence(&error.to_string());
        }
    }
    if let Ok(text) = std::str::from_utf8(bytes)
        && let Err(error) = truth_file::parse(Path::new("truth.jsonl"), text)
    {
        mocban_fuzz::one_sentence(&error.to_string());
    }
});
