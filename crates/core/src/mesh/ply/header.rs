//! The PLY header: encoding, elements and their properties.

use crate::mesh::error::MeshError;
use crate::mesh::text;

/// Encoding of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PlyEncoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

impl PlyEncoding {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Ascii => "ascii PLY",
            Self::LittleEndian | Self::BigEndian => "binary PLY",
        }
    }
}

/// Number type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PlyScalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl PlyScalar {
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns whether a 32-bit float represents every such number exactly.
    const fn is_single(self) -> bool {
        matches!(
            self,
            Self::I8 | Self::U8 | Self::I16 | Self::U16 | Self::F32
        )
    }

    const fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    fn parse(word: &[u8]) -> Option<Self> {
        match word {
            b"char" | b"int8" => Some(Self::I8),
            b"uchar" | b"uint8" => Some(Self::U8),
            b"short" | b"int16" => Some(Self::I16),
            b"ushort" | b"uint16" => Some(Self::U16),
            b"int" | b"int32" => Some(Self::I32),
            b"uint" | b"uint32" => Some(Self::U32),
            b"float" | b"float32" => Some(Self::F32),
            b"double" | b"float64" => Some(Self::F64),
            _ => None,
        }
    }
}

/// Type of a property: a number, or a counted list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PlyType {
    Scalar(PlyScalar),
    List { count: PlyScalar, item: PlyScalar },
}

