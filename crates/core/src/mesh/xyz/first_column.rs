//! A first column of points without a title that may be no coordinate although it does not number all points: it has gaps or
//! begins anew, some lines lack it, or it is the number of a scan or a time.

use super::layout::PointLayout;
use super::numbers::{NUMBERED_POINTS, has_normals, is_whole};
use super::time_order::is_time_order;
use crate::domain::cancel::polled;
use crate::mesh::MeshError;

/// Points at the beginning that show that most numbers are not whole.
const FIRST_POINTS: usize = 64;
/// Most places at which numbers of points begin anew or have gaps. The rows of a grid have more.
const MOST_BREAKS: usize = 9;
/// Lines that show whether some lack the first number.
const COMPARED_LINES: usize = 1000;

/// Returns whether the first column, read as x, is one number before coordinates, such as that of a scan or its time.
pub(super) fn is_one_number(bytes: &[u8], layout: &PointLayout, points: &[[f64; 3]]) -> bool {
    points.len() >= NUMBERED_POINTS
        && is_constant(points, 0)
        && has_coordinates_behind(bytes, layout)
}

/// Refuses lines of which some begin with a whole number and others do not have it.
///
/// # Errors
/// Returns an error that names the first line of the rarer kind.
pub(super) fn check_lacking_numbers(bytes: &[u8], layout: &PointLayout) -> Result<(), MeshError> {
    let Some([narrow, wide]) = layout.uneven_widths() else {
        return Ok(());
    };
    let (mut numbers, mut fractions) = (Vec::new(), Vec::new());
    let mut wholes = 0;
    for (line, row) in polled(layout.rows(bytes).take(COMPARED_LINES)) {
        let width = layout.width_of(row);
        let Some(first) = layout.first_number(row).filter(|_| width >= narrow) else {
            continue;
        };
        match (width == wide, first.fract() == 0.0) {
            (true, true) => numbers.push(line),
            (false, false) => fractions.push(line),
            (true, false) => return Ok(()),
            (false, true) => wholes += 1,
        }
    }
    if numbers.len().min(fractions.len()) < NUMBERED_POINTS || fractions.len() < wholes {
        return Ok(());
    }
    let (line, reason) = if layout.width == wide {
        let reason = format!(
            "it has {narrow} columns, but most lines have {wide}; it may lack the number that the others begin with"
        );
        (fractions[0], reason)
    } else {
        let reason = format!(
            "it has {wide} columns, but most lines have {narrow}; it may begin with a number that the others lack"
        );
        (numbers[0], reason)
    };
    Err(MeshError::Line { line, reason })
}

/// Refuses points whose first column may be x, or the numbers of points or scans, or times.
///
/// # Errors
/// Returns an error that names the first line without a number, or the first point.
pub(super) fn check_first_column(
    bytes: &[u8],
    layout: &PointLayout,
    points: &[[f64; 3]],
) -> Result<(), MeshError> {
    if layout.numbered().is_none() || points.len() < NUMBERED_POINTS {
        return Ok(());
    }
    let is_whole = is_mostly_whole(points);
    let is_likely = is_whole || is_time_order(points);
    if !is_likely || !(counts_up(points) || has_coordinates_behind(bytes, layout)) {
        return Ok(());
    }
    let most = layout.width;
    let mut widths = layout
        .rows(bytes)
        .map(|(line, row)| (line, layout.width_of(row)));
    let narrow = widths.find(|(_, width)| *width < most);
    let (line, reason) = match narrow.filter(|_| is_whole) {
        Some((line, width)) => (
            line,
            format!(
                "it has {width} columns, but most lines have {most}; it may lack the number that the others begin with"
            ),
        ),
        None if is_whole => (
            layout.first_point,
            "its first number may be x, or that of a point or a scan; name the columns in a line before the points, such as `n x y z`"
                .to_owned(),
        ),
        None => (
            layout.first_point,
            "its first number may be x or a time; name the columns in a line before the points, such as `t x y z`"
                .to_owned(),
        ),
    };
    Err(MeshError::Line { line, reason })
}

/// Returns whether the three columns behind the first one may be coordinates: they vary and have fractions, and no normals
/// follow what would be coordinates with the first one.
fn has_coordinates_behind(bytes: &[u8], layout: &PointLayout) -> bool {
    let Some(numbered) = layout.numbered().filter(|_| !has_normals(bytes, layout)) else {
        return false;
    };
    let rows = polled(numbered.rows(bytes));
    let behind: Vec<[f64; 3]> = rows
        .filter_map(|(_, row)| numbered.position(row).ok())
        .collect();
    behind.len() >= NUMBERED_POINTS
        && (0..3).all(|axis| !is_whole(&behind, axis) && !is_constant(&behind, axis))
}

fn is_constant(points: &[[f64; 3]], axis: usize) -> bool {
    polled(points.windows(2)).all(|pair| pair[0][axis] == pair[1][axis])
}

/// Returns whether nine of ten numbers are whole or missing.
fn is_mostly_whole(points: &[[f64; 3]]) -> bool {
    let has_fraction = |point: &&[f64; 3]| point[0].is_finite() && point[0].fract() != 0.0;
    let first = &points[..points.len().min(FIRST_POINTS)];
    if first.iter().filter(has_fraction).count() > first.len() / 2 {
        return false;
    }
    let odd = polled(points).filter(has_fraction).count();
    odd <= points.len() / 10
}

