//! Format detection by content.

use super::{MeshError, stl, text};
use crate::domain::FileKind;

/// The supported formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DetectedFormat {
    /// Wavefront OBJ.
    Obj,
    /// Stanford polygon format, ASCII or binary of either byte order.
    Ply,
    /// Binary STL.
    StlBinary,
    /// ASCII STL.
    StlAscii,
    /// Lines of numbers, the first three of each a position.
    Xyz,
}

/// Lines of a text that are examined.
const LINES_TRIED: usize = 1000;

impl DetectedFormat {
    /// Detects the format of a file from its content. The file name is used only if the content is truncated or
    /// ambiguous.
    ///
    /// # Errors
    /// Returns an error if the content is of no supported format.
    pub(super) fn of(bytes: &[u8], name: &str) -> Result<Self, MeshError> {
        if bytes.is_empty() {
            return Err(MeshError::Empty);
        }
        let kind = FileKind::of(bytes);
        match kind {
            FileKind::Ply => Ok(Self::Ply),
            _ if stl::whole_binary_count(bytes, bytes.len() as u64).is_some() => {
                Ok(Self::StlBinary)
            }
            FileKind::Binary if has_extension(name, "stl") => Ok(Self::StlBinary),
            // A text file with a control character may be classed as binary.
            FileKind::Text | FileKind::Binary => match first_words(bytes) {
                Some(format) => Ok(format),
                // A truncated binary STL with a text header cannot be recognised by its size, so the file name decides.
                None if has_extension(name, "stl") && text::contains(bytes, 0) => {
                    Ok(Self::StlBinary)
                }
                None => Err(MeshError::NotAMesh(kind)),
            },
            _ => Err(MeshError::NotAMesh(kind)),
        }
    }
}

pub(super) fn has_extension(name: &str, wanted: &str) -> bool {
    std::path::Path::new(name)
        .extension()
        .is_some_and(|ext| ext.eq_ignore_ascii_case(wanted))
}

fn first_words(bytes: &[u8]) -> Option<DetectedFormat> {
    let bytes = &bytes[..bytes.len().min(text::MAX_LINE_BYTES)];
    for (number, line) in text::lines(bytes).take(LINES_TRIED) {
        let mut words = text::words(line);
        let Some(first) = words.next() else { continue };
        match first {
            _ if line.starts_with(b"#") || line.starts_with(b"//") => {}
            b"ply" if number == 1 => return Some(DetectedFormat::Ply),
            // A binary STL may have a header that begins with `solid`.
            _ if first.eq_ignore_ascii_case(b"solid") => {
                let is_binary = bytes.iter().take(4096).any(|byte| *byte == 0);
                return Some(if is_binary {
                    DetectedFormat::StlBinary
                } else {
                    DetectedFormat::StlAscii
                });
            }
            b"v" | b"vn" | b"vt" | b"vp" | b"f" | b"o" | b"g" | b"s" | b"mtllib" | b"usemtl" => {
                return Some(DetectedFormat::Obj);
            }
            _ if super::xyz::is_data_or_title(line) => return Some(DetectedFormat::Xyz),
            _ => return None,
        }
    }
    None
}
