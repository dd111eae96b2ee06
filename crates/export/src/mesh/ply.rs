//! Writes placed scans as binary PLY.

use std::io::{self, Write};

use super::placed_mesh::PlacedMesh;
use mocban_core::domain::LengthUnit;

/// Colour of vertices outside of the print.
const WHITE: [u8; 3] = [255; 3];

/// Writes a scan as binary little-endian PLY: per vertex its position, print colour, stroke label (0 or 1) and height
/// over the fitted surface; per face its corners. `unit` is the unit of the scan, if known.
pub(super) fn write_ply(
    mesh: &PlacedMesh,
    unit: Option<LengthUnit>,
    out: &mut impl Write,
) -> io::Result<()> {
    let unit = unit.map_or("unknown, as in the scan", |_| "mm");
    let (vertices, faces) = (mesh.positions.len(), mesh.source.triangles.len());
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment unit {unit}\n\
         comment x right, y up as in the print, z out of the block\n\
         element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar stroke\n\
         property float height\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )?;
    for (k, position) in mesh.positions.iter().enumerate() {
        let [x, y, z] = position.map(f32::to_le_bytes);
        let [red, green, blue] = mesh.colours[k].unwrap_or(WHITE);
        let labels = [red, green, blue, u8::from(mesh.strokes[k])];
        let height = mesh.heights[k].to_le_bytes();
        out.write_all([x, y, z, labels, height].as_flattened())?;
    }
    for triangle in &mesh.source.triangles {
        out.write_all(&[3])?;
        out.write_all(triangle.map(u32::to_le_bytes).as_flattened())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::write_ply;
    use crate::mesh::placed_mesh::tests::placed;
    use mocban_core::domain::LengthUnit;
    use mocban_core::mesh::{MeshLimits, Vertices, read};

    #[test]
    fn positions_and_faces_are_read_back() {
        let mesh = placed(Some(LengthUnit::Mm));
        let mut file = Vec::new();
        write_ply(&mesh, Some(LengthUnit::Mm), &mut file).expect("written");
        let back = read(&file, "a.ply", &MeshLimits::SUGGESTED).expect("reads");
        assert_eq!(*back.triangles, *mesh.source.triangles);
        assert_eq!(back.vertices, Vertices::Single(mesh.positions.into()));
    }

    #[test]
    fn a_vertex_holds_colour_label_and_height() {
        let mesh = placed(None);
        let mut file = Vec::new();
        write_ply(&mesh, None, &mut file).expect("written");
        let end = b"end_header\n";
        let header = file.windows(end.len()).position(|part| part == end);
        let body = &file[header.expect("a header") + end.len()..];
        let row = |k: usize| &body[20 * k..][..20];
        assert_eq!(row(0)[12..15], mesh.colours[0].expect("over the print"));
        assert_eq!([row(0)[15], row(1)[15], row(4)[15]], [1, 0, 0]);
        assert_eq!(row(4)[12..15], [255; 3]);
        assert_eq!(row(1)[16..], mesh.heights[1].to_le_bytes());
        assert!(String::from_utf8_lossy(&file).contains("comment unit unknown"));
    }
}
