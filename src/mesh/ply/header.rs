//! The PLY header: encoding, elements and their properties.

use super::super::{MeshError, text};

/// How the body is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

impl Encoding {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Ascii => "ascii PLY",
            Self::LittleEndian | Self::BigEndian => "binary PLY",
        }
    }

    fn parse(word: &[u8]) -> Option<Self> {
        match word {
            b"ascii" => Some(Self::Ascii),
            b"binary_little_endian" => Some(Self::LittleEndian),
            b"binary_big_endian" => Some(Self::BigEndian),
            _ => None,
        }
    }
}

/// Type of a number in the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Whether a 32-bit float holds every such number of a binary body.
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

/// One value, or a counted list of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    One(Scalar),
    List { count: Scalar, item: Scalar },
}

impl Shape {
    /// Bytes of the shortest such value in a binary body.
    const fn least_size(self) -> usize {
        match self {
            Self::One(scalar) => scalar.size(),
            Self::List { count, .. } => count.size(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) shape: Shape,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) rows: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Bytes of the shortest row in a binary body.
    pub(super) fn least_size(&self) -> usize {
        self.properties.iter().map(|p| p.shape.least_size()).sum()
    }

    /// Bytes of every row, when no property is a list.
    pub(super) fn fixed_size(&self) -> Option<usize> {
        let one = |p: &Property| matches!(p.shape, Shape::One(_));
        self.properties.iter().all(one).then(|| self.least_size())
    }

    /// Whether a row is three 32-bit floats.
    pub(super) fn is_plain_position(&self) -> bool {
        let mut shapes = self.properties.iter().map(|property| property.shape);
        self.properties.len() == 3 && shapes.all(|shape| shape == Shape::One(Scalar::F32))
    }

    /// Whether 32-bit floats hold all of the position's coordinates.
    fn is_single_position(&self) -> bool {
        let is_single = |name: &str| {
            let property = self.place(&[name]).map(|place| &self.properties[place]);
            property.is_none_or(|p| matches!(p.shape, Shape::One(kind) if kind.is_single()))
        };
        ["x", "y", "z"].into_iter().all(is_single)
    }

    /// Type of the corners where a row is a list of 32-bit indices that a byte counts.
    pub(super) fn plain_corners(&self) -> Option<Scalar> {
        let [
            Property {
                shape:
                    Shape::List {
                        count: Scalar::U8,
                        item,
                    },
                ..
            },
        ] = self.properties[..]
        else {
            return None;
        };
        matches!(item, Scalar::I32 | Scalar::U32).then_some(item)
    }

    /// Place of a property among the others.
    pub(super) fn place(&self, names: &[&str]) -> Option<usize> {
        self.properties
            .iter()
            .position(|p| names.contains(&p.name.as_str()))
    }
}

/// Longest header in bytes; it holds names and notes, and every line of it is kept.
const LONGEST: usize = 1 << 20;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
}

impl Header {
    /// The header and the place of the first byte after it.
    pub(super) fn parse(bytes: &[u8]) -> Result<(Self, usize), MeshError> {
        let mut encoding = None;
        let mut elements = Vec::new();
        let mut at = 0;
        while let Some((line, next)) = line_at(bytes, at) {
            at = next;
            if at > LONGEST {
                return Err(wrong("it is longer than 1 MiB"));
            }
            let words: Vec<&[u8]> = text::words(line).collect();
            match words.as_slice() {
                [b"end_header"] => {
                    let encoding = encoding.ok_or_else(|| wrong("no format line"))?;
                    return Ok((Self { encoding, elements }, at));
                }
                [b"format", name, ..] => encoding = Some(parse_encoding(name)?),
                [b"element", name, rows] => elements.push(parse_element(name, rows)?),
                [b"property", rest @ ..] => elements
                    .last_mut()
                    .ok_or_else(|| wrong("a property before the first element"))?
                    .properties
                    .push(parse_property(rest)?),
                [] | [b"ply" | b"comment" | b"obj_info", ..] => {}
                _ => return Err(wrong(&format!("{} is not understood", text::shown(line)))),
            }
        }
        Err(wrong("the file ends before end_header"))
    }

    /// Whether 32-bit floats hold all vertices as the body has them.
    pub(super) fn has_single_vertices(&self) -> bool {
        let mut vertices = self.elements.iter().filter(|e| e.name == "vertex");
        self.encoding != Encoding::Ascii && vertices.all(Element::is_single_position)
    }

    /// Rows of the elements of this name.
    pub(super) fn rows(&self, name: &str) -> u64 {
        self.elements
            .iter()
            .filter(|element| element.name == name)
            .fold(0, |sum: u64, element| sum.saturating_add(element.rows))
    }
}

/// The line at a place without its end, and the place after it; `None` when no line ends there. All three ends
/// occur, and the byte after a lone carriage return may already belong to a binary body, so the first line decides.
fn line_at(bytes: &[u8], at: usize) -> Option<(&[u8], usize)> {
    let old_mac = bytes.get(3) == Some(&b'\r') && bytes.get(4) != Some(&b'\n');
    let end = if old_mac { b'\r' } else { b'\n' };
    let rest = bytes.get(at..)?;
    let len = rest.iter().position(|byte| *byte == end)?;
    Some((rest[..len].trim_ascii(), at + len + 1))
}

fn parse_encoding(name: &[u8]) -> Result<Encoding, MeshError> {
    Encoding::parse(name).ok_or_else(|| {
        wrong(&format!(
            "{} is not a format (ascii, binary_little_endian, binary_big_endian)",
            text::shown(name)
        ))
    })
}

fn parse_element(name: &[u8], rows: &[u8]) -> Result<Element, MeshError> {
    let count = std::str::from_utf8(rows)
        .ok()
        .and_then(|digits| digits.parse().ok());
    let name = String::from_utf8_lossy(name).into_owned();
    let Some(count) = count else {
        return Err(wrong(&format!(
            "element {} has the count {}",
            text::shown(name.as_bytes()),
            text::shown(rows)
        )));
    };
    Ok(Element {
        name,
        rows: count,
        properties: Vec::new(),
    })
}

fn parse_property(words: &[&[u8]]) -> Result<Property, MeshError> {
    let scalar = |word: &[u8]| {
        Scalar::parse(word).ok_or_else(|| wrong(&format!("{} is not a type", text::shown(word))))
    };
    let (shape, name) = match words {
        [b"list", count, item, name] => {
            let count = scalar(count)?;
            if count.is_float() {
                return Err(wrong("a list is counted by a float"));
            }
            let item = scalar(item)?;
            (Shape::List { count, item }, name)
        }
        [kind, name] => (Shape::One(scalar(kind)?), name),
        _ => return Err(wrong("a property of neither two nor four words")),
    };
    Ok(Property {
        name: String::from_utf8_lossy(name).into_owned(),
        shape,
    })
}

fn wrong(reason: &str) -> MeshError {
    MeshError::Header(reason.to_owned())
}
