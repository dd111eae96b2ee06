//! Writers of STL, PLY and OBJ files. Coordinates are written as 32-bit floats.

use std::fmt::Write as _;

use nalgebra::Vector3;

use super::Mesh;

/// A file format to write.
///
/// ```
/// use mocban_core::mesh::write::MeshFormat;
/// use mocban_core::mesh::{Mesh, MeshLimits, read};
///
/// let mesh = Mesh {
///     vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]].into(),
///     triangles: vec![[0, 1, 2]].into(),
/// };
/// for format in [MeshFormat::StlBinary, MeshFormat::PlyLittleEndian, MeshFormat::Obj] {
///     let bytes = format.encode(&mesh);
///     assert_eq!(read(&bytes, "scan", &MeshLimits::SUGGESTED)?, mesh);
/// }
/// # Ok::<(), mocban_core::mesh::MeshError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    /// Binary STL: each triangle with its own three vertices.
    StlBinary,
    /// STL as text.
    StlAscii,
    /// PLY as text.
    PlyAscii,
    /// Binary PLY, little-endian.
    PlyLittleEndian,
    /// Binary PLY, big-endian.
    PlyBigEndian,
    /// Wavefront OBJ.
    Obj,
}

impl MeshFormat {
    /// Every format.
    pub const ALL: [Self; 6] = [
        Self::StlBinary,
        Self::StlAscii,
        Self::PlyAscii,
        Self::PlyLittleEndian,
        Self::PlyBigEndian,
        Self::Obj,
    ];

    /// Returns the extension of the file's name.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::StlBinary | Self::StlAscii => "stl",
            Self::PlyAscii | Self::PlyLittleEndian | Self::PlyBigEndian => "ply",
            Self::Obj => "obj",
        }
    }

    /// Encodes a mesh as the bytes of a file.
    pub fn encode(self, mesh: &Mesh) -> Vec<u8> {
        match self {
            Self::StlBinary => stl_binary(mesh),
            Self::StlAscii => stl_ascii(mesh),
            Self::PlyAscii => ply_ascii(mesh),
            Self::PlyLittleEndian => ply_binary(mesh, "binary_little_endian", u32::to_le_bytes),
            Self::PlyBigEndian => ply_binary(mesh, "binary_big_endian", u32::to_be_bytes),
            Self::Obj => obj(mesh),
        }
    }
}

fn single(point: [f64; 3]) -> [f32; 3] {
    point.map(|c| c as f32)
}

fn corners(mesh: &Mesh, triangle: [u32; 3]) -> [[f32; 3]; 3] {
    triangle.map(|corner| single(mesh.vertices.at(corner as usize)))
}

/// Returns the unit normal of a triangle, directed by its winding. Returns zeros for a triangle without area, as other
/// STL writers do.
fn normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|corner| Vector3::from(corner.map(f64::from)));
    let unit = (b - a).cross(&(c - a)).try_normalize(0.0);
    unit.map_or([0.0; 3], |unit| unit.map(|c| c as f32).into())
}

fn stl_binary(mesh: &Mesh) -> Vec<u8> {
    let mut out = Vec::with_capacity(84 + 50 * mesh.triangles.len());
    let mut header = [b' '; 80];
    header[..12].copy_from_slice(b"scan, binary");
    out.extend(header);
    out.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        let points = corners(mesh, *triangle);
        for value in [normal(points)].iter().chain(&points).flatten() {
            out.extend(value.to_le_bytes());
        }
        out.extend([0, 0]);
    }
    out
}

fn stl_ascii(mesh: &Mesh) -> Vec<u8> {
    let mut out = String::from("solid scan\n");
    for triangle in &mesh.triangles {
        let points = corners(mesh, *triangle);
        let [x, y, z] = normal(points);
        push(&mut out, format_args!("facet normal {x} {y} {z}\n"));
        out.push_str(" outer loop\n");
        for [x, y, z] in points {
            push(&mut out, format_args!("  vertex {x} {y} {z}\n"));
        }
        out.push_str(" endloop\nendfacet\n");
    }
    out.push_str("endsolid scan\n");
    out.into_bytes()
}

fn ply_header(mesh: &Mesh, format: &str) -> String {
    let (vertices, faces) = (mesh.vertices.len(), mesh.triangles.len());
    format!(
        "ply\nformat {format} 1.0\ncomment scan\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

fn ply_ascii(mesh: &Mesh) -> Vec<u8> {
    let mut out = ply_header(mesh, "ascii");
    for [x, y, z] in mesh.vertices.iter().map(single) {
        push(&mut out, format_args!("{x} {y} {z}\n"));
    }
    for [a, b, c] in &mesh.triangles {
        push(&mut out, format_args!("3 {a} {b} {c}\n"));
    }
    out.into_bytes()
}

fn ply_binary(mesh: &Mesh, format: &str, word: fn(u32) -> [u8; 4]) -> Vec<u8> {
    let mut out = ply_header(mesh, format).into_bytes();
    out.reserve(12 * mesh.vertices.len() + 13 * mesh.triangles.len());
    for value in mesh.vertices.iter().flat_map(single) {
        out.extend(word(value.to_bits()));
    }
    for triangle in &mesh.triangles {
        out.push(3);
        for corner in triangle {
            out.extend(word(*corner));
        }
    }
    out
}

fn obj(mesh: &Mesh) -> Vec<u8> {
    let mut out = String::from("# scan\no scan\n");
    for [x, y, z] in mesh.vertices.iter().map(single) {
        push(&mut out, format_args!("v {x} {y} {z}\n"));
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| corner + 1);
        push(&mut out, format_args!("f {a} {b} {c}\n"));
    }
    out.into_bytes()
}

fn push(out: &mut String, text: std::fmt::Arguments) {
    out.write_fmt(text).expect("a String takes any text");
}

#[cfg(test)]
mod tests {
    use super::MeshFormat;
    use crate::mesh::{Mesh, MeshLimits, read};

    fn wedge() -> Mesh {
        Mesh {
            vertices: vec![
                [0.0, 0.0, 0.5],
                [1.25, 0.0, -3.0e-5],
                [0.0, 1.0, 123.456],
                [-7.0, 2.0, 0.0],
            ]
            .into(),
            triangles: vec![[0, 1, 2], [2, 1, 3]].into(),
        }
    }

    /// Returns the corners of all triangles in single precision.
    fn soup(mesh: &Mesh) -> Vec<[f32; 3]> {
        let corner = |index: &u32| mesh.vertices.at(*index as usize).map(|c| c as f32);
        mesh.triangles.iter().flatten().map(corner).collect()
    }

    #[test]
    fn every_format_is_read_back_with_its_triangles() {
        for format in MeshFormat::ALL {
            let name = format!("wedge.{}", format.extension());
            let back = read(&format.encode(&wedge()), &name, &MeshLimits::SUGGESTED);
            let back = back.unwrap_or_else(|error| panic!("{format:?}: {error}"));
            assert_eq!(soup(&back), soup(&wedge()), "{format:?}");
        }
    }
}
