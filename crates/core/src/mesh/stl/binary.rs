//! Binary STL: an 80-byte header, a count, and 50 bytes a facet.

use std::io::{self, Read};

use crate::domain::cancel::{poll, polled};
use crate::mesh::error::{MeshError, MeshLimits, MeshReadError};
use crate::mesh::missing::PositionCheck;
use crate::mesh::triangle_mesh::{Mesh, Vertices};
use crate::page_vec::{PageVec, fill};

/// Name in messages.
const FORMAT: &str = "binary STL";
/// Bytes of the header, including the count.
pub(crate) const HEADER: usize = 84;
/// Bytes of a facet.
pub(crate) const FACET: usize = 50;
/// Facets that are checked at a time, and read from a file at a time.
const CHECKED_FACETS: usize = 128;
const READ_FACETS: usize = 1280;
/// Facets that show whether all facets of a body have some length.
const COMPARED_FACETS: usize = 1000;
/// Most attribute bytes of each facet that are recognized if further bytes follow the last facet.
const MAX_ATTRIBUTES: usize = 256;
/// Parts of [`CHECKED_FACETS`] between two polls for a cancellation.
const PARTS_PER_POLL: usize = 128;

/// Returns the count in the header; `None` if the file ends before it.
pub(crate) fn binary_count(bytes: &[u8]) -> Option<u32> {
    bytes
        .get(80..HEADER)
        .and_then(|count| count.try_into().ok())
        .map(u32::from_le_bytes)
}

/// Returns the number of triangles if a file of `len` bytes has exactly the size that its header implies. Such a file
/// is a binary STL even if it begins with `solid`.
pub(crate) fn whole_binary_count(bytes: &[u8], len: u64) -> Option<u32> {
    let holds = |count: &u32| len == HEADER as u64 + FACET as u64 * u64::from(*count);
    binary_count(bytes).filter(holds)
}

/// Reads the facets of a binary STL after its header, a buffer at a time.
pub(crate) fn read_facets(
    source: &mut impl Read,
    count: u32,
    limits: &MeshLimits,
) -> Result<(Mesh, PositionCheck), MeshReadError> {
    let mut facets = FacetBuffer::with_capacity(count, limits)?;
    let mut bytes = vec![0; FACET * (count as usize).min(READ_FACETS)];
    let mut left = count as usize;
    while left > 0 {
        let most = bytes.len().min(FACET * left);
        let bytes = &mut bytes[..most];
        let have = fill(source, bytes)?;
        let (whole, _) = bytes[..have].as_chunks();
        facets.push(whole);
        left -= whole.len();
        if have < bytes.len() {
            return Err(truncated(u64::from(count) - left as u64, count).into());
        }
    }
    if fill(source, &mut [0])? > 0 {
        return Err(io::Error::other("it grew while it was read").into());
    }
    Ok(facets.into_mesh()?)
}

/// Returns the error of a file that ends after `have` of `count` triangles.
pub(crate) fn truncated(have: u64, count: u32) -> MeshError {
    MeshError::Truncated {
        format: FORMAT,
        what: "triangles".into(),
        have,
        want: u64::from(count),
    }
}

/// Reads a binary STL. Ignores normals, attributes, text or NUL after the last triangle, and other trailing bytes that are
/// too few for a triangle.
pub(crate) fn read_binary(
    bytes: &[u8],
    limits: &MeshLimits,
) -> Result<(Mesh, PositionCheck), MeshError> {
    let count = binary_count(bytes).ok_or_else(|| MeshError::Truncated {
        format: FORMAT,
        what: "bytes of its header".into(),
        have: bytes.len() as u64,
        want: HEADER as u64,
    })?;
    let rest = &bytes[HEADER..];
    let (rows, _) = rest.as_chunks::<FACET>();
    let have = rows.len() as u64;
    if have < u64::from(count) {
        return Err(truncated(have, count));
    }
    let mut facets = FacetBuffer::with_capacity(count, limits)?;
    // A few bytes may follow the last facet, but as many for each facet are part of them.
    let is_each = !rest.is_empty() && rest.len().is_multiple_of(rows.len());
    if rest.len() == FACET * rows.len() && have == u64::from(count) {
        facets.push(rows);
    } else if let Some(with_attributes) = facets_with_attributes(rest, count) {
        for facet in with_attributes {
            facets.push(&[*facet]);
        }
    } else if (have == u64::from(count) && !is_each) || is_text_after(rest, count) {
        facets.push(&rows[..count as usize]);
    } else {
        return Err(uncounted(rest, count));
    }
    facets.into_mesh()
}

/// Returns whether the bytes after the facets are text, which may have NUL, or are all NUL. The floats of a facet never are
/// text.
fn is_text_after(body: &[u8], count: u32) -> bool {
    let after = body.get(FACET * count as usize..).unwrap_or_default();
    let zeros = polled(after).filter(|byte| **byte == 0).count();
    let has_text = 2 * zeros < after.len();
    let mut lines = polled(after.split(|byte| matches!(byte, 0 | b'\n')));
    let is_text = |line: &[u8]| {
        let is_usual = |c: char| !c.is_control() || c.is_ascii_whitespace();
        std::str::from_utf8(line).is_ok_and(|line| line.chars().all(is_usual))
    };
    count > 0 && !after.is_empty() && (zeros == after.len() || (has_text && lines.all(is_text)))
}

