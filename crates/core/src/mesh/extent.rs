//! The size of a mesh by parts of its file, for a look before all of it is read.

use std::io::{self, Read, Seek, SeekFrom};

use super::error::{MeshLimits, MeshReadError};
use super::format::DetectedFormat;
use super::missing::is_finite;
use super::ply::VertexRows;
use super::robust_bounds::Bounds;
use super::triangle_stream::binary_stl_triangles;
use super::{stl, text, xyz};
use crate::domain::LengthUnit;
use crate::domain::cancel::poll;
use crate::page_vec::fill;

/// Files of at most this length are read as a whole.
pub(super) const WHOLE_BYTES: u64 = 4 << 20;
/// Bytes at the beginning of a longer file that show its format. They hold the longest header of a PLY file.
const HEAD_BYTES: u64 = (1 << 20) + (1 << 12);
/// Places of a longer file for its size.
const FEW: PartSpread = PartSpread {
    parts: 64,
    bytes: 16 << 10,
};
/// Places of a longer file for a picture.
pub(super) const MANY: PartSpread = PartSpread {
    parts: 1024,
    bytes: 4 << 10,
};
/// Bytes at the beginning of a file in which it may name its unit.
const UNIT_BYTES: usize = 4096;
/// Beginnings of lines that may name the unit.
const COMMENTS: [&[u8]; 5] = [b"#", b"//", b"comment", b"obj_info", b"solid"];

/// Places of a file, evenly spread, from which vertices are read.
#[derive(Debug, Clone, Copy)]
pub(super) struct PartSpread {
    /// Number of places.
    parts: u64,
    /// Bytes of a text, or about those of rows, that are read at each place.
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
    let mut seen = GrowingBox::default();
    let unit = each_position(file, (len, name), limits, FEW, &mut |position| {
        seen.add(position);
    })?;
    Ok(MeshExtent {
        sides: seen.sides(),
        is_exact: false,
        unit,
    })
}

/// Visits vertices at some places of a file with a length and a name. Returns the unit that the file names.
pub(super) fn each_position(
    file: &mut (impl Read + Seek),
    (len, name): (u64, &str),
    limits: &MeshLimits,
    spread: PartSpread,
    visit: &mut dyn FnMut([f64; 3]),
) -> Result<Option<LengthUnit>, MeshReadError> {
    let mut head = Vec::new();
    file.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
    let unit = stated_unit(&head);
    if let Some(count) = binary_stl_triangles(&head, len, name)? {
        limits.check_triangles(u64::from(count))?;
        let facets = [stl::HEADER as u64, len];
        each_part(file, facets, stl::FACET as u64, spread, |part| {
            let (facets, _) = part.as_chunks::<{ stl::FACET }>();
            let corners = facets.iter().flat_map(stl::corners);
            corners.for_each(|corner| visit(corner.map(f64::from)));
        })?;
        return Ok(unit);
    }
    let of_keyword = |line: &[u8], keyword: &[u8]| {
        let mut words = text::words(line);
        let word = words.next()?;
        let is_vertex = word.eq_ignore_ascii_case(keyword);
        is_vertex.then(|| text::position(words).ok()).flatten()
    };
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head);
    match DetectedFormat::of(text, name)? {
        // The mark shifts the offsets of rows.
        DetectedFormat::Ply if text.len() < head.len() => {}
        DetectedFormat::Ply => ply_parts(file, &head, len, limits, spread, visit)?,
        DetectedFormat::Obj => each_line(file, [0, len], spread, |line| {
            of_keyword(line, b"v").into_iter().for_each(&mut *visit);
        })?,
        DetectedFormat::StlAscii => each_line(file, [0, len], spread, |line| {
            of_keyword(line, b"vertex")
                .into_iter()
                .for_each(&mut *visit);
        })?,
        DetectedFormat::Xyz => each_part(file, [0, len], 1, spread, |part| {
            let points = xyz::read(whole_lines(part), limits);
            let points = points.map(|mesh| mesh.vertices).unwrap_or_default();
            points.iter().for_each(&mut *visit);
        })?,
        // Its length is not the one that its header implies.
        DetectedFormat::StlBinary => {}
    }
    Ok(unit)
}

