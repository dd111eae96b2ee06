//! The size of a mesh by parts of its file, for a look before all of it is read.

use std::io::{self, Read, Seek, SeekFrom};

use super::error::{MeshError, MeshLimits, MeshReadError};
use super::extreme_vertices::ExtremeVertices;
use super::far_values::{FarValues, VertexKind, find_far_values};
use super::format::DetectedFormat;
use super::missing::is_position;
use super::ply::VertexRows;
use super::robust_bounds::Bounds;
use super::stated_unit::stated_unit;
use super::triangle_mesh::Vertices;
use super::triangle_stream::binary_stl_triangles;
use super::xyz::SampledPoints;
use super::{stl, text};
use crate::domain::cancel::poll;
use crate::domain::{LengthUnit, are_zeros, has_only_zeros};
use crate::page_vec::fill;

/// Files of at most this length are read as a whole.
pub(super) const WHOLE_BYTES: u64 = 4 << 20;
/// Bytes at the beginning of a longer file that show its format. They hold the longest header of a PLY file.
const HEAD_BYTES: u64 = (1 << 20) + (1 << 12);
/// Places of a longer file for its size.
const FOR_SIZE: SampleSpread = SampleSpread {
    parts: 64,
    bytes: 16 << 10,
};
/// Places of a longer file for a picture of it.
pub(super) const FOR_PICTURE: SampleSpread = SampleSpread {
    parts: 16 << 10,
    bytes: 256,
};

/// The end of a longer OBJ, where it has faces.
const END_OF_FILE: SampleSpread = SampleSpread {
    parts: 1,
    bytes: 16 << 10,
};

/// Places of a file, evenly spread, from which vertices are read.
#[derive(Debug, Clone, Copy)]
pub(super) struct SampleSpread {
    /// Number of places.
    parts: u64,
    /// Bytes that are read at each place; of binary rows, as many whole rows as fit, but at least one.
    bytes: u64,
}

/// What parts of its file say about a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshExtent {
    /// Lengths of the box along the axes around the vertices that were read, in the unit of the mesh. `None` if none was
    /// found.
    pub sides: Option<[f64; 3]>,
    /// Whether all vertices were read. Otherwise the mesh may be a little larger.
    pub is_exact: bool,
    /// The unit that the file names in a comment.
    pub unit: Option<LengthUnit>,
}

impl MeshExtent {
    /// Returns the longest side, in the unit of the mesh.
    pub fn longest(&self) -> Option<f64> {
        let sides = self.sides?;
        Some(sides.into_iter().fold(0.0, f64::max))
    }

    /// Describes vertices that are all of a file, which begins with `head`.
    pub(super) fn of_all(vertices: impl Iterator<Item = [f64; 3]>, head: &[u8]) -> Self {
        let mut seen = GrowingBox::default();
        vertices.for_each(|vertex| seen.add(vertex));
        Self {
            sides: seen.sides(),
            is_exact: true,
            unit: stated_unit(head),
        }
    }
}

/// Describes a mesh by parts of its file of `len` bytes.
///
/// # Errors
/// Returns an error if the file is no mesh, ends early as far as its header shows, exceeds a limit, or cannot be read.
pub(super) fn sampled(
    file: &mut (impl Read + Seek),
    len: u64,
    name: &str,
    limits: &MeshLimits,
) -> Result<MeshExtent, MeshReadError> {
    let (positions, unit) = some_positions(file, (len, name), limits, FOR_SIZE)?;
    let mut seen = GrowingBox::default();
    for position in positions {
        seen.add(position);
    }
    Ok(MeshExtent {
        sides: seen.sides(),
        is_exact: false,
        unit,
    })
}

/// Returns vertices at some places of a file with a length and a name, without numbers that stand for a missing position, and the
/// unit that the file names.
pub(super) fn some_positions(
    file: &mut (impl Read + Seek),
    (len, name): (u64, &str),
    limits: &MeshLimits,
    spread: SampleSpread,
) -> Result<(Vec<[f64; 3]>, Option<LengthUnit>), MeshReadError> {
    let mut found = Vec::new();
    let (unit, kind) = each_position(file, (len, name), limits, spread, &mut |position| {
        found.push(position);
    })?;
    let vertices: Vertices = found.into();
    let far_values = far_values_of(&vertices, kind);
    let is_kept = |vertex: &[f64; 3]| !far_values.are_at(*vertex);
    Ok((vertices.iter().filter(is_kept).collect(), unit))
}

