//! Wavefront OBJ: plain files by our own pass over them, all others through `tobj`.
//!
//! `tobj` is handed the `v` and `f` lines alone: groups and materials would cut the mesh into parts with repeated
//! vertices, normals and texture corners are not used, and names may be in any encoding.

mod quick;

use std::io::{BufRead, Read};

use super::{Mesh, MeshError, MeshLimits, error, text};

const OPTIONS: tobj::LoadOptions = tobj::LoadOptions {
    single_index: false,
    triangulate: true,
    ignore_points: true,
    ignore_lines: true,
};

/// Reads an OBJ. With faces, its vertices are those the faces use, in the order of their first use; without
/// faces it is a point set.
pub(super) fn read(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    quick::read(bytes, limits).map_or_else(|| read_by_tobj(bytes, limits), Ok)
}

fn read_by_tobj(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    let joined = join_continued_lines(bytes);
    let bytes = joined.as_deref().unwrap_or(bytes);
    let counts = count(bytes);
    limits.check_vertices(counts.vertices)?;
    limits.check_triangles(counts.triangles)?;
    if counts.triangles == 0 {
        return read_points(bytes);
    }
    let mut reader = Filtered::new(bytes);
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut reader, &OPTIONS, no_materials)
        .map_err(|reason| find_fault(bytes, reason))?;
    let mesh = joined_models(models);
    if !mesh.vertices.iter().flatten().all(f64::is_finite) {
        return Err(find_fault(bytes, tobj::LoadError::PositionParseError));
    }
    Ok(mesh)
}

/// The models end to end. Without groups there is one, and `tobj` keeps the vertices of one model apart from
/// those of the next.
fn joined_models(models: Vec<tobj::Model>) -> Mesh {
    let mut mesh = Mesh::default();
    for model in models {
        let offset = mesh.vertices.len() as u32;
        let (positions, _) = model.mesh.positions.as_chunks::<3>();
        let (triangles, _) = model.mesh.indices.as_chunks::<3>();
        mesh.vertices.extend(positions.iter().copied());
        mesh.triangles
            .extend(triangles.iter().map(|t| t.map(|index| index + offset)));
    }
    mesh
}

/// A line of use to us, without its comment.
enum Record<'a> {
    /// Words after `v`.
    Vertex(&'a [u8]),
    /// Words after `f`: three corners at least.
    Face(&'a [u8]),
}

fn records(bytes: &[u8]) -> impl Iterator<Item = (u64, Record<'_>)> {
    text::lines(bytes).filter_map(|(number, line)| Some((number, record(line)?)))
}

fn record(line: &[u8]) -> Option<Record<'_>> {
    let (keyword, rest) = line.split_at_checked(1)?;
    if !rest.first().is_some_and(u8::is_ascii_whitespace) {
        return None;
    }
    let rest = rest.split(|byte| *byte == b'#').next().unwrap_or_default();
    match keyword {
        b"v" => Some(Record::Vertex(rest)),
        b"f" if text::words(rest).nth(2).is_some() => Some(Record::Face(rest)),
        _ => None,
    }
}

#[derive(Default)]
struct Counts {
    vertices: u64,
    triangles: u64,
}

fn count(bytes: &[u8]) -> Counts {
    let mut counts = Counts::default();
    for (_, record) in records(bytes) {
        match record {
            Record::Vertex(_) => counts.vertices += 1,
            Record::Face(rest) => counts.triangles += text::words(rest).count() as u64 - 2,
        }
    }
    counts
}

/// Lines that end in a backslash run on in the next; `None` when there are none.
fn join_continued_lines(bytes: &[u8]) -> Option<Vec<u8>> {
    let ends = |at: usize| matches!(bytes.get(at), Some(b'\n' | b'\r'));
    let mut places = (0..bytes.len())
        .filter(|at| bytes[*at] == b'\\' && ends(at + 1))
        .peekable();
    places.peek()?;
    let mut joined = bytes.to_vec();
    for at in places {
        let crlf = joined.get(at + 1..at + 3) == Some(b"\r\n");
        joined[at..=at + 1 + usize::from(crlf)].fill(b' ');
    }
    Some(joined)
}

