//! Triangle meshes and point sets in their own frame and unit, and their readers and writers.

mod arrays;
mod clustering;
mod decimal;
mod error;
mod extent;
mod extreme_vertices;
mod far_values;
mod format;
mod inner_range;
mod missing;
mod obj;
mod ply;
pub mod robust_bounds;
mod stated_unit;
mod stl;
mod text;
mod triangle_mesh;
mod triangle_stream;
#[cfg(test)]
mod unusual_tests;
mod weld;

pub mod write;
mod xyz;

pub use arrays::{MeshArrayError, PositionSlice};
pub use error::{MeshError, MeshLimits, MeshReadError};
pub use extent::{MeshExtent, far_values_of_stl};
pub use far_values::FarValues;
pub use missing::MeshRead;
pub use triangle_mesh::{Mesh, Vertices};
pub use triangle_stream::{
    STL_HEAD, Triangle, TriangleStream, binary_stl_triangles, pass_over_binary_stl,
};

use std::io::{Read, Seek};

use crate::domain::cancel::PolledReader;
use crate::domain::{FileKind, are_zeros};
use crate::page_vec::PageVec;
use far_values::VertexKind;
use format::{DetectedFormat, has_extension};
use missing::PositionCheck;

/// Reads a mesh or point set from the bytes of a file, like [`read_from`].
///
/// The format is detected from the content; `name` is used only if the content is truncated or ambiguous. Polygons are
/// triangulated as fans; faces with fewer than three corners are left out. Each triangle of an STL gets three vertices of
/// its own. A wrong count in a header never reserves more memory than a file of this size could need.
///
/// ```
/// use mocban_core::mesh::{MeshLimits, read};
///
/// let obj = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
/// let mesh = read(obj, "square.obj", &MeshLimits::SUGGESTED)?;
/// assert_eq!(*mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
///
/// let xyz = b"x,y,z\n0,0,1.5\n1,0,1.5\n";
/// let points = read(xyz, "points.xyz", &MeshLimits::SUGGESTED)?;
/// assert_eq!(points.vertices.at(1), [1.0, 0.0, 1.5]);
/// # Ok::<(), mocban_core::mesh::MeshError>(())
/// ```
///
/// # Errors
/// Returns an error if the bytes are not a complete mesh of a supported format, contain an index out of range, have no
/// vertex with a position, or exceed the limits.
pub fn read(bytes: &[u8], name: &str, limits: &MeshLimits) -> Result<Mesh, MeshError> {
    read_bytes(bytes, name, limits).map(|read| read.mesh)
}

fn read_bytes(bytes: &[u8], name: &str, limits: &MeshLimits) -> Result<MeshRead, MeshError> {
    limits.check_bytes(bytes.len() as u64)?;
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let checked = |mesh: Mesh, incomplete_faces| {
        let check = PositionCheck::of(&mesh.vertices);
        (mesh, check, incomplete_faces)
    };
    let whole = |mesh| checked(mesh, 0);
    if are_zeros(bytes) {
        return Err(MeshError::OnlyZeros);
    }
    let format = DetectedFormat::of(bytes, name)?;
    let bytes = match format {
        DetectedFormat::Obj | DetectedFormat::StlAscii | DetectedFormat::Xyz => {
            text::without_end_mark(bytes)
        }
        DetectedFormat::Ply | DetectedFormat::StlBinary => bytes,
    };
    let (mesh, check, incomplete_faces) = match format {
        DetectedFormat::Obj => obj::read(bytes, limits).map(|(mesh, faces)| checked(mesh, faces)),
        DetectedFormat::Ply => ply::read(bytes, limits),
        DetectedFormat::StlBinary => {
            stl::read_binary(bytes, limits).map(|(mesh, check)| (mesh, check, 0))
        }
        DetectedFormat::StlAscii => stl::read_ascii(bytes, limits).map(whole),
        DetectedFormat::Xyz => xyz::read(bytes, has_extension(name, "pts"), limits).map(whole),
    }
    .map_err(|fault| text::fault_at_end(fault, bytes))?;
    if mesh.vertices.is_empty() {
        return Err(MeshError::NoVertices);
    }
    let kind = match format {
        DetectedFormat::StlBinary | DetectedFormat::StlAscii => VertexKind::Corners,
        _ if mesh.triangles.is_empty() => VertexKind::Points,
        DetectedFormat::Obj | DetectedFormat::Ply | DetectedFormat::Xyz => VertexKind::Shared,
    };
    check.without_missing(mesh, kind, incomplete_faces)
}

