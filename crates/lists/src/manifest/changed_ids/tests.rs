//! Which ids look as if a spreadsheet program had changed them.

use std::path::Path;

use super::super::{read_block_json, read_blocks};
use super::ChangedIds;

/// Returns the warning about ids with their meshes, from line 2.
fn warning(rows: &[(&str, &str)]) -> Option<String> {
    let mut ids = ChangedIds::default();
    for (line, (id, mesh)) in (2..).zip(rows) {
        ids.add(line, id, [Path::new(mesh), Path::new("print.png")]);
    }
    ids.warning()
}

#[test]
fn several_dates_and_powers_among_other_ids_are_counted() {
    let found = warning(&[
        ("1-Nov", "m/a.stl"),
        ("0117", "m/b.stl"),
        ("Nov-01", "m/c.stl"),
        ("1.00E+05", "m/d.stl"),
        ("01-Thg11", "m/e.stl"),
    ]);
    assert_eq!(
        found.as_deref(),
        Some(
            "4 ids look like dates or powers of ten, such as \"1-Nov\" (lines 2, 4, 5): a spreadsheet program may have made \
             them of texts such as 1-11 and 1E5; give the column the format Text, correct its cells and save the list again, best \
             as XLSX"
        )
    );
    let numeric = [("2026-11-01", "a"), ("01.11.2026", "b"), ("x", "c")];
    assert!(warning(&numeric).is_some_and(|text| text.starts_with("2 ids")));
}

#[test]
fn shortened_long_numbers_need_no_other_sign() {
    for (rows, start) in [
        (
            &[("1.23457E+11", "a.stl"), ("1,23458E+11", "b.stl")][..],
            "2 ids look like ",
        ),
        (
            &[("1.23457E+11", "a.stl"), ("B", "b.stl")],
            "the id \"1.23457E+11\" on line 2 looks like ",
        ),
    ] {
        let found = warning(rows);
        let is_found = found.as_ref().is_some_and(|text| text.starts_with(start));
        assert!(is_found, "{found:?}");
    }
    assert_eq!(warning(&[("1.23457E+11", "1.23457E+11.stl")]), None);
    assert_eq!(warning(&[("1.5E+11", "a.stl"), ("B", "b.stl")]), None);
}

#[test]
fn a_file_shows_what_an_id_was_made_of() {
    for (id, mesh) in [
        ("1-Nov", "m/1-11.stl"),
        ("Nov-01", "m\\b04_11-01.stl"),
        ("1-Nov-26", "m/11.1.stl"),
        ("2026-11-01", "scans 2026/01-11.stl"),
        ("1.00E+05", "m/1E5.stl"),
        ("1.23E+08", "m/b_123456789.stl"),
        ("1E+05", "1e5/mesh.stl"),
    ] {
        let found = warning(&[(id, mesh)]);
        let start = format!("the id {id:?} on line 2 looks like a date or a power of ten: ");
        let is_found = found.as_ref().is_some_and(|text| text.starts_with(&start));
        assert!(is_found, "{id} {mesh}: {found:?}");
    }
}

#[test]
fn real_ids_are_left_alone() {
    // All are dates; the paths have them; one alone; ids of other forms; numbers of an inventory.
    for rows in [
        &[("2026-11-01", "a.stl"), ("2026-11-02", "b.stl")][..],
        &[
            ("1-Nov", "m/1-Nov.stl"),
            ("2-Nov", "2-nov/a.stl"),
            ("x", "x.stl"),
        ],
        &[("1-Nov", "a.stl"), ("0117", "b.stl"), ("0118", "c.stl")],
        &[("1E5", "1e5.stl"), ("2E5", "b.stl"), ("1A5", "c.stl")],
        &[("MAR-01", "a"), ("MAR-02", "b"), ("x", "c")],
        &[
            ("1-11", "a"),
            ("1999.1.2", "b"),
            ("32-Nov", "c"),
            ("2026-13-40", "d"),
        ],
        &[
            ("1999.12.05", "a"),
            ("1999.12.06", "b"),
            ("1999.13.40", "c"),
        ],
        &[
            ("2026-11-01", "2026-11-1.stl"),
            ("2026-11-02", "2.11.2026.stl"),
        ],
    ] {
        assert_eq!(warning(rows), None, "{rows:?}");
    }
}

#[test]
fn blocks_that_rows_share_count_once() {
    let mut blocks = ChangedIds::of_blocks();
    let mut add = |line, block| blocks.add(line, block, ["a.stl", "a.png"].map(Path::new));
    for line in 2..6 {
        add(line, "1.23457E+11");
        add(line, "B");
    }
    let found = blocks.warning().expect("a warning");
    let start = "the block \"1.23457E+11\" on line 2 looks like a date or a power of ten: ";
    assert!(found.starts_with(start), "{found}");
    let mut dates = ChangedIds::of_blocks();
    for (line, block) in [(2, "1-Nov"), (3, "1-Nov"), (4, "x")] {
        dates.add(line, block, ["a.stl", "a.png"].map(Path::new));
    }
    assert_eq!(dates.warning(), None, "one block may be so named");
    dates.add(5, "2-Nov", ["a.stl", "a.png"].map(Path::new));
    let found = dates.warning().expect("a warning");
    assert!(
        found.starts_with(
            "2 blocks look like dates or powers of ten, such as \"1-Nov\" (lines 2, 5): "
        ),
        "{found}"
    );
}

#[test]
fn blocks_are_looked_at_too() {
    let csv = "block,mesh,page\n1-Nov,1-11.stl,p.png\n";
    let read = read_blocks(csv.as_bytes()).expect("a list");
    let is_warned = |text: &String| text.contains("\"1-Nov\" on line 2");
    assert!(read.warnings.iter().any(is_warned), "{:?}", read.warnings);
    let json = "[{\"block\":\"1-11\",\"mesh\":\"1-11.stl\",\"page\":\"p.png\"}]";
    let read = read_block_json(json.as_bytes()).expect("a list");
    assert_eq!(read.warnings, [""; 0]);
}
