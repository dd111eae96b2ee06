//! The layout of an XYZ file: its title, its columns, and what its commas mean.

use crate::mesh::MeshError;
use crate::mesh::{decimal, text};

/// Most cells of a title that are read.
const MAX_NAMES: usize = 64;
/// Columns that may precede the coordinates in a commented title.
const NUMBER_NAMES: [&str; 8] = ["id", "no", "nr", "n", "index", "number", "num", "point"];
const UNITS: [&str; 5] = ["mm", "cm", "m", "in", "inch"];

/// What commas mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CommaUse {
    /// They stand between cells.
    Separator,
    /// They stand within numbers. White space and semicolons separate cells; a comma may follow a number, too.
    Decimal,
    /// They may do both.
    Unclear,
}

/// Where the coordinates are.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointLayout {
    /// Line of the first point, counted from 1.
    pub(super) first_point: u64,
    /// Columns of x, y and z.
    columns: [usize; 3],
    commas: CommaUse,
    /// Whether the first column may be the numbers of points.
    may_be_numbered: bool,
}

impl PointLayout {
    /// Determines the layout from the title and the first point, and from the first point with a comma.
    ///
    /// # Errors
    /// Returns an error if the title has more columns than the first point.
    pub(super) fn of(bytes: &[u8]) -> Result<Self, MeshError> {
        let mut lines = text::lines(bytes);
        let mut title = None;
        let mut layout = Self {
            first_point: u64::MAX,
            columns: [0, 1, 2],
            commas: CommaUse::Separator,
            may_be_numbered: false,
        };
        for (line, content) in &mut lines {
            if let Some(found) = Title::of(content) {
                title = Some((line, found));
                continue;
            }
            if is_comment(content) || is_other_title(content) {
                continue;
            }
            layout.first_point = line;
            if text::contains(bytes, b',') {
                let later = lines.map(|(_, line)| line).filter(|line| !is_comment(line));
                let found = std::iter::once(content).chain(later).find_map(comma_use);
                layout.commas = found.unwrap_or(layout.commas);
            }
            let width = layout.cells(content).take(MAX_NAMES).count();
            let first = layout.cells(content).next().unwrap_or_default();
            layout.may_be_numbered = width > 3 && first.iter().all(u8::is_ascii_digit);
            if let Some((line, title)) = title {
                layout.name_columns(&title, line, width)?;
            }
            break;
        }
        Ok(layout)
    }

    fn name_columns(&mut self, title: &Title, line: u64, width: usize) -> Result<(), MeshError> {
        if title.columns != self.columns && width < title.width {
            if title.is_comment {
                return Ok(());
            }
            let named = title.width;
            let reason = format!("it names {named} columns, but the first point has {width}");
            return Err(MeshError::Line { line, reason });
        }
        (self.columns, self.may_be_numbered) = (title.columns, false);
        Ok(())
    }

    /// Returns the layout of a file whose first column is the numbers of points, unless the title says otherwise.
    pub(super) fn numbered(self) -> Option<Self> {
        self.may_be_numbered.then_some(Self {
            columns: [1, 2, 3],
            ..self
        })
    }

    /// Parses the coordinates of a point; the error is a message.
    pub(super) fn position(&self, line: &[u8]) -> Result<[f64; 3], String> {
        if self.commas == CommaUse::Separator && self.columns == [0, 1, 2] {
            return plain_position(line).map_or_else(|| text::position(cells(line)), Ok);
        }
        if self.commas == CommaUse::Unclear && line.contains(&b',') {
            let reason =
                "its commas may separate numbers or be part of them; write spaces between numbers";
            return Err(reason.into());
        }
        let mut coordinates: [&[u8]; 3] = [b"missing"; 3];
        let mut have = 0;
        for (column, cell) in self.cells(line).enumerate().take(MAX_NAMES) {
            if let Some(axis) = self.columns.iter().position(|of_axis| *of_axis == column) {
                coordinates[axis] = cell;
                have += 1;
            }
        }
        if have < 3 {
            return Err(format!("{have} of 3 coordinates"));
        }
        if self.commas == CommaUse::Separator {
            return text::position(coordinates.into_iter());
        }
        let points = coordinates.map(|cell| {
            let has_point = cell.contains(&b'.') && text::parse::<f64>(cell).is_some();
            has_point.then(|| format!("{} has a point, but others have a comma", text::quote(cell)))
        });
        if let Some(reason) = points.into_iter().flatten().next() {
            return Err(reason);
        }
        let with_points = coordinates.map(with_point);
        text::position(with_points.iter().map(Vec::as_slice))
    }

    fn cells<'a>(&self, line: &'a [u8]) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let mut words = outer_cells(line);
        let mut cells = cells(line);
        let commas = self.commas;
        std::iter::from_fn(move || match commas {
            CommaUse::Decimal => words.next(),
            CommaUse::Separator | CommaUse::Unclear => cells.next(),
        })
    }
}

/// Parses three numbers with simple separators, as in almost every line. Returns `None` for all other lines.
#[inline]
fn plain_position(line: &[u8]) -> Option<[f64; 3]> {
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
    Some(position)
}

/// Returns whether a file that begins with this line may be a point set.
pub(in crate::mesh) fn is_data_or_title(line: &[u8]) -> bool {
    Title::of(line).is_some() || is_count(line) || text::position(cells(line)).is_ok()
}

/// Returns whether a line is empty or a comment.
pub(in crate::mesh) fn is_comment(line: &[u8]) -> bool {
    matches!(line, [] | [b'#' | b'%', ..] | [b'/', b'/', ..])
}

/// Returns whether a line is a number of points.
fn is_count(line: &[u8]) -> bool {
    line.iter().all(u8::is_ascii_digit)
}

