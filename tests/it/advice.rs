//! Advice in messages: each option that a command in backticks has is one of that command.

use std::collections::BTreeMap;

use crate::source_text::{code_spans, package_dir, source_files};

/// Commands with commands of their own, whose options the reference does not list.
const WITH_COMMANDS: [&str; 3] = ["db", "verdict", "config"];

/// Returns the options of a command line that a command does not have. `known` has the text on each command, and `global` that
/// on all of them. Nothing is returned for a text that is no command line.
fn unknown_options<'c>(
    line: &'c str,
    known: &BTreeMap<&str, &str>,
    global: &str,
) -> Option<Vec<&'c str>> {
    let mut words = line.trim_start_matches("mocban ").split(' ');
    let text = known.get(words.next()?)?;
    let options = words.filter(|word| word.len() > 2 && word.starts_with("--"));
    let is_unknown = |option: &&str| !text.contains(*option) && !global.contains(*option);
    Some(options.filter(is_unknown).collect())
}

#[test]
fn options_in_advice_belong_to_their_command() {
    let reference = package_dir().join("docs/reference/commands.md");
    let reference = std::fs::read_to_string(reference).expect("the reference");
    let mut sections = reference.split("\n## ");
    let global = sections.next().expect("the global options");
    let known = sections.filter_map(|section| section.split_once('\n'));
    let mut known: BTreeMap<&str, &str> = known.collect();
    known.retain(|command, _| !WITH_COMMANDS.contains(command));
    let mut count = 0;
    for file in source_files() {
        let lines = file.text.lines().map(str::trim_start);
        for line in lines.filter(|line| !line.starts_with("//")) {
            for quoted in code_spans(line) {
                let unknown = unknown_options(quoted, &known, global);
                count += usize::from(unknown.is_some());
                let unknown = unknown.unwrap_or_default();
                assert!(unknown.is_empty(), "{}: `{quoted}`: {unknown:?}", file.name);
            }
        }
    }
    assert!(count > 40, "{count}");
    let unknown = unknown_options("mocban export --only all --name x", &known, global);
    assert_eq!(unknown, Some(vec!["--name"]));
}