fn ply_parts(
    file: &mut (impl Read + Seek),
    head: &[u8],
    len: u64,
    limits: &MeshLimits,
    spread: PartSpread,
    visit: &mut dyn FnMut([f64; 3]),
) -> Result<(), MeshReadError> {
    let Some(rows) = VertexRows::of(head, len)? else {
        return Ok(());
    };
    limits.check_vertices(rows.rows)?;
    let mut add = |row: &[u8]| {
        rows.position(row).into_iter().for_each(&mut *visit);
    };
    if let Some(size) = rows.size {
        let end = rows.start + size * rows.rows;
        each_part(file, [rows.start, end], size, spread, |part| {
            part.chunks_exact(size as usize).for_each(&mut add);
        })?;
        return Ok(());
    }
    // Faces follow, whose lines also begin with numbers. A row is about as long as the first ones.
    let first = head.get(rows.start as usize..).unwrap_or_default();
    let lines = memchr::memchr_iter(b'\n', first).count().max(1);
    let about = rows.rows.saturating_mul(first.len() as u64) / lines as u64;
    let end = rows.start.saturating_add(about / 10 * 9).min(len);
    each_line(file, [rows.start, end], spread, add)?;
    Ok(())
}

/// Visits parts of the rows between two offsets.
fn each_part(
    file: &mut (impl Read + Seek),
    [start, end]: [u64; 2],
    row: u64,
    spread: PartSpread,
    mut visit: impl FnMut(&[u8]),
) -> io::Result<()> {
    let rows = end.saturating_sub(start) / row;
    let most = (spread.bytes / row).max(1).min(rows);
    let mut bytes = vec![0; (most * row) as usize];
    for part in 0..spread.parts {
        poll();
        let share = part as f64 / (spread.parts - 1) as f64;
        let first = ((rows - most) as f64 * share) as u64;
        file.seek(SeekFrom::Start(start + first * row))?;
        let have = fill(file, &mut bytes)?;
        visit(&bytes[..have]);
    }
    Ok(())
}

/// Visits lines between two offsets.
fn each_line(
    file: &mut (impl Read + Seek),
    range: [u64; 2],
    spread: PartSpread,
    mut visit: impl FnMut(&[u8]),
) -> io::Result<()> {
    each_part(file, range, 1, spread, |part| {
        let lines = whole_lines(part).split(|byte| *byte == b'\n');
        lines.for_each(|line| visit(line.trim_ascii()));
    })
}

/// Returns the lines of a part of a text that it has from their beginning to their end.
fn whole_lines(part: &[u8]) -> &[u8] {
    let mut ends = (0..part.len()).filter(|at| part[*at] == b'\n');
    match (ends.next(), ends.next_back()) {
        (Some(first), Some(last)) => &part[first + 1..last],
        _ => &[],
    }
}

/// Returns the unit that a comment at the beginning of a file names.
fn stated_unit(head: &[u8]) -> Option<LengthUnit> {
    let head = &head[..head.len().min(UNIT_BYTES)];
    let mut lines = text::lines(head).map(|(_, line)| line);
    lines.find_map(|line| {
        let is_comment = COMMENTS.iter().any(|start| line.starts_with(start));
        is_comment.then(|| unit_of(line)).flatten()
    })
}

