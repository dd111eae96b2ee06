//! Reads OBJ files with unusual lines by the crate `tobj`.
//!
//! `tobj` gets only `v` and `f` lines, because it makes faces of polylines (`l`), repeats vertices in each group, and may
//! overflow in indices of normals. Comments, colours and continuations are removed, because it does not read all of them
//! (<https://github.com/Twinklebear/tobj/issues/54>).

use std::fmt::Write as _;
use std::io::Cursor;
use std::path::Path;

use tobj::LoadError;

use super::plain::OddLine;
use crate::domain::cancel::{PolledReader, polled};
use crate::mesh::error::{MeshError, MeshLimits};
use crate::mesh::text;
use crate::mesh::triangle_mesh::{Mesh, Vertices};

/// Largest file. `tobj` takes 5 to 20 times as many bytes, and notices no cancellation after the last line.
const MAX_BYTES: usize = 128 << 20;

/// Reads a file whose first unusual line is `odd`. Returns the mesh, and the number of faces with fewer than three corners,
/// which are left out.
///
/// # Errors
/// Returns an error if the file exceeds the limits or `tobj` refuses it.
pub(super) fn read(
    bytes: &[u8],
    odd: OddLine,
    limits: &MeshLimits,
) -> Result<(Mesh, u64), MeshError> {
    if bytes.len() > MAX_BYTES {
        let reason =
            format!("an OBJ with such a line may have at most {MAX_BYTES} bytes; save it as PLY");
        return Err(MeshError::Line {
            line: odd.0,
            reason,
        });
    }
    let GeometryLines {
        mut text,
        vertices,
        triangles,
        incomplete_faces,
    } = GeometryLines::of(bytes, limits)?;
    if triangles == 0 {
        // `tobj` drops vertices without a face.
        for vertex in polled(1..=vertices) {
            writeln!(text, "f {vertex} {vertex} {vertex}").expect("a String takes any text");
        }
    }
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &Path| Err(LoadError::OpenFileFailed);
    let mut source = PolledReader(Cursor::new(text.as_bytes()));
    let loaded = tobj::load_obj_buf(&mut source, &options, no_materials);
    let read = &text.as_bytes()[..source.0.position() as usize];
    let (models, _) = loaded.map_err(|error| fault(error, read))?;
    let model = models
        .into_iter()
        .next()
        .expect("`tobj` adds a model at the end");
    let positions = model.mesh.positions.as_chunks().0;
    let corners = model.mesh.indices.as_chunks().0;
    let mesh = Mesh {
        vertices: Vertices::Double(polled(positions).copied().collect()),
        triangles: polled(corners).copied().take(triangles as usize).collect(),
    };
    Ok((mesh, incomplete_faces))
}

/// The lines for `tobj`.
struct GeometryLines {
    /// The lines of vertices and faces, with empty lines for all others.
    text: String,
    vertices: u64,
    triangles: u64,
    /// Number of faces with fewer than three corners.
    incomplete_faces: u64,
}

impl GeometryLines {
    fn of(bytes: &[u8], limits: &MeshLimits) -> Result<Self, MeshError> {
        let mut found = Self {
            text: String::with_capacity(bytes.len()),
            vertices: 0,
            triangles: 0,
            incomplete_faces: 0,
        };
        let mut lines = text::lines(bytes);
        while let Some((_, line)) = lines.next() {
            let line = String::from_utf8_lossy(line);
            let keyword = line.trim_end_matches('\\').split_whitespace().next();
            let mut joined = String::new();
            let mut ends = 1;
            if matches!(keyword, Some("v" | "f")) {
                joined += without_comment(&line);
                while joined.ends_with('\\') {
                    let (_, more) = lines.next().unwrap_or_default();
                    joined.pop();
                    joined = joined + " " + without_comment(&String::from_utf8_lossy(more));
                    ends += 1;
                }
            }
            let mut words: Vec<&str> = joined.split_whitespace().collect();
            for word in &mut words {
                if text::number(word.as_bytes()).is_some_and(f64::is_nan) {
                    *word = "NaN";
                }
            }
            let is_index = |corner: &&str| corner.parse::<i64>().is_ok();
            match words.as_slice() {
                ["f", corners @ ..] if corners.len() < 3 => {
                    found.incomplete_faces += 1;
                    if corners.iter().all(is_index) {
                        words.clear();
                    }
                }
                ["f", corners @ ..] => found.triangles += corners.len() as u64 - 2,
                ["v", rest @ ..] => {
                    found.vertices += 1;
                    match rest {
                        // `tobj` divides by a weight, but other programs do not. It refuses two numbers.
                        [_, _, _, weight] if weight.parse() != Ok(1.0) => words.push(weight),
                        [_, _, _, _, _, _] | [_, _, _, _, _, _, _] => words.truncate(4),
                        _ => {}
                    }
                }
                _ => {}
            }
            limits.check_vertices(found.vertices)?;
            limits.check_triangles(found.triangles)?;
            found.text += &words.join(" ");
            found.text.extend(std::iter::repeat_n('\n', ends));
        }
        Ok(found)
    }
}

/// Returns a line up to its comment. The `#` of `1.#IND` begins none.
fn without_comment(line: &str) -> &str {
    let is_comment = |at: &usize| !text::is_indefinite(&line.as_bytes()[at.saturating_sub(2)..]);
    let mut marks = line.match_indices('#').map(|(at, _)| at);
    marks
        .find(is_comment)
        .map_or(line, |at| &line[..at])
        .trim_ascii_end()
}

/// Says why `tobj` refused a file, of which it has read the lines up to that with the fault.
fn fault(error: LoadError, read: &[u8]) -> MeshError {
    let line = text::lines(read).count() as u64 - 1;
    let reason = match error {
        LoadError::FaceVertexOutOfBounds => return MeshError::NoSuchVertex,
        LoadError::PositionParseError => {
            let fault = text::lines(read).find(|(number, _)| *number == line);
            let words = text::words(fault.map_or(&[][..], |(_, line)| line));
            let reason = text::position(words.skip(1)).err();
            reason.unwrap_or_else(|| "a coordinate is missing or not a number".into())
        }
        LoadError::ColorParseError => {
            "neither a weight of 1 nor a colour follows the coordinates".into()
        }
        LoadError::FaceParseError => "a corner is not the number of a vertex".into(),
        other => other.to_string(),
    };
    MeshError::Line { line, reason }
}
