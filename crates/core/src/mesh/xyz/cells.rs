//! The cells of a line of points, and the fast parser of almost all lines.

use super::grouped::digits;
use crate::mesh::decimal;

/// Stands in place of an empty cell: a coordinate is missing there.
pub(super) const MISSING: &[u8] = b"nan";

/// Parses three numbers with simple separators, as in almost every line. Returns `None` for all other lines, and, if the
/// third number `is_last`, for lines that continue after it.
#[inline]
pub(super) fn plain_position(line: &[u8], is_last: bool) -> Option<[f64; 3]> {
    let mut position = [0.0; 3];
    let mut rest = line;
    for value in &mut position {
        while let [b' ' | b'\t', next @ ..] = rest {
            rest = next;
        }
        (*value, rest) = decimal::parse(rest)?;
        rest = match rest {
            [] | [b' ' | b'\t', ..] => rest,
            [b',' | b';', next @ ..] => next,
            _ => return None,
        };
    }
    (!is_last || rest.is_empty()).then_some(position)
}

/// Parses three numbers like [`plain_position`], with one tab between them.
#[inline]
pub(super) fn plain_tabbed_position(line: &[u8]) -> Option<[f64; 3]> {
    let mut position = [0.0; 3];
    let mut rest = line;
    for value in &mut position {
        while let [b' ', next @ ..] = rest {
            rest = next;
        }
        (*value, rest) = decimal::parse(rest)?;
        while let [b' ' | b'\r', next @ ..] = rest {
            rest = next;
        }
        rest = match rest {
            [] => rest,
            [b'\t', next @ ..] => next,
            _ => return None,
        };
    }
    Some(position)
}

/// Returns the cells between white space, commas and semicolons.
pub(super) fn cells(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    cells_between(line, |byte| matches!(byte, b',' | b';'))
}

/// Returns the cells between white space and semicolons, without commas at their ends.
pub(super) fn outer_cells(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let words = cells_between(line, |byte| byte == b';').map(|word| {
        let word = word.strip_prefix(b",").unwrap_or(word);
        word.strip_suffix(b",").unwrap_or(word)
    });
    words.filter(|word| !word.is_empty())
}

/// Returns the cells between tabs, which may be empty, without white space at their ends.
pub(super) fn tab_cells(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|byte| *byte == b'\t').map(<[u8]>::trim_ascii)
}

/// Returns the cells between white space and separators. A cell between two separators, or between one and an end of the line,
/// may be [`MISSING`].
fn cells_between<'a>(
    line: &'a [u8],
    is_separator: impl Fn(u8) -> bool + 'a,
) -> impl Iterator<Item = &'a [u8]> {
    let mut at = 0;
    let mut is_after_separator = false;
    let skip_space = |mut at: usize| {
        while line.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        at
    };
    std::iter::from_fn(move || {
        let start = skip_space(at);
        let rest = line.get(start..).unwrap_or_default();
        let is_end = |byte: &u8| is_separator(*byte) || byte.is_ascii_whitespace();
        let end = start + rest.iter().position(is_end).unwrap_or(rest.len());
        at = skip_space(end);
        let is_before_separator = line.get(at).is_some_and(|byte| is_separator(*byte));
        if is_before_separator {
            at += 1;
        } else if start == end && !is_after_separator {
            return None;
        }
        is_after_separator = is_before_separator;
        Some(if start == end {
            MISSING
        } else {
            &line[start..end]
        })
    })
}

/// Returns whether a blank groups the digits of a number, as in `1 234.5`: a cell of one to three digits precedes one that
/// begins with exactly three.
pub(super) fn has_grouped_digits<'a>(cells: impl Iterator<Item = &'a [u8]>) -> bool {
    let mut is_after_group = false;
    for cell in cells {
        let unsigned = cell.strip_prefix(b"-").unwrap_or(cell);
        let digits = digits(unsigned);
        let is_whole = digits == unsigned.len();
        let is_group = digits == 3
            && unsigned.len() == cell.len()
            && (is_whole || matches!(unsigned[digits], b'.' | b','));
        if is_after_group && is_group {
            return true;
        }
        is_after_group = is_whole && matches!(digits, 1..=3);
    }
    false
}

/// Spaces that group digits or stand between numbers and are no ASCII: no-break space in UTF-8 and in Latin-1, narrow no-break
/// space, thin space and figure space.
const WIDE_SPACES: [&[u8]; 5] = [
    b"\xc2\xa0",
    b"\xe2\x80\xaf",
    b"\xe2\x80\x89",
    b"\xe2\x80\x87",
    b"\xa0",
];

