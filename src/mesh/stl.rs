//! STL, binary and ascii: a soup of triangles, in which each vertex is repeated as often as it is used.

use std::io::{self, Read};

use super::{DetectedFormat, Mesh, MeshError, MeshLimits, MeshReadError, Vertices, error, text};
use crate::page_vec::{PageVec, fill};

/// Bytes of the header, the count included.
pub(super) const HEADER: usize = 84;
const FACET: usize = 50;
/// Facets that are read at a time, and that a file is asked for.
const FEW: usize = 128;
const MANY: usize = 1280;

/// Triangles by a binary header; `None` when the file ends before the count.
pub(super) fn binary_count(bytes: &[u8]) -> Option<u32> {
    bytes
        .get(80..HEADER)
        .and_then(|count| count.try_into().ok())
        .map(u32::from_le_bytes)
}

/// Triangles of a file that begins with these bytes and has so many, where it is 80 bytes of anything, a count, 50 bytes
/// a triangle and nothing after them: a binary STL even if it begins with `solid`.
pub(super) fn whole_binary_count(bytes: &[u8], len: u64) -> Option<u32> {
    let holds = |count: &u32| len == HEADER as u64 + FACET as u64 * u64::from(*count);
    binary_count(bytes).filter(holds)
}

/// Reads the triangles of a whole binary STL from behind its header, few bytes at a time.
pub(super) fn read_facets(
    source: &mut impl Read,
    count: u32,
    limits: &MeshLimits,
) -> Result<Mesh, MeshReadError> {
    let mut facets = Facets::of(count, limits)?;
    let mut bytes = vec![0; FACET * (count as usize).min(MANY)];
    let mut left = count as usize;
    while left > 0 {
        let most = bytes.len().min(FACET * left);
        let bytes = &mut bytes[..most];
        let have = fill(source, bytes)?;
        let (whole, _) = bytes[..have].as_chunks();
        facets.take(whole)?;
        left -= whole.len();
        if have < bytes.len() {
            return Err(truncated(u64::from(count) - left as u64, count).into());
        }
    }
    if fill(source, &mut [0])? > 0 {
        return Err(io::Error::other("it grew while it was read").into());
    }
    Ok(facets.soup()?)
}

fn truncated(have: u64, count: u32) -> MeshError {
    MeshError::Truncated {
        format: DetectedFormat::StlBinary.name(),
        what: "triangles".into(),
        have,
        want: u64::from(count),
    }
}

/// Reads a binary STL; bytes after the last triangle are left out, as are normals and attributes.
pub(super) fn read_binary(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    let count = binary_count(bytes).ok_or_else(|| MeshError::Truncated {
        format: DetectedFormat::StlBinary.name(),
        what: "bytes of its header".into(),
        have: bytes.len() as u64,
        want: HEADER as u64,
    })?;
    let (facets, _) = bytes[HEADER..].as_chunks::<FACET>();
    let have = facets.len() as u64;
    if have < u64::from(count) {
        return Err(truncated(have, count));
    }
    let mut taken = Facets::of(count, limits)?;
    taken.take(&facets[..count as usize])?;
    taken.soup()
}

/// Facets on their way into a mesh.
struct Facets {
    vertices: PageVec<[f32; 3]>,
    few: Vec<[f32; 3]>,
}

impl Facets {
    /// With room for so many, if that is within the limits.
    fn of(count: u32, limits: &MeshLimits) -> Result<Self, MeshError> {
        limits.check_triangles(u64::from(count))?;
        limits.check_vertices(3 * u64::from(count))?;
        Ok(Self {
            vertices: PageVec::with_capacity(3 * count as usize),
            few: Vec::with_capacity(3 * FEW),
        })
    }

    fn take(&mut self, facets: &[[u8; FACET]]) -> Result<(), MeshError> {
        for facets in facets.chunks(FEW) {
            self.few.clear();
            for facet in facets {
                self.few.extend(corners(facet));
            }
            error::all_finite(&self.few, self.vertices.len())?;
            self.vertices.extend_from_slice(&self.few);
        }
        Ok(())
    }

    fn soup(self) -> Result<Mesh, MeshError> {
        soup(Vertices::Single(self.vertices))
    }
}

