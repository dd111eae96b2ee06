//! Numbers whose digits are grouped by threes, such as `1.234,5` or `1 234.5`.

/// First cells of a line that show what its blanks mean.
const FIRST_CELLS: usize = 3;

/// The number of a cell with a decimal point and without what groups its digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlainNumber {
    pub(super) text: Vec<u8>,
    /// The decimal mark of the cell, a point or a comma, as far as the cell shows it.
    pub(super) mark: Option<u8>,
}

impl PlainNumber {
    /// Recognizes a number with groups of three digits behind a first one of one to three, and perhaps a fraction. One
    /// group behind a point or a comma may be a fraction, so it is no grouped number unless a fraction follows.
    pub(super) fn of_grouped(cell: &[u8]) -> Option<Self> {
        let sign = usize::from(matches!(cell.first(), Some(b'-' | b'+')));
        let (first, mut rest) = cell[sign..].split_at(digits(&cell[sign..]));
        let separator = *rest.first()?;
        let is_separator = matches!(separator, b' ' | b'.' | b',' | b'\'');
        if !is_separator || !matches!(first.len(), 1..=3) {
            return None;
        }
        let mut plain = cell[..sign + first.len()].to_vec();
        let mut groups = 0;
        while let [mark, after @ ..] = rest
            && *mark == separator
            && digits(after) == 3
        {
            plain.extend_from_slice(&after[..3]);
            rest = &after[3..];
            groups += 1;
        }
        let is_mark = matches!(separator, b'.' | b',');
        let other = |mark: u8| if mark == b',' { b'.' } else { b',' };
        let mark = match *rest {
            [] if groups > 1 || !is_mark => is_mark.then(|| other(separator)),
            [mark @ (b'.' | b','), ref fraction @ ..]
                if mark != separator
                    && !fraction.is_empty()
                    && digits(fraction) == fraction.len() =>
            {
                plain.push(b'.');
                plain.extend_from_slice(fraction);
                Some(mark)
            }
            _ => return None,
        };
        (groups > 0).then_some(Self { text: plain, mark })
    }
}

/// Returns the number of digits that a text begins with.
pub(super) fn digits(text: &[u8]) -> usize {
    text.iter().take_while(|byte| byte.is_ascii_digit()).count()
}

/// Returns the separator of cells, a semicolon or a tab, if blanks within cells group the digits of numbers. `sample` is some
/// lines of points.
pub(super) fn separator_of_grouped(sample: &[&[u8]]) -> Option<u8> {
    let mut separators = [b';', b'\t'].into_iter();
    separators.find(|separator| {
        let is_grouped = |line: &&&[u8]| has_blanks_in_cells(line, *separator);
        let mut grouped = sample.iter().filter(is_grouped).peekable();
        grouped.peek().is_some() && grouped.all(|line| without_groups(line, *separator).is_some())
    })
}

/// Returns whether a line has three or more cells, and blanks between digits of one of them.
fn has_blanks_in_cells(line: &[u8], separator: u8) -> bool {
    let between = |window: &[u8]| window[0].is_ascii_digit() && window[2].is_ascii_digit();
    memchr::memchr_iter(separator, line).count() > 1
        && line
            .windows(3)
            .any(|window| window[1] == b' ' && between(window))
}

/// Returns a line in which no blank groups digits. Returns `None` if a blank within one of its first cells does not. Other
/// blanks within further cells become underscores.
pub(super) fn without_groups(line: &[u8], separator: u8) -> Option<Vec<u8>> {
    let mut plain = Vec::with_capacity(line.len());
    for (nth, cell) in line.split(|byte| *byte == separator).enumerate() {
        if nth > 0 {
            plain.push(separator);
        }
        let cell = cell.trim_ascii();
        if !cell.contains(&b' ') {
            plain.extend_from_slice(cell);
        } else if PlainNumber::of_grouped(cell).is_some() {
            plain.extend(cell.iter().filter(|byte| **byte != b' '));
        } else if nth < FIRST_CELLS {
            return None;
        } else {
            let joined = |byte: &u8| if *byte == b' ' { b'_' } else { *byte };
            plain.extend(cell.iter().map(joined));
        }
    }
    Some(plain)
}

/// Returns whether the first cells of a line, between white space, are three pairs that look like grouped numbers with
/// fractions: `12 345.6`.
pub(super) fn are_grouped_pairs<'a>(cells: impl Iterator<Item = &'a [u8]>) -> bool {
    let cells: Vec<&[u8]> = cells.take(6).collect();
    let (pairs, _) = cells.as_chunks::<2>();
    let is_grouped = |[whole, group]: &[&[u8]; 2]| {
        let joined = [*whole, b" ", *group].concat();
        PlainNumber::of_grouped(&joined).is_some_and(|number| number.mark.is_some())
    };
    pairs.len() == 3 && pairs.iter().all(is_grouped)
}

#[cfg(test)]
mod tests {
    use super::{PlainNumber, separator_of_grouped, without_groups};

    #[test]
    fn grouped_numbers_have_a_plain_form_and_a_decimal_mark() {
        for (cell, plain, mark) in [
            ("1.234,5", "1234.5", Some(b',')),
            ("-1,234,567.50", "-1234567.50", Some(b'.')),
            ("1.234.567", "1234567", Some(b',')),
            ("12 345", "12345", None),
            ("12 345,6", "12345.6", Some(b',')),
            ("1'234.5", "1234.5", Some(b'.')),
        ] {
            let text = plain.as_bytes().to_vec();
            let wanted = PlainNumber { text, mark };
            assert_eq!(
                PlainNumber::of_grouped(cell.as_bytes()),
                Some(wanted),
                "{cell}"
            );
        }
        for other in [
            "",
            "-",
            "1",
            "1,5",
            "1.234",
            "1,234",
            "1234,567.8",
            "1.23,4",
            "1.234,",
            "1.234,5.6",
            "1 23",
            "1  234",
            "x 123",
            "1.234.56",
            "1 234x",
        ] {
            assert_eq!(PlainNumber::of_grouped(other.as_bytes()), None, "{other}");
        }
    }

    #[test]
    fn blanks_group_digits_only_between_other_separators() {
        let separator = |lines: &[&str]| {
            let lines: Vec<&[u8]> = lines.iter().map(|line| line.as_bytes()).collect();
            separator_of_grouped(&lines)
        };
        assert_eq!(separator(&["1,5;2;3", "1 234,5;2;3"]), Some(b';'));
        assert_eq!(separator(&["1 234.5\t2\t3"]), Some(b'\t'));
        assert_eq!(separator(&["1 234,5;2;3", "1 2;3;4"]), None);
        assert_eq!(separator(&["100 200 300;255"]), None);
        assert_eq!(separator(&["1 ; 2 ; 3", "1 234 2 3"]), None);
        let plain = |line: &str| without_groups(line.as_bytes(), b';');
        assert_eq!(
            plain("1 234,5; 2 ;3;4;a b c"),
            Some(b"1234,5;2;3;4;a_b_c".to_vec())
        );
        assert_eq!(plain("1 2;3;4"), None);
    }
}
