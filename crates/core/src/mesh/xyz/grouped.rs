//! Numbers whose digits are grouped by threes, such as `1.234,5` or `1 234.5`.

/// First cells of a line that show what its blanks mean.
const FIRST_CELLS: usize = 3;
/// Apostrophes that group digits: that of ASCII, and the typographic one in UTF-8 and in Windows-1252.
const APOSTROPHES: [&[u8]; 3] = [b"'", b"\xe2\x80\x99", b"\x92"];

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
        let mark = match *rest {
            [] if groups > 1 || !is_mark => is_mark.then(|| other_mark(separator)),
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

/// Returns the comma for a point, and the point for a comma.
pub(super) const fn other_mark(mark: u8) -> u8 {
    if mark == b',' { b'.' } else { b',' }
}

/// Returns a line without the apostrophes that group the digits of its numbers. `None` if it has none.
pub(super) fn without_apostrophes(line: &[u8]) -> Option<Vec<u8>> {
    // The first bytes of the apostrophes.
    memchr::memchr3(b'\'', b'\xe2', b'\x92', line)?;
    let is_end = |byte: &u8| byte.is_ascii_whitespace() || b",;".contains(byte);
    let mut plain = Vec::with_capacity(line.len());
    let mut is_grouped = false;
    for part in line.split_inclusive(is_end) {
        let end = part.iter().position(is_end).unwrap_or(part.len());
        let (cell, separator) = part.split_at(end);
        if let Some(number) = number_with_apostrophes(cell) {
            plain.extend(number.text);
            is_grouped = true;
        } else {
            plain.extend_from_slice(cell);
        }
        plain.extend_from_slice(separator);
    }
    is_grouped.then_some(plain)
}

/// Returns the number of a cell whose digits apostrophes group. `None` for other cells.
fn number_with_apostrophes(cell: &[u8]) -> Option<PlainNumber> {
    let mut usual = Vec::with_capacity(cell.len());
    let mut rest = cell;
    while let Some((first, after)) = rest.split_first() {
        let behind = APOSTROPHES.iter().find_map(|mark| rest.strip_prefix(*mark));
        usual.push(if behind.is_some() { b'\'' } else { *first });
        rest = behind.unwrap_or(after);
    }
    let number = PlainNumber::of_grouped(&usual)?;
    usual.contains(&b'\'').then_some(number)
}

/// Returns whether commas behind numbers with apostrophes may separate numbers or be decimal commas: `1'234,5,2'345,6`.
/// Fewer than four cells are the coordinates.
pub(super) fn has_unclear_commas(line: &[u8]) -> bool {
    let is_possible = line.contains(&b',') && !line.contains(&b'.');
    if !is_possible || without_apostrophes(line).is_none() {
        return false;
    }
    let cells: Vec<&[u8]> = line.split(|byte| *byte == b',').collect();
    let may_be_one = |pair: &[&[u8]]| {
        let fraction = pair[1].trim_ascii_end();
        number_with_apostrophes(pair[0].trim_ascii_start()).is_some()
            && !fraction.is_empty()
            && digits(fraction) == fraction.len()
    };
    cells.len() > FIRST_CELLS && cells.windows(2).any(may_be_one)
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
    use super::{
        PlainNumber, has_unclear_commas, separator_of_grouped, without_apostrophes, without_groups,
    };

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
    fn apostrophes_between_groups_of_digits_are_removed() {
        for (line, plain) in [
            ("14'293,45 -24'808,22", Some("14293,45 -24808,22")),
            ("1'234'567.5;2;3", Some("1234567.5;2;3")),
            ("14\u{2019}293.45\t2\t3", Some("14293.45\t2\t3")),
            ("1'234 it's 1'23", Some("1234 it's 1'23")),
            ("1.5'000 1''234 '1'234'", None),
            ("1 2 3", None),
        ] {
            let found = without_apostrophes(line.as_bytes());
            assert_eq!(
                found,
                plain.map(|plain| plain.as_bytes().to_vec()),
                "{line}"
            );
        }
        let found = without_apostrophes(b"14\x92293,45");
        assert_eq!(found, Some(b"14293,45".to_vec()));
    }

    #[test]
    fn commas_behind_apostrophes_may_be_unclear() {
        for (line, is_unclear) in [
            ("14'293,45,24'808,22,18'742,57", true),
            ("14'293,24'808,742,255", true),
            ("14'293,24'808,742", false),
            ("14'293.4,24'808.2,742,255", false),
            ("14'293, 45, 24'808, 22", false),
            ("14'293,24'808,18'742,2'255", false),
            ("1,2,3,4", false),
        ] {
            assert_eq!(has_unclear_commas(line.as_bytes()), is_unclear, "{line}");
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
