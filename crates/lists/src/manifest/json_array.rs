//! Splits a JSON array into the texts of its values, which are then parsed like the lines of JSON Lines.

use std::ops::Range;

/// What is wrong with the text of an array, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DamagedArray {
    /// The line, counted from 1.
    pub line: usize,
    /// What was seen there.
    pub reason: &'static str,
}

/// Returns whether a text begins as an array.
pub fn is_array(list: &[u8]) -> bool {
    list.trim_ascii_start().starts_with(b"[")
}

/// A place in the text of an array, which goes from value to value. Every call takes the same text.
#[derive(Debug, Clone)]
pub struct ArrayCursor {
    at: usize,
    /// Its line, from 1.
    line: usize,
    progress: ArrayProgress,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ArrayProgress {
    BeforeArray,
    BehindValue,
    Ended,
}

impl Default for ArrayCursor {
    fn default() -> Self {
        Self {
            at: 0,
            line: 1,
            progress: ArrayProgress::BeforeArray,
        }
    }
}

impl ArrayCursor {
    /// Returns the line on which the next value begins, from 1, and its place in `list`, or `None` behind the last value.
    ///
    /// # Errors
    /// Returns an error, and then nothing more, if the array ends early, a comma is missing between two values, or text
    /// follows its end.
    pub fn next_value(
        &mut self,
        list: &[u8],
    ) -> Option<Result<(usize, Range<usize>), DamagedArray>> {
        if self.progress == ArrayProgress::Ended {
            return None;
        }
        let found = self.advance(list);
        self.progress = match found {
            Ok(Some(_)) => ArrayProgress::BehindValue,
            Ok(None) | Err(_) => ArrayProgress::Ended,
        };
        found.transpose()
    }

    fn advance(&mut self, list: &[u8]) -> Result<Option<(usize, Range<usize>)>, DamagedArray> {
        self.skip_blanks(list);
        if self.progress == ArrayProgress::BeforeArray {
            // The opening bracket.
            self.at += 1;
        } else {
            match self.byte(list)? {
                b',' => self.at += 1,
                b']' => {}
                _ => return Err(self.refused("a comma is missing before this row")),
            }
        }
        self.skip_blanks(list);
        if self.byte(list)? == b']' {
            self.at += 1;
            self.skip_blanks(list);
            return if self.at < list.len() {
                Err(self.refused("text follows the end of the list"))
            } else {
                Ok(None)
            };
        }
        let (line, start) = (self.line, self.at);
        self.skip_value(list);
        Ok(Some((line, start..self.at)))
    }

    fn refused(&self, reason: &'static str) -> DamagedArray {
        DamagedArray {
            line: self.line,
            reason,
        }
    }

    fn byte(&self, list: &[u8]) -> Result<u8, DamagedArray> {
        let byte = list.get(self.at).copied();
        byte.ok_or_else(|| self.refused("the list ends early; save or copy it again"))
    }

    fn go_to(&mut self, list: &[u8], at: usize) {
        let passed = &list[self.at..at];
        self.line += passed.split(|byte| *byte == b'\n').count() - 1;
        self.at = at;
    }

    fn skip_blanks(&mut self, list: &[u8]) {
        let rest = list[self.at..].iter();
        let blanks = rest.take_while(|byte| byte.is_ascii_whitespace()).count();
        self.go_to(list, self.at + blanks);
    }

    /// Goes to the end of a value: behind the bracket that closes it, or before a comma, bracket or blank.
    fn skip_value(&mut self, list: &[u8]) {
        let (mut depth, mut in_text, mut is_escaped) = (0_usize, false, false);
        let mut end = list.len();
        for (at, byte) in list.iter().enumerate().skip(self.at) {
            if in_text {
                in_text = *byte != b'"' || is_escaped;
                is_escaped = *byte == b'\\' && !is_escaped;
                continue;
            }
            let closes = matches!(byte, b']' | b'}');
            if depth == 0 && (*byte == b',' || closes || byte.is_ascii_whitespace()) {
                // A bracket that closes nothing is a value that the parser refuses.
                end = at.max(self.at + usize::from(*byte != b']'));
                break;
            }
            match byte {
                b'"' => in_text = true,
                b'[' | b'{' => depth += 1,
                _ if closes => depth -= 1,
                _ => {}
            }
            if closes && depth == 0 {
                end = at + 1;
                break;
            }
        }
        self.go_to(list, end);
    }
}

/// Returns where the parser stopped in a row that begins on the line `first` of a file: the line of the file if the row has
/// several lines, else the column of the row, both from 1.
pub fn place_in_row(error: &serde_json::Error, first: usize, row: &[u8]) -> String {
    if row.contains(&b'\n') {
        format!("line {}", first + error.line().max(1) - 1)
    } else {
        format!("column {}", error.column())
    }
}

#[cfg(test)]
mod tests {
    use super::{ArrayCursor, DamagedArray};

    fn values(list: &str) -> (Vec<(usize, String)>, Option<DamagedArray>) {
        let (mut cursor, mut found) = (ArrayCursor::default(), Vec::new());
        while let Some(next) = cursor.next_value(list.as_bytes()) {
            match next {
                Ok((line, place)) => found.push((line, list[place].to_owned())),
                Err(refused) => return (found, Some(refused)),
            }
        }
        assert!(cursor.next_value(list.as_bytes()).is_none());
        (found, None)
    }

    #[test]
    fn values_are_split_with_their_lines() {
        let list = "\n[\n {\"a\": [1, {\"b\": \"],}\\\"\"}]},\n\n{\"c\"\n:2} , 3,]\n";
        let expected = [
            (3, "{\"a\": [1, {\"b\": \"],}\\\"\"}]}"),
            (5, "{\"c\"\n:2}"),
            (6, "3"),
        ];
        let (found, problem) = values(list);
        assert_eq!(found, expected.map(|(line, text)| (line, text.to_owned())));
        assert_eq!(problem, None);
        assert_eq!(values("[]"), (vec![], None));
    }

    #[test]
    fn damaged_arrays_are_refused_with_their_line() {
        let early = "the list ends early; save or copy it again";
        for (list, line, reason) in [
            ("[{}\n", 2, early),
            ("[{\"a\": \"}]\n", 2, early),
            ("[{}\n {}]", 2, "a comma is missing before this row"),
            ("[{}]\n{}", 2, "text follows the end of the list"),
            ("[", 1, early),
        ] {
            let expected = DamagedArray { line, reason };
            assert_eq!(values(list).1, Some(expected), "{list}");
        }
        // The parser refuses what is no object.
        for list in ["[,]", "[}]", "[{},,{}]", "[}}}]", "[,,,"] {
            assert!(
                values(list)
                    .0
                    .iter()
                    .any(|(_, value)| !value.starts_with('{')),
                "{list}"
            );
        }
    }

    proptest::proptest! {
        #[test]
        fn any_text_ends(list in "[\\[\\]{},\"\\\\a \n]{0,40}") {
            let (found, _) = values(&format!("[{list}"));
            proptest::prop_assert!(found.len() <= list.len() + 1);
        }
    }
}
