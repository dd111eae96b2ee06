//! Reader of PTX: scans on a grid, each with a header that moves its points to a common frame.

use super::title::count_of;
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
            points: count_of(columns)?.checked_mul(count_of(rows)?)?,
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

/// Returns the error of a scan that ends early.
fn truncated(what: &str, have: u64, want: u64) -> MeshError {
    MeshError::Truncated {
        format: "PTX scan",
        what: what.into(),
        have,
        want,
    }
}

/// Returns the number of whole lines of a header that is cut off behind or within its last line; `None` if the lines begin no
/// header.
fn cut_header_lines(lines: &[&[u8]]) -> Option<u64> {
    let fits = |(nth, line): (usize, &&[u8])| match nth {
        0 | 1 => count_of(line).is_some(),
        2..=5 => numbers::<3>(line).is_some(),
        _ => numbers::<4>(line).is_some(),
    };
    let whole = lines
        .iter()
        .enumerate()
        .take_while(|line| fits(*line))
        .count();
    (whole > 0 && whole + 1 >= lines.len()).then_some(whole as u64)
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
        let header = PtxHeader::of(&header).ok_or_else(|| {
            let is_end = lines.peek().is_none();
            match cut_header_lines(&header).filter(|_| is_end) {
                Some(have) => truncated("lines of its header", have, HEADER_LINES as u64),
                None => MeshError::Line {
                    line,
                    reason: "no header of a PTX scan begins here; the scan before it may have more points than its header says"
                        .into(),
                },
            }
        })?;
        limits.check_vertices(header.points.saturating_add(points.len() as u64))?;
        for have in 0..header.points {
            let cut = || truncated("vertices", have, header.points);
            let (line, content) = lines.next().ok_or_else(cut)?;
            let position = text::position(text::words(content)).map_err(|reason| {
                // Lines of one number each begin the header of the next scan, perhaps behind the rest of a line.
                let next = lines.peek().map(|(_, next)| *next).unwrap_or_default();
                let is_second = count_of(content).is_some() && numbers::<3>(next).is_some();
                if count_of(next).is_some() || is_second {
                    cut()
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
        let within_line = open(&format!("{cut}0.25 0.\n{text}"));
        assert_eq!(within_line.expect_err("cut"), open(cut).expect_err("cut"));
        let joined = open(&format!("{cut}0.25 0.{text}"));
        assert_eq!(joined.expect_err("cut"), open(cut).expect_err("cut"));
        let more = open(&format!("{text}1 2 3 0.5\n")).expect_err("more");
        assert!(
            more.starts_with("line 15: no header of a PTX scan begins here; "),
            "{more}"
        );
        let header = "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n0 0 0 1\n";
        let ends = header.match_indices('\n').map(|(at, _)| at + 1);
        for (lines, end) in (1..10).zip(ends) {
            for more in ["", "0 0.5 "] {
                let said = open(&format!("{text}{}{more}", &header[..end])).expect_err("cut");
                let wanted = format!(
                    "the PTX scan is truncated: it holds {lines} of 10 lines of its header"
                );
                assert_eq!(said, wanted, "{more:?}");
            }
        }
    }
}
