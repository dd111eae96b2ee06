//! The documentation: links and pictures exist, the book lists every page, and the commands of the tutorials work.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use mocban::documentation::anchor;
use mocban::store::Project;
use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};
use serde_json::{Value, json};

use crate::cli::{binary, mocban, shell};
use crate::page::{Page, answer};
use crate::review_page::check_answers;
use crate::source_text::{files_with_extension, package_dir};

/// What other pages need to know of a page.
#[derive(Debug, Default)]
struct MarkdownPage {
    /// Targets of links and pictures.
    links: Vec<String>,
    /// Names by which other pages link to headings.
    anchors: BTreeSet<String>,
    /// Lines of the code blocks marked `sh`.
    commands: Vec<String>,
}

impl MarkdownPage {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).expect("UTF-8");
        let mut page = Self::default();
        let (mut heading, mut is_shell) = (None, false);
        for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    page.links.push(dest_url.into_string());
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => {
                    page.anchors
                        .insert(anchor(&heading.take().unwrap_or_default()));
                }
                Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(kind))) => {
                    is_shell = &*kind == "sh";
                }
                Event::End(TagEnd::CodeBlock) => is_shell = false,
                Event::Text(text) if is_shell => {
                    page.commands.extend(text.lines().map(str::to_owned));
                }
                Event::Text(text) | Event::Code(text) => {
                    if let Some(heading) = &mut heading {
                        heading.push_str(&text);
                    }
                }
                _ => {}
            }
        }
        page
    }
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let root = package_dir();
    let mut files = files_with_extension(&root.join("docs"), "md");
    let at_top = [
        "README.md",
        "CONTRIBUTING.md",
        "CHANGELOG.md",
        "SECURITY.md",
    ];
    files.extend(at_top.map(|name| root.join(name)));
    let all: BTreeMap<PathBuf, MarkdownPage> = files
        .iter()
        .map(|path| {
            (
                path.canonicalize().expect("a path"),
                MarkdownPage::read(path),
            )
        })
        .collect();
    let (mut wrong, mut count) = (Vec::new(), 0);
    for (path, page) in &all {
        let folder = path.parent().expect("a folder");
        let is_in_book = path.starts_with(root.join("docs"));
        for link in page.links.iter().filter(|link| !link.contains("://")) {
            count += 1;
            if is_in_book && link.starts_with("../../") {
                wrong.push(format!("{}: {link} is not in the book", path.display()));
            }
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() {
                path.clone()
            } else {
                folder.join(file)
            };
            let found = target.canonicalize().ok();
            let of_page = found.as_ref().and_then(|found| all.get(found));
            let has_anchor =
                anchor.is_empty() || of_page.is_some_and(|page| page.anchors.contains(anchor));
            if found.is_none() || !has_anchor {
                wrong.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 60, "{count} links");
}

#[test]
fn the_book_lists_every_page() {
    let docs = package_dir().join("docs");
    let summary = MarkdownPage::read(&docs.join("SUMMARY.md"));
    let listed: BTreeSet<PathBuf> = summary.links.iter().map(|link| docs.join(link)).collect();
    let mut all: BTreeSet<PathBuf> = files_with_extension(&docs, "md").into_iter().collect();
    all.remove(&docs.join("SUMMARY.md"));
    assert_eq!(listed, all);
}

#[test]
fn both_tutorials_have_the_same_commands() {
    let commands = |name: &str| MarkdownPage::read(&package_dir().join(name)).commands;
    let english = commands("docs/tutorial/first-hour.md");
    let mut vietnamese = commands("docs/vi/gio-dau-tien.md");
    for command in &mut vietnamese {
        *command = command.replace(" --lang vi", "");
    }
    assert_eq!(english, vietnamese);
    assert!(english.len() > 10, "{english:?}");
}

/// Compares a page with what the program prints, or writes the page if `MOCBAN_UPDATE_DOCS` is set.
fn check_generated(name: &str, text: &str) {
    let path = package_dir().join("docs/reference").join(name);
    if std::env::var_os("MOCBAN_UPDATE_DOCS").is_some() {
        fs::write(&path, text).expect("written");
    }
    let found = fs::read_to_string(&path).expect("UTF-8");
    assert!(
        found == text,
        "{} is out of date; run: MOCBAN_UPDATE_DOCS=1 cargo test --test it docs::",
        path.display()
    );
}

#[test]
fn the_reference_of_settings_is_current() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let settings = mocban(dir.path(), &["config", "show", "--explain"])
        .expect(0)
        .out;
    check_generated(
        "settings.md",
        &format!(
            "# Settings\n\nThe defaults, as `mocban config show --explain` prints them. Values that differ belong in `mocban.toml` \
             in the\nproject, in an environment variable such as `MOCBAN_RUN_WORKERS`, or in \
             `--set run.workers=4`.\n\n```toml\n{}\n```\n",
            settings.trim_end()
        ),
    );
}