/// Finds what stands for missing positions in a binary STL with some triangles, at places spread over the file.
///
/// # Errors
/// Returns an error if the file cannot be read.
pub fn far_values_of_stl(file: &mut (impl Read + Seek), triangles: u32) -> io::Result<FarValues> {
    let len = stl::HEADER as u64 + stl::FACET as u64 * u64::from(triangles);
    let mut found = Vec::new();
    each_corner(file, len, FOR_SIZE, &mut |corner| found.push(corner))?;
    let vertices = Vertices::Single(found.into());
    Ok(far_values_of(&vertices, VertexKind::Corners))
}

fn far_values_of(vertices: &Vertices, kind: VertexKind) -> FarValues {
    let extremes = ExtremeVertices::of(vertices, is_position);
    find_far_values(vertices, kind, &extremes, is_position)
}

/// Visits the corners of facets at some places of a binary STL of `len` bytes.
fn each_corner(
    file: &mut (impl Read + Seek),
    len: u64,
    spread: SampleSpread,
    visit: &mut dyn FnMut([f32; 3]),
) -> io::Result<()> {
    let facets = [stl::HEADER as u64, len];
    each_part(file, facets, stl::FACET as u64, spread, |part| {
        let (facets, _) = part.as_chunks::<{ stl::FACET }>();
        facets.iter().flat_map(stl::corners).for_each(&mut *visit);
    })
}

/// Visits vertices at some places of a file with a length and a name. Returns the unit that the file names, and what the
/// vertices are. Visits none if their places are not known, and leaves out repeated vertices at the origin, which have no
/// position, except in an STL.
fn each_position(
    file: &mut (impl Read + Seek),
    (len, name): (u64, &str),
    limits: &MeshLimits,
    spread: SampleSpread,
    visit: &mut dyn FnMut([f64; 3]),
) -> Result<(Option<LengthUnit>, VertexKind), MeshReadError> {
    let mut head = Vec::new();
    file.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
    if are_zeros(&head) && has_only_zeros(file)? {
        return Err(MeshError::OnlyZeros.into());
    }
    let unit = stated_unit(&head);
    if let Some(count) = binary_stl_triangles(&head, len, name)? {
        limits.check_triangles(u64::from(count))?;
        each_corner(file, len, spread, &mut |corner| {
            visit(corner.map(f64::from));
        })?;
        return Ok((unit, VertexKind::Corners));
    }
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head);
    let lines = TextLines {
        start: (head.len() - text.len()) as u64,
        end: len,
        line_end: if text::is_classic_mac(text) {
            b'\r'
        } else {
            b'\n'
        },
    };
    let (mut origins, mut has_faces) = (0_u64, false);
    let mut visit_other = |position: [f64; 3]| {
        if position == [0.0; 3] {
            origins += 1;
        } else {
            visit(position);
        }
    };
    match DetectedFormat::of(text, name)? {
        DetectedFormat::Ply => {
            has_faces = ply_parts(file, text, lines, limits, spread, &mut visit_other)?;
        }
        DetectedFormat::Obj => {
            let mut visit_line = |line: &[u8]| {
                let position = after_keyword(line, b"v");
                position.into_iter().for_each(&mut visit_other);
                has_faces |= is_face_of_obj(line);
            };
            lines.visit(file, spread, &mut visit_line)?;
            // The places that are read may miss a few faces, which are nearly always at the end.
            lines.at_end().visit(file, END_OF_FILE, |line| {
                has_faces |= is_face_of_obj(line);
            })?;
        }
        DetectedFormat::StlAscii => {
            lines.visit(file, spread, |line| {
                let position = after_keyword(line, b"vertex");
                position.into_iter().for_each(&mut *visit);
            })?;
            return Ok((unit, VertexKind::Corners));
        }
        DetectedFormat::Xyz => {
            let points = SampledPoints::of(whole_lines(text, lines.line_end, true))?;
            let rows = TextLines {
                start: lines.start + points.header_bytes,
                ..lines
            };
            rows.visit(file, spread, |line| {
                points.position(line).into_iter().for_each(&mut visit_other);
            })?;
        }
        // Its length is not the one that its header implies.
        DetectedFormat::StlBinary => {}
    }
    if origins == 1 {
        visit([0.0; 3]);
    }
    let kind = if has_faces {
        VertexKind::Shared
    } else {
        VertexKind::Points
    };
    Ok((unit, kind))
}

/// Returns whether a line of an OBJ is a face with three or more corners. Other faces are left out.
fn is_face_of_obj(line: &[u8]) -> bool {
    let mut words = text::words(line);
    words.next() == Some(b"f") && words.take(3).count() == 3
}

/// Returns the position that follows a keyword at the beginning of a line.
fn after_keyword(line: &[u8], keyword: &[u8]) -> Option<[f64; 3]> {
    let mut words = text::words(line);
    let is_vertex = words.next()?.eq_ignore_ascii_case(keyword);
    is_vertex.then(|| text::position(words).ok()).flatten()
}

