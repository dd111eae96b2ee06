//! Finds quotation marks in CSV text that do not close where they should, so that a cell would take in the lines after it.

use std::fmt::{self, Display, Formatter};

use memchr::memchr;

/// Maximum number of lines in a cell. A longer cell more likely lacks its closing quote.
const MAX_CELL_LINES: usize = 100;

/// A quoted cell that takes in lines that are probably rows of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{fault}")]
pub struct QuoteError {
    /// Line on which the quote opens, from 1.
    pub line: usize,
    /// What is wrong.
    pub fault: QuoteFault,
}

/// What is wrong with a quoted cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuoteFault {
    /// The text ends in the cell.
    Unclosed,
    /// The next quote, on this line, is in the middle of a cell.
    ClosedInText(usize),
    /// The cell has more than a hundred lines. The next quote is on this line.
    Long(usize),
}

impl Display for QuoteFault {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unclosed => f.write_str("a quote is opened here and never closed"),
            Self::ClosedInText(line) => write!(
                f,
                "a quote is opened here, and the next one, on line {line}, is followed by text; \
                 close the quote on its line, and write a quote inside a quoted cell twice"
            ),
            Self::Long(line) => write!(
                f,
                "a quote is opened here and closed only on line {line}; a cell has at most {MAX_CELL_LINES} lines"
            ),
        }
    }
}

/// Where the parser is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum QuoteState {
    /// At the start of a cell, where a quote opens.
    CellStart,
    /// In a cell, where a quote is an ordinary character.
    InCell,
    /// In a quoted cell that opened on this line.
    Quoted(usize),
    /// After a quote in a quoted cell that opened on this line. Another quote would make it an ordinary character.
    AfterQuote(usize),
    /// After the end of a quoted cell that opened on the first line and closed on the second. Only blanks may follow.
    Closed(usize, usize),
}