/// Returns whether a line before the points is a count of them, units or a quoted text.
fn is_other_title(line: &[u8]) -> bool {
    let is_units = names(line).count() >= 3 && names(line).all(|name| UNITS.contains(&&*name));
    let is_quoted = matches!(line.first(), Some(b'"' | b'\''));
    let mut unquoted = line.to_vec();
    unquoted.retain(|byte| !matches!(byte, b'"' | b'\''));
    is_count(line) || is_units || (is_quoted && text::position(cells(&unquoted)).is_err())
}

/// A line that names columns.
struct Title {
    /// Columns of x, y and z.
    columns: [usize; 3],
    /// Number of columns.
    width: usize,
    is_comment: bool,
}

impl Title {
    /// Returns the columns that a line names. A comment names them only if x, y and z are its first words, or follow the
    /// name of a column of numbers.
    fn of(line: &[u8]) -> Option<Self> {
        let is_delimited = line.iter().any(|byte| b",;\t".contains(byte));
        let is_name = |name: &String| is_delimited || !UNITS.contains(&&**name);
        let names: Vec<String> = names(line).filter(is_name).collect();
        let mut columns = [0; 3];
        for (column, wanted) in columns.iter_mut().zip(["x", "y", "z"]) {
            *column = names.iter().position(|name| name == wanted)?;
        }
        let is_comment = is_comment(line);
        let has_number = NUMBER_NAMES.contains(&&*names[0]);
        let last = columns.into_iter().max().unwrap_or_default();
        let is_title = !is_comment || last == 2 + usize::from(has_number);
        is_title.then_some(Self {
            columns,
            width: names.len(),
            is_comment,
        })
    }
}

/// Returns the names in a title in lower case: the letters and digits that its cells begin with, without quotes, brackets
/// and what marks a comment. Tabs, commas and semicolons separate cells, or else white space.
fn names(line: &[u8]) -> impl Iterator<Item = String> {
    let is_mark = |byte: &u8| b"#%/ \t".contains(byte);
    let start = line.iter().position(|byte| !is_mark(byte));
    let text = &line[start.unwrap_or(line.len())..];
    let is_delimiter = |byte: &u8| b",;\t".contains(byte);
    let is_delimited = text.iter().any(is_delimiter);
    let cells = text.split(move |byte| {
        if is_delimited {
            is_delimiter(byte)
        } else {
            byte.is_ascii_whitespace()
        }
    });
    cells
        .filter(|cell| !cell.is_empty())
        .take(MAX_NAMES)
        .map(|cell| {
            let start = cell.iter().position(u8::is_ascii_alphanumeric);
            let name = &cell[start.unwrap_or(cell.len())..];
            let end = name.iter().position(|byte| !byte.is_ascii_alphanumeric());
            let name = &name[..end.unwrap_or(name.len())];
            String::from_utf8_lossy(name).to_ascii_lowercase()
        })
}

/// Returns what the commas of a point mean; `None` if it has none.
fn comma_use(line: &[u8]) -> Option<CommaUse> {
    let first_comma = line.iter().position(|byte| *byte == b',')?;
    let mut words = line
        .split(|byte| is_outer_separator(*byte))
        .filter(|word| !word.is_empty());
    let (first, second) = (words.next()?, words.next());
    let without_last = first.strip_suffix(b",").unwrap_or(first);
    let is_list = without_last.split(|byte| *byte == b',').count() > 2;
    let is_spaced = first.ends_with(b",") && first_comma + 1 == first.len();
    if is_list || is_spaced || second.is_none() {
        return Some(CommaUse::Separator);
    }
    let is_decimal = |word: &[u8]| {
        word.contains(&b',')
            && !word.contains(&b'.')
            && text::parse::<f64>(&with_point(word)).is_some()
    };
    if outer_cells(line).any(is_decimal) {
        return Some(CommaUse::Decimal);
    }
    // As in `1,000.5 2 3`.
    let is_unclear = outer_cells(line).take(3).any(|word| word.contains(&b','));
    Some(if is_unclear {
        CommaUse::Unclear
    } else {
        CommaUse::Separator
    })
}

/// Replaces a comma by a point.
fn with_point(number: &[u8]) -> Vec<u8> {
    let mut number = number.to_vec();
    if let Some(comma) = number.iter_mut().find(|byte| **byte == b',') {
        *comma = b'.';
    }
    number
}

const fn is_outer_separator(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == b';'
}

/// Returns the cells between white space and semicolons, without commas at their ends.
fn outer_cells(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let words = line.split(|byte| is_outer_separator(*byte)).map(|word| {
        let word = word.strip_prefix(b",").unwrap_or(word);
        word.strip_suffix(b",").unwrap_or(word)
    });
    words.filter(|word| !word.is_empty())
}

/// Returns the cells between white space, commas and semicolons. Between two commas or semicolons a coordinate is
/// missing.
fn cells(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut at = 0;
    let skip_space = |mut at: usize| {
        while line.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        at
    };
    std::iter::from_fn(move || {
        let start = skip_space(at);
        let rest = line.get(start..).unwrap_or_default();
        let is_end =
            |byte: &u8| matches!(byte, b',' | b';' | b' ' | b'\t' | b'\r' | b'\n' | b'\x0c');
        let end = start + rest.iter().position(is_end).unwrap_or(rest.len());
        at = skip_space(end);
        if let Some(b',' | b';') = line.get(at) {
            at += 1;
        } else if start == end {
            return None;
        }
        Some(if start == end {
            b"nan"
        } else {
            &line[start..end]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::{cells, plain_position};
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
            match plain_position(line.trim_ascii_start().as_bytes()) {
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
}