/// Returns whether numbers increase by one but at a few places.
fn counts_up(points: &[[f64; 3]]) -> bool {
    let breaks = polled(points.windows(2)).filter(|pair| pair[1][0] - pair[0][0] != 1.0);
    breaks.take(MOST_BREAKS + 1).count() <= MOST_BREAKS.min(points.len() / NUMBERED_POINTS)
}

#[cfg(test)]
mod tests {
    use crate::mesh::{MeshLimits, Vertices, read};

    /// Returns lines with a position each, after what `first` says of their number.
    fn rows(first: &dyn Fn(usize) -> String) -> String {
        let row = |k: usize| {
            let [x, y, z] = position(k);
            format!("{}{x} {y} {z}\n", first(k))
        };
        (0..60).map(row).collect()
    }

    fn position(k: usize) -> [f64; 3] {
        let [x, y] = [k % 8, k / 8].map(|at| at as f64);
        [
            x + 0.25,
            1.5 * y + 0.125,
            (9.0 * x + y).sin().mul_add(0.5, 2.0),
        ]
    }

    fn open(text: &str) -> Result<Vertices, String> {
        let mesh = read(text.as_bytes(), "scan.xyz", &MeshLimits::SUGGESTED);
        mesh.map(|mesh| mesh.vertices)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_line_without_its_number_is_named() {
        for without in [0, 30, 59] {
            let text = rows(&|k| {
                if k == without {
                    String::new()
                } else {
                    format!("{k} ")
                }
            });
            assert_eq!(
                open(&text),
                Err(format!(
                    "line {}: it has 3 columns, but most lines have 4; it may lack the number that the others begin with",
                    without + 1
                ))
            );
        }
    }

    #[test]
    fn many_lines_without_their_number_are_named() {
        let text = rows(&|k| {
            if k.is_multiple_of(3) {
                String::new()
            } else {
                format!("{k} ")
            }
        });
        let said = "line 1: it has 3 columns, but most lines have 4; it may lack the number that the others begin with";
        assert_eq!(open(&text), Err(said.to_owned()));
        let text = rows(&|k| {
            if k % 3 == 1 {
                format!("{k} ")
            } else {
                String::new()
            }
        });
        let said = "line 2: it has 4 columns, but most lines have 3; it may begin with a number that the others lack";
        assert_eq!(open(&text), Err(said.to_owned()));
        // A colour that only some points have.
        let row = |k: usize| {
            let [x, y, z] = position(k);
            format!("{x} {y} {z}{}\n", [" 7", ""][k % 2])
        };
        let text: String = (0..60).map(row).collect();
        assert_eq!(open(&text), Ok((0..60).map(position).collect()));
    }

    #[test]
    fn numbers_that_begin_anew_and_those_of_scans_are_refused_unless_columns_are_named() {
        let wanted: Vertices = (0..60).map(position).collect();
        let said = "line 1: its first number may be x, or that of a point or a scan; name the columns in a line before the points, \
                    such as `n x y z`";
        for text in [
            rows(&|k| format!("{} ", k % 40)),
            rows(&|k| format!("{} ", k / 10)),
            rows(&|k| format!("{} ", k.min(55))),
        ] {
            assert_eq!(open(&text).expect_err(&text), said);
            assert_eq!(open(&format!("n x y z\n{text}")).as_ref(), Ok(&wanted));
        }
        for one in ["7 ", "7.0 ", "0.5 "] {
            let text = rows(&|_| one.to_owned());
            assert_eq!(open(&text).as_ref(), Ok(&wanted), "{one}");
        }
        let whole = |k: usize| format!("{} {} {} {}\n", k % 40, 7 * k % 31, k / 8, k * k % 13);
        let whole: String = (0..60).map(whole).collect();
        assert_eq!(open(&whole).expect_err("whole numbers"), said);
    }

    #[test]
    fn times_are_refused_unless_columns_are_named() {
        let text = rows(&|k| format!("{} ", 100_000.5 + 0.001 * (k + k / 20) as f64));
        assert_eq!(
            open(&text).expect_err("times"),
            "line 1: its first number may be x or a time; name the columns in a line before the points, such as `t x y z`"
        );
        let named = open(&format!("t x y z\n{text}"));
        assert_eq!(named, Ok((0..60).map(position).collect()));
    }

    #[test]
    fn coordinates_on_whole_numbers_or_in_their_order_stay_coordinates() {
        let plain = |k: usize| {
            [
                (k / 8) as f64,
                1.5 * (k % 8) as f64 + 0.25,
                0.5 + (k % 7) as f64,
            ]
        };
        for more in ["128", "0.5", "255 128 0", "0.48 0.64 0.6"] {
            let row = |k: usize| {
                let [x, y, z] = plain(k);
                format!("{x} {y} {z} {more}\n")
            };
            let text: String = (0..60).map(row).collect();
            assert_eq!(open(&text), Ok((0..60).map(plain).collect()), "{more}");
        }
        let sorted = |k: usize| {
            [
                (k * k) as f64 * 0.011 + 0.005,
                0.5 + (k % 7) as f64,
                1.25 + (k % 5) as f64,
            ]
        };
        let row = |k: usize| {
            let [x, y, z] = sorted(k);
            format!("{x} {y} {z} 0.{}5\n", k % 9)
        };
        let text: String = (0..60).map(row).collect();
        assert_eq!(open(&text), Ok((0..60).map(sorted).collect()));
    }
}
