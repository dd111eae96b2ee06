//! Reader of PTX: scans on a grid, each with a header that moves its points to a common frame.

use super::title::is_count;
use crate::mesh::text;
use crate::mesh::{MeshError, MeshLimits};

/// Lines of a header: columns, rows, the place and axes of the scanner, and four rows of a matrix.
const HEADER_LINES: usize = 10;

/// The header of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PtxHeader {
    points: u64,
    /// Rows of the matrix that a position is multiplied with from the left. The last one is the shift.
    matrix: [[f64; 4]; 4],
}

impl PtxHeader {
    /// Reads a header from its lines. Returns `None` if they are no header.
    fn of(lines: &[&[u8]]) -> Option<Self> {
        let &[columns, rows, ref rest @ ..] = lines else {
            return None;
        };
        let (scanner, matrix) = rest.split_at_checked(4)?;
        let is_scanner = scanner.iter().all(|line| numbers::<3>(line).is_some());
        let matrix: Option<Vec<[f64; 4]>> = matrix.iter().map(|line| numbers(line)).collect();
        let matrix: [[f64; 4]; 4] = matrix?.try_into().ok()?;
        if !is_scanner {
            return None;
        }
        Some(Self {
            points: count(columns)?.checked_mul(count(rows)?)?,
            matrix,
        })
    }

    /// Moves a position of the scan to the common frame. A point at the origin was not measured.
    fn moved(&self, position: [f64; 3]) -> [f64; 3] {
        if position == [0.0; 3] {
            return [f64::NAN; 3];
        }
        let [x, y, z] = position;
        let [of_x, of_y, of_z, shift] = &self.matrix;
        [0, 1, 2].map(|axis| x * of_x[axis] + y * of_y[axis] + z * of_z[axis] + shift[axis])
    }
}

/// Returns the number that is alone in a line.
fn count(line: &[u8]) -> Option<u64> {
    let is_number = !line.is_empty() && is_count(line);
    is_number.then(|| text::parse(line)).flatten()
}

/// Returns the numbers of a line that has `N` of them and nothing else.
fn numbers<const N: usize>(line: &[u8]) -> Option<[f64; N]> {
    let mut words = text::words(line);
    let mut found = [0.0; N];
    for value in &mut found {
        *value = text::number(words.next()?).filter(|value| value.is_finite())?;
    }
    words.next().is_none().then_some(found)
}

/// Returns the length of the header that a file of PTX begins with; `None` if it is no such file.
pub(super) fn header_bytes(bytes: &[u8]) -> Option<usize> {
    let raw: Vec<&[u8]> = text::raw_lines(bytes)
        .take(HEADER_LINES)
        .map(|(_, raw)| raw)
        .collect();
    let lines: Vec<&[u8]> = raw.iter().map(|line| line.trim_ascii()).collect();
    PtxHeader::of(&lines)?;
    let with_ends: usize = raw.iter().map(|line| line.len() + 1).sum();
    Some(with_ends.min(bytes.len()))
}

/// Reads the points of all scans, in their common frame; a point that was not measured is NaN. Returns `None` if the file
/// does not begin with a header of PTX.
///
/// # Errors
/// Returns an error if a line is no point, a scan is not complete, or there are too many points.
pub(super) fn points(
    bytes: &[u8],
    limits: &MeshLimits,
) -> Option<Result<Vec<[f64; 3]>, MeshError>> {
    header_bytes(bytes)?;
    Some(all_points(bytes, limits))
}

fn all_points(bytes: &[u8], limits: &MeshLimits) -> Result<Vec<[f64; 3]>, MeshError> {
    let mut points = Vec::new();
    let lines = text::lines(bytes).filter(|(_, line)| !line.is_empty());
    let mut lines = lines.peekable();
    while let Some((line, _)) = lines.peek().copied() {
        let header = lines.by_ref().take(HEADER_LINES).map(|(_, line)| line);
        let header: Vec<&[u8]> = header.collect();
        let header = PtxHeader::of(&header).ok_or_else(|| MeshError::Line {
            line,
            reason: "no header of a PTX scan begins here; the scan before it may have more points than its header says"
                .into(),
        })?;
        limits.check_vertices(header.points.saturating_add(points.len() as u64))?;
        for have in 0..header.points {
            let truncated = || MeshError::Truncated {
                format: "PTX scan",
                what: "vertices".into(),
                have,
                want: header.points,
            };
            let (line, content) = lines.next().ok_or_else(truncated)?;
            let position = text::position(text::words(content)).map_err(|reason| {
                // Two lines of one number each begin the header of the next scan.
                let next = lines.peek().map(|(_, next)| *next);
                let is_header = [Some(content), next]
                    .iter()
                    .all(|of| of.and_then(count).is_some());
                if is_header {
                    truncated()
                } else {
                    MeshError::Line { line, reason }
                }
            })?;
            points.push(header.moved(position));
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use crate::mesh::{MeshLimits, MeshRead, read_from};

    fn open(text: &str) -> Result<MeshRead, String> {
        let about = text.len() as u64;
        let read = read_from(&mut text.as_bytes(), about, "a.ptx", &MeshLimits::SUGGESTED);
        read.map_err(|error| error.to_string())
    }

    /// Returns a scan of two columns and two rows, moved by 10 along x and turned from x to y.
    fn scan(shift: u32) -> String {
        format!(
            "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n{shift} 0 0 1\n\
             1 0 5 0.5\n0 0 0 0.5\n0 2 6 0.5 9 9 9\n0.25 0.5 7 0.25\n"
        )
    }

    #[test]
    fn the_points_of_all_scans_are_moved_and_unmeasured_ones_are_counted() {
        let first = [[10.0, 1.0, 5.0], [8.0, 0.0, 6.0], [9.5, 0.25, 7.0]];
        let one = open(&scan(10)).expect("reads");
        assert_eq!(one.mesh.vertices, first.to_vec().into());
        assert_eq!(one.losses.missing_vertices, 1);
        let both = open(&format!("{}{}", scan(10), scan(20))).expect("reads");
        let second = first.map(|[x, y, z]| [x + 10.0, y, z]);
        assert_eq!(both.mesh.vertices, [first, second].concat().into());
        assert_eq!(both.losses.missing_vertices, 2);
        assert_eq!(open(&scan(10).replace('\n', "\r\n")), Ok(one));
    }

    #[test]
    fn a_scan_with_another_number_of_points_is_refused() {
        let text = scan(10);
        let cut = &text[..text.len() - "0.25 0.5 7 0.25\n".len()];
        assert_eq!(
            open(cut).expect_err("cut"),
            "the PTX scan is truncated: it holds 3 of 4 vertices"
        );
        let followed = open(&format!("{cut}{text}"));
        assert_eq!(followed.expect_err("cut"), open(cut).expect_err("cut"));
        let more = open(&format!("{text}1 2 3 0.5\n")).expect_err("more");
        assert!(
            more.starts_with("line 15: no header of a PTX scan begins here; "),
            "{more}"
        );
    }
}
