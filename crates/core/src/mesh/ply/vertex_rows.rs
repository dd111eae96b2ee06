//! Where the vertices of a PLY file are, for reading some of them.

use super::header::{PlyElement, PlyEncoding, PlyHeader, PlyScalar, PlyType};
use super::source::{BinarySource, NumberSource as _};
use crate::mesh::error::MeshError;
use crate::mesh::text;

/// Where the vertices of a PLY file are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::mesh) struct VertexRows {
    /// Offset of the first one in the file.
    pub(in crate::mesh) start: u64,
    /// Number of vertices.
    pub(in crate::mesh) rows: u64,
    /// Bytes of a row; `None` in text.
    pub(in crate::mesh) size: Option<u64>,
    /// Whether the header counts faces or triangle strips.
    pub(in crate::mesh) has_faces: bool,
    encoding: PlyEncoding,
    /// Number of properties, which is that of the words of a row in text.
    properties: usize,
    /// Columns of x, y and z: offsets in bytes, or in text the numbers of words before them.
    columns: [(usize, PlyScalar); 3],
}

impl VertexRows {
    /// Finds the rows by the beginning of a file of `len` bytes. `None` if their place or their columns depend on lists.
    ///
    /// # Errors
    /// Returns an error if the header is invalid, or the file ends before the last vertex.
    pub(in crate::mesh) fn of(head: &[u8], len: u64) -> Result<Option<Self>, MeshError> {
        let (header, body) = PlyHeader::parse(head)?;
        let encoding = header.encoding;
        let mut start = body as u64;
        let mut elements = header.elements.iter();
        let has_faces = elements
            .any(|element| matches!(&*element.name, "face" | "tristrips") && element.rows > 0);
        for element in &header.elements {
            let size = element.fixed_size().map(|size| size as u64);
            if element.name == "vertex" {
                let is_text = encoding == PlyEncoding::Ascii;
                let columns = ["x", "y", "z"].map(|name| column(element, name, is_text));
                let (Some(size), [Some(x), Some(y), Some(z)]) = (size, columns) else {
                    return Ok(None);
                };
                let rows = Self {
                    start,
                    rows: element.rows,
                    size: (!is_text && size > 0).then_some(size),
                    has_faces,
                    encoding,
                    properties: element.properties.len(),
                    columns: [x, y, z],
                };
                return rows.within(len).map(Some);
            }
            match size.filter(|_| encoding != PlyEncoding::Ascii) {
                _ if element.rows == 0 => {}
                Some(size) => start = start.saturating_add(element.rows.saturating_mul(size)),
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    /// Returns the rows if a file of `len` bytes holds all of them.
    fn within(self, len: u64) -> Result<Self, MeshError> {
        let have = self.size.map(|size| len.saturating_sub(self.start) / size);
        match have {
            Some(have) if have < self.rows => Err(MeshError::Truncated {
                format: self.encoding.name(),
                what: "vertices".into(),
                have,
                want: self.rows,
            }),
            _ => Ok(self),
        }
    }

    /// Returns the position in a row, without line end in text. `None` if it is not three numbers, or if a line of text may be
    /// that of a face.
    pub(in crate::mesh) fn position(&self, row: &[u8]) -> Option<[f64; 3]> {
        let mut out = [0.0; 3];
        if self.encoding == PlyEncoding::Ascii {
            let words: Vec<&[u8]> = text::words(row).take(self.properties + 1).collect();
            // A face begins with the number of the words that follow.
            let is_face = || text::parse::<usize>(words[0]) == Some(words.len() - 1);
            if words.len() != self.properties || is_face() {
                return None;
            }
            for (value, (at, _)) in out.iter_mut().zip(self.columns) {
                *value = text::number(words.get(at)?)?;
            }
            return Some(out);
        }
        for (value, (at, scalar)) in out.iter_mut().zip(self.columns) {
            *value = number(scalar, row.get(at..)?, self.encoding)?;
        }
        Some(out)
    }
}

/// Returns where a coordinate is in a row, and its type.
fn column(element: &PlyElement, name: &str, is_text: bool) -> Option<(usize, PlyScalar)> {
    let at = element.position_of(&[name])?;
    let PlyType::Scalar(scalar) = element.properties[at].shape else {
        return None;
    };
    let before = element.properties[..at].iter();
    let bytes = before.map(|property| property.shape.min_size()).sum();
    Some((if is_text { at } else { bytes }, scalar))
}

/// Returns the number at the beginning of some bytes.
fn number(scalar: PlyScalar, bytes: &[u8], encoding: PlyEncoding) -> Option<f64> {
    let number = match encoding {
        PlyEncoding::BigEndian => BinarySource::<true> { rest: bytes }.next(scalar),
        _ => BinarySource::<false> { rest: bytes }.next(scalar),
    };
    number.ok()
}