/// Some programs write this mark before text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads a mesh or point set like [`read`], but from a stream. `about` is its approximate length in bytes. A binary STL
/// of exactly this length is read in parts, so the whole file is never in memory.
///
/// ```
/// use mocban_core::mesh::{MeshLimits, read, read_from};
///
/// let ply = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
///     property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
///     0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
/// let limits = MeshLimits::SUGGESTED;
/// let mesh = read_from(&mut ply.as_slice(), ply.len() as u64, "a.ply", &limits)?;
/// assert_eq!(mesh.mesh, read(ply, "a.ply", &limits)?);
/// assert_eq!(mesh.losses.missing_vertices, 0);
/// # Ok::<(), mocban_core::mesh::MeshReadError>(())
/// ```
///
/// # Errors
/// Returns an error if [`read`] would return one, or if the source fails.
pub fn read_from(
    source: &mut impl Read,
    about: u64,
    name: &str,
    limits: &MeshLimits,
) -> Result<MeshRead, MeshReadError> {
    limits.check_bytes(about)?;
    let mut source = PolledReader(source);
    let mut head = Vec::with_capacity(stl::HEADER);
    source
        .by_ref()
        .take(stl::HEADER as u64)
        .read_to_end(&mut head)?;
    let is_other = head.starts_with(BYTE_ORDER_MARK)
        || FileKind::of(&head) == FileKind::Ply
        || are_zeros(&head);
    if let Some(count) = stl::whole_binary_count(&head, about).filter(|_| !is_other) {
        let (mesh, check) = stl::read_facets(&mut source, count, limits)?;
        return Ok(check.without_missing(mesh, VertexKind::Corners, 0)?);
    }
    let bytes = PageVec::read(head.as_slice().chain(source), about as usize)?;
    Ok(read_bytes(&bytes, name, limits)?)
}

/// Describes the size of a mesh by its file of `len` bytes. Of a long file, reads only parts.
///
/// # Errors
/// For a short file, returns the errors of [`read_from`]. For a long file, returns an error if its header shows one, or if it
/// cannot be read.
pub fn extent(
    file: &mut (impl Read + Seek),
    len: u64,
    name: &str,
    limits: &MeshLimits,
) -> Result<MeshExtent, MeshReadError> {
    limits.check_bytes(len)?;
    if len > extent::WHOLE_BYTES {
        return extent::sampled(file, len, name, limits);
    }
    let bytes = short_file(file)?;
    let mesh = read(&bytes, name, limits)?;
    Ok(MeshExtent::of_all(mesh.vertices.iter(), &bytes))
}

/// Visits vertices of a mesh by its file of `len` bytes: all of a short file, and some of a long one, spread over the file.
///
/// # Errors
/// Returns an error like [`extent`].
pub fn visit_some_vertices(
    file: &mut (impl Read + Seek),
    len: u64,
    name: &str,
    limits: &MeshLimits,
    visit: &mut dyn FnMut([f64; 3]),
) -> Result<(), MeshReadError> {
    limits.check_bytes(len)?;
    if len > extent::WHOLE_BYTES {
        let (some, _) = extent::some_positions(file, (len, name), limits, extent::FOR_PICTURE)?;
        some.into_iter().for_each(visit);
    } else {
        let mesh = read(&short_file(file)?, name, limits)?;
        mesh.vertices.iter().for_each(visit);
    }
    Ok(())
}

