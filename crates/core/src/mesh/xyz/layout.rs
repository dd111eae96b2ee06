//! The layout of an XYZ file: its columns, what separates them, and what its commas mean.

use std::borrow::Cow;

use super::cells::{
    MISSING, cells, has_grouped_digits, outer_cells, plain_position, plain_tabbed_position,
    tab_cells, without_wide_spaces,
};
use super::grouped::{
    PlainNumber, are_grouped_pairs, has_unclear_commas, separator_of_grouped, without_apostrophes,
    without_groups,
};
use super::height_grid;
use super::title::{MAX_NAMES, Title, is_comment, is_other_title};
use crate::mesh::MeshError;
use crate::mesh::text;

/// Why a line whose commas may do both is refused.
const UNCLEAR_COMMAS: &str =
    "its commas may separate numbers or be part of them; write spaces between numbers";
/// Lines of points that show how cells are separated.
const SAMPLED_LINES: usize = 1000;

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

/// The fast parser that may read a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FastParser {
    None,
    /// [`plain_position`].
    Words,
    /// [`plain_tabbed_position`].
    Tabs,
}

/// Where the coordinates are.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointLayout {
    /// Line of the first point, counted from 1.
    pub(super) first_point: u64,
    /// Columns of x, y and z.
    columns: [usize; 3],
    commas: CommaUse,
    /// Number of columns between tabs, if each tab ends a cell that may be empty. Otherwise tabs are white space.
    tabs: Option<usize>,
    /// The separator of cells if blanks within cells group digits.
    grouped: Option<u8>,
    /// Number of columns of most lines.
    pub(super) width: usize,
    /// Least and largest number of columns of lines that may be points.
    widths: [usize; 2],
    /// Whether a title names the columns.
    is_titled: bool,
    /// Whether a column may precede the coordinates.
    may_be_numbered: bool,
    fast_parser: FastParser,
}

impl PointLayout {
    /// Determines the layout from the title and the first points, and from the first point with a comma.
    ///
    /// # Errors
    /// Returns an error if the title has more columns than the points, or if the lines are those of a grid of heights.
    pub(super) fn of(bytes: &[u8]) -> Result<Self, MeshError> {
        let mut lines = text::raw_lines(bytes);
        let (mut title, mut first) = (None, None);
        for (line, raw) in lines.by_ref() {
            let content = raw.trim_ascii();
            if let Some(found) = Title::of(content) {
                title = Some((line, found));
            } else if !is_comment(content) && !is_other_title(content, title.is_some()) {
                first = Some((line, raw));
                break;
            }
        }
        let mut layout = Self {
            first_point: u64::MAX,
            columns: [0, 1, 2],
            commas: CommaUse::Separator,
            tabs: None,
            grouped: None,
            width: 0,
            widths: [0; 2],
            is_titled: false,
            may_be_numbered: false,
            fast_parser: FastParser::None,
        };
        let Some((first_point, first)) = first else {
            return Ok(layout);
        };
        height_grid::check_header(first_point, first)?;
        layout.first_point = first_point;
        let later = lines.map(|(_, raw)| raw);
        let later = later.filter(|raw| !is_comment(raw.trim_ascii()));
        let mut points = std::iter::once(first).chain(later);
        let sample: Vec<&[u8]> = points.by_ref().take(SAMPLED_LINES).collect();
        if text::contains(bytes, b',') {
            let found = sample.iter().copied().chain(points).find_map(comma_use);
            layout.commas = found.unwrap_or(layout.commas);
        }
        let named = title.as_ref().map(|(_, title)| title);
        layout.grouped = separator_of_grouped(&sample);
        let ungrouped = sample.iter().map(|line| layout.ungrouped(line));
        let ungrouped: Vec<Cow<'_, [u8]>> = ungrouped.map(Option::unwrap_or_default).collect();
        let sample: Vec<&[u8]> = ungrouped.iter().map(|line| &**line).collect();
        layout.tabs = tab_columns(&sample, named);
        let widths: Vec<usize> = sample.iter().map(|line| layout.width_of(line)).collect();
        layout.width = most_frequent(&widths);
        let of_points = || widths.iter().copied().filter(|width| *width >= 3);
        layout.widths = [of_points().min(), of_points().max()].map(Option::unwrap_or_default);
        if named.is_none() {
            height_grid::check_width(first_point, layout.width)?;
        }
        let has_clear_commas =
            |line: &[u8]| layout.commas != CommaUse::Unclear || !line.contains(&b',');
        let is_pairs =
            |line: &&[u8]| has_clear_commas(line) && are_grouped_pairs(layout.cells(line));
        if layout.tabs.is_none() && sample.iter().all(is_pairs) {
            let reason = "blanks may group the digits of its numbers or separate them; write numbers such as \"1 234.5\" without \
                          blanks";
            return Err(MeshError::Line {
                line: first_point,
                reason: reason.into(),
            });
        }
        layout.may_be_numbered = layout.width > 3;
        if let Some((line, title)) = title {
            let widest = widths.into_iter().max().unwrap_or_default();
            layout.name_columns(&title, line, widest)?;
        }
        Ok(layout.with_columns(layout.columns))
    }

