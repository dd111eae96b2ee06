//! Single-pass parser of OBJ text: `v` lines with decimal numbers, `f` lines with any form of index.

use crate::domain::cancel::{PollCounter, polled};
use crate::mesh::error::MeshLimits;
use crate::mesh::text;
use crate::mesh::triangle_mesh::{Mesh, Vertices};
use crate::page_vec::PageVec;

/// Digits that fit a 64-bit mantissa without overflow.
const MAX_DIGITS: usize = 19;
/// Mantissas below this are exact as a 64-bit float.
const EXACT_BELOW: u64 = 1 << 53;
/// Powers of ten that 64-bit floats represent exactly. The quotient of an exact mantissa and an exact power is rounded
/// only once, so it is the float nearest to the decimal number (Clinger 1990, doi:10.1145/93542.93557).
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];
/// Digits of an index that is parsed without a check for overflow.
const MAX_INDEX_DIGITS: usize = 18;
/// Estimates of the bytes that a file needs per vertex and per triangle. They are high, so that too little memory is
/// reserved rather than too much.
const BYTES_PER_VERTEX: usize = 96;
const BYTES_PER_TRIANGLE: usize = 48;

/// The geometry of a file as written.
pub(super) struct ParsedObj {
    /// Positions, in the mesh's unit.
    pub(super) vertices: PageVec<[f64; 3]>,
    /// Indices of vertices, from 0; they may lie beyond the last vertex.
    pub(super) triangles: PageVec<[u32; 3]>,
    /// Whether every coordinate is finite.
    is_finite: bool,
}

/// Parses a file, up to the vertex or face that exceeds the limits. Returns `None` if its lines end in CR only, a line is continued on the next, or a `v` or `f` line
/// contains an invalid number or index.
pub(super) fn parse(bytes: &[u8], limits: &MeshLimits) -> Option<ParsedObj> {
    // Lines of classic Mac OS end in a carriage return only.
    if !text::contains(bytes, b'\n') && text::contains(bytes, b'\r') {
        return None;
    }
    let mut vertices: PageVec<[f64; 3]> = PageVec::with_capacity(bytes.len() / BYTES_PER_VERTEX);
    let mut triangles = PageVec::with_capacity(bytes.len() / BYTES_PER_TRIANGLE);
    let mut cursor = LineCursor {
        rest: bytes,
        is_finite: true,
    };
    let mut counter = PollCounter::default();
    while !cursor.rest.is_empty() && limits.allow(vertices.len(), triangles.len()) {
        let before = cursor.rest.len();
        cursor.skip_space();
        match cursor.rest {
            [b'v', space, rest @ ..] if is_space(*space) => {
                cursor.rest = rest;
                vertices.push(cursor.position()?);
            }
            [b'f', space, rest @ ..] if is_space(*space) => {
                cursor.rest = rest;
                cursor.face(vertices.len(), &mut triangles, limits)?;
            }
            _ => {}
        }
        cursor.next_line()?;
        counter.add(text::poll_items(before - cursor.rest.len()));
    }
    Some(ParsedObj {
        vertices,
        triangles,
        is_finite: cursor.is_finite,
    })
}

impl ParsedObj {
    /// Keeps the vertices that faces use, in the order of their first use, or all vertices if there are no faces.
    /// Returns `None` if an index is out of range or a kept coordinate is not finite.
    pub(super) fn into_mesh(self) -> Option<Mesh> {
        let Self {
            mut vertices,
            mut triangles,
            is_finite,
        } = self;
        if !triangles.is_empty() {
            vertices = in_order_of_use(&vertices, &mut triangles)?;
        }
        let is_kept_finite = || vertices.as_flattened().iter().all(|v| v.is_finite());
        (is_finite || is_kept_finite()).then_some(Mesh {
            vertices: Vertices::Double(vertices),
            triangles,
        })
    }
}

/// The unread part of a file.
struct LineCursor<'a> {
    rest: &'a [u8],
    /// Whether every number so far is finite.
    is_finite: bool,
}

