//! Numbers in formats with text of their own, such as `"B"000`: what a reader sees is the id, and the cell has only its number.

use super::format_code::{CodeToken, GENERAL, MAX_CODE_CHARS, take_token};

/// How a format of numbers shows the whole number of an id.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ShownNumber {
    /// The code of the format.
    code: String,
    /// At least this many digits between two texts, or `None` if the code is not read.
    between: Option<(String, usize, String)>,
}

/// Where the reader of a code is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CodePart {
    Before,
    Digits,
    Behind,
}

/// The parts of a code up to a place.
struct CodeParts {
    part: CodePart,
    before: String,
    zeros: usize,
    behind: String,
    /// Whether text stands between digits, or digits stand behind a point.
    is_divided: bool,
    /// Whether the section is only for some numbers.
    has_condition: bool,
}

impl CodeParts {
    fn add_text(&mut self, text: &str) {
        if self.part == CodePart::Before {
            self.before += text;
        } else {
            self.part = CodePart::Behind;
            self.behind += text;
        }
    }

    fn add_digits(&mut self, zeros: usize) {
        self.is_divided |= self.part == CodePart::Behind;
        self.part = CodePart::Digits;
        self.zeros += zeros;
    }
}

impl ShownNumber {
    /// Returns what a code does to a whole number that is no date, percentage or power of ten, or `None` if it shows it as it
    /// is, but for separators of thousands.
    pub(super) fn of_code(code: &str) -> Option<Self> {
        if code.chars().count() > MAX_CODE_CHARS {
            return Some(Self {
                code: code.chars().take(MAX_CODE_CHARS).collect(),
                between: None,
            });
        }
        let mut parts = CodeParts {
            part: CodePart::Before,
            before: String::new(),
            zeros: 0,
            behind: String::new(),
            is_divided: false,
            has_condition: false,
        };
        let mut rest = code;
        loop {
            let general = rest.get(..GENERAL.len());
            if general.is_some_and(|word| word.eq_ignore_ascii_case(GENERAL)) {
                parts.add_digits(0);
                rest = &rest[GENERAL.len()..];
                continue;
            }
            let Some(token) = take_token(&mut rest) else {
                break;
            };
            match token {
                // The first section is that of positive numbers.
                CodeToken::Character(';') => break,
                CodeToken::Character('%' | 'E' | 'e' | '@') => return None,
                CodeToken::Character('0') => parts.add_digits(1),
                CodeToken::Character('#' | '?') => parts.add_digits(0),
                CodeToken::Character(',') if parts.part == CodePart::Digits => {}
                CodeToken::Character('.') if parts.part == CodePart::Digits => {
                    parts.is_divided = true;
                }
                CodeToken::Character(other) => parts.add_text(other.encode_utf8(&mut [0; 4])),
                CodeToken::Text(text) => parts.add_text(text),
                CodeToken::Brackets(inner) => {
                    // Other numbers are shown in another way.
                    parts.has_condition |= inner.starts_with(['<', '>', '=']);
                    // A currency, such as `[$€-407]`; all else is a colour or a condition.
                    let currency = inner.strip_prefix('$');
                    let currency = currency.and_then(|inner| inner.split('-').next());
                    parts.add_text(currency.unwrap_or_default());
                }
                CodeToken::Room => {}
            }
        }
        parts.shown(code)
    }
}

impl CodeParts {
    fn shown(self, code: &str) -> Option<ShownNumber> {
        let has_text = !self.before.trim().is_empty() || !self.behind.trim().is_empty();
        let shown = |between| ShownNumber {
            code: code.to_owned(),
            between,
        };
        if self.has_condition || self.is_divided && has_text {
            return Some(shown(None));
        }
        let is_changed = !self.is_divided && (has_text || self.zeros > 1);
        is_changed.then(|| {
            let before = self.before.trim_start().to_owned();
            let behind = self.behind.trim_end().to_owned();
            shown(Some((before, self.zeros, behind)))
        })
    }
}

