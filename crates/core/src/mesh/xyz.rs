//! Reader of XYZ point sets: text files in which each line has the coordinates of a point.

mod cells;
mod first_column;
mod grouped;
#[cfg(test)]
mod grouped_tests;
mod height_grid;
mod layout;
mod numbers;
mod ptx;
mod quoted;
#[cfg(test)]
mod tests;
mod time_order;
mod title;

use super::{Mesh, MeshError, MeshLimits, text};
use crate::domain::cancel::polled;
use crate::domain::named_separator;
use first_column::{check_first_column, check_lacking_numbers, is_one_number};
use layout::PointLayout;
use numbers::{are_numbers, check_grid};

pub(super) use title::{is_comment, is_data_or_title};

/// Bytes of the shortest line: three digits, two spaces, a line end.
const SHORTEST_LINE: usize = 6;
/// Lines at the beginning of which one may name the separator of cells.
const TITLE_LINES: usize = 8;

/// Reads the positions and ignores further columns such as normals and colours. Numbers may be separated by white
/// space, commas, semicolons or what a line such as `sep=|` names, and may have decimal commas. Lines before the first point
/// may be comments, the number of points or the names of the columns. A first column with numbers of points is ignored. An
/// empty cell is a missing coordinate. The headers of PTX scans are applied.
///
/// In a PTS file, the number before the points is theirs, so fewer points are refused.
pub(super) fn read(bytes: &[u8], is_pts: bool, limits: &MeshLimits) -> Result<Mesh, MeshError> {
    text::check_lines(bytes)?;
    let separated = odd_separator(bytes).map(|odd| with_semicolons(bytes, odd));
    let bytes = separated.as_deref().unwrap_or(bytes);
    let found = if let Some(points) = ptx::points(bytes, limits) {
        points?
    } else {
        let points = plain_or_quoted_points(bytes, limits)?;
        if is_pts {
            check_stated(bytes, points.len() as u64)?;
        }
        points
    };
    Ok(Mesh {
        vertices: found.into(),
        ..Mesh::default()
    })
}

/// Returns the separator that a line at the beginning of a file names, if it is none of the usual ones.
fn odd_separator(bytes: &[u8]) -> Option<u8> {
    let mut lines = text::lines(bytes).take(TITLE_LINES);
    let named = lines.find_map(|(_, line)| named_separator(line))?;
    let is_odd = named.is_ascii_punctuation() && !b",;.+-'\"#%/=".contains(&named);
    is_odd.then_some(named)
}

/// Returns a text with semicolons in place of another separator.
fn with_semicolons(bytes: &[u8], separator: u8) -> Vec<u8> {
    let usual = |byte: &u8| if *byte == separator { b';' } else { *byte };
    polled(bytes).map(usual).collect()
}

/// Reads points, also with cells in quotation marks. Of two errors, returns that of the later line, because the way of reading
/// that got there fits the file better.
fn plain_or_quoted_points(bytes: &[u8], limits: &MeshLimits) -> Result<Vec<[f64; 3]>, MeshError> {
    let found = points(bytes, limits);
    let is_understood = match &found {
        Ok(points) => !points.is_empty(),
        Err(fault) => !matches!(fault, MeshError::Line { .. }),
    };
    let unquoted = (!is_understood)
        .then(|| quoted::plain_text(bytes))
        .flatten();
    let Some(unquoted) = unquoted else {
        return found;
    };
    let plain = unquoted.and_then(|plain| points(&plain, limits));
    let plain = plain.map_err(|fault| quoted::with_cell_of(bytes, fault));
    let line = |fault: &MeshError| match fault {
        MeshError::Line { line, .. } => *line,
        _ => u64::MAX,
    };
    match (found, plain) {
        (Err(fault), Err(of_plain)) if line(&fault) > line(&of_plain) => Err(fault),
        (_, plain) => plain,
    }
}

fn points(bytes: &[u8], limits: &MeshLimits) -> Result<Vec<[f64; 3]>, MeshError> {
    let layout = PointLayout::of(bytes)?;
    check_lacking_numbers(bytes, &layout)?;
    let points = positions(bytes, &layout, limits)?;
    if let Some(numbered) = behind_numbers(bytes, &layout, &points) {
        let points = positions(bytes, &numbered, limits)?;
        return check_grid(bytes, &numbered, &points).map(|()| points);
    }
    check_first_column(bytes, &layout, &points)?;
    check_grid(bytes, &layout, &points).map(|()| points)
}

/// Returns the layout of coordinates behind a first column that has the numbers of points, or one number. `None` if it has
/// neither. `points` are read with this column as x.
fn behind_numbers(bytes: &[u8], layout: &PointLayout, points: &[[f64; 3]]) -> Option<PointLayout> {
    let numbered = layout.numbered()?;
    let has_numbers = are_numbers(points) || is_one_number(bytes, layout, points);
    has_numbers.then_some(numbered)
}

