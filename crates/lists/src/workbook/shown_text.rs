//! Texts in formats with text of their own, such as `"B"@`: what a reader sees is the id, and the cell has only a part of it.

use super::format_code::{CodeToken, GENERAL, MAX_CODE_CHARS, take_token};

/// How a format shows the text of an id.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ShownText {
    /// The code of the format.
    code: String,
    /// What stands before and behind the text, or `None` if the code is not read.
    between: Option<[String; 2]>,
}

/// Number of the section of texts, if a code has all four.
const SECTION_OF_TEXTS: usize = 3;

impl ShownText {
    /// Returns what a code does to a text, or `None` if it shows it as it is.
    pub(super) fn of_code(code: &str) -> Option<Self> {
        if code.chars().count() > MAX_CODE_CHARS {
            return Some(Self {
                code: code.chars().take(MAX_CODE_CHARS).collect(),
                between: None,
            });
        }
        let mut sections = sections_of(code);
        let has_all = sections.len() > SECTION_OF_TEXTS;
        let section = if has_all {
            sections.swap_remove(SECTION_OF_TEXTS)
        } else {
            sections.pop().filter(|last| last.places > 0)?
        };
        let is_general = section.before.trim().eq_ignore_ascii_case(GENERAL);
        let is_empty = section.before.trim().is_empty() && section.behind.trim().is_empty();
        // An empty section hides the text, which is then taken as it is.
        if is_empty && section.places < 2 || is_general && section.places == 0 {
            return None;
        }
        let between = (section.places == 1).then(|| {
            let before = section.before.trim_start().to_owned();
            let behind = section.behind.trim_end().to_owned();
            [before, behind]
        });
        Some(Self {
            code: code.to_owned(),
            between,
        })
    }

    /// Returns what a reader sees of a text, or the code of the format if that is not known.
    pub(super) fn text(&self, text: &str) -> Result<String, String> {
        match &self.between {
            Some([before, behind]) => Ok([before.as_str(), text.trim(), behind.as_str()].concat()),
            None => Err(self.code.clone()),
        }
    }
}

/// A section of a code.
#[derive(Default)]
struct FormatSection {
    /// Text before the first place of the cell's text, and behind it.
    before: String,
    behind: String,
    /// Number of places of the cell's text.
    places: usize,
}

impl FormatSection {
    fn add(&mut self, text: &str) {
        if self.places == 0 {
            self.before += text;
        } else {
            self.behind += text;
        }
    }
}

/// Returns the sections of a code, at least one.
fn sections_of(code: &str) -> Vec<FormatSection> {
    let mut sections = Vec::new();
    let mut section = FormatSection::default();
    let mut rest = code;
    while let Some(token) = take_token(&mut rest) {
        match token {
            CodeToken::Character(';') => sections.push(std::mem::take(&mut section)),
            CodeToken::Character('@') => section.places += 1,
            CodeToken::Character(other) => section.add(other.encode_utf8(&mut [0; 4])),
            CodeToken::Text(text) => section.add(text),
            // A colour or a condition, and blank room.
            CodeToken::Brackets(_) | CodeToken::Room => {}
        }
    }
    sections.push(section);
    sections
}

#[cfg(test)]
mod tests {
    use super::super::read_sheet;
    use super::super::test_helpers::workbook;
    use super::ShownText;

    #[test]
    fn text_of_a_format_is_part_of_what_is_shown() {
        for (code, expected) in [
            ("\"B\"@", "B17"),
            ("\"khối \"@", "khối 17"),
            ("@\"-x\"", "17-x"),
            ("\\B\\-@_)", "B-17"),
            ("[Red]\"B\"@", "B17"),
            ("0;-0;0;\"T;\"@", "T;17"),
            ("\"B\"000;\"C\"@", "C17"),
        ] {
            let shown = ShownText::of_code(code).expect(code);
            assert_eq!(shown.text(" 17").as_deref(), Ok(expected), "{code}");
        }
    }

    #[test]
    fn codes_that_show_a_text_as_it_is_and_codes_that_are_not_read_are_told_apart() {
        for code in [
            "@",
            "General",
            "0000",
            "\"B\"000",
            "0;-0;0;@",
            "0;0;0;General",
            ";;;",
            "_-@_-",
            "\"@\"0",
            "",
        ] {
            assert_eq!(ShownText::of_code(code), None, "{code}");
        }
        for code in ["@\"-\"@", "@@", "0;0;0;\"text\""] {
            let shown = ShownText::of_code(code).expect(code);
            assert_eq!(shown.text("17"), Err(code.to_owned()));
        }
        assert!(ShownText::of_code(&"x".repeat(300)).is_some_and(|shown| shown.text("a").is_err()));
    }

    #[test]
    fn ids_have_the_text_of_their_format() {
        let styles = "<styleSheet><numFmts><numFmt numFmtId=\"164\" formatCode=\"&quot;B&quot;@\"/>\
            <numFmt numFmtId=\"165\" formatCode=\"@@\"/></numFmts><cellXfs><xf numFmtId=\"0\"/>\
            <xf numFmtId=\"164\"/><xf numFmtId=\"165\"/></cellXfs></styleSheet>";
        let strings = "<sst><si><t>17</t></si></sst>";
        let read = |header: &str, cell: &str| {
            let head = format!("<c t=\"inlineStr\"><is><t>{header}</t></is></c>");
            let rows = format!("<row>{head}</row><row>{cell}</row>");
            let table = read_sheet(&workbook(&[("a", &rows)], strings, styles), None);
            let csv = table.map(|table| String::from_utf8(table.csv).expect("UTF-8"));
            csv.map_err(|error| error.to_string())
        };
        for cell in [
            "<c s=\"1\" t=\"s\"><v>0</v></c>",
            "<c s=\"1\" t=\"str\"><v>17</v></c>",
            "<c s=\"1\" t=\"inlineStr\"><is><t>17</t></is></c>",
        ] {
            assert_eq!(
                read("id", cell).as_deref(),
                Ok("\"id\"\n\"B17\"\n"),
                "{cell}"
            );
        }
        let note = "<c s=\"1\" t=\"str\"><v>17</v></c>";
        let titled = read(
            "id</t></is></c><c t=\"inlineStr\"><is><t>note",
            &format!("{note}{note}"),
        );
        assert_eq!(titled.as_deref(), Ok("\"id\",\"note\"\n\"B17\",\"17\"\n"));
        assert_eq!(
            read("id", "<c s=\"2\" t=\"s\"><v>0</v></c>"),
            Err(
                "cell A2 of column \"id\" shows its text in the format @@, which is not read; give the column the format \
                 Text and write the cell again"
                    .to_owned()
            )
        );
    }
}