/// Reads a file of at most `WHOLE_BYTES`.
fn short_file(file: &mut impl Read) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(extent::WHOLE_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{Mesh, MeshError, MeshLimits, Vertices, read, read_from};
    use crate::domain::FileKind;

    const LIMITS: MeshLimits = MeshLimits {
        max_bytes: 1 << 20,
        max_vertices: 1000,
        max_triangles: 1000,
    };

    /// One complete file of each format and encoding.
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

    /// A source that returns a few bytes at a time.
    struct Slow<'a>(&'a [u8]);

    impl std::io::Read for Slow<'_> {
        fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
            let most = into.len().min(37);
            self.0.read(&mut into[..most])
        }
    }

    /// Reads from a file that had `about` bytes when it was opened.
    fn from_file(bytes: &[u8], about: usize, name: &str) -> Result<Mesh, String> {
        read_from(&mut Slow(bytes), about as u64, name, &LIMITS)
            .map(|read| read.mesh)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_file_is_read_like_its_bytes() {
        let mut many = samples();
        let mut long = vec![b' '; 80];
        // Almost three times as many facets as are read at a time.
        let count = 2 * 1280 + 7_u32;
        long.extend(count.to_le_bytes());
        long.extend((0..count * 50).map(|k| (k % 60) as u8));
        let at_end = long.len() - 50 + 14;
        let mut nan = long.clone();
        nan[at_end..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        for bytes in [long, nan] {
            for len in [bytes.len(), bytes.len() - 7, bytes.len() - 50 * 900 - 3] {
                let held = read(&bytes[..len], "a.stl", &MeshLimits::SUGGESTED);
                let read = read_from(
                    &mut Slow(&bytes[..len]),
                    bytes.len() as u64,
                    "a.stl",
                    &MeshLimits::SUGGESTED,
                );
                let read = read
                    .map(|read| read.mesh)
                    .map_err(|error| error.to_string());
                assert_eq!(read, held.map_err(|error| error.to_string()), "{len}");
            }
        }
        many.push(("none.stl", vec![0; 84]));
        many.push(("ply.stl", [&b"ply\n"[..], &[0; 80]].concat()));
        many.push(("mark.stl", [&b"\xef\xbb\xbf"[..], &[0; 81]].concat()));
        many.push(("empty.stl", Vec::new()));
        for (name, bytes) in many {
            for len in (0..bytes.len()).rev().step_by(13).chain([bytes.len()]) {
                let bytes = &bytes[..len];
                let held = read(bytes, name, &LIMITS).map_err(|error| error.to_string());
                assert_eq!(from_file(bytes, len, name), held, "{name} {len}");
            }
        }
    }

    #[test]
    fn a_file_that_grows_or_shrinks_while_it_is_read_is_rejected() {
        let (_, bytes) = samples().swap_remove(3);
        let grown = [&bytes[..], b"more"].concat();
        assert_eq!(
            from_file(&grown, bytes.len(), "a.stl"),
            Err("it grew while it was read".into())
        );
        let shrunk = &bytes[..bytes.len() - 51];
        assert_eq!(
            from_file(shrunk, bytes.len(), "a.stl"),
            Err("the binary STL is truncated: it holds 0 of 2 triangles".into())
        );
    }

    #[test]
    fn format_is_detected_by_content_not_by_name() {
        for (name, bytes) in samples() {
            let named = read(&bytes, name, &LIMITS).expect("reads");
            let misnamed = read(&bytes, "print.png", &LIMITS).expect("reads");
            assert_eq!(named, misnamed, "{name}");
        }
    }

    #[test]
    fn text_samples_give_the_same_mesh_with_crlf() {
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
    fn error_names_the_type_of_other_files() {
        assert_eq!(read(b"", "a.ply", &LIMITS), Err(MeshError::Empty));
        for name in ["a.stl", "a.ply", "a.obj", "a.xyz"] {
            for len in [1, 84, 85, 5000] {
                let zeros = read(&vec![0; len], name, &LIMITS);
                assert_eq!(zeros, Err(MeshError::OnlyZeros), "{name} {len}");
            }
        }
        let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";
        assert_eq!(
            read(png, "a.stl", &LIMITS),
            Err(MeshError::NotAMesh(FileKind::Png))
        );
        let error = read(b"Dear reader,\nthis is a letter.\n", "a.obj", &LIMITS).expect_err("text");
        assert_eq!(
            error.to_string(),
            "the file is text; OBJ, PLY and STL meshes and XYZ points are read"
        );
        assert!(read(&[7, 0, 1, 2], "a.obj", &LIMITS).is_err());
    }

    #[test]
    fn limit_errors_name_their_setting() {
        let tight = MeshLimits {
            max_bytes: 10,
            ..LIMITS
        };
        let error = read(&samples()[0].1, "a.obj", &tight).expect_err("over");
        assert!(error.to_string().ends_with("limits.mesh.max_bytes is 10"));
        for (name, bytes) in samples() {
            let tight = MeshLimits {
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
    fn a_file_truncated_at_any_byte_gives_an_error_of_one_line_or_a_smaller_mesh() {
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

    /// Returns the number of vertices that fit the reserved memory.
    fn capacity(vertices: &Vertices) -> usize {
        match vertices {
            Vertices::Single(all) => all.capacity(),
            Vertices::Double(all) => all.capacity(),
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]
        #[test]
        fn changed_bytes_never_panic_and_keep_the_guarantees_of_a_mesh(
            sample in 0_usize..6,
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        ) {
            let (name, mut bytes) = samples().swap_remove(sample);
            for (at, value) in changes {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            if let Ok(mesh) = read(&bytes, name, &LIMITS) {
                prop_assert!(capacity(&mesh.vertices) <= 2 * bytes.len());
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
