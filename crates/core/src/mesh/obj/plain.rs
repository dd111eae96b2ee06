//! Single-pass reader of OBJ files with usual lines only.

use crate::domain::cancel::{PollCounter, polled};
use crate::mesh::decimal;
use crate::mesh::error::{MeshError, MeshLimits};
use crate::mesh::text;
use crate::mesh::triangle_mesh::{Mesh, Vertices};
use crate::page_vec::PageVec;

/// Most digits of an index, so that it fits 64 bits.
const MAX_INDEX_DIGITS: usize = 18;
/// Estimates of the bytes that a file needs per vertex and per triangle. They are high, so that too little memory is
/// reserved rather than too much.
const BYTES_PER_VERTEX: usize = 96;
const BYTES_PER_TRIANGLE: usize = 48;

/// A line that [`read`] leaves to another reader, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct OddLine(pub(super) u64);

/// Reads a file with these lines only:
///
/// - an empty line or a comment, or one that begins with `vn`, `vt`, `g`, `o`, `s`, `usemtl` or `mtllib`
/// - `v` with three numbers, and then nothing, a weight of 1 or a colour
/// - `f` with corners: an integer, which up to two more and slashes may follow
///
/// Returns the mesh, and the number of faces with fewer than three corners, which are left out.
///
/// # Errors
/// Returns the first other line. The inner error says that the file exceeds the limits, or that a face refers to a missing
/// vertex.
pub(super) fn read(
    bytes: &[u8],
    limits: &MeshLimits,
) -> Result<Result<(Mesh, u64), MeshError>, OddLine> {
    if text::is_classic_mac(bytes) {
        return Err(OddLine(1));
    }
    let mut reader = PlainReader {
        rest: bytes,
        line: 1,
        vertices: PageVec::with_capacity(bytes.len() / BYTES_PER_VERTEX),
        triangles: PageVec::with_capacity(bytes.len() / BYTES_PER_TRIANGLE),
        last_used: (0, 1),
        incomplete_faces: 0,
    };
    let mut counter = PollCounter::default();
    while !reader.rest.is_empty() && limits.allow(reader.vertices.len(), reader.triangles.len()) {
        let before = reader.rest.len();
        reader.line(limits).ok_or(OddLine(reader.line))?;
        counter.add(text::poll_items(before - reader.rest.len()));
    }
    Ok(reader.into_mesh(limits))
}

/// The unread part of a file, and the geometry read so far.
struct PlainReader<'a> {
    rest: &'a [u8],
    /// The line that `rest` begins with, counted from 1.
    line: u64,
    /// Positions, in the mesh's unit.
    vertices: PageVec<[f64; 3]>,
    /// Indices of vertices, from 0; they may lie beyond the last vertex.
    triangles: PageVec<[u32; 3]>,
    /// The highest index in a face, and the first line with it.
    last_used: (u32, u64),
    /// Number of faces with fewer than three corners.
    incomplete_faces: u64,
}

impl<'a> PlainReader<'a> {
    /// Keeps the vertices that faces use, in the order of their first use, or all vertices if there are no faces.
    fn into_mesh(mut self, limits: &MeshLimits) -> Result<(Mesh, u64), MeshError> {
        limits.check_vertices(self.vertices.len() as u64)?;
        limits.check_triangles(self.triangles.len() as u64)?;
        if !self.triangles.is_empty() {
            let (index, line) = self.last_used;
            if index as usize >= self.vertices.len() {
                let reason = "a corner refers to a vertex that the file does not have".into();
                return Err(MeshError::Line { line, reason });
            }
            self.vertices = in_order_of_use(&self.vertices, &mut self.triangles);
        }
        let mesh = Mesh {
            vertices: Vertices::Double(self.vertices),
            triangles: self.triangles,
        };
        Ok((mesh, self.incomplete_faces))
    }

    /// Reads a line; returns `None` if it is another than [`read`] lists.
    #[inline]
    fn line(&mut self, limits: &MeshLimits) -> Option<()> {
        let mut text = TextCursor(self.rest);
        text.skip_space();
        self.rest = text.0;
        match text.0 {
            [b'v', space, rest @ ..] if is_space(*space) => self.vertex(TextCursor(rest))?,
            [b'f', space, rest @ ..] if is_space(*space) => self.face(TextCursor(rest), limits)?,
            rest => {
                if !is_ignored(rest) {
                    return None;
                }
            }
        }
        self.next_line();
        Some(())
    }

    fn next_line(&mut self) {
        let end = match self.rest {
            [b'\n', ..] => Some(0),
            rest => memchr::memchr(b'\n', rest),
        };
        let len = end.map_or(self.rest.len(), |end| end + 1);
        self.rest = &self.rest[len..];
        self.line += 1;
    }

    /// Parses three numbers, and skips a weight of 1 or the three or four words of a colour.
    fn vertex(&mut self, mut text: TextCursor<'a>) -> Option<()> {
        let mut position = [0.0; 3];
        for value in &mut position {
            text.skip_space();
            *value = text.number()?;
        }
        self.vertices.push(position);
        if let [b'\n', ..] = text.0 {
            self.rest = text.0;
            return Some(());
        }
        let (mut words, mut len, mut was_space) = (0, 0, true);
        for byte in text.0 {
            match byte {
                b'\n' | b'#' => break,
                byte if is_space(*byte) => was_space = true,
                _ => words += u32::from(std::mem::take(&mut was_space)),
            }
            len += 1;
        }
        let (rest, end) = text.0.split_at(len);
        self.rest = end;
        let is_plain = match words {
            1 => text::parse(rest.trim_ascii()) == Some(1.0),
            0 => true,
            words => matches!(words, 3 | 4) && !rest.trim_ascii_end().ends_with(b"\\"),
        };
        is_plain.then_some(())
    }

