//! The meaning of the columns of YOLO text. A box with a confidence and the id of a track has as many columns as a triangle,
//! so all lines of a file decide together.

use crate::labels::message::quoted;
use crate::labels::model::bounds;
use crate::labels::page_fit::MAX_CORNERS;

/// Columns of a box: a class, the centre, width and height.
pub(super) const MIN_COLUMNS: usize = 5;
/// Columns of the longest outline: a class, the corners, a confidence and an id.
pub(super) const MAX_COLUMNS: usize = 2 * MAX_CORNERS + 3;
/// Columns of the shortest outline.
const TRIANGLE: usize = 7;
/// An outline that is this many times as large as the box in its first columns is none.
const MAX_RATIO: f64 = 4.0;

/// The numbers of a line.
pub(super) struct YoloRow {
    /// Number of the line, from 1.
    pub(super) line: usize,
    /// The class and all that follows it.
    pub(super) numbers: Vec<f64>,
}

impl YoloRow {
    /// Parses the words of a line.
    pub(super) fn new<'w>(
        line: usize,
        words: impl Iterator<Item = &'w str>,
    ) -> Result<Self, String> {
        let number = |word: &str| {
            let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| format!("{} is not a number", quoted(word)))
        };
        let numbers: Vec<f64> = words.map(number).collect::<Result<_, _>>()?;
        match numbers.as_slice() {
            [class, ..] if class.fract() != 0.0 => {
                Err(format!("the class is {class}, not a whole number"))
            }
            few if few.len() < MIN_COLUMNS => Err(format!(
                "{} numbers; a line has a class and at least 4 more",
                few.len()
            )),
            _ => Ok(Self { line, numbers }),
        }
    }

    /// Returns the numbers after the class without some at the end.
    fn coordinates(&self, left_out: usize) -> &[f64] {
        &self.numbers[1..self.numbers.len() - left_out]
    }
}

/// The first line of a kind, and how many columns it has.
#[derive(Clone, Copy)]
struct FirstLine {
    line: usize,
    columns: usize,
}

/// What is known of the columns of a file.
#[derive(Default)]
pub(super) struct FileColumns {
    /// The first lines with outlines, or boxes of as many columns, by whether their number of columns is odd.
    outlines: [Option<FirstLine>; 2],
    /// The first line with six columns.
    box_with_confidence: Option<FirstLine>,
    /// Number of lines that may be outlines, and whether all have the same number of columns.
    count: usize,
    has_other_lengths: bool,
    /// Number of lines that end like a confidence and an id, and whether an id is larger than any fraction.
    tracked: usize,
    has_large_id: bool,
    /// Areas of what the lines outline with and without their last two columns.
    areas: [f64; 2],
    /// Number of lines with outlines much larger than the box in the first columns, with and without the last two columns.
    larger_than_box: [usize; 2],
}

impl FileColumns {
    /// Adds a line.
    pub(super) fn add(&mut self, row: &YoloRow) -> Result<(), String> {
        let columns = row.numbers.len();
        let this = FirstLine {
            line: row.line,
            columns,
        };
        let last = row.numbers[columns - 1];
        if columns.is_multiple_of(2) && !is_confidence(last) && !is_id(last) {
            return Err(format!(
                "column {columns} is {last}, neither a confidence from 0 to 1 nor the id of a track"
            ));
        }
        if columns == MIN_COLUMNS + 1 {
            self.box_with_confidence.get_or_insert(this);
        }
        if columns >= TRIANGLE {
            let first = self.outlines[columns % 2].get_or_insert(this);
            self.has_other_lengths |= first.columns != columns;
            self.count += 1;
            self.add_outline(row);
        }
        // An outline that lost a number has as many columns as one with a confidence.
        let beside = match self.outlines {
            [Some(even), Some(odd)] => Some((even, odd)),
            [None, Some(odd)] => self.box_with_confidence.map(|even| (even, odd)),
            _ => None,
        };
        match beside {
            None => Ok(()),
            Some((a, b)) => {
                let other = if a.line == row.line { b } else { a };
                Err(format!(
                    "{columns} columns are neither a box nor an outline beside the {} columns of line {}",
                    other.columns, other.line
                ))
            }
        }
    }

    fn add_outline(&mut self, row: &YoloRow) {
        let columns = row.numbers.len();
        let confidence = usize::from(columns.is_multiple_of(2));
        if let [.., confidence, id] = *row.numbers
            && is_confidence(confidence)
            && is_id(id)
            && columns % 2 == 1
        {
            self.tracked += 1;
            self.has_large_id |= id > 1.0;
        }
        let box_area = (row.numbers[3] * row.numbers[4]).abs();
        for (k, left_out) in [confidence, 2].into_iter().enumerate() {
            let area = match row.coordinates(left_out) {
                [_, _, width, height] => (width * height).abs(),
                coordinates => area_around(coordinates),
            };
            self.areas[k] += area;
            self.larger_than_box[k] += usize::from(area > MAX_RATIO * box_area);
        }
    }

    /// Decides what the columns mean.
    ///
    /// # Errors
    /// Returns the line and the reason if they mean nothing that is known, or may mean two things.
    pub(super) fn decide(&self) -> Result<YoloColumns, (usize, String)> {
        let [even, odd] = self.outlines;
        let Some(first) = even.or(odd) else {
            return Ok(YoloColumns { is_tracked: false });
        };
        let is_triangle = first.columns == TRIANGLE;
        let [with, without] = self.areas;
        let ends_tracked = odd.is_some() && self.tracked == self.count;
        let is_tracked = ends_tracked && (self.has_large_id || with > MAX_RATIO * without);
        // The corner of a page is a point with whole numbers, too.
        if ends_tracked && !is_tracked && is_triangle && with > without {
            let reason = "7 columns may be a box with a confidence and an id, or a triangle (a box needs only 5)";
            return Err((first.line, reason.to_owned()));
        }
        let larger = self.larger_than_box[usize::from(is_tracked)];
        // A box near the corner of the page where coordinates are small hardly differs from what its other columns outline,
        // and neither does an outline there from a box.
        let is_box =
            2 * larger > self.count && !self.has_other_lengths && (self.count > 1 || is_triangle);
        if is_box {
            let columns = first.columns;
            return Err((
                first.line,
                format!(
                    "the first 5 of {columns} columns are a box and the others neither corners nor a confidence and an id"
                ),
            ));
        }
        Ok(YoloColumns { is_tracked })
    }
}

/// What the columns of a file mean.
#[derive(Clone, Copy)]
pub(super) struct YoloColumns {
    /// Whether lines of an odd length of seven or more end with a confidence and the id of a track.
    is_tracked: bool,
}

impl YoloColumns {
    /// Returns the numbers of a box or outline.
    pub(super) fn coordinates(self, row: &YoloRow) -> &[f64] {
        let columns = row.numbers.len();
        row.coordinates(match columns.is_multiple_of(2) {
            true => 1,
            false if self.is_tracked && columns >= TRIANGLE => 2,
            false => 0,
        })
    }
}

fn is_confidence(number: f64) -> bool {
    (0.0..=1.0).contains(&number)
}

fn is_id(number: f64) -> bool {
    number >= 0.0 && number.fract() == 0.0
}

/// Returns the area of the box around points whose coordinates follow one another.
fn area_around(coordinates: &[f64]) -> f64 {
    let (points, _) = coordinates.as_chunks::<2>();
    let [x0, y0, x1, y1] = bounds(points);
    (x1 - x0) * (y1 - y0)
}
