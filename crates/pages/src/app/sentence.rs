//! Sentences in both languages, without commands, because the app has buttons for them.

use crate::messages;
use crate::review::Language;
use mocban_core::domain::ErrorCode;
use mocban_project::ProjectError;
use mocban_project::error::without_error_numbers;
use std::io;
use std::path::Path;

/// A sentence in English and Vietnamese.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Sentence {
    english: String,
    vietnamese: String,
}

impl Sentence {
    /// Stands for a folder that is not known where an error occurs.
    pub(super) const UNKNOWN_FOLDER: &'static str = ".";

    /// Makes a sentence of its texts.
    pub(super) fn new(english: impl Into<String>, vietnamese: impl Into<String>) -> Self {
        Self {
            english: english.into(),
            vietnamese: vietnamese.into(),
        }
    }

    /// Makes a sentence of a message of the program, which is in English, without its commands. In Vietnamese, a message that
    /// is not known is quoted.
    pub(super) fn of_program(text: &str) -> Self {
        let plain = without_commands(text);
        let known = messages::vietnamese(&plain);
        let vietnamese = known.unwrap_or_else(|| format!("Chương trình báo: {plain}"));
        Self::new(plain, vietnamese)
    }

    /// Explains an error of the project in a folder, and names the page or button that helps.
    pub(super) fn of_error(error: &ProjectError, dir: &Path) -> Self {
        let [at, place] = if dir == Path::new(Self::UNKNOWN_FOLDER) {
            ["this project", "dự án này"].map(str::to_owned)
        } else {
            [(); 2].map(|()| dir.display().to_string())
        };
        match error.code() {
            ErrorCode::ProjectInUse => Self::new(
                format!(
                    "another run works on {at}: wait for its end, or press Stop on the page Run"
                ),
                format!(
                    "một lần chạy khác đang làm việc với {place}: hãy chờ, hoặc bấm Dừng ở trang Căn chỉnh"
                ),
            ),
            ErrorCode::Locked => Self::new(
                format!(
                    "another program has used the catalog in {at} for too long: close it and try again"
                ),
                format!(
                    "một chương trình khác dùng danh mục trong {place} quá lâu: hãy đóng nó rồi thử lại"
                ),
            ),
            ErrorCode::NotWritable => Self::new(
                format!("{at} cannot be written to: check its rights and its disk, and try again"),
                format!("không ghi được vào {place}: hãy kiểm tra quyền và ổ đĩa, rồi thử lại"),
            ),
            ErrorCode::DiskFull => Self::new(
                format!(
                    "the disk of {at} is full: free some space and try again, everything stored so far is safe"
                ),
                format!(
                    "đĩa của {place} đã đầy: hãy giải phóng chỗ trống rồi thử lại, mọi thứ đã lưu vẫn an toàn"
                ),
            ),
            ErrorCode::Damaged => Self::new(
                format!("the catalog in {at} is damaged: press Check now on the page Health"),
                format!("danh mục trong {place} bị hỏng: hãy bấm Kiểm tra ngay ở trang Tình trạng"),
            ),
            ErrorCode::DamagedFile | ErrorCode::NotACatalog | ErrorCode::LogLost => Self::new(
                format!("the catalog in {at} cannot be read: put your last backup in its place"),
                format!(
                    "không đọc được danh mục trong {place}: hãy thay bằng bản sao lưu gần nhất"
                ),
            ),
            ErrorCode::NoProject => Self::new(
                "there is no such project any more: make one on the page Import",
                "dự án này không còn: hãy tạo dự án ở trang Nhập dữ liệu",
            ),
            ErrorCode::Unavailable => Self::new(
                format!("the server of {at} does not answer: check the network and try again"),
                format!("máy chủ của {place} không trả lời: hãy kiểm tra mạng rồi thử lại"),
            ),
            ErrorCode::TooManyFiles => Self::new(
                format!("too many files are open to read {at}: close other programs and try again"),
                format!(
                    "có quá nhiều tệp đang mở để đọc {place}: hãy đóng các chương trình khác rồi thử lại"
                ),
            ),
            _ => Self::of_program(&error.text(dir)),
        }
    }

    /// Returns the text in a language.
    pub(super) fn text(&self, language: Language) -> &str {
        match language {
            Language::English => &self.english,
            Language::Vietnamese => &self.vietnamese,
        }
    }
}

/// Returns what the system says of an error in English and Vietnamese.
pub(super) fn system_reasons(error: &io::Error) -> [String; 2] {
    let english = without_error_numbers(&error.to_string());
    let by_kind = || messages::reason_of_kind(error.kind()).map(str::to_owned);
    let vietnamese = messages::vietnamese(&english).or_else(by_kind);
    let vietnamese = vietnamese.unwrap_or_else(|| english.clone());
    [english, vietnamese]
}

/// Returns a text without the remarks in brackets and the clauses that name commands or options, without lines that have
/// nothing else, and without the numbers of the system's errors.
pub(super) fn without_commands(text: &str) -> String {
    // The pages send settings as the program takes them with this option.
    let text = text.strip_prefix("--set: ").unwrap_or(text);
    let lines: Vec<String> = text.lines().filter_map(line_without_commands).collect();
    let plain = if lines.is_empty() {
        text.to_owned()
    } else {
        lines.join("\n")
    };
    without_error_numbers(&plain.replace('`', ""))
}

fn line_without_commands(line: &str) -> Option<String> {
    let text = without_remarks(line);
    let sentences = text.trim_end_matches('.').split(". ");
    let sentences: Vec<String> = sentences
        .filter_map(|sentence| {
            let clauses = sentence.split("; ");
            let clauses: Vec<&str> = clauses.filter(|clause| !names_command(clause)).collect();
            (!clauses.is_empty()).then(|| clauses.join("; "))
        })
        .collect();
    let end = if text.ends_with('.') { "." } else { "" };
    (!sentences.is_empty()).then(|| sentences.join(". ") + end)
}