impl ShownNumber {
    /// Returns what a reader sees of a number, or the code of the format if that is not known.
    pub(super) fn text(&self, number: &str) -> Result<String, String> {
        let whole = number.trim().parse::<u64>().ok();
        match (&self.between, whole) {
            (Some((before, zeros, behind)), Some(whole)) => {
                let digits = format!("{whole:0>width$}", width = *zeros);
                Ok([before, digits.as_str(), behind].concat())
            }
            _ => Err(self.code.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::read_sheet;
    use super::super::test_helpers::{text_rows, workbook};
    use super::ShownNumber;

    #[test]
    fn text_of_a_format_is_part_of_what_is_shown() {
        for (code, number, expected) in [
            ("\"B\"000", "17", "B017"),
            ("B\\-0", "17", "B-17"),
            ("0000;-0000", "17", "0017"),
            ("[Red]000", "17", "017"),
            ("General\" a\"", "17", "17 a"),
            ("\"Ván \"0", "4", "Ván 4"),
            ("[$\u{20ab}-42A]0", "5", "\u{20ab}5"),
            ("\"x\"00\"y\"", "123", "x123y"),
        ] {
            let shown = ShownNumber::of_code(code).expect(code);
            assert_eq!(shown.text(number).as_deref(), Ok(expected), "{code}");
        }
    }

    #[test]
    fn codes_that_show_a_number_as_it_is_and_codes_that_are_not_read_are_told_apart() {
        for code in [
            "0",
            "#,##0",
            "General",
            "0.00",
            "0%",
            "_-* #,##0_-",
            "[Red]0",
            "0.00E+00",
            "@",
            "",
        ] {
            assert_eq!(ShownNumber::of_code(code), None, "{code}");
        }
        for code in ["00\"-\"00", "000\\-000", "\"B\"0.0", "[>99]\"B\"0;\"C\"0"] {
            let shown = ShownNumber::of_code(code).expect(code);
            assert_eq!(shown.text("17"), Err(code.to_owned()));
        }
        let shown = ShownNumber::of_code("\"B\"000").expect("a code");
        assert_eq!(shown.text("1.5"), Err("\"B\"000".to_owned()));
        let code = "\"B\"000;\"C\"000";
        let shown = ShownNumber::of_code(code).expect(code);
        assert_eq!(shown.text("-17"), Err(code.to_owned()));
        assert_eq!(shown.text("17").as_deref(), Ok("B017"));
    }

    #[test]
    fn ids_have_the_text_of_their_format() {
        let styles = "<styleSheet><numFmts><numFmt numFmtId=\"164\" formatCode=\"&quot;B&quot;000\"/>\
            <numFmt numFmtId=\"165\" formatCode=\"000\\-000\"/></numFmts><cellXfs><xf numFmtId=\"0\"/>\
            <xf numFmtId=\"164\"/><xf numFmtId=\"165\"/></cellXfs></styleSheet>";
        let sheet = |header: &str, style: u32| {
            let rows = format!(
                "{}<row><c s=\"{style}\"><v>17</v></c></row>",
                text_rows(&[&[header, "mesh", "print"]])
            );
            workbook(&[("a", &rows)], "", styles)
        };
        let csv = |header: &str, style| {
            let table = read_sheet(&sheet(header, style), None).expect("a sheet");
            String::from_utf8(table.csv).expect("UTF-8")
        };
        assert!(csv("id", 1).contains("\n\"B017\""), "{}", csv("id", 1));
        assert!(csv("note", 1).contains("\n\"17\""), "{}", csv("note", 1));
        let refused = read_sheet(&sheet("id", 2), None).expect_err("a format");
        assert_eq!(
            refused.to_string(),
            "cell A2 of column \"id\" shows its number in the format 000\\-000, which is not read; give the column the \
             format Text and write the cell again"
        );
    }
}
