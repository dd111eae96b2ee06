//! Scanned surfaces in their own frame and unit, and the readers that bring them in.

mod error;
mod format;
mod limits;
mod obj;
mod ply;
mod points;
mod stl;
mod text;
mod vertices;
pub mod write;

pub use error::Error;
pub use format::Format;
pub use limits::Limits;
pub use vertices::Vertices;

use crate::large::Large;

/// Triangles over vertices, in the mesh's own frame and unit. A point set has no triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Positions of corners and points.
    pub vertices: Vertices,
    /// Indices into `vertices`, wound as in the file.
    pub triangles: Large<[u32; 3]>,
}

/// Reads a mesh or point set from a file's bytes.
///
/// The format is told by content; `name` serves only where the content leaves a doubt. Polygons become fans of
/// triangles, those of fewer than three corners are left out. STL stays a soup: a vertex is repeated in each of its
/// triangles. Nothing is reserved on a header's word alone: counts are held against the bytes that are there.
///
/// # Errors
/// When the bytes are no whole mesh of a known format, hold a number that is not finite or an index out of range,
/// or exceed the limits.
pub fn read(bytes: &[u8], name: &str, limits: &Limits) -> Result<Mesh, Error> {
    limits.check_bytes(bytes.len() as u64)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mesh = match Format::of(bytes, name)? {
        Format::Obj => obj::read(bytes, limits),
        Format::Ply => ply::read(bytes, limits),
        Format::StlBinary => stl::read_binary(bytes, limits),
        Format::StlAscii => stl::read_ascii(bytes, limits),
        Format::Xyz => points::read(bytes, limits),
    }?;
    if mesh.vertices.is_empty() {
        return Err(Error::NoVertices);
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{Error, Limits, read};
    use crate::domain::FileKind;

    const LIMITS: Limits = Limits {
        max_bytes: 1 << 20,
        max_vertices: 1000,
        max_triangles: 1000,
    };

    /// One whole file of each format and encoding.
    fn samples() -> Vec<(&'static str, Vec<u8>)> {
        let obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf -3 -2 -1\n";
        let ascii =
            b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
            property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
            0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        let mut binary = String::from_utf8_lossy(ascii)
            .replace("ascii", "binary_little_endian")
            .into_bytes();
        binary.truncate(binary.len() - b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".len());
        for value in [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.] {
            binary.extend(value.to_le_bytes());
        }
        binary.push(3);
        for index in 0_i32..3 {
            binary.extend(index.to_le_bytes());
        }
        let mut stl = vec![0; 80];
        stl.extend(2_u32.to_le_bytes());
        stl.extend([0; 100]);
        let solid = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
            vertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
        vec![
            ("a.obj", obj.to_vec()),
            ("a.ply", ascii.to_vec()),
            ("b.ply", binary),
            ("a.stl", stl),
            ("b.stl", solid.to_vec()),
            ("a.xyz", b"0 0 0\n1 0 0\n0 1 0\n".to_vec()),
        ]
    }

    #[test]
    fn format_is_told_by_content_not_by_name() {
        for (name, bytes) in samples() {
            let named = read(&bytes, name, &LIMITS).expect("reads");
            let misnamed = read(&bytes, "print.png", &LIMITS).expect("reads");
            assert_eq!(named, misnamed, "{name}");
        }
    }

    #[test]
    fn every_whole_sample_becomes_the_same_corners_with_crlf() {
        for (name, bytes) in samples() {
            let Ok(text) = String::from_utf8(bytes) else {
                continue;
            };
            if text.contains('\0') {
                continue;
            }
            let unix = read(text.as_bytes(), name, &LIMITS).expect("reads");
            let dos = read(text.replace('\n', "\r\n").as_bytes(), name, &LIMITS).expect("reads");
            assert_eq!(unix, dos, "{name}");
        }
    }

    #[test]
    fn what_is_no_mesh_is_named() {
        assert_eq!(read(b"", "a.ply", &LIMITS), Err(Error::Empty));
        let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";
        assert_eq!(
            read(png, "a.stl", &LIMITS),
            Err(Error::NotAMesh(FileKind::Png))
        );
        let error = read(b"Dear reader,\nthis is a letter.\n", "a.obj", &LIMITS).expect_err("text");
        assert_eq!(
            error.to_string(),
            "the file is text; OBJ, PLY and STL meshes and XYZ points are read"
        );
        assert!(read(&[7, 0, 1, 2], "a.obj", &LIMITS).is_err());
    }

    #[test]
    fn limits_name_their_setting() {
        let tight = Limits {
            max_bytes: 10,
            ..LIMITS
        };
        let error = read(&samples()[0].1, "a.obj", &tight).expect_err("over");
        assert!(error.to_string().ends_with("limits.mesh.max_bytes is 10"));
        for (name, bytes) in samples() {
            let tight = Limits {
                max_vertices: 2,
                ..LIMITS
            };
            let error = read(&bytes, name, &tight).expect_err("over");
            assert!(
                error.to_string().ends_with("limits.mesh.max_vertices is 2"),
                "{name}: {error}"
            );
        }
    }

    #[test]
    fn a_file_cut_at_any_byte_gives_one_line_or_a_smaller_mesh() {
        for (name, bytes) in samples() {
            let whole = read(&bytes, name, &LIMITS).expect("reads");
            for len in 0..bytes.len() {
                match read(&bytes[..len], name, &LIMITS) {
                    Ok(mesh) => assert!(mesh.triangles.len() <= whole.triangles.len()),
                    Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{error}"),
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]
        #[test]
        fn changed_bytes_never_panic_and_never_break_a_promise(
            sample in 0_usize..6,
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        ) {
            let (name, mut bytes) = samples().swap_remove(sample);
            for (at, value) in changes {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            if let Ok(mesh) = read(&bytes, name, &LIMITS) {
                prop_assert!(mesh.vertices.capacity() <= 2 * bytes.len());
                prop_assert!(mesh.vertices.iter().flatten().all(f64::is_finite));
                let count = mesh.vertices.len() as u32;
                prop_assert!(mesh.triangles.as_flattened().iter().all(|index| *index < count));
            }
        }

        #[test]
        fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = read(&bytes, "a.stl", &LIMITS);
            let _ = read(&[b"ply\nformat ascii 1.0\n", bytes.as_slice()].concat(), "a", &LIMITS);
        }
    }
}