fn positions(
    bytes: &[u8],
    layout: &PointLayout,
    limits: &MeshLimits,
) -> Result<Vec<[f64; 3]>, MeshError> {
    let mut points = Vec::with_capacity((bytes.len() / SHORTEST_LINE).min(1 << 16));
    let mut scan_end = None;
    for (line, row) in layout.rows(bytes) {
        match layout.position(row) {
            Ok(point) => {
                limits.check_vertices(points.len() as u64 + 1)?;
                points.push(point);
            }
            Err(reason) => {
                // The next scan of a PTS file begins with its count where the one before it ends.
                let have = points.len() as u64;
                let of_first = || title::stated_count(bytes, layout.first_point);
                let end = scan_end.or_else(|| of_first().map(|(_, count)| count));
                let count = title::count_of(row).filter(|_| end == Some(have));
                let count = count.ok_or(MeshError::Line { line, reason })?;
                scan_end = Some(have.saturating_add(count));
            }
        }
    }
    Ok(points)
}

/// Checks that a PTS file has as many points as its first line and the first lines of further scans say. More points are read:
/// the number may be one of something else.
///
/// # Errors
/// Returns an error that names the line with the number of the last scan.
fn check_stated(bytes: &[u8], points: u64) -> Result<(), MeshError> {
    // Points with quotation marks may have no such layout.
    let Ok(layout) = PointLayout::of(bytes) else {
        return Ok(());
    };
    let Some((mut line, mut want)) = title::stated_count(bytes, layout.first_point) else {
        return Ok(());
    };
    let (mut first, mut before) = (0, 0);
    for (number, row) in layout.rows(bytes) {
        if layout.position(row).is_ok() {
            before += 1;
        } else if let Some(count) = title::count_of(row) {
            (line, first, want) = (number, before, count);
        }
    }
    let have = points.saturating_sub(first);
    if have < want {
        return Err(MeshError::FewerPoints { line, have, want });
    }
    Ok(())
}

/// The columns of a long file, of which only some lines are read.
#[derive(Debug, Clone, Copy)]
pub(super) struct SampledPoints {
    layout: PointLayout,
    /// The separator of cells, if it is none of the usual ones.
    odd_separator: Option<u8>,
    /// Bytes at the beginning of the file that have no points, although their lines look like some.
    pub(super) header_bytes: u64,
}

impl SampledPoints {
    /// Determines the columns by whole lines at the beginning of a file.
    ///
    /// # Errors
    /// Returns an error if the title has more columns than the points.
    pub(super) fn of(head: &[u8]) -> Result<Self, MeshError> {
        let header = ptx::header_bytes(head).unwrap_or_default();
        let head = &head[header..];
        let odd_separator = odd_separator(head);
        let separated = odd_separator.map(|odd| with_semicolons(head, odd));
        let head = separated.as_deref().unwrap_or(head);
        let layout = PointLayout::of(head)?;
        let numbered = layout.numbered().and_then(|_| {
            let rows = layout.rows(head);
            let positions = rows.filter_map(|(_, row)| layout.position(row).ok());
            let mut first = None;
            let possible = positions.map(|point| {
                let is_first = point[0] == *first.get_or_insert(point[0]);
                (is_first || point[0].fract() == 0.0).then_some(point)
            });
            let points: Option<Vec<_>> = possible.collect();
            behind_numbers(head, &layout, &points?)
        });
        Ok(Self {
            layout: numbered.unwrap_or(layout),
            odd_separator,
            header_bytes: header as u64,
        })
    }

    /// Returns the position in a line. `None` if it has none, such as a title.
    pub(super) fn position(&self, raw: &[u8]) -> Option<[f64; 3]> {
        let separated = self.odd_separator.map(|odd| with_semicolons(raw, odd));
        let row = self.layout.row(separated.as_deref().unwrap_or(raw))?;
        self.layout.position(row).ok()
    }
}

#[cfg(test)]
mod count_tests {
    use crate::mesh::{MeshLimits, read};

    #[test]
    fn fewer_points_than_a_pts_file_states_are_refused() {
        let row = |k: u32| format!("{}.5 {}.25 1.125 0.5\n", k * 5 % 11, k % 7);
        let rows = |count: u32| (0..count).map(row).collect::<String>();
        let open = |text: &str, name: &str| {
            let read = read(text.as_bytes(), name, &MeshLimits::SUGGESTED);
            read.map(|mesh| mesh.vertices.len())
                .map_err(|error| error.to_string())
        };
        let cut = format!("20\n{}", rows(17));
        let said = "line 1 says that 20 points follow, but 17 do; copy the file again if it was cut, or correct the number";
        assert_eq!(open(&cut, "a.PTS"), Err(said.to_owned()));
        // The number may be another one, such as a date.
        assert_eq!(open(&cut, "a.xyz"), Ok(17));
        let several = format!("17\n{}20\n{}", rows(17), rows(5));
        let said = "line 19 says that 20 points follow, but 5 do; copy the file again if it was cut, or correct the number";
        assert_eq!(open(&several, "a.pts"), Err(said.to_owned()));
        for (count, have) in [("17", 17), ("12", 17), ("", 17)] {
            let text = format!("{count}\n{}", rows(17));
            assert_eq!(open(&text, "a.pts"), Ok(have), "{count}");
        }
        let several = format!("17\n{}5\n{}", rows(17), rows(5));
        assert_eq!(open(&several, "a.pts"), Ok(22));
    }
}