/// Returns a line without the wide spaces that group the digits of its numbers, and with blanks for the others. `None` if
/// it has none.
pub(super) fn without_wide_spaces(line: &[u8]) -> Option<Vec<u8>> {
    let mut plain = Vec::with_capacity(line.len());
    let (mut rest, mut has_wide) = (line, false);
    while let Some((first, after)) = rest.split_first() {
        let behind = WIDE_SPACES
            .iter()
            .find_map(|space| rest.strip_prefix(*space));
        if let Some(behind) = behind {
            has_wide = true;
            if !groups_digits(&plain, behind) {
                plain.push(b' ');
            }
            rest = behind;
        } else {
            plain.push(*first);
            rest = after;
        }
    }
    has_wide.then_some(plain)
}

/// Returns whether digits before a space and exactly three after it are those of one number.
fn groups_digits(before: &[u8], after: &[u8]) -> bool {
    let last = before.iter().rev();
    let count = last.take_while(|byte| byte.is_ascii_digit()).count();
    let start = before.len() - count;
    let is_fraction = start > 0 && matches!(before[start - 1], b'.' | b',');
    count > 0 && digits(after) == 3 && !is_fraction
}

#[cfg(test)]
mod tests {
    use super::{cells, has_grouped_digits, outer_cells, plain_position, without_wide_spaces};
    use crate::mesh::text;

    #[test]
    fn plain_lines_have_the_numbers_of_their_cells() {
        let numbers = [
            "1",
            "-2.5",
            "0.1234567",
            "1e3",
            "",
            "nan",
            "+4",
            "12345678901234567890",
            "x",
        ];
        let separators = [" ", ",", ";", "\t", " , ", ", ", "  ", ";;", ""];
        let (mut plain, mut other) = (0, 0);
        for code in 0..9_usize.pow(5) {
            let choice = |place: u32| code / 9_usize.pow(place) % 9;
            let [a, b, c] = [0, 1, 2].map(|place| numbers[choice(place)]);
            let (first, second) = (separators[choice(3)], separators[choice(4)]);
            let line = format!("{a}{first}{b}{second}{c}{}", ["", " 7", ",9"][code % 3]);
            match plain_position(line.trim_ascii_start().as_bytes(), false) {
                Some(position) => {
                    plain += 1;
                    assert_eq!(
                        Ok(position),
                        text::position(cells(line.as_bytes())),
                        "{line}"
                    );
                }
                None => other += 1,
            }
        }
        assert!(
            plain > 1000 && other > 1000,
            "{plain} plain lines, {other} others"
        );
    }

    #[test]
    fn a_cell_beside_a_separator_may_be_empty() {
        let joined = |cells: Vec<&[u8]>| String::from_utf8_lossy(&cells.join(&b'|')).into_owned();
        for (line, all, outer) in [
            (";1;2", "nan|1|2", "nan|1|2"),
            ("1;;2", "1|nan|2", "1|nan|2"),
            ("1 ; ; 2 ;", "1|nan|2|nan", "1|nan|2|nan"),
            (",,", "nan|nan|nan", ""),
            ("1,5;;2,5", "1|5|nan|2|5", "1,5|nan|2,5"),
            ("1,0, 2,5, 3", "1|0|2|5|3", "1,0|2,5|3"),
            ("1  2\t3", "1|2|3", "1|2|3"),
            ("", "", ""),
        ] {
            assert_eq!(joined(cells(line.as_bytes()).collect()), all, "{line}");
            let found = outer_cells(line.as_bytes()).collect();
            assert_eq!(joined(found), outer, "{line}");
        }
    }

    #[test]
    fn grouped_digits_are_found_and_wide_spaces_join_them() {
        let is_grouped = |line: &str| has_grouped_digits(cells(line.as_bytes()));
        assert!(is_grouped("1 234.5 2 3") && is_grouped("2.5 -12 345 3 4"));
        for plain in ["1 2345 2 3", "1.5 234 2 3", "1234 234 2 3", "1 -234 2 3"] {
            assert!(!is_grouped(plain), "{plain}");
        }
        let plain = |line: &[u8]| without_wide_spaces(line);
        assert_eq!(plain(b"1 2 3"), None);
        assert_eq!(
            plain("1\u{a0}234,5;2\u{202f}000\u{202f}111;3".as_bytes()),
            Some(b"1234,5;2000111;3".to_vec())
        );
        assert_eq!(plain(b"1\xa02.5\xa0333 4"), Some(b"1 2.5 333 4".to_vec()));
    }
}