/// Returns the unit that follows the word `unit` or `units` of a line.
fn unit_of(line: &[u8]) -> Option<LengthUnit> {
    let line = String::from_utf8_lossy(line).to_ascii_lowercase();
    let (_, rest) = line.split_once("unit")?;
    let mut words = rest.split(|c: char| !c.is_ascii_alphabetic());
    match words.find(|word| !["", "s", "is", "are", "in"].contains(word))? {
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some(LengthUnit::Mm),
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => Some(LengthUnit::Cm),
        "m" | "meter" | "meters" | "metre" | "metres" => Some(LengthUnit::M),
        "inch" | "inches" => Some(LengthUnit::In),
        _ => None,
    }
}

/// The box around the positions that were seen.
#[derive(Debug, Clone, Copy, Default)]
struct GrowingBox(Option<Bounds<3>>);

impl GrowingBox {
    fn add(&mut self, position: [f64; 3]) {
        if !is_finite(position) {
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
mod tests {
    use std::io::Cursor;

    use super::{WHOLE_BYTES, unit_of};
    use crate::domain::LengthUnit;
    use crate::mesh::write::MeshFormat;
    use crate::mesh::{Mesh, MeshLimits, extent};

    /// A wavy sheet of 40 by 30 by at most 4.
    fn sheet(side: usize) -> Mesh {
        let at = |k: usize| {
            let [x, y] = [k % side, k / side].map(|at| at as f64 / (side - 1) as f64);
            [40.0 * x, 30.0 * y, (9.0 * x).sin() + (7.0 * y).cos()]
        };
        let vertices: Vec<[f64; 3]> = (0..side * side).map(at).collect();
        let corner = |k: usize| [k, k + 1, k + side].map(|at| at as u32);
        let triangles = (0..side * side - side - 1).map(corner).collect::<Vec<_>>();
        Mesh {
            vertices: vertices.into(),
            triangles: triangles.into(),
        }
    }

    #[test]
    fn the_size_of_long_and_short_files_is_found_in_every_format() {
        for side in [20, 420] {
            let mesh = sheet(side);
            for format in MeshFormat::ALL {
                let bytes = format.encode(&mesh);
                let (len, name) = (bytes.len() as u64, format!("a.{}", format.extension()));
                let limits = &MeshLimits::SUGGESTED;
                let found = extent(&mut Cursor::new(&bytes), len, &name, limits);
                let found = found.expect("a mesh");
                assert_eq!(found.is_exact, len <= WHOLE_BYTES, "{name}");
                let sides = found.sides.expect("vertices");
                let usual = [[34.0, 40.01], [24.0, 30.01], [1.5, 4.01]];
                for (side, [low, high]) in sides.into_iter().zip(usual) {
                    assert!((low..=high).contains(&side), "{name}: {sides:?}");
                }
                assert_eq!(found.longest(), Some(sides[0]), "{name}");
                // A binary file that is cut shows it by its header.
                let cut = &bytes[..bytes.len() / 3];
                let found = extent(&mut Cursor::new(cut), cut.len() as u64, &name, limits);
                let is_text = bytes.is_ascii();
                assert!(found.is_err() || is_text, "{name} cut");
            }
        }
    }

    #[test]
    fn a_unit_is_read_in_a_comment() {
        for (line, unit) in [
            ("# units: mm", Some(LengthUnit::Mm)),
            ("comment Unit = Meters", Some(LengthUnit::M)),
            ("# all units are in inches", Some(LengthUnit::In)),
            ("solid plate UNITS=cm", Some(LengthUnit::Cm)),
            ("# unit vectors", None),
            ("# mm", None),
        ] {
            assert_eq!(unit_of(line.as_bytes()), unit, "{line}");
        }
        let xyz = b"# units: m\n0 0 0\n0.04 0.03 0\n0 0.01 0\n";
        let limits = &MeshLimits::SUGGESTED;
        let found = extent(&mut Cursor::new(xyz), xyz.len() as u64, "a.xyz", limits);
        let found = found.expect("points");
        assert_eq!(found.unit, Some(LengthUnit::M));
        assert_eq!(found.sides, Some([0.04, 0.03, 0.0]));
    }
}
