//! Lines before the points: titles that name columns, counts, units and comments.

use super::cells::cells;
use super::grouped::without_apostrophes;
use crate::domain::{LengthUnit, named_separator};
use crate::mesh::text;

/// Most cells of a title that are read.
pub(super) const MAX_NAMES: usize = 64;
/// Columns that may precede the coordinates in a commented title: numbers of points and scans, and times.
const NUMBER_NAMES: [&str; 26] = [
    "id",
    "no",
    "nr",
    "n",
    "index",
    "number",
    "num",
    "point",
    "pt",
    "pkt",
    "punkt",
    "pointid",
    "stt",
    "t",
    "time",
    "timestamp",
    "gps",
    "gpstime",
    "scan",
    "station",
    "frame",
    "profile",
    "line",
    "row",
    "col",
    "column",
];
/// Names of x, y and z, also those of surveys. A name ends at its first letter that is no ASCII, so that `H` is that of `Höhe`.
/// The name `n`, which may be that of a number, comes last.
const AXIS_NAMES: [&[&str]; 3] = [
    &[
        "x",
        "easting",
        "rechtswert",
        "rechts",
        "east",
        "est",
        "ost",
        "e",
    ],
    &["y", "northing", "hochwert", "hoch", "north", "nord", "n"],
    &[
        "z",
        "elevation",
        "altitude",
        "height",
        "hoehe",
        "elev",
        "alt",
        "h",
    ],
];

/// Returns whether a file that begins with this line may be a point set.
pub(in crate::mesh) fn is_data_or_title(line: &[u8]) -> bool {
    Title::of(line).is_some()
        || is_count(line)
        || named_separator(line).is_some()
        || text::position(cells(line)).is_ok()
        || without_apostrophes(line).is_some_and(|plain| text::position(cells(&plain)).is_ok())
}

/// Returns whether a line is empty or a comment.
pub(in crate::mesh) fn is_comment(line: &[u8]) -> bool {
    matches!(line, [] | [b'#' | b'%', ..] | [b'/', b'/', ..])
}

/// Returns whether a line is a number of points.
fn is_count(line: &[u8]) -> bool {
    line.iter().all(u8::is_ascii_digit)
}

/// Returns the number of points that a line has alone.
pub(super) fn count_of(line: &[u8]) -> Option<u64> {
    let line = line.trim_ascii();
    (!line.is_empty() && is_count(line))
        .then(|| text::parse(line))
        .flatten()
}

/// Returns the number of points that a line before the first one states, behind the number of this line.
pub(super) fn stated_count(bytes: &[u8], first_point: u64) -> Option<(u64, u64)> {
    let mut before = text::lines(bytes).take_while(|(line, _)| *line < first_point);
    before.find_map(|(number, line)| Some((number, count_of(line)?)))
}

/// Returns whether a line before the points is a count of them, units, a separator or a quoted text, which has no numbers if
/// the columns are named before it.
pub(super) fn is_other_title(line: &[u8], is_named: bool) -> bool {
    let is_units = names(line).count() >= 3 && names(line).all(|name| is_unit(&name));
    let is_quoted = matches!(line.first(), Some(b'"' | b'\''));
    let mut unquoted = line.to_vec();
    unquoted.retain(|byte| !matches!(byte, b'"' | b'\''));
    is_count(line)
        || is_units
        || named_separator(line).is_some()
        || (is_quoted
            && text::position(cells(&unquoted)).is_err()
            && !(is_named && cells(&unquoted).any(|cell| text::number(cell).is_some())))
}

/// A line that names columns.
pub(super) struct Title {
    /// Columns of x, y and z.
    pub(super) columns: [usize; 3],
    /// Number of columns.
    pub(super) width: usize,
    pub(super) is_comment: bool,
}

impl Title {
    /// Returns the columns that a line names. A comment names them only if x, y and z are its first words, or follow a colon or
    /// the names of columns of numbers.
    pub(super) fn of(line: &[u8]) -> Option<Self> {
        let is_comment = is_comment(line);
        let colon = line.iter().position(|byte| *byte == b':');
        let behind = colon.filter(|_| is_comment).map(|at| &line[at + 1..]);
        let behind = behind.and_then(|behind| Self::of_names(behind, is_comment));
        behind.or_else(|| Self::of_names(line, is_comment))
    }

    fn of_names(line: &[u8], is_comment: bool) -> Option<Self> {
        let is_delimited = line.iter().any(|byte| b",;\t".contains(byte));
        let is_name = |name: &String| is_delimited || !is_unit(name);
        let names: Vec<String> = names(line).filter(is_name).collect();
        let columns = axis_columns(&names)?;
        let first = columns.into_iter().min().unwrap_or_default();
        let last = columns.into_iter().max().unwrap_or_default();
        let mut before = names[..first].iter();
        let are_numbers = before.all(|name| NUMBER_NAMES.contains(&&**name));
        let is_title = !is_comment || (are_numbers && last == first + 2);
        is_title.then_some(Self {
            columns,
            width: names.len(),
            is_comment,
        })
    }
}

/// Returns the columns of x, y and z. The first column may be that of a number although it has the name of an axis.
fn axis_columns(names: &[String]) -> Option<[usize; 3]> {
    let find = |names: &[String]| {
        let column = |known: &[&str]| {
            let mut known = known.iter();
            known.find_map(|known| names.iter().position(|name| name == known))
        };
        let [x, y, z] = AXIS_NAMES.map(column);
        Some([x?, y?, z?])
    };
    let (first, rest) = names.split_first()?;
    let is_number = NUMBER_NAMES.contains(&&**first);
    let behind = is_number.then(|| find(rest)).flatten();
    let behind = behind.map(|columns: [usize; 3]| columns.map(|column| column + 1));
    behind.or_else(|| find(names))
}

fn is_unit(name: &str) -> bool {
    LengthUnit::is_name(name)
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
