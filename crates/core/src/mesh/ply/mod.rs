//! Reader of the Stanford polygon format (PLY): ASCII, binary little-endian and big-endian.

mod body;
mod header;
mod source;
mod vertex_rows;

pub(super) use vertex_rows::VertexRows;

use body::PlyBody;
use header::{PlyEncoding, PlyHeader};
use source::{AsciiSource, BinarySource};

use crate::mesh::error::{MeshError, MeshLimits};
use crate::mesh::missing::PositionCheck;
use crate::mesh::triangle_mesh::Mesh;

/// Reads vertices, faces and triangle strips; ignores other elements and properties. Returns also the number of faces with
/// fewer than three corners, which are left out.
pub(super) fn read(
    bytes: &[u8],
    limits: &MeshLimits,
) -> Result<(Mesh, PositionCheck, u64), MeshError> {
    let (header, start) = PlyHeader::parse(bytes)?;
    let read = |rest| match header.encoding {
        PlyEncoding::Ascii => body::read(&header, AsciiSource::new(rest), limits),
        PlyEncoding::LittleEndian => body::read(&header, BinarySource::<false> { rest }, limits),
        PlyEncoding::BigEndian => body::read(&header, BinarySource::<true> { rest }, limits),
    };
    let mut body = read(&bytes[start..]);
    // A line break after the header belongs to it or is data. The rows of lists, as of faces, fit one of them only.
    if let [b'\r' | b'\n', rest @ ..] = &bytes[start..]
        && header.encoding != PlyEncoding::Ascii
        && !matches!(body, Ok(PlyBody { padding: 0, .. }))
        && let Ok(other) = read(rest)
        // A truncated file may seem whole by chance if bytes after its rows are ignored.
        && (body.is_ok() || other.padding == 0)
    {
        if body.is_ok() || !header.has_lists() {
            let reason = "a line break follows end_header that may be data; save it again";
            return Err(MeshError::Header(reason.into()));
        }
        body = Ok(other);
    }
    let body = body?;
    Ok((body.mesh, body.check, body.incomplete_faces))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Mesh, MeshError, MeshLimits, Vertices};

    fn read(bytes: &[u8]) -> Result<Mesh, MeshError> {
        super::read(bytes, &MeshLimits::SUGGESTED).map(|(mesh, ..)| mesh)
    }

    fn ascii(elements: &str, body: &str) -> Vec<u8> {
        format!("ply\nformat ascii 1.0\n{elements}end_header\n{body}").into_bytes()
    }

    const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
    const CORNERS: &str = "property list uchar int vertex_indices\n";

    #[test]
    fn rows_that_the_header_does_not_count_are_refused() {
        let elements = format!("element vertex 3\n{XYZ}element face 1\n{CORNERS}");
        let rows = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        assert!(read(&ascii(&elements, &format!("{rows}\n \0"))).is_ok());
        let error = read(&ascii(&elements, &format!("{rows}3 2 1 0\n"))).expect_err("a row more");
        assert_eq!(
            error.to_string(),
            "the ascii PLY has 9 bytes after the rows that its header counts; save it again with the right counts"
        );
    }

    #[test]
    fn a_truncated_file_whose_data_begin_with_a_line_break_is_refused() {
        let header = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex 1\n{XYZ}element face 1\n{CORNERS}end_header\n"
        );
        let rows = [b"\r\xb2\xc2\x40".as_slice(), &[0; 8], &[3], &[0; 12]].concat();
        let whole = [header.as_bytes(), &rows].concat();
        assert_eq!(read(&whole).expect("reads").triangles.len(), 1);
        let error = read(&whole[..whole.len() - 1]).expect_err("truncated");
        assert!(error.to_string().contains("is truncated"), "{error}");
    }

    #[test]
    fn unknown_elements_and_properties_are_skipped() {
        let bytes = ascii(
            "comment made by hand\nobj_info num_cols 2\nelement camera 1\nproperty float f\n\
             property list uchar float k\nelement vertex 4\nproperty uchar red\nproperty double z\n\
             property float x\nproperty float y\nproperty list uchar short extra\nelement face 3\n\
             property uchar flags\nproperty list uint uint vertex_index\n\
             property list uchar float texcoord\n",
            "35.0 2 1 2\n9 0.5 1 2 1 7\n9 0 3 4 0\n9 0 5 6 0\n9 0 7 8 2 1 2\n\
             1 4 0 1 2 3 0\n1 2 0 1 0\n1 3 3 2 1 6 0 0 0 0 0 0\n",
        );
        let mesh = read(&bytes).expect("reads");
        assert_eq!(mesh.vertices.at(0), [1.0, 2.0, 0.5]);
        assert_eq!(mesh.vertices.at(3), [7.0, 8.0, 0.0]);
        assert_eq!(*mesh.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
    }

    #[test]
    fn coordinates_keep_the_precision_of_their_file() {
        let place = [0.1, 1e9 + 0.25, -3.0];
        let of = |kind: &str, coordinates: Vec<u8>| {
            let header = format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n\
                 property {kind} y\nproperty float z\nend_header\n"
            );
            read(&[header.as_bytes(), &coordinates].concat())
                .expect("reads")
                .vertices
        };
        let [x, y, z] = place.map(|v: f64| (v as f32).to_le_bytes().to_vec());
        let wide = [x.clone(), place[1].to_le_bytes().to_vec(), z.clone()].concat();
        assert_eq!(
            of("double", wide).at(0),
            [f64::from(0.1_f32), place[1], -3.0]
        );
        let single = of("float", [x, y, z].concat());
        assert_eq!(single.at(0), place.map(|v| f64::from(v as f32)));
        assert!(matches!(single, Vertices::Single(_)));
        let whole = [0.5_f32.to_le_bytes(), 16_777_217_i32.to_le_bytes(), [0; 4]].concat();
        assert_eq!(of("int", whole).at(0), [0.5, 16_777_217.0, 0.0]);
    }

    #[test]
    fn vertices_without_faces_are_a_point_set() {
        let mesh = read(&ascii(
            &format!("element vertex 2\n{XYZ}"),
            "1 2 3\n4 5 6\n",
        ));
        assert_eq!(mesh.expect("reads").vertices.len(), 2);
    }

    #[test]
    fn triangle_strips_alternate_their_winding() {
        let bytes = ascii(
            &format!(
                "element vertex 5\n{XYZ}element tristrips 1\nproperty list int int vertex_indices\n"
            ),
            "0 0 0 1 0 0 2 0 0 3 0 0 4 0 0 8 0 1 2 3 -1 2 3 4",
        );
        let mesh = read(&bytes).expect("reads");
        assert_eq!(*mesh.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    }

    #[test]
    fn absurd_counts_are_refused_without_memory() {
        let huge = |element: &str| {
            let text = ascii(
                &format!("element {element} 99999999999999\n{XYZ}"),
                "1 2 3\n",
            );
            read(&text).expect_err("absurd").to_string()
        };
        assert_eq!(
            huge("vertex"),
            "the file has 99999999999999 vertices; limits.mesh.max_vertices is 50000000"
        );
        assert_eq!(
            huge("other"),
            "the ascii PLY is truncated: it holds 1 of 99999999999999 rows of other"
        );
        let list = ascii(
            &format!(
                "element vertex 1\n{XYZ}element face 1\nproperty list uint int vertex_indices\n"
            ),
            "1 2 3\n4000000000 0 0",
        );
        assert_eq!(
            read(&list).expect_err("absurd").to_string(),
            "the ascii PLY is truncated: it holds 0 of 1 faces"
        );
        let nothing = ascii(
            &format!("element x 18446744073709551615\nelement vertex 1\n{XYZ}"),
            "1 2 3",
        );
        assert!(read(&nothing).is_ok());
    }

    #[test]
    fn a_long_list_of_corners_is_rejected_before_it_is_read() {
        let limits = MeshLimits {
            max_triangles: 10,
            ..MeshLimits::SUGGESTED
        };
        for element in ["face", "tristrips"] {
            let elements = format!("element vertex 1\n{XYZ}element {element} 1\n{CORNERS}");
            let corners = elements.replace("list uchar", "list uint");
            let bytes = ascii(&corners, &format!("1 2 3\n5000 {}x", "0 ".repeat(4999)));
            let error = super::read(&bytes, &limits).expect_err("long");
            assert_eq!(
                error.to_string(),
                "the file has 11 triangles; limits.mesh.max_triangles is 10"
            );
        }
    }

    #[test]
    fn vertices_may_be_declared_twice_but_not_without_coordinates() {
        let bare = ascii(
            &format!("element vertex 2\nelement vertex 1\n{XYZ}element face 1\n{CORNERS}"),
            "1 2 3\n3 0 1 2\n",
        );
        assert_eq!(
            read(&bare).expect_err("bare").to_string(),
            "the PLY header is wrong: element \"vertex\" has no property \"x\""
        );
        let limits = MeshLimits {
            max_vertices: 3,
            ..MeshLimits::SUGGESTED
        };
        let twice = ascii(
            &format!("element vertex 2\n{XYZ}").repeat(2),
            &"0 ".repeat(12),
        );
        assert_eq!(read(&twice).expect("reads").vertices.len(), 4);
        let error = super::read(&twice, &limits).expect_err("over");
        assert!(
            error.to_string().starts_with("the file has 4 vertices"),
            "{error}"
        );
    }

    #[test]
    fn a_header_without_end_is_rejected_after_a_mebibyte() {
        let bytes = ascii(
            &"property char a\n"
                .repeat(80_000)
                .replacen("property char a", "element a 1", 1),
            "",
        );
        let error = read(&bytes).expect_err("long");
        assert_eq!(
            error.to_string(),
            "the PLY header is wrong: it is longer than 1 MiB"
        );
    }

    #[test]
    fn faults_are_reported_with_their_place() {
        let elements = format!("element vertex 2\n{XYZ}element face 1\n{CORNERS}");
        let fault = |body: &str| read(&ascii(&elements, body)).expect_err(body).to_string();
        assert_eq!(
            fault("0 0 0 0 zero 0 3 0 1 0"),
            "vertex 2: \"zero\" is not a number"
        );
        assert_eq!(
            fault("0 0 0 0 0 0 3 0 1 2"),
            "face 1 refers to vertex 2, but the file has 2 vertices"
        );
        assert_eq!(
            fault("0 0 0 0 0 0 3 0 1 -1"),
            "face 1 refers to vertex -1, but the file has 2 vertices"
        );
        assert_eq!(
            fault("0 0 0 0 0 0 3 0 1 .5"),
            "face 1: 0.5 is not a vertex index"
        );
        assert_eq!(
            fault("0 0 0 0 0 0 -3 0 1"),
            "face 1: -3 is not the length of a list"
        );
        assert_eq!(
            fault("0 0 0"),
            "the ascii PLY is truncated: it holds 1 of 2 vertices"
        );
    }

    #[test]
    fn wrong_headers_are_explained() {
        let fault = |text: &str| read(text.as_bytes()).expect_err(text).to_string();
        assert_eq!(
            fault("ply\nformat ascii 1.0\nelement vertex 1\n"),
            "the PLY header is wrong: the file ends before end_header"
        );
        assert_eq!(
            fault("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
            "the PLY header is wrong: element \"vertex\" has no property \"y\""
        );
        for header in [
            "format morse 1.0",
            "element vertex -1",
            "property float x",
            "element a 1\nproperty half x",
            "element a 1\nproperty list float int x",
            "colour blue",
        ] {
            let text = fault(&format!("ply\n{header}\nend_header\n"));
            assert!(text.starts_with("the PLY header is wrong: "), "{text}");
        }
    }

    /// Reference writer of any encoding.
    fn write(mesh: &Mesh, format: &str, wide: bool) -> Vec<u8> {
        let kind = if wide { "double" } else { "float" };
        let mut out = format!(
            "ply\nformat {format} 1.0\nelement vertex {}\nproperty {kind} x\nproperty {kind} y\n\
             property {kind} z\nelement face {}\n{CORNERS}end_header\n",
            mesh.vertices.len(),
            mesh.triangles.len()
        )
        .into_bytes();
        let big = format == "binary_big_endian";
        let text = format == "ascii";
        let mut put = |little: &[u8], word: String| {
            if text {
                out.extend(word.into_bytes());
                out.push(b' ');
            } else if big {
                out.extend(little.iter().rev());
            } else {
                out.extend(little);
            }
        };
        for value in mesh.vertices.iter().flatten() {
            if wide {
                put(&value.to_le_bytes(), value.to_string());
            } else {
                put(&(value as f32).to_le_bytes(), value.to_string());
            }
        }
        for triangle in &mesh.triangles {
            put(&[3], "3".into());
            for index in triangle {
                put(&index.to_le_bytes(), index.to_string());
            }
        }
        out
    }

    proptest! {
        #[test]
        fn every_encoding_is_read_back_exactly(
            vertices in prop::collection::vec(prop::array::uniform3(-1e6_f32..1e6), 1..40),
            corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..40),
            wide in any::<bool>(),
        ) {
            let mesh = Mesh {
                triangles: corners
                    .iter()
                    .map(|t| t.map(|index| index.index(vertices.len()) as u32))
                    .collect(),
                vertices: vertices.iter().map(|v| v.map(f64::from)).collect(),
            };
            for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
                let bytes = write(&mesh, format, wide);
                prop_assert_eq!(&read(&bytes).expect("reads"), &mesh);
                for cut in [1, 5, 20] {
                    let cut = &bytes[..bytes.len().saturating_sub(cut)];
                    let whole = format == "ascii" && cut.len() + 1 >= bytes.len();
                    prop_assert!(whole || read(cut).map_or(true, |m| m != mesh));
                }
            }
        }

        #[test]
        fn packed_rows_are_read_like_others(
            vertices in prop::collection::vec(prop::array::uniform3(-9.0..9.0_f32), 1..6),
            faces in prop::collection::vec(prop_oneof![
                6 => prop::collection::vec(0..6_i32, 3),
                1 => prop::collection::vec(-2..6_i32, 0..5),
            ], 0..6),
            cut in 0..9_usize,
            signed in any::<bool>(),
        ) {
            let item = if signed { "int" } else { "uint" };
            let read = |position: &str, before: &[u8], count: &str, count_bytes: usize| {
                let mut out = format!(
                    "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{position}element face {}\n\
                     property list {count} {item} vertex_indices\nend_header\n",
                    vertices.len(),
                    faces.len(),
                )
                .into_bytes();
                for vertex in &vertices {
                    out.extend(before);
                    out.extend(vertex.iter().flat_map(|value| value.to_le_bytes()));
                }
                for face in &faces {
                    out.extend(&(face.len() as u32).to_le_bytes()[..count_bytes]);
                    out.extend(face.iter().flat_map(|index| index.to_le_bytes()));
                }
                // Cuts at most the indices of the last face, whose size is the same in both layouts.
                let missing = cut.min(faces.last().map_or(0, |face| 4 * face.len()));
                out.truncate(out.len() - missing);
                read(&out).map_err(|error| error.to_string())
            };
            let plain = read(XYZ, &[], "uchar", 1);
            let flagged = format!("property uchar flag\n{XYZ}");
            prop_assert_eq!(plain, read(&flagged, &[7], "uint", 4));
        }
    }
}