fn names_command(clause: &str) -> bool {
    // A path may also contain the name of the program.
    let is_command = |word: &str| {
        let word = word.trim_start_matches(['(', '`']);
        word == "mocban" || word.len() > 2 && word.starts_with("--")
    };
    // Parsers quote signs and values in the same way.
    let is_quoted = |text: &str| text.starts_with(|c: char| c.is_ascii_alphabetic());
    let mut quoted = clause.split('`').skip(1).step_by(2);
    quoted.any(is_quoted) || clause.split(' ').any(is_command)
}

/// Removes the remarks in brackets that name commands.
fn without_remarks(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(" (") {
        let Some((inside, behind)) = after.split_once(')') else {
            break;
        };
        plain.push_str(before);
        if !names_command(inside) {
            plain.extend([" (", inside, ")"]);
        }
        rest = behind;
    }
    plain + rest
}

#[cfg(test)]
mod tests {
    use super::{Sentence, system_reasons, without_commands};
    use crate::review::Language;
    use mocban_project::{ProjectError, Refusal};
    use std::io;
    use std::path::Path;

    #[test]
    fn remarks_and_clauses_that_name_commands_are_left_out() {
        for (text, plain) in [
            (
                "There is no Acc (`mocban review --reviewer NAME` starts judging). 24 of 24 (86.2–100.0).",
                "There is no Acc. 24 of 24 (86.2–100.0).",
            ),
            (
                "The project has no pairs yet; `mocban import` adds them.",
                "The project has no pairs yet.",
            ),
            (
                "pair a was retired; its verdicts are kept, and `retire --undo` brings it back",
                "pair a was retired",
            ),
            (
                "there is no result to judge yet; first: mocban -C p run",
                "there is no result to judge yet",
            ),
            (
                "/home/lan/mocban data/list.csv:3: the id a is there twice; rename it",
                "/home/lan/mocban data/list.csv:3: the id a is there twice; rename it",
            ),
            (
                "--set: run.workers = \"x\": invalid type: string \"x\", expected usize",
                "run.workers = \"x\": invalid type: string \"x\", expected usize",
            ),
            (
                "--set: run.workers = -3: invalid value: integer `-3`, expected usize",
                "run.workers = -3: invalid value: integer -3, expected usize",
            ),
            ("use `x`", "use x"),
            (
                "the XML is damaged: expected `</Word>`, but `</Line>` was found; save the labels again",
                "the XML is damaged: expected </Word>, but </Line> was found; save the labels again",
            ),
            (
                "line 3: expected `,` or `}`; `show` says more",
                "line 3: expected , or }",
            ),
            (
                "2 files are missing, nothing was imported:\n  line 2: a.stl\nuse --allow-missing",
                "2 files are missing, nothing was imported:\n  line 2: a.stl",
            ),
            ("a (b", "a (b"),
            (
                "p/exports: Permission denied (os error 13)",
                "p/exports: Permission denied",
            ),
        ] {
            assert_eq!(without_commands(text), plain);
        }
    }

    #[test]
    fn an_error_names_no_command_in_either_language() {
        let error = ProjectError::from(Refusal::Damaged(
            "a row; `check --repair` mends it".to_owned(),
        ));
        let sentence = Sentence::of_error(&error, Path::new("p"));
        for language in Language::ALL {
            let text = sentence.text(language);
            assert!(text.contains(" p ") && !text.contains('`'), "{text}");
        }
        assert!(sentence.text(Language::English).contains("Check now"));
        assert!(
            sentence
                .text(Language::Vietnamese)
                .contains("Kiểm tra ngay")
        );
        let unknown = Sentence::of_error(&error, Path::new(Sentence::UNKNOWN_FOLDER));
        for (language, place) in Language::ALL
            .into_iter()
            .zip(["in this project", "trong dự án này"])
        {
            assert!(unknown.text(language).contains(place), "{unknown:?}");
        }
        let error = ProjectError::from(Refusal::Usage("a = 7 is too large".to_owned()));
        let sentence = Sentence::of_error(&error, Path::new("p"));
        assert_eq!(
            sentence.text(Language::Vietnamese),
            "Chương trình báo: a = 7 is too large"
        );
        let known = Sentence::of_program("there is no pair b4; `show` lists all");
        assert_eq!(known.text(Language::Vietnamese), "không có cặp b4");
        assert_eq!(known.text(Language::English), "there is no pair b4");
    }

    #[test]
    fn reasons_of_the_system_are_in_the_language_of_the_page() {
        let read_only = || io::Error::from(io::ErrorKind::ReadOnlyFilesystem);
        let [english, vietnamese] = system_reasons(&read_only());
        assert_eq!(english, "read-only filesystem or storage medium");
        assert_eq!(vietnamese, "ổ đĩa chỉ đọc được");
        let unknown = system_reasons(&io::Error::other("odd"));
        assert_eq!(unknown, ["odd", "odd"]);
        // As a system says it whose language no table has.
        let foreign = io::Error::new(io::ErrorKind::StorageFull, "Der Datenträger ist voll.");
        let [english, vietnamese] = system_reasons(&foreign);
        assert_eq!(english, "Der Datenträger ist voll.");
        assert_eq!(vietnamese, "đĩa đã đầy");
        let error = ProjectError::from(read_only()).context("cannot write the backup p/b.sqlite");
        let sentence = Sentence::of_error(&error, Path::new("p"));
        assert_eq!(
            sentence.text(Language::Vietnamese),
            "không ghi được bản sao lưu p/b.sqlite: ổ đĩa chỉ đọc được"
        );
    }
}