impl PlyType {
    /// Returns the bytes of the shortest value in a binary body.
    pub(super) const fn min_size(self) -> usize {
        match self {
            Self::Scalar(scalar) => scalar.size(),
            Self::List { count, .. } => count.size(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlyProperty {
    pub(super) name: String,
    pub(super) shape: PlyType,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlyElement {
    pub(super) name: String,
    pub(super) rows: u64,
    pub(super) properties: Vec<PlyProperty>,
}

impl PlyElement {
    /// Returns the bytes of the shortest row in a binary body.
    pub(super) fn min_size(&self) -> usize {
        self.properties.iter().map(|p| p.shape.min_size()).sum()
    }

    /// Returns the bytes of every row if no property is a list.
    pub(super) fn fixed_size(&self) -> Option<usize> {
        let one = |p: &PlyProperty| matches!(p.shape, PlyType::Scalar(_));
        self.properties.iter().all(one).then(|| self.min_size())
    }

    /// Returns whether a row is three 32-bit floats.
    pub(super) fn is_packed_position(&self) -> bool {
        let mut shapes = self.properties.iter().map(|property| property.shape);
        self.properties.len() == 3 && shapes.all(|shape| shape == PlyType::Scalar(PlyScalar::F32))
    }

    /// Returns whether 32-bit floats represent all coordinates exactly.
    fn is_single_position(&self) -> bool {
        let is_single = |name: &str| {
            let property = self
                .position_of(&[name])
                .map(|column| &self.properties[column]);
            property.is_none_or(|p| matches!(p.shape, PlyType::Scalar(kind) if kind.is_single()))
        };
        ["x", "y", "z"].into_iter().all(is_single)
    }

    /// Returns the type of the indices if each row is one list with an 8-bit count and 32-bit indices.
    pub(super) fn packed_corner_type(&self) -> Option<PlyScalar> {
        let [property] = self.properties.as_slice() else {
            return None;
        };
        let PlyType::List { count, item } = property.shape else {
            return None;
        };
        let is_packed = count == PlyScalar::U8 && matches!(item, PlyScalar::I32 | PlyScalar::U32);
        is_packed.then_some(item)
    }

    /// Returns the position of a property among the others.
    pub(super) fn position_of(&self, names: &[&str]) -> Option<usize> {
        self.properties
            .iter()
            .position(|p| names.contains(&p.name.as_str()))
    }
}

/// Largest header, bytes; every line of it is parsed.
const MAX_HEADER_BYTES: usize = 1 << 20;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlyHeader {
    pub(super) encoding: PlyEncoding,
    pub(super) elements: Vec<PlyElement>,
}

impl PlyHeader {
    /// Parses the header and returns it with the offset of the body.
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, usize), MeshError> {
        let mut encoding = None;
        let mut elements = Vec::new();
        let mut at = 0;
        let head = &bytes[..bytes.len().min(MAX_HEADER_BYTES + 1)];
        // Binary data after the header may have any bytes.
        let end = head.windows(10).position(|word| word == b"end_header");
        let is_classic_mac = text::is_classic_mac(&head[..end.unwrap_or(head.len())]);
        while let Some((line, next)) = line_at(head, at, is_classic_mac) {
            at = next;
            if at > MAX_HEADER_BYTES {
                break;
            }
            let words: Vec<&[u8]> = text::words(line).collect();
            match words.as_slice() {
                [b"end_header"] => {
                    let encoding = encoding.ok_or_else(|| header_error("no format line"))?;
                    // Lines may end in LF CR.
                    let is_lf_cr =
                        bytes.get(3..5) == Some(b"\n\r") && bytes.get(at) == Some(&b'\r');
                    return Ok((Self { encoding, elements }, at + usize::from(is_lf_cr)));
                }
                [b"format", name, ..] => encoding = Some(parse_encoding(name)?),
                [b"element", name, rows] => elements.push(parse_element(name, rows)?),
                [b"property", rest @ ..] => elements
                    .last_mut()
                    .ok_or_else(|| header_error("a property before the first element"))?
                    .properties
                    .push(parse_property(rest)?),
                [] | [b"ply" | b"comment" | b"obj_info", ..] => {}
                _ => {
                    return Err(header_error(&format!(
                        "{} is not understood",
                        text::quote(line)
                    )));
                }
            }
        }
        Err(header_error(if head.len() > MAX_HEADER_BYTES {
            "it is longer than 1 MiB"
        } else {
            "the file ends before end_header"
        }))
    }

    /// Returns whether 32-bit floats represent all vertices of a binary body exactly. Returns `false` for text.
    pub(super) fn has_single_vertices(&self) -> bool {
        let mut vertices = self.elements.iter().filter(|e| e.name == "vertex");
        self.encoding != PlyEncoding::Ascii && vertices.all(PlyElement::is_single_position)
    }

    /// Returns whether a row has a list.
    pub(super) fn has_lists(&self) -> bool {
        let mut elements = self.elements.iter().filter(|element| element.rows > 0);
        elements.any(|element| element.fixed_size().is_none())
    }

    /// Returns the number of rows of the elements with this name.
    pub(super) fn rows(&self, name: &str) -> u64 {
        let named = self.elements.iter().filter(|element| element.name == name);
        named.fold(0, |sum: u64, element| sum.saturating_add(element.rows))
    }
}

/// Returns the line at an offset and the offset of the next line. Returns `None` if the line has no end.
fn line_at(bytes: &[u8], at: usize, is_classic_mac: bool) -> Option<(&[u8], usize)> {
    let is_end = |byte: &u8| *byte == b'\n' || (is_classic_mac && *byte == b'\r');
    let rest = bytes.get(at..)?;
    let len = rest.iter().position(is_end)?;
    Some((rest[..len].trim_ascii(), at + len + 1))
}

fn parse_encoding(name: &[u8]) -> Result<PlyEncoding, MeshError> {
    match name {
        b"ascii" => Ok(PlyEncoding::Ascii),
        b"binary_little_endian" => Ok(PlyEncoding::LittleEndian),
        b"binary_big_endian" => Ok(PlyEncoding::BigEndian),
        _ => Err(header_error(&format!(
            "{} is not a format (ascii, binary_little_endian, binary_big_endian)",
            text::quote(name)
        ))),
    }
}

fn parse_element(name: &[u8], rows: &[u8]) -> Result<PlyElement, MeshError> {
    let fault = || {
        let (name, rows) = (text::quote(name), text::quote(rows));
        header_error(&format!("element {name} has the count {rows}"))
    };
    Ok(PlyElement {
        name: String::from_utf8_lossy(name).into_owned(),
        rows: text::parse(rows).ok_or_else(fault)?,
        properties: Vec::new(),
    })
}

fn parse_property(words: &[&[u8]]) -> Result<PlyProperty, MeshError> {
    let unknown = |word: &[u8]| header_error(&format!("{} is not a type", text::quote(word)));
    let scalar = |word| PlyScalar::parse(word).ok_or_else(|| unknown(word));
    let (shape, name) = match words {
        [b"list", count, item, name] => {
            let count = scalar(count)?;
            if count.is_float() {
                return Err(header_error("a list is counted by a float"));
            }
            let item = scalar(item)?;
            (PlyType::List { count, item }, name)
        }
        [kind, name] => (PlyType::Scalar(scalar(kind)?), name),
        _ => return Err(header_error("a property of neither two nor four words")),
    };
    Ok(PlyProperty {
        name: String::from_utf8_lossy(name).into_owned(),
        shape,
    })
}

fn header_error(reason: &str) -> MeshError {
    MeshError::Header(reason.to_owned())
}