impl LineCursor<'_> {
    fn skip_space(&mut self) {
        while let [byte, rest @ ..] = self.rest
            && is_space(*byte)
        {
            self.rest = rest;
        }
    }

    /// Moves to the next line; returns `None` if this one is continued there.
    fn next_line(&mut self) -> Option<()> {
        let len = self.rest.iter().position(|byte| *byte == b'\n');
        let (line, rest) = self.rest.split_at(len.unwrap_or(self.rest.len()));
        self.rest = rest.get(1..).unwrap_or_default();
        (!line.trim_ascii_end().ends_with(b"\\")).then_some(())
    }

    /// Parses the first three words; a weight and colours may follow.
    fn position(&mut self) -> Option<[f64; 3]> {
        let mut position = [0.0; 3];
        for value in &mut position {
            self.skip_space();
            *value = self.number()?;
        }
        Some(position)
    }

    /// Parses a number up to the end of its word.
    fn number(&mut self) -> Option<f64> {
        let word = self.rest;
        let negative = word.first() == Some(&b'-');
        self.rest = &word[usize::from(negative)..];
        let mut mantissa = 0;
        let whole = self.digits(&mut mantissa);
        let mut places = 0;
        if let [b'.', rest @ ..] = self.rest {
            self.rest = rest;
            places = self.digits(&mut mantissa);
        }
        let is_exact = (1..=MAX_DIGITS).contains(&(whole + places)) && mantissa < EXACT_BELOW;
        if is_exact && self.is_at_end_of_word() {
            let value = mantissa as f64 / POWERS_OF_TEN[places];
            return Some(if negative { -value } else { value });
        }
        let len = word.iter().position(|byte| is_end_of_word(*byte));
        let (word, rest) = word.split_at(len.unwrap_or(word.len()));
        self.rest = rest;
        let value: f64 = text::parse(word)?;
        self.is_finite &= value.is_finite();
        Some(value)
    }

    /// Reads decimal digits, appends them to `number` and returns their count. On overflow, `number` wraps around.
    #[inline]
    fn digits(&mut self, number: &mut u64) -> usize {
        let before = self.rest.len();
        while let [digit @ b'0'..=b'9', rest @ ..] = self.rest {
            *number = number
                .wrapping_mul(10)
                .wrapping_add(u64::from(digit - b'0'));
            self.rest = rest;
        }
        before - self.rest.len()
    }

    fn is_at_end_of_word(&self) -> bool {
        self.rest.first().is_none_or(|byte| is_end_of_word(*byte))
    }

    /// Parses the corners of a polygon and appends the polygon as a fan of triangles around its first corner.
    /// `vertices` is the number of vertices parsed so far. Polygons of fewer than three corners add nothing. Stops at the
    /// first triangle that exceeds the limits.
    fn face(
        &mut self,
        vertices: usize,
        triangles: &mut PageVec<[u32; 3]>,
        limits: &MeshLimits,
    ) -> Option<()> {
        let (mut first, mut last) = (0, 0);
        for count in polled(0..) {
            self.skip_space();
            let is_end = matches!(self.rest, [] | [b'\n' | b'#', ..]);
            if is_end || triangles.len() as u64 > limits.max_triangles {
                break;
            }
            let corner = self.corner(vertices)?;
            match count {
                0 => first = corner,
                1 => {}
                _ => triangles.push([first, last, corner]),
            }
            last = corner;
        }
        Some(())
    }

    /// Parses `v`, `v/vt`, `v//vn` or `v/vt/vn` and returns the vertex's index, from 0. `vertices` is the number of
    /// vertices parsed so far. A negative index counts back from the last of them.
    fn corner(&mut self, vertices: usize) -> Option<u32> {
        let index = self.index()?;
        let mut parts = 1;
        while let [b'/', rest @ ..] = self.rest {
            self.rest = rest;
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
        let place = u32::try_from(place).ok();
        place.filter(|_| self.is_at_end_of_word())
    }

    /// Parses an integer.
    fn index(&mut self) -> Option<i64> {
        let word = self.rest;
        let sign = usize::from(matches!(word.first(), Some(b'-' | b'+')));
        self.rest = &word[sign..];
        let mut index = 0;
        match self.digits(&mut index) {
            0 => None,
            1..=MAX_INDEX_DIGITS if word[0] == b'-' => Some(-(index as i64)),
            1..=MAX_INDEX_DIGITS => Some(index as i64),
            digits => text::parse(&word[..sign + digits]),
        }
    }
}

/// White space within a line.
const fn is_space(byte: u8) -> bool {
    byte.is_ascii_whitespace() && byte != b'\n'
}

const fn is_end_of_word(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == b'#'
}

/// Returns the vertices that triangles use, in the order of their first use, and renumbers the triangles to match.
/// Returns `None` if an index is out of range.
fn in_order_of_use(
    all: &[[f64; 3]],
    triangles: &mut PageVec<[u32; 3]>,
) -> Option<PageVec<[f64; 3]>> {
    const UNUSED: u32 = u32::MAX;
    let mut new_index = vec![UNUSED; all.len()];
    let mut vertices = PageVec::with_capacity(all.len());
    for index in polled(triangles.as_flattened_mut()) {
        let new = new_index.get_mut(*index as usize)?;
        if *new == UNUSED {
            *new = vertices.len() as u32;
            vertices.push(all[*index as usize]);
        }
        *index = *new;
    }
    Some(vertices)
}
