//! Format detection by content.

use super::{MeshError, stl, text, xyz};
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

/// Extensions of point sets.
const POINT_EXTENSIONS: [&str; 7] = ["xyz", "asc", "txt", "csv", "pts", "ptx", "xyzrgb"];

/// Lines of a text that are examined, without comments.
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
            _ if is_ascii_stl(bytes) => Ok(Self::StlAscii),
            FileKind::Binary if has_extension(name, "stl") => Ok(Self::StlBinary),
            // A text file with a control character may be classed as binary.
            FileKind::Text | FileKind::Binary => match first_words(bytes) {
                Some(format) => Ok(format),
                // A truncated binary STL with a text header cannot be recognised by its size, so the file name decides.
                None if has_extension(name, "stl") && text::contains(bytes, 0) => {
                    Ok(Self::StlBinary)
                }
                // The reader says which line is wrong.
                None if POINT_EXTENSIONS
                    .iter()
                    .any(|wanted| has_extension(name, wanted))
                    && kind == FileKind::Text =>
                {
                    Ok(Self::Xyz)
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
    let mut is_first = true;
    let content = text::lines(bytes).filter(|(_, line)| !xyz::is_comment(line));
    for (number, line) in content.take(LINES_TRIED) {
        let mut words = text::words(line);
        match words.next().unwrap_or_default() {
            b"ply" if number == 1 => return Some(DetectedFormat::Ply),
            first if is_first && first.eq_ignore_ascii_case(b"solid") => {
                return Some(DetectedFormat::StlBinary);
            }
            b"v" if is_first || text::position(words).is_ok() => return Some(DetectedFormat::Obj),
            b"vn" | b"vt" | b"vp" | b"f" | b"o" | b"g" | b"s" | b"mtllib" | b"usemtl"
                if is_first =>
            {
                return Some(DetectedFormat::Obj);
            }
            _ if is_first && xyz::is_data_or_title(line) => return Some(DetectedFormat::Xyz),
            // Keywords that are rare or of one program may precede the vertices of an OBJ.
            _ => is_first = false,
        }
    }
    None
}

/// Returns whether a file is an ASCII STL, which may begin with comments. The header of a binary STL may begin with `solid`,
/// too, and a name in text may have NUL.
fn is_ascii_stl(bytes: &[u8]) -> bool {
    let mut head = bytes[..bytes.len().min(4096)].trim_ascii_start();
    while !head.is_empty() && xyz::is_comment(head) {
        let end = memchr::memchr2(b'\n', b'\r', head);
        head = head[end.unwrap_or(head.len())..].trim_ascii_start();
    }
    let has = |word: &[u8]| {
        head.windows(word.len())
            .any(|at| at.eq_ignore_ascii_case(word))
    };
    let is_solid = text::words(head)
        .next()
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    is_solid && (!head.contains(&0) || (has(b"facet") && has(b"vertex")))
}