/// The three corners of a facet: twelve little-endian 32-bit floats, the first three of them the normal.
fn corners(facet: &[u8; FACET]) -> [[f32; 3]; 3] {
    let (floats, _) = facet[12..48].as_chunks::<4>();
    let at = |i: usize| f32::from_le_bytes(floats[i]);
    [0, 3, 6].map(|i| [at(i), at(i + 1), at(i + 2)])
}

/// Every three vertices in a row are a triangle.
fn soup(vertices: Vertices) -> Result<Mesh, MeshError> {
    if vertices.is_empty() {
        return Err(MeshError::NoFaces);
    }
    let triangles = (0..vertices.len() as u32)
        .step_by(3)
        .map(|first| [first, first + 1, first + 2])
        .collect();
    Ok(Mesh {
        vertices,
        triangles,
    })
}

/// Reads an ascii STL of one or more solids; loops of more than three corners become fans.
pub(super) fn read_ascii(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshError> {
    let mut reader = Ascii::default();
    for (line, content) in text::lines(bytes) {
        reader
            .line(content, limits)
            .map_err(|reason| reason.at(line))?;
    }
    if reader.open != Open::Nothing {
        return Err(MeshError::EndMissing {
            format: DetectedFormat::StlAscii.name(),
            have: reader.facets,
            missing: reader.open.end(),
        });
    }
    soup(reader.vertices.into())
}

/// What the reader is inside of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Open {
    #[default]
    Nothing,
    Solid,
    Facet,
}

impl Open {
    const fn end(self) -> &'static str {
        match self {
            Self::Nothing => "an end",
            Self::Solid => "endsolid",
            Self::Facet => "endfacet",
        }
    }
}

/// A wrong line, before its number is known; or an error that has a place of its own.
enum Wrong {
    Line(String),
    Placed(MeshError),
}

impl Wrong {
    fn at(self, line: u64) -> MeshError {
        match self {
            Self::Line(reason) => MeshError::Line { line, reason },
            Self::Placed(error) => error,
        }
    }
}

#[derive(Default)]
struct Ascii {
    open: Open,
    facets: u64,
    /// Corners read, those left out of the soup included.
    corners: u64,
    loop_corners: Vec<[f64; 3]>,
    vertices: Vec<[f64; 3]>,
}

impl Ascii {
    fn line(&mut self, line: &[u8], limits: &MeshLimits) -> Result<(), Wrong> {
        let mut words = text::words(line);
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        match keyword.to_ascii_lowercase().as_slice() {
            b"vertex" => self.corner(text::position(words).map_err(Wrong::Line)?),
            b"solid" => self.step(Open::Nothing, Open::Solid, keyword),
            b"facet" => self.step(Open::Solid, Open::Facet, keyword),
            b"outer" | b"endloop" => Ok(()),
            b"endfacet" => {
                self.step(Open::Facet, Open::Solid, keyword)?;
                self.close_facet(limits).map_err(Wrong::Placed)
            }
            b"endsolid" => self.step(Open::Solid, Open::Nothing, keyword),
            _ => Err(Wrong::Line(format!(
                "{} is not a word of ascii STL",
                text::shown(keyword)
            ))),
        }
    }

    fn step(&mut self, from: Open, to: Open, keyword: &[u8]) -> Result<(), Wrong> {
        if self.open != from {
            return Err(Wrong::Line(format!(
                "{} stands where it must not",
                text::shown(keyword)
            )));
        }
        self.open = to;
        Ok(())
    }

    fn corner(&mut self, position: [f64; 3]) -> Result<(), Wrong> {
        if self.open != Open::Facet {
            return Err(Wrong::Line("a vertex outside of a facet".into()));
        }
        self.corners += 1;
        let corner = error::finite(position, self.corners).map_err(Wrong::Placed)?;
        self.loop_corners.push(corner);
        Ok(())
    }

