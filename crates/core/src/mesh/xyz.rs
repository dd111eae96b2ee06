//! Reader of XYZ point sets: text files in which each line has the coordinates of a point.

mod layout;

use super::{Mesh, MeshError, MeshLimits, text};
use crate::domain::cancel::polled;
use layout::PointLayout;

pub(super) use layout::{is_comment, is_data_or_title};

/// Bytes of the shortest line: three digits, two spaces, a line end.
const SHORTEST_LINE: usize = 6;
/// Fewest points that show that a column holds their numbers.
const NUMBERED_POINTS: usize = 10;

/// Reads the positions and ignores further columns such as normals and colours. Numbers may be separated by white
/// space, commas or semicolons, and may have decimal commas. Lines before the first point may be comments, the number of
/// points or the names of the columns. A first column with numbers of points is ignored.
pub(super) fn read(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    text::check_lines(bytes)?;
    let layout = PointLayout::of(bytes)?;
    let points = points(bytes, &layout, limits)?;
    let vertices = match layout.numbered() {
        Some(numbered) if are_numbers(&points) => self::points(bytes, &numbered, limits)?,
        _ => points,
    };
    Ok(Mesh {
        vertices: vertices.into(),
        ..Mesh::default()
    })
}

fn points(
    bytes: &[u8],
    layout: &PointLayout,
    limits: &MeshLimits,
) -> Result<Vec<[f64; 3]>, MeshError> {
    let mut points = Vec::with_capacity((bytes.len() / SHORTEST_LINE).min(1 << 16));
    let lines = text::lines(bytes).skip_while(|(line, _)| *line < layout.first_point);
    for (line, content) in lines {
        if is_comment(content) {
            continue;
        }
        let point = layout.position(content);
        let point = point.map_err(|reason| MeshError::Line { line, reason })?;
        limits.check_vertices(points.len() as u64 + 1)?;
        points.push(point);
    }
    Ok(points)
}

/// The columns of a long file, of which only some lines are read.
#[derive(Debug, Clone, Copy)]
pub(super) struct SampledPoints(PointLayout);

impl SampledPoints {
    /// Determines the columns by whole lines at the beginning of a file.
    ///
    /// # Errors
    /// Returns an error if the title has more columns than the first point.
    pub(super) fn of(head: &[u8]) -> Result<Self, MeshError> {
        let layout = PointLayout::of(head)?;
        let numbered = layout.numbered().filter(|_| {
            let lines = text::lines(head).filter(|(line, _)| *line >= layout.first_point);
            let points: Vec<_> = lines
                .filter_map(|(_, line)| layout.position(line).ok())
                .collect();
            are_numbers(&points)
        });
        Ok(Self(numbered.unwrap_or(layout)))
    }

    /// Returns the position in a line. `None` if it has none, such as a title.
    pub(super) fn position(&self, line: &[u8]) -> Option<[f64; 3]> {
        let is_point = !is_comment(line);
        is_point.then(|| self.0.position(line).ok()).flatten()
    }
}

