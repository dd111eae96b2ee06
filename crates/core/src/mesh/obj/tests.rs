//! Tests of the OBJ reader, with `tobj` as the reference.

use std::io::BufReader;

use proptest::prelude::*;

use super::{find_fault, plain, plain_lines};
use crate::mesh::{Mesh, MeshError, MeshLimits};

fn read(text: &str) -> Result<Mesh, MeshError> {
    super::read(text.as_bytes(), &MeshLimits::SUGGESTED)
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";

#[test]
fn all_ways_to_write_a_corner_give_the_same_mesh() {
    let plain = read(&format!("{SQUARE}f 1 2 3 4\n")).expect("reads");
    assert_eq!(*plain.triangles, [[0, 1, 2], [0, 2, 3]]);
    for face in [
        "1/1 2/1 3/1 4/1",
        "1//1 2//1 3//1 4//1",
        "1/1/1 2/1/1 3/1/1 4/1/1",
        "-4 -3 -2 -1",
        "-4/-1/-1 -3/-1/-1 -2/-1/-1 -1/-1/-1",
        "1 2 3 \\\n 4",
        "1 2 3 4 # a square",
    ] {
        let mesh = read(&format!("{SQUARE}f {face}\n")).expect(face);
        assert_eq!(mesh, plain, "{face}");
    }
}

#[test]
fn vertex_colours_and_weights_are_ignored() {
    let mesh = read("v 0 0 0 255 0 0\nv 2 0 0 2\nv 0 1 0 1 1 1 1\nf 1 2 3\n").expect("reads");
    assert_eq!(mesh.vertices.at(1), [2.0, 0.0, 0.0]);
    assert_eq!(mesh.vertices.len(), 3);
}

#[test]
fn groups_and_materials_do_not_repeat_vertices() {
    let text = format!(
        "mtllib none.mtl\no a\n{SQUARE}g one\nusemtl red\nf 1 2 3\ng two\nusemtl blue\nf 1 3 4\n"
    );
    let mesh = read(&text).expect("reads");
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (4, 2));
}

#[test]
fn names_in_another_encoding_are_ignored() {
    let mut bytes = b"o \xc0\xf1\xff\n".to_vec();
    bytes.extend_from_slice(SQUARE.as_bytes());
    bytes.extend_from_slice(b"f 1 2 3\n");
    assert!(super::read(&bytes, &MeshLimits::SUGGESTED).is_ok());
}

#[test]
fn positions_keep_all_their_digits() {
    let mesh = read("v 1234567.123456789 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("reads");
    assert_eq!(mesh.vertices.at(0)[0], 1_234_567.123_456_789);
}

#[test]
fn faces_of_two_corners_and_lines_are_ignored() {
    let mesh = read(&format!("{SQUARE}f 1 2\nf\nl 1 2 3\nf 1 2 3\n")).expect("reads");
    assert_eq!(mesh.triangles.len(), 1);
    let points = read(&format!("{SQUARE}f 1 2\n")).expect("reads");
    assert_eq!((points.vertices.len(), points.triangles.len()), (4, 0));
}

#[test]
fn faults_are_reported_with_their_place() {
    let fault = |text: &str| read(text).expect_err(text).to_string();
    assert_eq!(
        fault("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n"),
        "vertex 2 has the coordinate NaN, which is not a finite number"
    );
    assert_eq!(
        fault("v 0 0 0\nv 1 1e999 0\n"),
        "vertex 2 has the coordinate inf, which is not a finite number"
    );
    assert_eq!(
        fault(&format!("{SQUARE}f 1 2 3\nf 1 2 9\n")),
        "face 2 refers to vertex 9, but the file has 4 vertices"
    );
    assert_eq!(
        fault(&format!("{SQUARE}f 0 1 2\n")),
        "face 1 refers to vertex 0, but the file has 4 vertices"
    );
    assert_eq!(
        fault("v 0 0 0\nf -2 -1 -1\n"),
        "face 1 refers to vertex -2, but the file has 1 vertices"
    );
    assert_eq!(fault("v 0 0\n"), "line 1: 2 of 3 coordinates");
    assert_eq!(
        fault(&format!("{SQUARE}f 1 2 x\n")),
        "line 7: \"x\" is not a number"
    );
    assert_eq!(
        fault(&format!("{SQUARE}f /1 2 3\n")),
        "line 7: corner \"/1\" names no vertex"
    );
    assert_eq!(
        fault("v 0,5 0 0\nv 0 0 0\nv 1 1 1\nf 1 2 3\n"),
        "line 1: \"0,5\" is not a number"
    );
}

/// Reads the geometry lines of a file with `tobj`.
fn read_by_tobj(text: &str) -> Result<Mesh, MeshError> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let joined = super::join_continued_lines(text.as_bytes());
    let bytes = joined.as_deref().unwrap_or(text.as_bytes());
    if super::count(bytes)[1] == 0 {
        return read_points(bytes);
    }
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let lines = plain_lines(bytes);
    let (models, _) = tobj::load_obj_buf(&mut BufReader::new(&*lines), &options, no_materials)
        .map_err(|_reason| find_fault(bytes))?;
    let mut mesh = Mesh::default();
    for model in models {
        let offset = mesh.vertices.len() as u32;
        let (positions, _) = model.mesh.positions.as_chunks::<3>();
        let (triangles, _) = model.mesh.indices.as_chunks::<3>();
        mesh.vertices.extend(positions.iter().copied());
        mesh.triangles
            .extend(triangles.iter().map(|t| t.map(|index| index + offset)));
    }
    if mesh.vertices.iter().flatten().all(f64::is_finite) {
        Ok(mesh)
    } else {
        Err(find_fault(bytes))
    }
}

