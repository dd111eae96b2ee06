//! Lists with long cells and many missing files: memory of an import and length of its messages.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::cli::{Call, empty};
use crate::crowd::watched;

/// Rows of each list.
const ROWS: usize = 400;

/// Imports a list. Returns the ended command, and its peak memory minus the size of the list, in MiB.
fn import(dir: &Path, name: &str, header: &str, row: impl Fn(usize) -> String) -> (Call, u64) {
    let mut text = String::new();
    for line in header
        .lines()
        .map(ToOwned::to_owned)
        .chain((0..ROWS).map(row))
    {
        writeln!(text, "{line}").expect("written to memory");
    }
    fs::write(dir.join(name), &text).expect("written");
    let (call, kib) = watched(
        dir,
        &["-C", "p", "--json", "import", name, "--allow-missing"],
    );
    (call, (kib >> 10).saturating_sub(text.len() as u64 >> 20))
}

#[test]
fn long_cells_need_little_memory_beyond_the_list() {
    let dir = empty();
    let cell = "c".repeat(60_000);
    let (call, csv) = import(dir.path(), "a.csv", "id,mesh,print,a,b,c", |row| {
        format!("a{row},a.csv,a.csv,{cell},{cell},{cell}")
    });
    assert_eq!(call.expect(0).json()["added"], ROWS);
    // In memory, a JSON number needs 16 times as many bytes as its text.
    let numbers = format!("[0{}]", ",0".repeat(30_000));
    let (call, jsonl) = import(dir.path(), "b.jsonl", "", |row| {
        format!(r#"{{"id":"b{row}","mesh":"a.csv","print":"a.csv","x":{numbers}}}"#)
    });
    assert_eq!(call.expect(0).json()["added"], ROWS);
    assert!(csv < 100 && jsonl < 100, "{csv} and {jsonl} MiB");
}

#[test]
fn missing_files_are_listed_up_to_a_limit_and_counted_beyond_it() {
    let dir = empty();
    let path = "d/".repeat(2000);
    let (call, _) = import(dir.path(), "a.csv", "id,mesh,print", |row| {
        format!("a{row},{path}a,{path}b\nb{row},{path}a,{path}b")
    });
    let call = call.expect(0);
    let found = call.json();
    assert_eq!(found["missing_files"].as_array().map(Vec::len), Some(1000));
    assert_eq!(found["more_missing_files"], 4 * ROWS - 1000);
    assert!(
        call.err.contains("1580 more files do not exist"),
        "{}",
        call.err
    );
    assert!(call.err.len() < 15_000, "{} bytes", call.err.len());
}

#[test]
fn a_list_of_invalid_rows_needs_little_memory() {
    let dir = empty();
    let rows = "a\n".repeat(5000);
    let (call, mib) = import(dir.path(), "a.csv", "id,mesh,print", |_| rows.clone());
    let call = call.expect(2);
    let text = call.out + &call.err;
    assert!(text.contains("and 1999980 more"), "{text}");
    assert!(mib < 100, "{mib} MiB");
}