    /// Returns the layout with other columns of coordinates.
    fn with_columns(self, columns: [usize; 3]) -> Self {
        let is_plain = self.commas == CommaUse::Separator && self.grouped.is_none();
        let fast_parser = match self.tabs {
            _ if !is_plain || columns != [0, 1, 2] => FastParser::None,
            None => FastParser::Words,
            Some(_) => FastParser::Tabs,
        };
        Self {
            columns,
            fast_parser,
            ..self
        }
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
        self.columns = title.columns;
        (self.is_titled, self.may_be_numbered) = (true, false);
        Ok(())
    }

    /// Returns the number of columns of a line, without empty ones at its end.
    pub(super) fn width_of(&self, line: &[u8]) -> usize {
        let cells = self.cells(line).take(MAX_NAMES).enumerate();
        let filled = cells.filter(|(_, cell)| *cell != MISSING);
        filled.last().map_or(0, |(column, _)| column + 1)
    }

    /// Returns the layout of a file whose first column is the numbers of points, unless the title says otherwise.
    pub(super) fn numbered(self) -> Option<Self> {
        let layout = self.with_columns([1, 2, 3]);
        self.may_be_numbered.then_some(layout)
    }

    /// Returns the layout of a file in which some whole numbers, such as the row and the column of a point, stand where this
    /// layout has x. `None` if there are too few columns, or if a title names them.
    pub(super) fn behind(self, numbers: usize) -> Option<Self> {
        let x = self.columns[0] + numbers;
        let layout = self.with_columns([x, x + 1, x + 2]);
        (self.width > x + 2 && !self.is_titled).then_some(layout)
    }

    /// Returns the columns of x, y and z.
    pub(super) const fn columns(&self) -> [usize; 3] {
        self.columns
    }

    /// Returns both numbers of columns if some lines have one more than others and no title names them.
    pub(super) fn uneven_widths(&self) -> Option<[usize; 2]> {
        let [narrow, wide] = self.widths;
        (narrow + 1 == wide && !self.is_titled).then_some(self.widths)
    }

    /// Returns the number that a row begins with.
    pub(super) fn first_number(&self, row: &[u8]) -> Option<f64> {
        self.cells(row).next().and_then(number_with_comma)
    }

    /// Returns the layout of normals that follow the position, if there are enough columns.
    pub(super) fn of_normals(self) -> Option<Self> {
        let first = self.columns[0] + 3;
        let layout = self.with_columns([first, first + 1, first + 2]);
        (self.width > first + 2).then_some(layout)
    }

