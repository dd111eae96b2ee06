//! Passes over the triangles of a mesh without the whole mesh in memory.

use std::io::Read;

use super::error::{MeshError, MeshLimits, MeshReadError};
use super::far_values::FarValues;
use super::format::has_extension;
use super::missing::is_position;
use super::stl;
use super::triangle_mesh::Mesh;
use crate::domain::FileKind;
use crate::page_vec::fill;

/// Corners of a triangle in the frame and unit of the mesh.
pub type Triangle = [[f64; 3]; 3];

/// Triangles that are visited at a time.
const BATCH: usize = 1 << 16;

/// Visits the triangles of a mesh in the order of the file, up to 65,536 at a time.
pub trait TriangleStream {
    /// Passes over all triangles once.
    ///
    /// # Errors
    /// Returns an error if the mesh cannot be read or `visit` returns one.
    fn pass(
        &mut self,
        visit: &mut dyn FnMut(&[Triangle]) -> Result<(), MeshReadError>,
    ) -> Result<(), MeshReadError>;
}

impl TriangleStream for &Mesh {
    fn pass(
        &mut self,
        visit: &mut dyn FnMut(&[Triangle]) -> Result<(), MeshReadError>,
    ) -> Result<(), MeshReadError> {
        let mut batch = Vec::with_capacity(BATCH.min(self.triangles.len()));
        for corners in self.triangles.chunks(BATCH) {
            batch.clear();
            batch.extend(
                corners
                    .iter()
                    .map(|corners| corners.map(|corner| self.vertices.at(corner as usize))),
            );
            visit(&batch)?;
        }
        Ok(())
    }
}

/// Returns the number of triangles of a binary STL from its first 84 bytes and its length; `None` if it is something else.
///
/// # Errors
/// Returns an error if the file is a binary STL that ends early.
pub fn binary_stl_triangles(head: &[u8], len: u64, name: &str) -> Result<Option<u32>, MeshError> {
    if FileKind::of(head) == FileKind::Ply {
        return Ok(None);
    }
    if let Some(count) = stl::whole_binary_count(head, len) {
        return Ok(Some(count));
    }
    let is_named_stl = has_extension(name, "stl");
    let is_binary = FileKind::of(head) == FileKind::Binary;
    match stl::binary_count(head) {
        Some(count) if is_named_stl && is_binary => {
            let have = len.saturating_sub(stl::HEADER as u64) / stl::FACET as u64;
            if have < u64::from(count) {
                return Err(stl::truncated(have, count));
            }
            Ok(None)
        }
        _ => Ok(None),
    }
}

/// Bytes at the beginning of a file that [`binary_stl_triangles`] needs.
pub const STL_HEAD: usize = stl::HEADER;

