//! The guide of the app: the same in English and Vietnamese, and a page or a reason for every command of the program.

use std::collections::BTreeSet;

use crate::source_text::{code_spans, package_dir, source_files};

/// The headings of the guide in English and Vietnamese, in their order.
const HEADINGS: [[&str; 2]; 11] = [
    ["Work in the browser", "Làm việc trong trình duyệt"],
    ["Start it with a double click", "Mở bằng cách bấm đúp"],
    ["Import", "Nhập dữ liệu"],
    ["Lists of pairs", "Danh sách các cặp"],
    ["Act on several pairs", "Thao tác với nhiều cặp"],
    ["Pictures of a pair", "Hình của một cặp"],
    ["Back up a project", "Sao lưu dự án"],
    ["Restore a backup", "Khôi phục bản sao lưu"],
    WITHOUT_PAGE,
    ["Who can open it", "Ai mở được"],
    ["Invite a reviewer", "Mời người đánh giá"],
];
/// The heading of the section about commands without a page.
const WITHOUT_PAGE: [&str; 2] = ["What has no page", "Việc gì không có trang"];
/// The button of the page that a link of an invitation opens, which shows both languages at once.
const BUTTON_OF_GUESTS: [&str; 2] = ["Begin", "Bắt đầu"];

/// Returns a file of the documentation.
fn read(name: &str) -> String {
    let path = package_dir().join("docs").join(name);
    std::fs::read_to_string(path).expect("UTF-8")
}

/// Returns the guide in English and Vietnamese.
fn guides() -> [String; 2] {
    ["guides/app.md", "vi/ung-dung.md"].map(read)
}

/// Returns the headings of a page, each with the text below it.
fn sections(page: &str) -> Vec<(&str, &str)> {
    let parts = page.split("\n## ");
    let parts = parts.map(|part| part.split_once('\n').unwrap_or((part, "")));
    parts
        .map(|(heading, body)| (heading.trim_start_matches("# "), body))
        .collect()
}

/// Returns the options that a text names.
fn named_options(text: &str) -> BTreeSet<&str> {
    let words = code_spans(text).into_iter().filter_map(|span| {
        let first = span.split_whitespace().next()?;
        first.starts_with("--").then_some(first)
    });
    words.collect()
}

/// Returns the files of the pictures in a text.
fn pictures(text: &str) -> Vec<&str> {
    let parts = text.split("![").skip(1);
    let files = parts.filter_map(|part| part.split_once("](")?.1.split(')').next());
    files.collect()
}

/// Returns the commands of each row of the table of pages.
fn commands_of_pages(guide: &str) -> Vec<Vec<&str>> {
    let rows = guide.lines().filter(|line| line.starts_with("| "));
    let cells = rows.filter_map(|row| row.trim_end_matches(" |").rsplit(" | ").next());
    // The first row has the titles.
    cells.skip(1).map(code_spans).collect()
}

/// Returns the commands that a help text lists.
fn listed(help: &str) -> Vec<&str> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let lines = lines.take_while(|line| !line.is_empty());
    // Continued lines are indented further.
    let lines = lines.filter(|line| !line.starts_with("   "));
    let names = lines.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").collect()
}

/// Returns all commands of the program, and of those with further commands each of these. Another test keeps their reference equal to
/// what `--help` prints.
fn all_commands(reference: &str) -> Vec<String> {
    let sections = sections(reference);
    let help_of = |name: &str| {
        let found = sections.iter().find(|(heading, _)| *heading == name);
        found.expect("a section of the reference").1
    };
    let names = listed(help_of("Commands"));
    let commands = names.into_iter().flat_map(|name| {
        let further = listed(help_of(name));
        if further.is_empty() {
            vec![name.to_owned()]
        } else {
            let further = further.into_iter();
            further.map(|below| format!("{name} {below}")).collect()
        }
    });
    commands.collect()
}

#[test]
fn every_command_has_its_page_or_a_reason() {
    let reference = read("reference/commands.md");
    let commands = all_commands(&reference);
    assert!(commands.len() > 25, "{commands:?}");
    let does = |span: &str, command: &str| {
        let rest = span.strip_prefix(command);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
    };
    for (guide, title) in guides().iter().zip(WITHOUT_PAGE) {
        let sections = sections(guide);
        let reasons = sections.iter().find(|(heading, _)| *heading == title);
        let (_, reasons) = reasons.expect(title);
        let mut named = commands_of_pages(guide).concat();
        named.extend(code_spans(reasons));
        let is_missing = |command: &&String| !named.iter().any(|span| does(span, command));
        let missing: Vec<_> = commands.iter().filter(is_missing).collect();
        assert!(missing.is_empty(), "no page and no reason: {missing:?}");
        let is_unknown = |span: &&&str| !commands.iter().any(|command| does(span, command));
        let unknown: Vec<_> = named.iter().filter(is_unknown).collect();
        assert!(unknown.is_empty(), "no such command: {unknown:?}");
    }
}

#[test]
fn both_guides_of_the_app_have_the_same_sections() {
    let [english, vietnamese] = guides();
    let rows = [&english, &vietnamese].map(|guide| commands_of_pages(guide));
    assert_eq!(rows[0], rows[1], "commands of the table");
    assert!(rows[0].len() > 10, "{rows:?}");
    let [english, vietnamese] = [sections(&english), sections(&vietnamese)];
    let headings = |sections: &[(&str, &str)], language: usize| {
        let known = HEADINGS.map(|heading| heading[language]);
        let found: Vec<String> = sections
            .iter()
            .map(|(name, _)| (*name).to_owned())
            .collect();
        assert_eq!(found, known);
    };
    headings(&english, 0);
    headings(&vietnamese, 1);
    for ((name, english), (_, vietnamese)) in english.iter().zip(&vietnamese) {
        assert_eq!(
            named_options(english),
            named_options(vietnamese),
            "{name}: options"
        );
        let translated = pictures(english).into_iter();
        let translated: Vec<_> = translated
            .map(|file| file.replace(".jpg", "-vi.jpg"))
            .collect();
        assert_eq!(translated, pictures(vietnamese), "{name}: pictures");
        // The Vietnamese guide may say more, such as names of columns, but not less.
        for what in ["\n\n", "*"] {
            let [original, translated] =
                [english, vietnamese].map(|text| text.matches(what).count());
            assert!(
                translated >= original,
                "{name}: {translated} of {original} {what:?}"
            );
        }
    }
}

#[test]
fn both_guides_name_the_same_buttons() {
    let plain = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let pages = source_files().into_iter();
    let pages = pages.filter(|file| file.name.starts_with("crates/pages/src/"));
    let pages: Vec<String> = pages.map(|file| plain(&file.text)).collect();
    let [english, vietnamese] = guides().map(|guide| plain(&guide));
    let buttons: BTreeSet<&str> = english.split('*').skip(1).step_by(2).collect();
    assert!(buttons.len() > 15, "{buttons:?}");
    for button in buttons {
        let before = format!("\"{button}\", \"");
        let translations = pages.iter().flat_map(|page| page.split(&before).skip(1));
        let translations = translations.filter_map(|rest| rest.split('"').next());
        let mut translations: BTreeSet<&str> = translations.collect();
        if button == BUTTON_OF_GUESTS[0] {
            translations.insert(BUTTON_OF_GUESTS[1]);
        }
        assert!(!translations.is_empty(), "no page has {button}");
        let is_named = |text: &&str| vietnamese.contains(&format!("*{text}*"));
        assert!(
            translations.iter().any(is_named),
            "the Vietnamese guide has none of {translations:?} for {button}"
        );
    }
}
