//! Reader of Wavefront OBJ files (<https://paulbourke.net/dataformats/obj/>).
//!
//! The module `plain` reads a file in a single pass over its bytes. If it rejects the file, the `v` and `f` lines are
//! rewritten without continuations, comments and extra columns, and parsed again. If that fails too, the first fault is
//! reported with its position in the file.
//!
//! Normals, texture coordinates, colours, groups and materials are not used. The tests compare the results with the
//! crate `tobj`, which takes 6 times as long on 500,000 vertices and does not report where a fault is.

mod plain;
#[cfg(test)]
mod tests;

use super::error::{self, MeshError, MeshLimits};
use super::text;
use super::triangle_mesh::Mesh;
use crate::domain::cancel::polled;

/// Reads an OBJ file.
///
/// A mesh with faces holds the vertices that its faces use, in the order of their first use. A file without faces is a
/// point set with all its vertices.
///
/// # Errors
/// Returns an error if the file exceeds the limits, a line is too long, a `v` or `f` line cannot be parsed, a face refers to a missing
/// vertex, or a used coordinate is not finite.
pub(super) fn read(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    text::check_lines(bytes)?;
    if let Some(parsed) = plain::parse(bytes, limits) {
        limits.check_vertices(parsed.vertices.len() as u64)?;
        limits.check_triangles(parsed.triangles.len() as u64)?;
        if let Some(mesh) = parsed.into_mesh() {
            return Ok(mesh);
        }
    }
    let joined = join_continued_lines(bytes);
    let bytes = joined.as_deref().unwrap_or(bytes);
    text::check_lines(bytes)?;
    let [vertices, triangles] = count(bytes);
    limits.check_vertices(vertices)?;
    limits.check_triangles(triangles)?;
    plain::parse(&plain_lines(bytes), limits)
        .and_then(plain::ParsedObj::into_mesh)
        .ok_or_else(|| find_fault(bytes))
}

/// A line that defines geometry, without its comment.
enum Record<'a> {
    /// Words after `v`.
    Vertex(&'a [u8]),
    /// Words after `f`: at least three corners.
    Face(&'a [u8]),
}

/// Returns the geometry lines of a file with their line numbers, counted from 1.
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

/// Counts the vertices and triangles of a file.
fn count(bytes: &[u8]) -> [u64; 2] {
    records(bytes).fold([0; 2], |[vertices, triangles], (_, record)| match record {
        Record::Vertex(_) => [vertices + 1, triangles],
        Record::Face(rest) => [vertices, triangles + text::words(rest).count() as u64 - 2],
    })
}

/// Joins each line that ends in a backslash with the next line. Returns `None` if no line ends in a backslash.
fn join_continued_lines(bytes: &[u8]) -> Option<Vec<u8>> {
    let ends = |at: usize| matches!(bytes.get(at), Some(b'\n' | b'\r'));
    let mut places = polled(0..bytes.len())
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

/// Rewrites the geometry lines with single spaces and line feeds. Drops a weight or colours after the three coordinates
/// of a vertex. Keeps all corners of a face.
fn plain_lines(bytes: &[u8]) -> Vec<u8> {
    let mut lines = Vec::with_capacity(bytes.len());
    for (_, record) in records(bytes) {
        let (keyword, rest, most) = match record {
            Record::Vertex(rest) => (b'v', rest, 3),
            Record::Face(rest) => (b'f', rest, usize::MAX),
        };
        lines.push(keyword);
        for word in text::words(rest).take(most) {
            lines.push(b' ');
            lines.extend_from_slice(word);
        }
        // Because of the space, the parser rejects a `v` without coordinates. Otherwise it would ignore the line.
        lines.extend_from_slice(b" \n");
    }
    lines
}

/// Returns the first fault of a file that the parser rejected.
fn find_fault(bytes: &[u8]) -> MeshError {
    let [vertices, _] = count(bytes);
    let (mut vertex, mut face) = (0, 0);
    for (line, record) in records(bytes) {
        let fault = match record {
            Record::Vertex(rest) => {
                vertex += 1;
                match text::position(text::words(rest)) {
                    Err(reason) => Some(MeshError::Line { line, reason }),
                    Ok(position) => error::check_finite(position, vertex).err(),
                }
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
        reason: "the OBJ cannot be read".into(),
    }
}

/// Returns the fault of a face, if it has one: a corner that is not one to three integers with slashes between them, or
/// an index outside the file's vertices. A negative index counts back from the last vertex defined before the face.
fn face_fault(rest: &[u8], line: u64, face: u64, (before, all): (u64, u64)) -> Option<MeshError> {
    for corner in text::words(rest) {
        let parts = || corner.split(|byte| *byte == b'/');
        for part in parts().filter(|p| !p.is_empty()) {
            if text::parse::<i64>(part).is_none() {
                let reason = text::not_a_number(part);
                return Some(MeshError::Line { line, reason });
            }
        }
        if parts().skip(3).any(|part| !part.is_empty()) {
            let reason = format!("corner {} has more than three indices", text::quote(corner));
            return Some(MeshError::Line { line, reason });
        }
        let Some(index) = parts().next().and_then(text::parse::<i64>) else {
            let reason = format!("corner {} names no vertex", text::quote(corner));
            return Some(MeshError::Line { line, reason });
        };
        let from_one = if index < 0 {
            (before as i64).saturating_add(index).saturating_add(1)
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