fn read_points(bytes: &[u8]) -> Result<Mesh, MeshError> {
    let mut vertices = Vec::new();
    for (line, record) in records(bytes) {
        if let Record::Vertex(rest) = record {
            let position = text::position(text::words(rest))
                .map_err(|reason| MeshError::Line { line, reason })?;
            vertices.push(error::finite(position, vertices.len() as u64 + 1)?);
        }
    }
    Ok(Mesh {
        vertices: vertices.into(),
        ..Mesh::default()
    })
}

/// Hands `tobj` one record after the other: three coordinates of a vertex (a weight `w` serves curves only, colours
/// are not used), all corners of a face.
struct Filtered<'a> {
    records: Box<dyn Iterator<Item = (u64, Record<'a>)> + 'a>,
    line: Vec<u8>,
    at: usize,
}

impl<'a> Filtered<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self {
            records: Box::new(records(bytes)),
            line: Vec::new(),
            at: 0,
        }
    }

    fn fill_line(&mut self, record: &Record<'_>) {
        let (keyword, rest, most) = match record {
            Record::Vertex(rest) => (b'v', rest, 3),
            Record::Face(rest) => (b'f', rest, usize::MAX),
        };
        self.line.clear();
        self.at = 0;
        self.line.push(keyword);
        for word in text::words(rest).take(most) {
            self.line.push(b' ');
            self.line.extend_from_slice(word);
        }
        self.line.push(b'\n');
    }
}

impl BufRead for Filtered<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.at == self.line.len()
            && let Some((_, record)) = self.records.next()
        {
            self.fill_line(&record);
        }
        Ok(&self.line[self.at..])
    }

    fn consume(&mut self, amount: usize) {
        self.at += amount;
    }
}

impl Read for Filtered<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let read = self.fill_buf()?.read(out)?;
        self.consume(read);
        Ok(read)
    }
}

/// Finds what `tobj` stumbled over, since it does not tell the place.
fn find_fault(bytes: &[u8], reason: tobj::LoadError) -> MeshError {
    let vertices = count(bytes).vertices;
    let (mut vertex, mut face) = (0, 0);
    for (line, record) in records(bytes) {
        let fault = match record {
            Record::Vertex(rest) => {
                vertex += 1;
                vertex_fault(rest, line, vertex)
            }
            Record::Face(rest) => {
                face += 1;
                face_fault(rest, line, face, (vertex, vertices))
            }
        };
        if let Some(error) = fault {
            return error;
        }
    }
    MeshError::Line {
        line: 1,
        reason: format!("the OBJ cannot be read: {reason}"),
    }
}

fn vertex_fault(rest: &[u8], line: u64, vertex: u64) -> Option<MeshError> {
    match text::position(text::words(rest)) {
        Err(reason) => Some(MeshError::Line { line, reason }),
        Ok(position) => error::finite(position, vertex).err(),
    }
}