/// Returns whether the first coordinates are whole and increasing numbers, as no scan has them.
fn are_numbers(points: &[[f64; 3]]) -> bool {
    let is_number = |pair: &[[f64; 3]]| pair[0][0] < pair[1][0] && pair[1][0].fract() == 0.0;
    points.len() >= NUMBERED_POINTS
        && points[0][0].fract() == 0.0
        && polled(points.windows(2)).all(is_number)
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, MeshError, MeshLimits, read};

    fn open(text: &str) -> Result<Mesh, MeshError> {
        read(text.as_bytes(), "scan.xyz", &MeshLimits::SUGGESTED)
    }

    fn refused(text: &str) -> String {
        open(text).expect_err(text).to_string()
    }

    const POINTS: [[f64; 3]; 2] = [[1.0, 2.5, 3.0], [4.0, 5.0, 6.25]];

    fn assert_points(text: &str) {
        let mesh = open(text).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(mesh.vertices, POINTS.to_vec().into(), "{text}");
        assert!(mesh.triangles.is_empty());
    }

    #[test]
    fn titles_counts_comments_and_further_columns_are_ignored() {
        for text in [
            "1 2.5 3\n4 5 6.25\n",
            "2\n1 2.5 3 255 0 0\n4 5 6.25 255 0 0\n",
            "x,y,z,nx\n1,2.5,3,0\n4,5,6.25,0\n",
            "# scan\n\n1;2.5;3\n4;5;6.25",
            "//X Y Z\n1\t2.5\t3\n4\t5\t6.25\n",
            "% made by a scanner, 2 points\n1 2.5 3\n% more\n4 5 6.25\n",
            "\"X\",\"Y\",\"Z\"\n1,2.5,3\n4,5,6.25\n",
            "\"scan of block 4\"\n2\nX [mm] Y [mm] Z [mm]\n1 2.5 3\n4 5 6.25\n",
            "X (mm);Y (mm);Z (mm)\n1;2.5;3\n4;5;6.25\n",
            "x_mm,y_mm,z_mm\n1,2.5,3\n4,5,6.25\n",
            "X Y Z\nmm mm mm\n1 2.5 3\n4 5 6.25\n",
            "X\tY\tZ\n[mm]\t[mm]\t[mm]\n1\t2.5\t3\n4\t5\t6.25\n",
            "# the axes are x y z\n1 2.5 3 0 0 0\n4 5 6.25 0 0 0\n",
        ] {
            assert_points(text);
        }
    }

    #[test]
    fn columns_are_those_that_the_title_names() {
        for text in [
            "z,y,x\n3,2.5,1\n6.25,5,4\n",
            "ID X Y Z\n7 1 2.5 3\n3 4 5 6.25\n",
            "# id x y z\n7 1 2.5 3\n3 4 5 6.25\n",
            "Point ID,X,Y,Z\n7,1,2.5,3\n3,4,5,6.25\n",
            "r;g;b;X;Y;Z\n0;0;0;1;2,5;3\n0;0;0;4;5;6,25\n",
        ] {
            assert_points(text);
        }
        assert_eq!(
            refused("Point number X Y Z\n7 1 2.5 3\n"),
            "line 1: it names 5 columns, but the first point has 4"
        );
    }

    #[test]
    fn a_first_column_of_increasing_numbers_is_no_coordinate() {
        let rows = |row: &dyn Fn(usize) -> String| (0..12).map(row).collect::<Vec<_>>().concat();
        let numbered = rows(&|k| format!("{} {} {} 1.5\n", 3 * k, k % 4, k / 4));
        let plain = rows(&|k| format!("{} {} 1.5\n", k % 4, k / 4));
        assert_eq!(open(&numbered), open(&plain));
        // Three columns are coordinates, and so are numbers that repeat.
        let three = rows(&|k| format!("{k} {} 1.5\n", k % 4));
        let grid = rows(&|k| format!("{} {} 1.5 9\n", k / 2, k % 4));
        let last = |text: &str| open(text).expect("reads").vertices.at(11);
        assert_eq!(
            (last(&three), last(&grid)),
            ([11.0, 3.0, 1.5], [5.0, 3.0, 1.5])
        );
    }

    #[test]
    fn decimal_commas_are_read_as_points() {
        for text in [
            "1,0 2,5 3,0\n4,0 5,0 6,25\n",
            "1 2,5 3\n4 5 6,25\n",
            "1;2,5;3\n4;5;6,25\n",
            "1\t2,50\t3\t0,5\n4\t5\t6,25\t0,5\n",
            "1,0, 2,5, 3,0\n4,0, 5,0, 6,25\n",
            "X;Y;Z\n1,0;2,5;3e0\n4;5;6,25\n",
            // Whole numbers come first.
            "4 5 6\n1,0 2,5 3\n4 5 6,25\n",
        ] {
            let last = text.split_once("4 5 6\n").map_or(text, |(_, rest)| rest);
            assert_points(last);
            let count = open(text).expect(text).vertices.len();
            assert_eq!(
                count,
                text.lines().filter(|line| !line.contains('X')).count(),
                "{text}"
            );
        }
        for text in [
            "1,2.5,3\n4,5,6.25\n",
            "1, 2.5, 3\n4, 5, 6.25",
            "1 ,2.5 ,3\n4 ,5 ,6.25\n",
        ] {
            assert_points(text);
        }
    }

    #[test]
    fn unclear_commas_are_refused() {
        assert_eq!(refused("1,5 2,5\n"), "line 1: 2 of 3 coordinates");
        assert!(refused("1 2 3\n1,000.5 2 3\n").starts_with("line 2: its commas"));
        for text in ["1,000.5 2 3\n", "1,000.5 2,000.5 3,000.5\n", "1 2,5.5 3\n"] {
            assert_eq!(
                refused(text),
                "line 1: its commas may separate numbers or be part of them; write spaces between numbers"
            );
        }
        assert_eq!(
            refused("1,5 2,5 3\n1.5 2 3\n"),
            "line 2: \"1.5\" has a point, but others have a comma"
        );
        assert_eq!(
            refused("1,5 2,5 3\n1,234,567 2 3\n"),
            "line 2: \"1.234,567\" is not a number"
        );
    }

    #[test]
    fn a_bad_line_is_named() {
        assert_eq!(refused("1 2 3\n4 5\n"), "line 2: 2 of 3 coordinates");
        assert_eq!(refused("1 2 3\n4 x 6\n"), "line 2: \"x\" is not a number");
        assert_eq!(
            refused("a scan of March\n1 2 3\n"),
            "line 1: \"a\" is not a number"
        );
        assert_eq!(
            refused("\"1\",\"2\",\"3\"\n"),
            "line 1: \"\"1\"\" is not a number"
        );
        assert_eq!(open("0\n"), Err(MeshError::NoVertices));
    }
}