    /// Parses the corners of a polygon and appends the polygon as a fan of triangles around its first corner. Polygons with
    /// fewer than three corners are only counted. Stops at the first triangle that exceeds the limits.
    fn face(&mut self, mut text: TextCursor<'a>, limits: &MeshLimits) -> Option<()> {
        let before = self.triangles.len();
        let (mut first, mut last, mut highest) = (0, 0, 0);
        for count in polled(0..) {
            text.skip_space();
            let is_end = matches!(text.0, [] | [b'\n' | b'#', ..]);
            if is_end || self.triangles.len() as u64 > limits.max_triangles {
                self.incomplete_faces += u64::from(count < 3);
                break;
            }
            let corner = text.corner(self.vertices.len())?;
            match count {
                0 => first = corner,
                1 => {}
                _ => self.triangles.push([first, last, corner]),
            }
            last = corner;
            highest = highest.max(corner);
        }
        if self.triangles.len() > before && highest > self.last_used.0 {
            self.last_used = (highest, self.line);
        }
        self.rest = text.0;
        Some(())
    }
}

/// The unread part of a line and what follows it.
struct TextCursor<'a>(&'a [u8]);

impl TextCursor<'_> {
    #[inline]
    fn skip_space(&mut self) {
        while let [byte, rest @ ..] = self.0
            && is_space(*byte)
        {
            self.0 = rest;
        }
    }

    /// Parses a number up to the end of its word.
    fn number(&mut self) -> Option<f64> {
        if let Some((value, rest)) = decimal::parse(self.0)
            && rest.first().is_none_or(u8::is_ascii_whitespace)
        {
            self.0 = rest;
            return Some(value);
        }
        // A comment may follow at once, but `1.#IND` has none.
        let number_before = |is_end: fn(&u8) -> bool| {
            let len = self.0.iter().position(is_end).unwrap_or(self.0.len());
            let (word, rest) = self.0.split_at(len);
            text::number(word).map(|number| (number, rest))
        };
        let found = number_before(u8::is_ascii_whitespace);
        let (value, rest) = found.or_else(|| number_before(|byte| is_end_of_word(*byte)))?;
        self.0 = rest;
        Some(value)
    }

    /// Parses `v`, `v/vt`, `v//vn` or `v/vt/vn` and returns the vertex's index, from 0. A negative index counts back from
    /// the last of the vertices so far. An index that no vertex can have is returned as the highest.
    fn corner(&mut self, vertices: usize) -> Option<u32> {
        let index = self.index()?;
        let mut parts = 1;
        while let [b'/', rest @ ..] = self.0 {
            self.0 = rest;
            parts += 1;
            if let Some(b'-' | b'+' | b'0'..=b'9') = rest.first() {
                self.index().filter(|_| parts <= 3)?;
            }
        }
        let place = if index < 0 {
            vertices as i64 + index
        } else {
            index - 1
        };
        let place = u32::try_from(place).unwrap_or(u32::MAX);
        self.0
            .first()
            .is_none_or(|byte| is_end_of_word(*byte))
            .then_some(place)
    }

    /// Parses an integer of at most [`MAX_INDEX_DIGITS`] digits.
    #[inline]
    fn index(&mut self) -> Option<i64> {
        let is_negative = self.0.first() == Some(&b'-');
        let sign = usize::from(is_negative || self.0.first() == Some(&b'+'));
        let mut index = 0;
        let digits = decimal::read_digits(&self.0[sign..], &mut index);
        self.0 = &self.0[sign + digits..];
        let index = if is_negative {
            (index as i64).wrapping_neg()
        } else {
            index as i64
        };
        (1..=MAX_INDEX_DIGITS).contains(&digits).then_some(index)
    }
}

/// Returns whether a line that a text begins with has no geometry.
fn is_ignored(text: &[u8]) -> bool {
    if let [b'v', b'n' | b't', space, ..] = text
        && space.is_ascii_whitespace()
    {
        return true;
    }
    let len = text.iter().position(u8::is_ascii_whitespace);
    let keyword = &text[..len.unwrap_or(text.len())];
    matches!(
        keyword,
        [] | [b'#', ..] | b"vn" | b"vt" | b"g" | b"o" | b"s" | b"usemtl" | b"mtllib"
    )
}

/// White space within a line.
const fn is_space(byte: u8) -> bool {
    byte.is_ascii_whitespace() && byte != b'\n'
}

const fn is_end_of_word(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == b'#'
}

/// Returns the vertices that triangles use, in the order of their first use, and renumbers the triangles to match.
fn in_order_of_use(all: &[[f64; 3]], triangles: &mut PageVec<[u32; 3]>) -> PageVec<[f64; 3]> {
    const UNUSED: u32 = u32::MAX;
    let mut new_index = vec![UNUSED; all.len()];
    let mut vertices = PageVec::with_capacity(all.len());
    for index in polled(triangles.as_flattened_mut()) {
        let new = &mut new_index[*index as usize];
        if *new == UNUSED {
            *new = vertices.len() as u32;
            vertices.push(all[*index as usize]);
        }
        *index = *new;
    }
    vertices
}