/// A corner that is no number, or outside of the file's vertices; a negative one counts back from the last vertex
/// before the face.
fn face_fault(rest: &[u8], line: u64, face: u64, (before, all): (u64, u64)) -> Option<MeshError> {
    for corner in text::words(rest) {
        for part in corner.split(|byte| *byte == b'/').filter(|p| !p.is_empty()) {
            if text::integer(part).is_none() {
                let reason = text::not_a_number(part);
                return Some(MeshError::Line { line, reason });
            }
        }
        let position = corner.split(|byte| *byte == b'/').next();
        let Some(index) = position.and_then(text::integer) else {
            let reason = format!("corner {} names no vertex", text::shown(corner));
            return Some(MeshError::Line { line, reason });
        };
        let from_one = if index < 0 {
            before as i64 + index + 1
        } else {
            index
        };
        if from_one < 1 || from_one > all as i64 {
            return Some(MeshError::IndexOutOfRange {
                face,
                index,
                vertices: all,
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, MeshError, MeshLimits};

    fn read(text: &str) -> Result<Mesh, MeshError> {
        super::read(text.as_bytes(), &MeshLimits::SUGGESTED)
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";

    #[test]
    fn all_ways_to_write_a_corner_give_the_same_mesh() {
        let plain = read(&format!("{SQUARE}f 1 2 3 4\n")).expect("reads");
        assert_eq!(plain.triangles, [[0, 1, 2], [0, 2, 3]]);
        for face in [
            "1/1 2/1 3/1 4/1",
            "1//1 2//1 3//1 4//1",
            "1/1/1 2/1/1 3/1/1 4/1/1",
            "-4 -3 -2 -1",
            "-4/-1/-1 -3/-1/-1 -2/-1/-1 -1/-1/-1",
            "1 2 3 \\\n 4",
            "1 2 3 4 # a square",
        ] {
            let mesh = read(&format!("{SQUARE}f {face}\n")).expect(face);
            assert_eq!(mesh, plain, "{face}");
        }
    }

    #[test]
    fn vertex_colours_and_weights_are_left_out() {
        let mesh = read("v 0 0 0 255 0 0\nv 2 0 0 2\nv 0 1 0 1 1 1 1\nf 1 2 3\n").expect("reads");
        assert_eq!(mesh.vertices.at(1), [2.0, 0.0, 0.0]);
        assert_eq!(mesh.vertices.len(), 3);
    }

    #[test]
    fn groups_and_materials_do_not_repeat_vertices() {
        let text = format!(
            "mtllib none.mtl\no a\n{SQUARE}g one\nusemtl red\nf 1 2 3\ng two\nusemtl blue\nf 1 3 4\n"
        );
        let mesh = read(&text).expect("reads");
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 2));
    }

    #[test]
    fn names_in_another_encoding_do_no_harm() {
        let mut bytes = b"o \xc0\xf1\xff\n".to_vec();
        bytes.extend_from_slice(SQUARE.as_bytes());
        bytes.extend_from_slice(b"f 1 2 3\n");
        assert!(super::read(&bytes, &MeshLimits::SUGGESTED).is_ok());
    }

    #[test]
    fn positions_keep_all_their_digits() {
        let mesh = read("v 1234567.123456789 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("reads");
        assert_eq!(mesh.vertices.at(0)[0], 1_234_567.123_456_789);
    }

    #[test]
    fn faces_of_two_corners_and_lines_are_left_out() {
        let mesh = read(&format!("{SQUARE}f 1 2\nf\nl 1 2 3\nf 1 2 3\n")).expect("reads");
        assert_eq!(mesh.triangles.len(), 1);
        let points = read(&format!("{SQUARE}f 1 2\n")).expect("reads");
        assert_eq!((points.vertices.len(), points.triangles.len()), (4, 0));
    }

    #[test]
    fn faults_are_told_by_their_place() {
        let fault = |text: &str| read(text).expect_err(text).to_string();
        assert_eq!(
            fault("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n"),
            "vertex 2 has the coordinate NaN, which is not a finite number"
        );
        assert_eq!(
            fault("v 0 0 0\nv 1 1e999 0\n"),
            "vertex 2 has the coordinate inf, which is not a finite number"
        );
        assert_eq!(
            fault(&format!("{SQUARE}f 1 2 3\nf 1 2 9\n")),
            "face 2 refers to vertex 9, but the file has 4 vertices"
        );
        assert_eq!(
            fault(&format!("{SQUARE}f 0 1 2\n")),
            "face 1 refers to vertex 0, but the file has 4 vertices"
        );
        assert_eq!(
            fault("v 0 0 0\nf -2 -1 -1\n"),
            "face 1 refers to vertex -2, but the file has 1 vertices"
        );
        assert_eq!(fault("v 0 0\n"), "line 1: 2 of 3 coordinates");
        assert_eq!(
            fault(&format!("{SQUARE}f 1 2 x\n")),
            "line 7: \"x\" is not a number"
        );
        assert_eq!(
            fault(&format!("{SQUARE}f /1 2 3\n")),
            "line 7: corner \"/1\" names no vertex"
        );
        assert_eq!(
            fault("v 0,5 0 0\nv 0 0 0\nv 1 1 1\nf 1 2 3\n"),
            "line 1: \"0,5\" is not a number"
        );
    }
}
