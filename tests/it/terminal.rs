//! Names, paths and notes from files cannot control the terminal: hidden characters become visible in every output.

use std::path::Path;

use mocban::domain::is_hidden;
use serde_json::{Value, json};

use crate::cli::{Call, binary, call, empty, mocban};
use crate::resume::{project, run};

/// Text with codes that clear the screen and set the title, C1 codes, controls of writing direction and zero-width
/// characters. Its second line imitates program output.
const HOSTILE: &str =
    "a\u{1b}[2J\u{1b}]0;title\u{7}\u{9b}31m\u{202e}b\u{2066}\u{200b}c\u{8}\u{7f}\nnext: rm";
/// Han-Nôm and Vietnamese text, which is shown unchanged.
const PLAIN: &str = "\u{20022}\u{5b57} Tra\u{302}\u{300}n";

/// Removes the codes of colours, which the program and its log print with `--color always`.
fn without_colours(text: &str) -> String {
    let codes =
        ["0", "1", "2", "3", "31", "32", "33", "34", "35"].map(|code| format!("\u{1b}[{code}m"));
    let plain = |text: String, code: &String| text.replace(code, "");
    codes.iter().fold(text.to_owned(), plain)
}

/// Checks that all characters of an output are visible, and that no line is forged.
#[track_caller]
fn assert_visible(call: &Call) {
    for text in [&call.out, &call.err] {
        let text = without_colours(text).replace("\r\n", "\n");
        let hidden: Vec<char> = text
            .chars()
            .filter(|c| is_hidden(*c) && *c != '\n')
            .collect();
        assert!(hidden.is_empty(), "{hidden:?} in {text:?}");
        let forged = text.lines().find(|line| line.starts_with("next: rm"));
        assert!(forged.is_none(), "{text}");
    }
}

/// Creates a project in which every text is hostile, with a failed pair and a judged one.
fn hostile_project(dir: &Path) {
    project(dir, "p", "2");
    let dir = dir.join("p");
    let data = dir.join("data");
    // A line break within the name of a block is refused.
    let one_line = HOSTILE.replace('\n', " ");
    let block = format!("{PLAIN}{one_line}");
    let row = json!({
        "id": "x1", "mesh": format!("{HOSTILE}.obj"), "print": format!("{HOSTILE}.png"),
        "character": HOSTILE, "block": block, "place": HOSTILE,
    });
    std::fs::write(data.join("more.jsonl"), format!("{row}\n")).expect("written");
    for colour in ["never", "always"] {
        let import = mocban(
            &dir,
            &[
                "import",
                "data/more.jsonl",
                "--allow-missing",
                "--color",
                colour,
            ],
        )
        .expect(0);
        assert!(import.err.contains("does not exist"), "{}", import.err);
        assert_visible(&import);
    }
    let project = mocban::store::Project::open(&dir).expect("a project");
    assert_visible(
        &call(run(&project, &["--color", "always"]).args(["--progress", "plain"])).expect(3),
    );
    for color in ["never", "always"] {
        let set = [
            "verdict",
            "set",
            "upright-0001",
            "fail",
            "--reviewer",
            PLAIN,
            "--note",
            &one_line,
        ];
        assert_visible(&mocban(&dir, &[&set[..], &["--color", color]].concat()).expect(0));
    }
}

#[test]
fn hidden_characters_of_names_and_notes_are_visible_in_every_output() {
    let dir = empty();
    hostile_project(dir.path());
    let dir = dir.path().join("p");
    for args in [
        &["status", "--failed"][..],
        &["show", "x1"],
        &["show", "upright-0001"],
        &["run", "--dry-run", "--rerun", "all"],
        &["verdict", "log"],
        &["agreement"],
        &["check"],
        &["report"],
        &["report", "--format", "csv"],
        &["report", "--format", "markdown"],
        &["report", "--format", "latex"],
        &["report", "--format", "html"],
        &["report", "--compare", "no\u{1b}[2J\nnext: rm"],
        &["show", "no\u{1b}[2J\nnext: rm"],
        &["import", "no\u{1b}[2J\u{202e}\nnext: rm"],
        &["-C", "no\u{1b}[2J\u{202e}\nnext: rm", "status"],
        &["no\u{1b}[2J\u{202e}"],
        &["config", "show", "--set", "fit.no\u{1b}[2J\u{202e}=1"],
        &["retry", "--dry-run\u{202e}"],
        &["verdict", "undo"],
        &["-vv", "run", "--rerun", "failed"],
        &["-vv", "run", "--rerun", "failed", "--log-format", "json"],
    ] {
        for colour in ["never", "always"] {
            let output = call(
                binary()
                    .current_dir(&dir)
                    .args(args)
                    .args(["--color", colour]),
            );
            assert!(
                !(output.out.is_empty() && output.err.is_empty()),
                "{args:?}"
            );
            assert_visible(&output);
        }
    }
    let shown = mocban(&dir, &["show", "x1"]).expect(0).out;
    assert!(shown.contains(PLAIN), "{shown}");
    assert!(
        shown.contains(r"a\u{1b}[2J\u{1b}]0;title\u{7}\u{9b}31m\u{202e}b"),
        "{shown}"
    );
}

#[test]
fn json_has_the_same_values_without_hidden_characters() {
    let dir = empty();
    hostile_project(dir.path());
    let dir = dir.path().join("p");
    for args in [
        &["status", "--failed"][..],
        &["show", "x1"],
        &["show", "upright-0001"],
        &["report"],
        &["check"],
        &["verdict", "log"],
    ] {
        let output = mocban(&dir, &[args, &["--json"]].concat()).expect(0);
        assert_visible(&output);
        for value in serde_json::Deserializer::from_str(&output.out).into_iter::<Value>() {
            value.expect("JSON");
        }
    }
    let shown = mocban(&dir, &["show", "x1", "--json"]).expect(0).json();
    let text = shown.to_string();
    let character = Value::from(HOSTILE).to_string();
    assert!(text.contains(&character), "{text}");
    let refused = mocban(&dir, &["show", "no\u{202e}", "--json"]);
    assert_visible(&refused);
    let first = refused.err.lines().next().expect("a line");
    let message: Value = serde_json::from_str(first).expect("JSON");
    assert!(
        message["message"]
            .as_str()
            .expect("a text")
            .contains('\u{202e}'),
        "{first}"
    );
}

/// Text formats are the same in a file and on stdout, but for the comment with the checksum of a file.
#[test]
fn a_report_in_a_file_has_no_hidden_characters() {
    let dir = empty();
    hostile_project(dir.path());
    let dir = dir.path().join("p");
    for format in ["text", "csv", "markdown", "latex", "html", "json"] {
        let args = ["report", "--format", format];
        mocban(&dir, &[&args[..], &["-o", "file"]].concat()).expect(0);
        let text = std::fs::read_to_string(dir.join("file")).expect("a report");
        let printed = mocban(&dir, &args).expect(0).out;
        let is_shown = |line: &&str| !line.contains("checksum ");
        let [text, printed]: [Vec<&str>; 2] =
            [&text, &printed].map(|report| report.trim_end().lines().filter(is_shown).collect());
        assert_eq!(text, printed, "{format}");
    }
}
