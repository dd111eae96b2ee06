//! Reader of XYZ point sets: text files in which each line starts with the three coordinates of a point.

use super::{Mesh, MeshError, MeshLimits, error, text};

/// Bytes of the shortest line: three digits, two spaces, a line end.
const SHORTEST_LINE: usize = 6;

/// Reads the positions and ignores further columns such as normals and colours. Numbers may be separated by white
/// space, commas or semicolons. The first line may be the number of points or the names of the columns.
pub(super) fn read(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    text::check_lines(bytes)?;
    let mut vertices = Vec::with_capacity((bytes.len() / SHORTEST_LINE).min(1 << 16));
    let mut first = true;
    for (line_number, line) in text::lines(bytes) {
        if is_comment(line) || (std::mem::take(&mut first) && is_title(line)) {
            continue;
        }
        let position = text::position(cells(line)).map_err(|reason| MeshError::Line {
            line: line_number,
            reason,
        })?;
        let count = vertices.len() as u64 + 1;
        limits.check_vertices(count)?;
        vertices.push(error::check_finite(position, count)?);
    }
    Ok(Mesh {
        vertices: vertices.into(),
        ..Mesh::default()
    })
}

/// Returns whether a file that begins with this line may be a point set.
pub(super) fn is_data_or_title(line: &[u8]) -> bool {
    is_title(line) || text::position(cells(line)).is_ok()
}

fn is_comment(line: &[u8]) -> bool {
    line.is_empty() || line.starts_with(b"#") || line.starts_with(b"//")
}

/// Returns whether a line is a count of points, or columns named x, y, z.
fn is_title(line: &[u8]) -> bool {
    let words: Vec<Vec<u8>> = cells(line)
        .take(3)
        .map(<[u8]>::to_ascii_lowercase)
        .collect();
    match words.as_slice() {
        [count] => count.iter().all(u8::is_ascii_digit),
        [x, y, z] => [x, y, z] == [b"x", b"y", b"z"],
        _ => false,
    }
}

fn cells(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|byte| byte.is_ascii_whitespace() || matches!(byte, b',' | b';'))
        .filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, MeshError, MeshLimits, read};

    fn open(text: &str) -> Result<Mesh, MeshError> {
        read(text.as_bytes(), "scan.xyz", &MeshLimits::SUGGESTED)
    }

    #[test]
    fn titles_counts_comments_and_further_columns_are_ignored() {
        let plain = open("1 2 3\n4 5 6\n").expect("reads");
        assert_eq!(
            plain.vertices,
            vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]].into()
        );
        assert!(plain.triangles.is_empty());
        for text in [
            "2\n1 2 3 255 0 0\n4 5 6 255 0 0\n",
            "x,y,z,nx\n1,2,3,0\n4,5,6,0\n",
            "# scan\n\n1;2;3\n4;5;6",
            "//X Y Z\n1\t2\t3\n4\t5\t6\n",
        ] {
            assert_eq!(open(text).expect(text), plain, "{text}");
        }
    }

    #[test]
    fn a_bad_line_is_named() {
        assert_eq!(
            open("1 2 3\n4 5\n").expect_err("short").to_string(),
            "line 2: 2 of 3 coordinates"
        );
        assert_eq!(
            open("1 2 3\n4 x 6\n").expect_err("word").to_string(),
            "line 2: \"x\" is not a number"
        );
        assert!(matches!(
            open("1 2 3\n4 inf 6\n"),
            Err(MeshError::NotFinite { vertex: 2, .. })
        ));
        assert_eq!(open("0\n"), Err(MeshError::NoVertices));
    }
}