/// Visits vertices of a PLY file, which begins with `head`. `lines` is all of the file behind a byte order mark. Returns whether
/// its header counts faces.
fn ply_parts(
    file: &mut (impl Read + Seek),
    head: &[u8],
    lines: TextLines,
    limits: &MeshLimits,
    spread: SampleSpread,
    visit: &mut dyn FnMut([f64; 3]),
) -> Result<bool, MeshReadError> {
    let Some(rows) = VertexRows::of(head, lines.end - lines.start)? else {
        return Ok(false);
    };
    limits.check_vertices(rows.rows)?;
    let mut add = |row: &[u8]| {
        rows.position(row).into_iter().for_each(&mut *visit);
    };
    let start = lines.start + rows.start;
    if let Some(size) = rows.size {
        let end = start + size * rows.rows;
        each_part(file, [start, end], size, spread, |part| {
            part.chunks_exact(size as usize).for_each(&mut add);
        })?;
        return Ok(rows.has_faces);
    }
    // A row is about as long as the first ones. Other elements follow.
    let first = head.get(rows.start as usize..).unwrap_or_default();
    let count = memchr::memchr_iter(lines.line_end, first).count().max(1);
    let about = rows.rows.saturating_mul(first.len() as u64) / count as u64;
    let end = start.saturating_add(about / 10 * 9).min(lines.end);
    let places = TextLines {
        start,
        end,
        ..lines
    };
    places.visit(file, spread, add)?;
    Ok(rows.has_faces)
}

/// Visits parts of the rows between two offsets. The first part begins at the first one.
fn each_part(
    file: &mut (impl Read + Seek),
    [start, end]: [u64; 2],
    row: u64,
    spread: SampleSpread,
    mut visit: impl FnMut(&[u8]),
) -> io::Result<()> {
    let rows = end.saturating_sub(start) / row;
    let most = (spread.bytes / row).max(1).min(rows);
    let mut bytes = vec![0; (most * row) as usize];
    for part in 0..spread.parts {
        poll();
        // Even distances would meet the rows of a grid in stripes. Multiples of the golden ratio spread without a pattern.
        let shift = (part as f64 * std::f64::consts::GOLDEN_RATIO).fract();
        let share = (part as f64 + shift) / spread.parts as f64;
        let first = ((rows - most) as f64 * share) as u64;
        file.seek(SeekFrom::Start(start + first * row))?;
        let have = fill(file, &mut bytes)?;
        visit(&bytes[..have]);
    }
    Ok(())
}

/// Lines between two offsets of a file.
#[derive(Debug, Clone, Copy)]
struct TextLines {
    /// Offset of the first line.
    start: u64,
    end: u64,
    /// Byte that ends a line.
    line_end: u8,
}

impl TextLines {
    /// Returns the lines at the end, of which [`END_OF_FILE`] reads all.
    fn at_end(self) -> Self {
        let start = self.end.saturating_sub(END_OF_FILE.bytes).max(self.start);
        Self { start, ..self }
    }

    /// Visits lines at some places, with white space at their ends.
    fn visit(
        self,
        file: &mut (impl Read + Seek),
        spread: SampleSpread,
        mut visit: impl FnMut(&[u8]),
    ) -> io::Result<()> {
        let mut is_first = true;
        each_part(file, [self.start, self.end], 1, spread, |part| {
            let lines = whole_lines(part, self.line_end, std::mem::take(&mut is_first));
            let lines = lines.split(|byte| *byte == self.line_end);
            lines.for_each(&mut visit);
        })
    }
}

/// Returns the whole lines in a part of a text, without the last line end. `begins_line` says whether the first byte begins a
/// line.
fn whole_lines(part: &[u8], line_end: u8, begins_line: bool) -> &[u8] {
    let first = if begins_line {
        Some(0)
    } else {
        memchr::memchr(line_end, part).map(|end| end + 1)
    };
    let last = memchr::memrchr(line_end, part);
    let range = first.zip(last).filter(|(first, last)| first <= last);
    let lines = range.map(|(first, last)| &part[first..last]);
    lines.unwrap_or_default()
}

/// The box around the positions that were seen.
#[derive(Debug, Clone, Copy, Default)]
struct GrowingBox(Option<Bounds<3>>);

impl GrowingBox {
    fn add(&mut self, position: [f64; 3]) {
        if !is_position(position) {
            return;
        }
        let [low, high] = self.0.get_or_insert([position; 2]);
        for axis in 0..3 {
            low[axis] = low[axis].min(position[axis]);
            high[axis] = high[axis].max(position[axis]);
        }
    }

    fn sides(&self) -> Option<[f64; 3]> {
        let [low, high] = self.0?;
        Some([0, 1, 2].map(|axis| high[axis] - low[axis]))
    }
}

#[cfg(test)]
mod tests;