    /// Returns the rows from the first point on, with the numbers of their lines.
    pub(super) fn rows<'a>(&'a self, bytes: &'a [u8]) -> impl Iterator<Item = (u64, &'a [u8])> {
        let lines = text::raw_lines(bytes).skip_while(move |(line, _)| *line < self.first_point);
        lines.filter_map(move |(line, raw)| Some((line, self.row(raw)?)))
    }

    /// Returns the part of a line that may be a point. `None` if the line is empty or a comment.
    #[inline]
    pub(super) fn row<'a>(&self, raw: &'a [u8]) -> Option<&'a [u8]> {
        let content = raw.trim_ascii();
        if self.tabs.is_none() {
            return (!is_comment(content)).then_some(content);
        }
        let is_row = content.is_empty() && raw.contains(&b'\t');
        (!is_comment(content) || is_row).then_some(raw)
    }

    /// Parses the coordinates of a row; the error is a message.
    #[inline]
    pub(super) fn position(&self, row: &[u8]) -> Result<[f64; 3], String> {
        let plain = match self.fast_parser {
            FastParser::None => None,
            FastParser::Words => plain_position(row, self.width == 3),
            FastParser::Tabs => plain_tabbed_position(row),
        };
        plain.map_or_else(|| self.odd_position(row), Ok)
    }

    /// Returns a line in which no apostrophe or blank groups digits. `None` if a cell has another blank.
    fn ungrouped<'a>(&self, line: &'a [u8]) -> Option<Cow<'a, [u8]>> {
        let line = without_apostrophes(line).map_or(Cow::Borrowed(line), Cow::Owned);
        match self.grouped {
            Some(separator) => without_groups(&line, separator).map(Cow::Owned),
            None => Some(line),
        }
    }

    fn odd_position(&self, row: &[u8]) -> Result<[f64; 3], String> {
        if self.commas == CommaUse::Separator && has_unclear_commas(row) {
            return Err(UNCLEAR_COMMAS.into());
        }
        let row = self.ungrouped(row).ok_or_else(|| {
            "a cell has a blank, but is not a number such as \"1 234\"".to_owned()
        })?;
        let found = self.position_of_cells(&row);
        match found.is_err().then(|| without_wide_spaces(&row)).flatten() {
            Some(plain) => self.position_of_cells(&plain).or(found),
            None => found,
        }
    }

    fn position_of_cells(&self, line: &[u8]) -> Result<[f64; 3], String> {
        if self.commas == CommaUse::Unclear && line.contains(&b',') {
            return Err(UNCLEAR_COMMAS.into());
        }
        if self.fast_parser != FastParser::None {
            self.check_cells(line, self.width_of(line))?;
            return text::position(self.cells(line));
        }
        let mut coordinates: [&[u8]; 3] = [b"missing"; 3];
        let (mut have, mut count) = (0, 0);
        for (column, cell) in self.cells(line).enumerate().take(MAX_NAMES) {
            if cell != MISSING {
                count = column + 1;
            }
            if let Some(axis) = self.columns.iter().position(|of_axis| *of_axis == column) {
                coordinates[axis] = cell;
                have += 1;
            }
        }
        self.check_cells(line, count)?;
        if have < 3 {
            return Err(format!("{have} of 3 coordinates"));
        }
        if self.commas == CommaUse::Separator {
            return text::position(coordinates.into_iter());
        }
        let points = coordinates.map(|cell| {
            let has_point = cell.contains(&b'.') && text::parse::<f64>(cell).is_some();
            has_point.then(|| text::other_decimal_mark(cell, b'.'))
        });
        if let Some(reason) = points.into_iter().flatten().next() {
            return Err(reason);
        }
        let mut position = [0.0; 3];
        for (value, cell) in position.iter_mut().zip(coordinates) {
            let number = number_with_comma(cell).or_else(|| number_with_grouping_points(cell));
            *value = number.ok_or_else(|| text::not_a_number(cell))?;
        }
        Ok(position)
    }

    /// Refuses a line that has more columns than the others because of doubled tabs or of blanks within numbers. `count` is
    /// the number of its columns; the error is a message.
    fn check_cells(&self, line: &[u8], count: usize) -> Result<(), String> {
        if count <= self.tabs.unwrap_or(self.width) {
            return Ok(());
        }
        match self.tabs {
            Some(width) if self.cells(line).take(count).any(|cell| cell == MISSING) => {
                Err(format!(
                    "it has {count} columns between tabs, but others have {width}; write one tab between columns"
                ))
            }
            None if has_grouped_digits(self.cells(line).take(MAX_NAMES)) => {
                let width = self.width;
                Err(format!(
                    "it has {count} columns, but most lines have {width}; write numbers such as \"1 234\" without blanks"
                ))
            }
            _ => Ok(()),
        }
    }

    fn cells<'a>(&self, line: &'a [u8]) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let mut between_tabs = tab_cells(line);
        let mut words = outer_cells(line);
        let mut cells = cells(line);
        let (is_tabbed, commas) = (self.tabs.is_some(), self.commas);
        std::iter::from_fn(move || match commas {
            _ if is_tabbed => {
                let cell = between_tabs.next()?;
                Some(if cell.is_empty() { MISSING } else { cell })
            }
            CommaUse::Decimal => words.next(),
            CommaUse::Separator | CommaUse::Unclear => cells.next(),
        })
    }
}