#[test]
fn the_reference_of_commands_is_current() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let help = |args: &[&str]| {
        let text = mocban(dir.path(), args).expect(0).out;
        format!("```text\n{}\n```\n", text.trim_end())
    };
    let overview = help(&["--help"]);
    let names = overview
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1);
    let names = names.take_while(|line| !line.is_empty());
    // Continued lines are indented further.
    let names = names.filter(|line| !line.starts_with("   "));
    let names = names.filter_map(|line| line.split_whitespace().next());
    let mut text = format!(
        "# Commands\n\nWhat `mocban --help` and `mocban COMMAND --help` print.\n\n{overview}"
    );
    for name in names.filter(|name| *name != "help") {
        text.extend(["\n## ", name, "\n\n", &help(&[name, "--help"])]);
    }
    assert!(text.matches("\n## ").count() > 15, "{text}");
    check_generated("commands.md", &text);
}

/// Returns the folder of the program.
fn binary_folder() -> PathBuf {
    let program = PathBuf::from(binary().get_program());
    program.parent().expect("a folder").to_owned()
}

/// Copies the demo pairs to the folders of the tutorial, under Vietnamese names.
fn own_files(dir: &Path) {
    for (from, to) in [("meshes", "quét"), ("prints", "in")] {
        fs::create_dir(dir.join(to)).expect("created");
        for entry in fs::read_dir(dir.join("mocban-demo/data").join(from)).expect("a folder") {
            let file = entry.expect("an entry").path();
            let stem = file.file_stem().expect("a name").to_string_lossy();
            let number = stem.trim_start_matches("upright-00");
            let extension = file.extension().expect("an extension").to_string_lossy();
            let name = format!("chữ số {number}.{extension}");
            fs::copy(&file, dir.join(to).join(name)).expect("copied");
        }
    }
}

/// Judges all results of a review page: the first two fail, the others pass. Attention checks pass too.
fn judge(page: &Page, project: &Project) {
    let mut failed = 0;
    for (number, item) in page.queue().iter().enumerate() {
        let checks = check_answers(project).len();
        let event = format!("e{number}");
        let post = |path: &str, body: &Value| {
            let reply = page.post(path, body).expect("a reply");
            let text = String::from_utf8_lossy(&reply.body);
            assert_eq!(reply.status, 200, "{text}");
        };
        post("/api/answer", &answer(&event, item, "pass"));
        if failed < 2 && check_answers(project).len() == checks {
            post("/api/undo", &json!({ "event": event }));
            let mut second = answer(&format!("{event}-again"), item, "fail");
            second["reason"] = json!("angle");
            post("/api/answer", &second);
            failed += 1;
        }
    }
}

/// Checks the numbers of the report about a project whose 20 results were judged by [`judge`].
fn check_report(project: &Project) {
    let report = mocban(project.dir(), &["--json", "report"]).expect(0).out;
    let report: Value = serde_json::from_str(&report).expect("JSON");
    let rows = report["rows"].as_array().expect("rows");
    let row = rows.iter().find(|row| row["metric"] == "ensemble");
    let row = row.expect("the judged metric");
    let counts = ["n", "judged", "passed", "failed", "unsure", "stale"].map(|name| &row[name]);
    assert_eq!(counts, [20, 20, 18, 2, 0, 0], "{row}");
    assert_eq!(row["acc"], 0.9);
    // The Wilson interval of 18 of 20.
    for (end, expected) in [0.698_97, 0.972_13].into_iter().enumerate() {
        let found = row["acc_ci95"][end].as_f64().expect("a number");
        assert!((found - expected).abs() < 1e-4, "{row}");
    }
    assert_eq!(report["provenance"]["reviewers"], 1);
    assert!(check_answers(project).len() >= 5);
}

#[test]
fn the_commands_of_the_tutorial_work_in_order() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let commands = MarkdownPage::read(&package_dir().join("docs/tutorial/first-hour.md")).commands;
    let project = Project::at(&dir.path().join("khối-4"));
    let path = [binary_folder(), "/usr/bin".into(), "/bin".into()];
    let path = std::env::join_paths(path).expect("a search path");
    for line in &commands {
        let line = match line.as_str() {
            // The demo has just the results to judge, and other files of a reader are copies of its files.
            "mocban demo" => "mocban demo --pairs 20",
            other => other,
        };
        if line.contains(" import ") {
            own_files(dir.path());
        }
        if [" view ", " review "]
            .iter()
            .any(|name| line.contains(name))
        {
            // A server runs until a person presses Ctrl-C.
            let words = line.split(' ').skip(1).chain(["--no-open", "--json"]);
            let mut page = Page::of(binary().current_dir(dir.path()).args(words));
            if line.contains(" review ") {
                page = page.with_session();
                judge(&page, &project);
            }
            rustix::process::kill_process(page.pid(), rustix::process::Signal::INT).expect("sent");
            assert_eq!(page.exit_code(), Some(0), "{line}");
            continue;
        }
        let output = shell(line)
            .current_dir(dir.path())
            .env("PATH", &path)
            .output()
            .expect("a shell");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{line}: {text}");
    }
    for file in [
        "mocban-demo/sheet.png",
        "khối-4/sheet.png",
        "báo-cáo.html",
        "bảng/README.md",
    ] {
        assert!(dir.path().join(file).is_file(), "{file}");
    }
    check_report(&project);
}