/// Passes over the facets of a binary STL, which is read a part at a time.
///
/// `source` starts after the header, and `far_values` stand for missing positions. Leaves out facets with a corner that has no
/// position, and returns the number of such corners.
///
/// # Errors
/// Returns an error if the file ends early or `visit` returns one.
pub fn pass_over_binary_stl(
    source: &mut impl Read,
    count: u32,
    far_values: &FarValues,
    limits: &MeshLimits,
    visit: &mut dyn FnMut(&[Triangle]) -> Result<(), MeshReadError>,
) -> Result<u64, MeshReadError> {
    limits.check_triangles(u64::from(count))?;
    let mut missing = 0;
    let mut bytes = vec![0; stl::FACET * BATCH.min(count as usize)];
    let mut batch = Vec::with_capacity(BATCH.min(count as usize));
    let mut left = count as usize;
    while left > 0 {
        let most = bytes.len().min(stl::FACET * left);
        let bytes = &mut bytes[..most];
        let have = fill(source, bytes)?;
        if have < bytes.len() {
            let read = count as usize - left + have / stl::FACET;
            return Err(stl::truncated(read as u64, count).into());
        }
        let (facets, _) = bytes.as_chunks::<{ stl::FACET }>();
        batch.clear();
        for facet in facets {
            let corners = stl::corners(facet).map(|corner| corner.map(f64::from));
            let absent = corners
                .iter()
                .filter(|corner| !is_position(**corner) || far_values.are_at(**corner))
                .count();
            missing += absent as u64;
            if absent == 0 {
                batch.push(corners);
            }
        }
        visit(&batch)?;
        left -= facets.len();
    }
    Ok(missing)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::{STL_HEAD, binary_stl_triangles, pass_over_binary_stl};
    use crate::mesh::far_values::FarValues;
    use crate::mesh::write::MeshFormat;
    use crate::mesh::{Mesh, MeshError, MeshLimits, far_values_of_stl, read_from};

    /// The first bytes of a binary STL with 300,000 triangles, whose header is a text.
    fn head() -> Vec<u8> {
        let mut head = b"solid of a scanner".to_vec();
        head.resize(80, b' ');
        head.extend(300_000_u32.to_le_bytes());
        head
    }

    #[test]
    fn whole_binary_files_are_recognized_by_their_length() {
        let len = STL_HEAD as u64 + 50 * 300_000;
        assert_eq!(
            binary_stl_triangles(&head(), len, "b.stl"),
            Ok(Some(300_000))
        );
    }

    #[test]
    fn a_binary_file_that_ends_early_is_refused() {
        let refused = binary_stl_triangles(&head(), 5_000_084, "b.STL");
        let expected = MeshError::Truncated {
            format: "binary STL",
            what: "triangles".into(),
            have: 100_000,
            want: 300_000,
        };
        assert_eq!(refused, Err(expected));
    }

    #[test]
    fn text_in_any_script_is_no_binary_file() {
        let mut text = "solid mộc bản\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n".repeat(3);
        for mark in ["", "\u{feff}"] {
            text.insert_str(0, mark);
            let head = &text.as_bytes()[..STL_HEAD];
            assert_eq!(binary_stl_triangles(head, 5_000, "b.stl"), Ok(None));
        }
    }

    #[test]
    fn facets_with_a_corner_without_position_are_left_out() {
        let corners = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.5],
            [f64::NAN, f64::INFINITY, 0.0],
        ];
        let mesh = Mesh {
            vertices: corners.into(),
            triangles: vec![[0, 1, 3], [0, 1, 2], [3, 3, 2]].into(),
        };
        let bytes = MeshFormat::StlBinary.encode(&mesh);
        let mut visited = Vec::new();
        let mut visit = |batch: &[_]| {
            visited.extend_from_slice(batch);
            Ok(())
        };
        let mut facets = &bytes[STL_HEAD..];
        let far_values = FarValues::default();
        let limits = MeshLimits::SUGGESTED;
        let missing = pass_over_binary_stl(&mut facets, 3, &far_values, &limits, &mut visit);
        assert_eq!(missing.expect("reads"), 3);
        assert_eq!(visited, [[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]]);
    }

    #[test]
    fn facets_at_a_repeated_number_far_outside_are_left_out_as_of_a_whole_file() {
        let corner = |k: usize| {
            let [x, y] = [k % 60, k / 60].map(|at| at as f64);
            [x, y, if k.is_multiple_of(40) { -9999.0 } else { 1.0 }]
        };
        let vertices: Vec<[f64; 3]> = (0..3000).map(corner).collect();
        let mesh = Mesh::from_soup(vertices.into());
        let bytes = MeshFormat::StlBinary.encode(&mesh);
        let limits = MeshLimits::SUGGESTED;
        let len = bytes.len() as u64;
        let whole = read_from(&mut bytes.as_slice(), len, "a.stl", &limits).expect("reads");
        assert_eq!(whole.losses.missing_vertices, 75);
        let far_values = far_values_of_stl(&mut Cursor::new(&bytes), 1000).expect("a file");
        let mut visited = 0;
        let mut visit = |batch: &[_]| {
            visited += batch.len();
            Ok(())
        };
        let mut facets = &bytes[STL_HEAD..];
        let missing = pass_over_binary_stl(&mut facets, 1000, &far_values, &limits, &mut visit);
        assert_eq!(missing.expect("reads"), 75);
        assert_eq!(visited, whole.mesh.triangles.len());
    }
}
