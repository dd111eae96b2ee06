//! Reads the sources that tests compare with the tables of messages.

use std::path::{Path, PathBuf};

/// Ends of the names of source files that only tests use.
const TEST_FILES: [&str; 3] = ["tests.rs", "test_fixtures.rs", "test_helpers.rs"];

/// Returns the folder of all crates.
pub(super) fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Returns the files of a kind below a folder, or the file itself.
pub(super) fn files(path: PathBuf, extension: &str) -> Vec<PathBuf> {
    let (mut open, mut found) = (vec![path], Vec::new());
    while let Some(path) = open.pop() {
        if path.is_dir() {
            let entries = std::fs::read_dir(path).expect("a folder");
            open.extend(entries.flatten().map(|entry| entry.path()));
        } else if path.extension().is_some_and(|known| known == extension) {
            found.push(path);
        }
    }
    found
}

/// Returns the texts of source files below the folder of all crates without their tests. Each path is a file or a folder.
pub(super) fn code_of(paths: &[&str]) -> Vec<String> {
    let files = paths
        .iter()
        .flat_map(|path| files(crates().join(path), "rs"));
    let of_program = files.filter(|path| !is_of_tests(path));
    let code = of_program.map(|path| {
        let source = std::fs::read_to_string(path).expect("a source");
        let code = source.split("#[cfg(test)]\nmod ").next();
        code.unwrap_or_default().to_owned()
    });
    code.collect()
}

fn is_of_tests(path: &Path) -> bool {
    let is_in_folder = path
        .parent()
        .is_some_and(|folder| folder.ends_with("tests"));
    let name = path.to_string_lossy();
    is_in_folder || TEST_FILES.iter().any(|end| name.ends_with(end))
}

/// Returns sources in which strings that go on in the next line are joined.
pub(super) fn joined(sources: &str) -> String {
    let mut parts = sources.split("\\\n");
    let mut joined = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        joined += part.trim_start();
    }
    joined
}

/// Returns the texts in quotation marks of a source, without its comments.
pub(super) fn literals(source: &str) -> Vec<String> {
    let chars: Vec<char> = source.chars().collect();
    let (mut found, mut at) = (Vec::new(), 0);
    while at < chars.len() {
        let rest = &chars[at..];
        at += match rest {
            ['/', '/', ..] => rest.iter().take_while(|c| **c != '\n').count(),
            ['\'', '\\', _, ..] => {
                let inside = rest[3..].iter().take_while(|c| **c != '\'');
                4 + inside.count()
            }
            ['\'', _, '\'', ..] => 3,
            ['"', inside @ ..] => {
                let is_raw = at > 0 && matches!(chars[at - 1], 'r' | '#');
                let (text, length) = literal(inside, is_raw);
                found.push(text);
                1 + length
            }
            _ => 1,
        };
    }
    found
}

/// Returns the content of the literal after an opening quotation mark, and its length in the source.
fn literal(rest: &[char], is_raw: bool) -> (String, usize) {
    let (mut text, mut at) = (String::new(), 0);
    while let Some(c) = rest.get(at) {
        match (c, rest.get(at + 1)) {
            ('"', _) => break,
            // The text goes on in the next line, without the blanks at its beginning.
            ('\\', Some('\n')) if !is_raw => {
                let blanks = rest[at + 1..].iter().take_while(|c| c.is_whitespace());
                at += 1 + blanks.count();
            }
            ('\\', Some(escaped)) if !is_raw => {
                text.push(if *escaped == 'n' { '\n' } else { *escaped });
                at += 2;
            }
            _ => {
                text.push(*c);
                at += 1;
            }
        }
    }
    (text, at + 1)
}
