//! Who imports whom: the source is held to the table in `src/lib.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Crates that only these rooms may name.
const ONLY_IN: &[(&str, &[&str])] = &[
    ("sqlx", &["catalog"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("indicatif", &["cli"]),
    ("anyhow", &["cli"]),
    ("toml", &["cli", "config"]),
    ("pulp", &["simd"]),
    ("nalgebra", &["stages", "demo", "mesh", "raster", "report"]),
];

/// What the pure rooms may not touch: files, processes, clocks, async.
const PURE_ROOMS: &[&str] = &["domain", "raster", "mesh", "stages"];
const IMPURE: &[&str] = &[
    "tokio::",
    "std::fs",
    "std::process",
    "std::env",
    "SystemTime",
    "Instant::now",
];

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn rust_files(dir: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("a readable directory") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            rust_files(&path, into);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            into.push(path);
        }
    }
}

/// Names of test modules that have files of their own: `#[cfg(test)] mod NAME;`.
fn test_modules(files: &[PathBuf]) -> BTreeSet<String> {
    let declared = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).expect("readable source");
        let mut names = Vec::new();
        for after in text.split("#[cfg(test)]\n").skip(1) {
            let line = after.lines().next().unwrap_or_default();
            let name = line
                .rsplit(' ')
                .next()
                .and_then(|name| name.strip_suffix(';'));
            names.extend(name.map(str::to_owned));
        }
        names
    };
    files.iter().flat_map(declared).collect()
}

/// Every source file of a room that ships, with the room's name. `main.rs` and `lib.rs` are no rooms.
fn sources() -> Vec<(String, PathBuf, String)> {
    let mut files = Vec::new();
    rust_files(&src(), &mut files);
    files.sort();
    let tests = test_modules(&files);
    files.retain(|path| {
        let inside = path
            .strip_prefix(src())
            .expect("below src")
            .with_extension("");
        !inside
            .iter()
            .any(|part| tests.contains(&*part.to_string_lossy()))
    });
    files
        .into_iter()
        .filter_map(|path| {
            let inside = path.strip_prefix(src()).expect("below src");
            let first = inside.components().next().expect("a name");
            let room = first.as_os_str().to_string_lossy();
            let room = room.trim_end_matches(".rs").to_owned();
            let text = std::fs::read_to_string(&path).expect("readable source");
            (room != "main" && room != "lib").then_some((room, path, text))
        })
        .collect()
}

/// The code of a file: no comments, no unit tests. A test module in a file of its own is but a line here, and what
/// follows it still counts.
fn code(text: &str) -> String {
    let inline = text.match_indices("#[cfg(test)]\n").find(|(at, mark)| {
        let rest = &text[at + mark.len()..];
        let line = rest.lines().next().unwrap_or_default();
        line.contains("mod ") && line.ends_with('{')
    });
    let shipped = inline.map_or(text, |(at, _)| &text[..at]);
    shipped
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .collect::<Vec<_>>()
        .join("\n")
}

/// Names right after `prefix`, also those in braces: `crate::{a::B, c}` gives `a` and `c`.
fn names_after(code: &str, prefix: &str) -> BTreeSet<String> {
    code.match_indices(prefix)
        .filter(|(at, _)| !code[..*at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
        .flat_map(|(at, _)| first_names(&code[at + prefix.len()..]))
        .collect()
}

fn first_names(rest: &str) -> Vec<String> {
    let Some(list) = rest.strip_prefix('{') else {
        return vec![identifier(rest)];
    };
    let mut depth = 0;
    let mut names = vec![String::new()];
    for c in list.chars() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => names.push(String::new()),
            _ if depth == 0 => names.last_mut().expect("never empty").push(c),
            _ => {}
        }
    }
    names.iter().map(|name| identifier(name.trim())).collect()
}

fn identifier(text: &str) -> String {
    text.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

/// The table in the code map: room to what it may import.
fn table() -> BTreeMap<String, BTreeSet<String>> {
    let lib = std::fs::read_to_string(src().join("lib.rs")).expect("readable source");
    let rooms: Vec<(String, String)> = lib
        .lines()
        .filter_map(|line| line.strip_prefix("//! | `"))
        .map(|line| {
            let cells: Vec<&str> = line.split('|').collect();
            (identifier(line), cells[2].trim().to_owned())
        })
        .collect();
    let all: BTreeSet<String> = rooms.iter().map(|(room, _)| room.clone()).collect();
    rooms
        .into_iter()
        .map(|(room, cell)| {
            let named = cell.split(',').map(|name| name.trim().replace('`', ""));
            let allowed = match cell.as_str() {
                "all" => all.clone(),
                _ => named.filter(|name| !name.is_empty()).collect(),
            };
            (room, allowed)
        })
        .collect()
}

#[test]
fn every_room_is_in_the_code_map() {
    let rooms: BTreeSet<String> = sources().into_iter().map(|(room, ..)| room).collect();
    let mapped: BTreeSet<String> = table().into_keys().collect();
    assert_eq!(rooms, mapped);
}

#[test]
fn rooms_import_only_what_the_table_allows() {
    let table = table();
    let mut wrong = Vec::new();
    for (room, path, text) in sources() {
        let code = code(&text);
        let mut used = names_after(&code, "crate::");
        let is_room_root =
            path.parent() == Some(&src()) || path.ends_with(format!("{room}/mod.rs"));
        if is_room_root {
            used.extend(names_after(&code, "super::"));
        }
        for name in used {
            let foreign = table.contains_key(&name) && name != room;
            if foreign && !table[&room].contains(&name) {
                wrong.push(format!("{}: {room} may not import {name}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn crates_stay_in_their_rooms() {
    let mut wrong = Vec::new();
    for (room, path, text) in sources() {
        let code = code(&text);
        for (name, rooms) in ONLY_IN {
            let named = !names_after(&code, &format!("{name}::")).is_empty();
            if named && !rooms.contains(&room.as_str()) {
                wrong.push(format!("{}: {name} is not for {room}", path.display()));
            }
        }
        for thing in IMPURE {
            if PURE_ROOMS.contains(&room.as_str()) && code.contains(thing) {
                wrong.push(format!("{}: {thing} is not for {room}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_progress_draws() {
    for (_, path, text) in sources() {
        let draws = !names_after(&code(&text), "indicatif::").is_empty();
        assert!(
            !draws || path.ends_with("cli/progress.rs"),
            "{}",
            path.display()
        );
    }
}

#[test]
fn every_file_says_its_job_first() {
    let mut files = Vec::new();
    rust_files(&src(), &mut files);
    for room in ["tests", "benches"] {
        rust_files(&src().with_file_name(room), &mut files);
    }
    for path in files {
        let text = std::fs::read_to_string(&path).expect("readable source");
        assert!(text.starts_with("//! "), "{}", path.display());
    }
}

#[test]
fn names_are_found_in_paths_and_braces() {
    let code = "use crate::{domain::{Stage, PairName}, mesh};\nlet x = crate::raster::Grid; mycrate::no();";
    let found: Vec<String> = names_after(code, "crate::").into_iter().collect();
    assert_eq!(found, ["domain", "mesh", "raster"]);
}