/// Returns the number of columns if each tab ends a cell. Tabs that only align numbers stand side by side in lines that have
/// a number in every column.
fn tab_columns(sample: &[&[u8]], title: Option<&Title>) -> Option<usize> {
    let columns = title.map_or([0, 1, 2], |title| title.columns);
    let (mut most_cells, mut most_filled, mut has_point) = (0, 0, false);
    for line in sample.iter().filter(|line| line.contains(&b'\t')) {
        let cells: Vec<&[u8]> = tab_cells(line).take(MAX_NAMES).collect();
        let last = cells.iter().rposition(|cell| !cell.is_empty());
        let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
        let is_number = |column: usize| cells.get(column).copied().and_then(number_with_comma);
        most_cells = most_cells.max(last.map_or(0, |last| last + 1));
        most_filled = most_filled.max(filled);
        has_point |= columns.iter().all(|column| is_number(*column).is_some());
    }
    let is_named = title.is_some_and(|title| title.width == most_cells);
    let is_each = has_point && (most_cells == most_filled || is_named);
    is_each.then_some(most_cells)
}

/// Returns the most frequent of some numbers of columns, at most [`MAX_NAMES`] each.
fn most_frequent(widths: &[usize]) -> usize {
    let mut counts = [0; MAX_NAMES + 1];
    for width in widths {
        counts[*width] += 1;
    }
    let found = (0..counts.len()).max_by_key(|width| counts[*width]);
    found.unwrap_or_default()
}

/// Parses a number that may have a decimal comma.
fn number_with_comma(cell: &[u8]) -> Option<f64> {
    text::number(&text::with_point(cell))
}

/// Parses a number with a decimal comma whose digits are grouped by points.
fn number_with_grouping_points(cell: &[u8]) -> Option<f64> {
    let number = PlainNumber::of_grouped(cell)?;
    (number.mark == Some(b','))
        .then(|| text::number(&number.text))
        .flatten()
}

/// Returns what the commas of a point mean; `None` if it has none.
fn comma_use(line: &[u8]) -> Option<CommaUse> {
    let plain = memchr::memchr(b',', line).and_then(|_| without_apostrophes(line));
    let line = plain.as_deref().unwrap_or(line);
    let first_comma = line.iter().position(|byte| *byte == b',')?;
    let mut words = line
        .split(|byte| is_outer_separator(*byte))
        .filter(|word| !word.is_empty());
    let (first, second) = (words.next()?, words.next());
    let without_last = first.strip_suffix(b",").unwrap_or(first);
    let is_list = without_last.split(|byte| *byte == b',').count() > 2;
    let is_spaced = first.ends_with(b",") && first_comma + 1 == first.len();
    let is_alone = second.is_none() && !line.contains(&b';') && !line.contains(&b'\t');
    if is_list || is_spaced || is_alone {
        return Some(CommaUse::Separator);
    }
    let is_decimal = |word: &[u8]| {
        word.contains(&b',')
            && if word.contains(&b'.') {
                number_with_grouping_points(word).is_some()
            } else {
                text::parse::<f64>(&text::with_point(word)).is_some()
            }
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

const fn is_outer_separator(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == b';'
}