    fn close_facet(&mut self, limits: &MeshLimits) -> Result<(), MeshError> {
        self.facets += 1;
        if let [first, rest @ ..] = self.loop_corners.as_slice() {
            for pair in rest.windows(2) {
                self.vertices.extend([*first, pair[0], pair[1]]);
            }
        }
        self.loop_corners.clear();
        limits.check_triangles(self.vertices.len() as u64 / 3)?;
        limits.check_vertices(self.vertices.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, MeshError, MeshLimits, read};

    fn binary(header: &[u8], corners: &[[f32; 3]]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend((corners.len() as u32 / 3).to_le_bytes());
        for facet in corners.chunks_exact(3) {
            bytes.extend([0xff; 12]);
            for value in facet.as_flattened() {
                bytes.extend(value.to_le_bytes());
            }
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn open(bytes: &[u8]) -> Result<Mesh, MeshError> {
        read(bytes, "scan.stl", &MeshLimits::SUGGESTED)
    }

    const CORNERS: [[f32; 3]; 6] = [
        [0., 0., 0.],
        [1., 0., 0.],
        [0., 1., 0.],
        [0., 1., 0.],
        [1., 0., 0.],
        [1., 1., 0.25],
    ];

    #[test]
    fn binary_is_known_even_when_its_header_begins_with_solid() {
        for header in [b"solid made by a scanner".as_slice(), b"", b"COLOR=...."] {
            let mesh = open(&binary(header, &CORNERS)).expect("reads");
            assert_eq!(mesh.vertices.len(), 6);
            assert_eq!(mesh.vertices.at(5), [1.0, 1.0, 0.25]);
            assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
        }
    }

    #[test]
    fn bytes_after_the_last_triangle_are_left_out() {
        let mut bytes = binary(b"", &CORNERS);
        bytes.extend(b"trailer");
        assert_eq!(open(&bytes).expect("reads").triangles.len(), 2);
    }

    #[test]
    fn truncated_binary_says_how_many_of_how_many() {
        for header in [b"solid a".as_slice(), b"\0", b"text header"] {
            let bytes = binary(header, &CORNERS);
            let error = open(&bytes[..bytes.len() - 1]).expect_err("truncated");
            assert_eq!(
                error.to_string(),
                "the binary STL is truncated: it holds 1 of 2 triangles"
            );
        }
        let error = open(&[0; 50]).expect_err("truncated");
        assert_eq!(
            error.to_string(),
            "the binary STL is truncated: it holds 50 of 84 bytes of its header"
        );
    }

    #[test]
    fn lying_count_is_an_error_not_an_allocation() {
        let mut bytes = binary(b"", &CORNERS);
        bytes[80..84].fill(0xff);
        let error = open(&bytes).expect_err("lies");
        assert_eq!(
            error.to_string(),
            "the binary STL is truncated: it holds 2 of 4294967295 triangles"
        );
    }

    #[test]
    fn no_facets_and_nan_are_refused() {
        assert_eq!(open(&binary(b"", &[])), Err(MeshError::NoFaces));
        assert_eq!(
            open(b"solid empty\nendsolid empty\n"),
            Err(MeshError::NoFaces)
        );
        let mut corners = CORNERS;
        corners[4][1] = f32::NAN;
        let error = open(&binary(b"", &corners)).expect_err("NaN");
        assert!(
            error
                .to_string()
                .starts_with("vertex 5 has the coordinate NaN")
        );
    }

    const ASCII: &str = "solid a b\n FACET NORMAL nan nan nan\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n \
        vertex 1 1 1e-1\n vertex 0 1 0\n endloop\n endfacet\nendsolid a b\n";

    #[test]
    fn ascii_loops_of_four_become_two_triangles() {
        let mesh = open(ASCII.as_bytes()).expect("reads");
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(mesh.vertices.at(2), [1.0, 1.0, 0.1]);
        let two = open(ASCII.repeat(2).as_bytes()).expect("reads");
        assert_eq!(two.triangles.len(), 4);
    }

    #[test]
    fn truncated_ascii_says_where_it_ends() {
        let cut = |word: &str| &ASCII[..ASCII.find(word).expect("is there")];
        assert_eq!(
            open(cut("endsolid").as_bytes())
                .expect_err("cut")
                .to_string(),
            "the ascii STL is truncated: it ends after 1 facets without endsolid"
        );
        assert_eq!(
            open(cut("endloop").as_bytes())
                .expect_err("cut")
                .to_string(),
            "the ascii STL is truncated: it ends after 0 facets without endfacet"
        );
        assert_eq!(
            open(cut(" 1e-1").as_bytes()).expect_err("cut").to_string(),
            "line 6: 2 of 3 coordinates"
        );
    }
}