/// Returns the facets of a body in which the last two bytes of each are the length of attributes after it. Returns `None`
/// if such facets do not fill the body.
fn facets_with_attributes(mut rest: &[u8], count: u32) -> Option<Vec<&[u8; FACET]>> {
    let mut facets = Vec::new();
    for _ in polled(0..count) {
        let (facet, after) = rest.split_first_chunk()?;
        let length = u16::from_le_bytes([facet[FACET - 2], facet[FACET - 1]]);
        rest = after.get(usize::from(length)..)?;
        facets.push(facet);
    }
    rest.is_empty().then_some(facets)
}

/// Returns the error of a body with more bytes than `count` facets have.
fn uncounted(body: &[u8], count: u32) -> MeshError {
    let (bytes, want) = (body.len() as u64, u64::from(count));
    let facet = FACET as u64;
    let each = bytes.div_ceil(want.max(1));
    let is_longer = want > 0 && each > facet && !bytes.is_multiple_of(want * facet);
    let is_exact = each * want == bytes;
    let has_facets = have_positions(body, FACET);
    let has_longer = is_longer && have_positions(body, each as usize);
    if has_longer && (!has_facets || (is_exact && !bytes.is_multiple_of(facet))) {
        return if is_exact {
            MeshError::FacetBytes { bytes: each }
        } else {
            // The last facet is cut off.
            truncated(bytes / each, count)
        };
    }
    if has_facets && bytes.is_multiple_of(facet) {
        return MeshError::Uncounted {
            format: FORMAT,
            what: "triangles",
            have: bytes / facet,
            want,
        };
    }
    if !has_facets && let Some(each) = longer_facets(body, count) {
        return MeshError::FacetBytes { bytes: each };
    }
    MeshError::BytesAfterRows {
        format: FORMAT,
        bytes: bytes - facet * want,
    }
}

/// Returns the length of facets with attributes in a body with further bytes after the last one. `None` if no length fits.
fn longer_facets(body: &[u8], count: u32) -> Option<u64> {
    let count = count as usize;
    let most = body.len().checked_div(count)?.min(FACET + MAX_ATTRIBUTES);
    let mut lengths = (FACET + 1..=most).rev();
    let found = lengths.find(|each| have_positions(&body[..each * count], *each));
    found.map(|each| each as u64)
}

/// Returns whether the first facets of a body have positions, if each takes `each` bytes. Read from a wrong place, almost all
/// floats are extremely large or small.
fn have_positions(body: &[u8], each: usize) -> bool {
    let is_likely = |value: f32| value == 0.0 || (1e-20..1e20).contains(&value.abs());
    let facets = body.chunks_exact(each).take(COMPARED_FACETS);
    let mut facets = facets.filter_map(|bytes| bytes.first_chunk());
    facets.all(|facet| corners(facet).into_iter().flatten().all(is_likely))
}

/// Vertices of the facets read so far.
struct FacetBuffer {
    vertices: PageVec<[f32; 3]>,
    /// Corners of up to [`CHECKED_FACETS`] facets.
    chunk: Vec<[f32; 3]>,
    check: PositionCheck,
}

impl FacetBuffer {
    /// Reserves memory for `count` facets if that is within the limits.
    fn with_capacity(count: u32, limits: &MeshLimits) -> Result<Self, MeshError> {
        limits.check_triangles(u64::from(count))?;
        limits.check_vertices(3 * u64::from(count))?;
        Ok(Self {
            vertices: PageVec::with_capacity(3 * count as usize),
            chunk: vec![[0.0; 3]; 3 * CHECKED_FACETS],
            check: PositionCheck::NONE,
        })
    }

    fn push(&mut self, facets: &[[u8; FACET]]) {
        for (part, facets) in facets.chunks(CHECKED_FACETS).enumerate() {
            if part.is_multiple_of(PARTS_PER_POLL) {
                poll();
            }
            let (triangles, _) = self.chunk.as_chunks_mut::<3>();
            for (triangle, facet) in triangles.iter_mut().zip(facets) {
                *triangle = corners(facet);
            }
            let chunk = &self.chunk[..3 * facets.len()];
            self.check.add_used(chunk);
            self.vertices.extend_from_slice(chunk);
        }
    }

    fn into_mesh(self) -> Result<(Mesh, PositionCheck), MeshError> {
        if self.vertices.is_empty() {
            return Err(MeshError::NoFaces);
        }
        let mesh = Mesh::from_soup(Vertices::Single(self.vertices));
        Ok((mesh, self.check))
    }
}

/// Returns the corners of a facet. A facet starts with twelve little-endian 32-bit floats: the normal and three
/// corners.
#[inline]
pub(crate) fn corners(facet: &[u8; FACET]) -> [[f32; 3]; 3] {
    let mut corners = [[0.0; 3]; 3];
    let (floats, _) = facet[12..48].as_chunks();
    for (coordinate, bytes) in corners.as_flattened_mut().iter_mut().zip(floats) {
        *coordinate = f32::from_le_bytes(*bytes);
    }
    corners
}