/// Reads the vertices of a file without faces; `tobj` drops them.
fn read_points(bytes: &[u8]) -> Result<Mesh, MeshError> {
    let mut vertices = Vec::new();
    for (line, record) in super::records(bytes) {
        if let super::Record::Vertex(rest) = record {
            let position = crate::mesh::text::position(crate::mesh::text::words(rest))
                .map_err(|reason| MeshError::Line { line, reason })?;
            let count = vertices.len() as u64 + 1;
            vertices.push(crate::mesh::error::check_finite(position, count)?);
        }
    }
    Ok(Mesh {
        vertices: vertices.into(),
        ..Mesh::default()
    })
}

/// A number as programs write it, and as few do.
fn number() -> impl Strategy<Value = String> {
    prop_oneof![
        (-1e4..1e4_f64).prop_map(|v| format!("{v:.6}")),
        any::<f64>().prop_map(|v| format!("{v}")),
        any::<f64>().prop_map(|v| format!("{v:e}")),
        any::<f32>().prop_map(|v| format!("{v}")),
        any::<i64>().prop_map(|v| format!("{v}.")),
        Just("+1.5".to_owned()),
        Just("-.25".to_owned()),
        Just("1.5E+2".to_owned()),
    ]
}

fn vertex() -> impl Strategy<Value = String> {
    let rest = prop_oneof![4 => Just(""), 1 => Just(" 1.0"), 1 => Just("  0.5 0.5 0.5 ")];
    let space = prop_oneof![4 => Just(" "), 1 => Just("\t  ")];
    (number(), number(), number(), rest, space)
        .prop_map(|(x, y, z, rest, space)| format!("v {x}{space}{y} {z}{rest}"))
}

fn face() -> impl Strategy<Value = String> {
    let corner = (-12..13_i32, 0..7).prop_map(|(v, way)| match way {
        0 => format!("{v}/1"),
        1 => format!("{v}//2"),
        2 => format!("{v}/3/-1"),
        _ => format!("{v}"),
    });
    prop::collection::vec(corner, 0..6).prop_map(|corners| format!("f {}", corners.join(" ")))
}

fn line() -> impl Strategy<Value = String> {
    let other = prop::sample::select(vec![
        "",
        "# v 1 2 3",
        "vn 0 0 1",
        "vt 0.5 0.5",
        "g one",
        "usemtl red",
        "s off",
        "  v 1 2 3 # a",
        "f 1 2 3#",
        "f 1 2 3 \\",
        "v 1 2",
        "v 1 2 nan",
        "f 1 2 x",
        "f 0 1 2",
        "f 1/a 2 3",
        "l 1 2",
    ]);
    prop_oneof![6 => vertex(), 6 => face(), 1 => other.prop_map(str::to_owned)]
}

proptest! {
    #[test]
    fn every_file_is_read_or_refused_as_by_tobj(
        lines in prop::collection::vec(line(), 0..24),
        end in prop::sample::select(vec!["\n", "\r\n", "\r", "\n\n"]),
    ) {
        let text = lines.join(end);
        // Messages, because NaN is not equal to itself.
        let [ours, theirs] = [read(&text), read_by_tobj(&text)];
        let message = |error: MeshError| error.to_string();
        prop_assert_eq!(ours.map_err(message), theirs.map_err(message));
    }

    #[test]
    fn numbers_equal_those_of_the_standard_library(text in number()) {
        let mesh = read(&format!("v {text} 0 0\n"));
        let value: f64 = text.parse().expect("a number");
        let bits = mesh.ok().map(|mesh| mesh.vertices.at(0)[0].to_bits());
        prop_assert_eq!(bits, value.is_finite().then(|| value.to_bits()));
    }
}

#[test]
fn usual_files_are_read_in_one_pass() {
    for end in ["\n", "\r\n"] {
        let lines = [
            "v 0 0 0",
            "v 1 0 0",
            "v 1 1 0",
            "v 0 1 0",
            "f 4/1 2//1 -2 +1",
            "",
        ];
        let parsed =
            plain::parse(lines.join(end).as_bytes(), &MeshLimits::SUGGESTED).expect("a usual file");
        let mesh = parsed.into_mesh().expect("indices in range");
        assert_eq!(*mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.vertices.at(0), [0.0, 1.0, 0.0]);
    }
    let points = read("v 0 0 0\nv 1 0 0").expect("points");
    assert_eq!(points.vertices, vec![[0.0; 3], [1.0, 0.0, 0.0]].into());
    assert!(points.triangles.is_empty());
}

#[test]
fn odd_indices_and_unused_coordinates_are_read_as_by_tobj() {
    for lines in [
        "v nan 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 2 3 4\n",
        "v 1 0 0\nv 1 1 0\nv 0 1 0\nf +1/ 2// 00000000000000000000003///\n",
        "v 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1/1/1 2 3\n",
        "v 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 x\nf 3 2 1\n",
        "v\r\nv 1 0 0\n",
        "v 1 0 0\nv 1 1 0\nv 0 1 0\nf 99999999999999999999 2 3\n",
        "v 1 0 0\nv 1 1 0\nv 0 1 0\nf -9223372036854775808 2 3\n",
    ] {
        assert_eq!(read(lines), read_by_tobj(lines), "{lines}");
    }
}
