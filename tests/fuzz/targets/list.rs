//! Reads arbitrary bytes as a manifest in CSV and in JSON Lines: gives valid rows, or problems of one line each.

#![no_main]

use std::collections::BTreeSet;

use libfuzzer_sys::fuzz_target;
use mocban::manifest::{ManifestError, ManifestRow, parse_csv, parse_jsonl};

fuzz_target!(|bytes: &[u8]| {
    check(parse_csv(bytes));
    check(parse_jsonl(bytes));
});

fn check(parsed: Result<Vec<ManifestRow>, ManifestError>) {
    match parsed {
        Ok(rows) => {
            let ids: BTreeSet<_> = rows.iter().map(|row| row.name.as_str()).collect();
            assert_eq!(ids.len(), rows.len());
            assert!(rows.windows(2).all(|two| two[0].line <= two[1].line));
        }
        Err(refused) => {
            assert!(!refused.problems.is_empty());
            for problem in &refused.problems {
                mocban_fuzz::one_sentence(problem);
            }
        }
    }
}