/// Refuses text in which a quoted cell probably takes in further rows. Opens and closes quotes where the crate `csv` does:
/// a quote opens a cell only as its first character.
///
/// # Errors
/// Returns an error for the first such cell: if it is never closed, if it has more than one line and text follows its
/// closing quote, or if it has more than `MAX_CELL_LINES` lines.
pub fn check_quotes(text: &[u8], delimiter: u8) -> Result<(), QuoteError> {
    use QuoteState::{AfterQuote, CellStart, Closed, InCell, Quoted};
    // Most lists have no quotes.
    if memchr(b'"', text).is_none() {
        return Ok(());
    }
    let mut state = CellStart;
    let mut line = 1;
    for byte in text {
        let ends_cell = *byte == delimiter || matches!(byte, b'\n' | b'\r');
        state = match state {
            Quoted(opened) if *byte == b'"' => AfterQuote(opened),
            Quoted(opened) => Quoted(opened),
            AfterQuote(opened) if *byte == b'"' => Quoted(opened),
            AfterQuote(opened) | Closed(opened, _) if line - opened >= MAX_CELL_LINES => {
                let fault = QuoteFault::Long(line);
                return Err(QuoteError {
                    line: opened,
                    fault,
                });
            }
            _ if ends_cell => CellStart,
            CellStart if *byte == b'"' => Quoted(line),
            CellStart | InCell => InCell,
            AfterQuote(opened) if opened == line => InCell,
            AfterQuote(opened) if byte.is_ascii_whitespace() => Closed(opened, line),
            Closed(opened, closed) if byte.is_ascii_whitespace() => Closed(opened, closed),
            AfterQuote(opened) | Closed(opened, _) => {
                let fault = QuoteFault::ClosedInText(line);
                return Err(QuoteError {
                    line: opened,
                    fault,
                });
            }
        };
        line += usize::from(*byte == b'\n');
    }
    match state {
        Quoted(line) => Err(QuoteError {
            line,
            fault: QuoteFault::Unclosed,
        }),
        AfterQuote(opened) if line - opened >= MAX_CELL_LINES => Err(QuoteError {
            line: opened,
            fault: QuoteFault::Long(line),
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::{MAX_CELL_LINES, QuoteFault, check_quotes};
    use crate::manifest::{parse_blocks, parse_csv};
    use proptest::prelude::{prop, prop_assert_eq, proptest};

    fn fault(text: &str) -> Option<(usize, QuoteFault)> {
        let error = check_quotes(text.as_bytes(), b',').err()?;
        Some((error.line, error.fault))
    }

    fn records(text: &str) -> usize {
        let mut reader = ::csv::ReaderBuilder::new();
        let reader = reader.flexible(true).has_headers(false);
        reader.from_reader(text.as_bytes()).byte_records().count()
    }

    #[test]
    fn a_quote_that_is_never_closed_is_named_by_its_line() {
        use QuoteFault::Unclosed;
        for (text, line) in [
            ("a,b\n1,\"x\n2,y\n3,z\n", Some(2)),
            ("a,b\r\n1,\"x\r\n2,y", Some(2)),
            ("a\n\"", Some(2)),
            ("a\n\"x\"\"\n", Some(2)),
            ("a\n\"x\"", None),
            ("a\n\"x\"\n", None),
            ("a\n\"x\ny\"\n", None),
            ("a\n\"x\ny\" ,\"z\"\n", None),
            ("a\nx\"y\n5\" print\n", None),
            ("a, \"b\n", None),
        ] {
            let expected = line.map(|line| (line, Unclosed));
            assert_eq!(fault(text), expected, "{text:?}");
        }
        let error = check_quotes(b"a\n\"x\n", b',').expect_err("unclosed");
        assert_eq!(error.to_string(), "a quote is opened here and never closed");
    }

    #[test]
    fn a_cell_that_takes_in_rows_is_refused() {
        use QuoteFault::{ClosedInText, Long};
        let swallowed = "a,b\n1,\"x\n2,y\n3,\"z\"\n";
        assert_eq!(fault(swallowed), Some((2, ClosedInText(4))));
        assert_eq!(fault("a\n\"x\ny\" z\n"), Some((2, ClosedInText(3))));
        assert_eq!(fault("a\n\"x\"z\n"), None);
        let long = |lines: usize| format!("a\n\"{}\"\nb\n", vec!["x"; lines].join("\n"));
        assert_eq!(fault(&long(MAX_CELL_LINES)), None);
        assert_eq!(
            fault(&long(MAX_CELL_LINES + 1)),
            Some((2, Long(MAX_CELL_LINES + 2)))
        );
        let at_end = long(MAX_CELL_LINES + 1);
        let at_end = at_end.trim_end_matches("\nb\n");
        assert!(matches!(fault(at_end), Some((2, Long(_)))));
    }

    #[test]
    fn lists_of_pairs_and_of_blocks_with_an_open_quote_are_refused() {
        let pairs = "id,mesh,print,note\n1,a,b,ok\n2,a,b,\"thin\n3,a,b,ok\n";
        let blocks = "block,mesh,page\nb1,a,\"b\nb2,a,b\n";
        let refused = parse_csv(pairs.as_bytes()).expect_err("refused");
        let text = "line 3: a quote is opened here and never closed";
        assert_eq!(refused.to_string(), text);
        let refused = parse_blocks(blocks.as_bytes()).expect_err("refused");
        assert_eq!(refused.to_string(), text.replace('3', "2"));
    }

    proptest! {
        /// The crate `csv` is in a quoted cell at the end of a text if a line break there begins no record.
        #[test]
        fn a_quote_is_unclosed_exactly_if_the_parser_ends_in_a_quoted_cell(
            parts in prop::collection::vec(prop::sample::select(vec!["\"", ",", "\n", "\r\n", "\r", " ", "x"]), 0..24),
        ) {
            let text = parts.concat();
            let is_quoted = records(&format!("{text}x\ny")) == records(&format!("{text}x"));
            let found = fault(&text);
            // An earlier fault is found first.
            let is_earlier = matches!(found, Some((_, QuoteFault::ClosedInText(_))));
            prop_assert_eq!(found.is_some(), is_quoted || is_earlier, "{:?}", text);
        }
    }
}
