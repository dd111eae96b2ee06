//! Tests of the OBJ reader on files whose mesh or fault is known.

use proptest::prelude::*;

use super::{by_tobj, plain};
use crate::domain::cancel::{CancelToken, Cancelled};
use crate::mesh::{Mesh, MeshError, MeshLimits};

fn read(text: &str) -> Result<Mesh, MeshError> {
    super::read(text.as_bytes(), &MeshLimits::SUGGESTED).map(|(mesh, _)| mesh)
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
fn vertex_colours_are_ignored_even_if_some_vertices_have_none() {
    let text = "v 0 0 0 255 0 0\nv 2 0 0 1.0\nv 0 1 0 1 1 1 1\nv 1 1 0\nf 1 2 3 4\n";
    let mesh = read(text).expect("reads");
    assert_eq!(mesh.vertices.at(1), [2.0, 0.0, 0.0]);
    assert_eq!(mesh.vertices.len(), 4);
    let odd = read(&format!("{text}p 1\n")).expect("reads");
    assert_eq!(odd, mesh);
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
fn faces_of_two_corners_are_counted_and_lines_are_ignored() {
    // The second text of a kind has a line that only `tobj` reads.
    for (text, triangles, incomplete) in [
        ("f 1 2\nf 3 \nf 1 2 3\nf 1/1 2/1\n", 1, 3),
        ("f 1 2\nf\nl 1 2 3\nf 1 2 3\nf 1/1 2/1\n", 1, 3),
        ("f 1 2\n", 0, 1),
        ("f 1 2 \\\n\nl 1 2\n", 0, 1),
    ] {
        let text = format!("{SQUARE}{text}");
        let read = super::read(text.as_bytes(), &MeshLimits::SUGGESTED);
        let (mesh, faces) = read.expect("reads");
        assert_eq!(
            (mesh.triangles.len(), faces),
            (triangles, incomplete),
            "{text}"
        );
        assert_eq!(mesh.vertices.len(), if triangles == 0 { 4 } else { 3 });
    }
}

#[test]
fn faults_are_reported_with_their_place() {
    let fault = |text: &str| read(text).expect_err(text).to_string();
    for (text, expected) in [
        ("v 0 0\n", "line 1: 2 of 3 coordinates"),
        (
            "v 0 0 0\nv 0,5 0 0\n",
            "line 2: \"0,5\" is not a number; save the file with decimal points instead of commas",
        ),
        (
            "v 0 0 0 1\nv 1 1 1 2\n",
            "line 2: neither a weight of 1 nor a colour follows the coordinates",
        ),
        (
            "v 0 0 0 1 1\n",
            "line 1: neither a weight of 1 nor a colour follows the coordinates",
        ),
        (
            "v 0 0 0\nv 1 1 1 \\\n 1\nf 1 2 1/x\n",
            "line 4: a corner is not the number of a vertex",
        ),
        (
            "v 0 0 0\nl 1 1\nf 1 1 2\n",
            "a face refers to a vertex that the file does not have",
        ),
    ] {
        assert_eq!(fault(text), expected, "{text}");
    }
    for face in ["1 2 9", "0 1 2", "1 2 -9", "/1 2 3", "4294967296 1 2"] {
        let text = format!("{SQUARE}f 1 2 3\nf 1 2 3 4\nf {face}\nf 1 2 3");
        let reason = "a corner refers to a vertex that the file does not have";
        let expected = if face == "/1 2 3" {
            "a face refers to a vertex that the file does not have".into()
        } else {
            format!("line 9: {reason}")
        };
        assert_eq!(fault(&text), expected, "{face}");
    }
}

#[test]
fn a_backslash_continues_only_lines_that_define_geometry() {
    let square = read(&format!("{SQUARE}f 1 2 3 4\n")).expect("reads");
    for text in [
        format!("# C:\\scans\\\n{SQUARE}f 1 2 3 4\n"),
        format!("{SQUARE}usemtl a\\\nf 1 2 3 4\n"),
        "v\\\n 0 0 0\nv 1 \\\n0 0\nv 1 1 0\nv 0 1 0\nf 1\\\n2 \\ \r\n 3 # a\\\nf 1 3 4".to_owned(),
    ] {
        assert_eq!(read(&text), Ok(square.clone()), "{text}");
    }
}

#[test]
fn lines_of_classic_mac_os_are_read_even_if_one_ends_in_a_line_feed() {
    let text = format!(
        "# a\n{}",
        format!("{SQUARE}f 1 2 3 4\n").replace('\n', "\r")
    );
    assert_eq!(read(&text), read(&format!("{SQUARE}f 1 2 3 4\n")));
    assert_eq!(read(&text[4..]), read(&text));
    // As `tobj` does.
    let stray = read(&format!("{SQUARE}f 1 2\r3 4\r\n"));
    assert_eq!(stray, read(&text));
}

#[test]
fn coordinates_that_windows_calls_indefinite_are_missing() {
    let text = "v -nan(ind) 0 0\nv 0 0 -1.#IND00\nv 1 1 1\n";
    let plain = read(text).expect("reads");
    let odd = read(&format!("p 1\n{text}")).expect("reads");
    for mesh in [plain, odd] {
        let missing = mesh
            .vertices
            .iter()
            .map(|[x, _, z]| x.is_nan() || z.is_nan());
        assert_eq!(missing.collect::<Vec<_>>(), [true, true, false]);
    }
}

#[test]
fn polylines_do_not_become_faces() {
    let mesh = read(&format!("{SQUARE}l 1 2 3\nf 1 2 3\nl 1 2 3 4\n")).expect("reads");
    assert_eq!(mesh.triangles.len(), 1);
}

#[test]
fn limits_hold_and_cancellations_are_noticed_in_odd_files() {
    let vertices = "v 0 0 0 1\n".repeat(9000);
    let faces = "f 1 2 3 4\n".repeat(9000);
    let text = format!("p 1\n{vertices}{faces}");
    for (limits, what) in [
        (
            MeshLimits {
                max_vertices: 8999,
                ..MeshLimits::SUGGESTED
            },
            "9000 vertices",
        ),
        (
            MeshLimits {
                max_triangles: 17_999,
                ..MeshLimits::SUGGESTED
            },
            "18000 triangles",
        ),
    ] {
        let error = super::read(text.as_bytes(), &limits)
            .expect_err("too many")
            .to_string();
        assert!(error.contains(what), "{error}");
    }
    let token = CancelToken::cancelled_at(4);
    assert_eq!(token.run(|| read(&text).map(drop)), Err(Cancelled));
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

proptest! {
    #[test]
    fn numbers_equal_those_of_the_standard_library(text in number()) {
        let mesh = read(&format!("v {text} 0 0\n"));
        let value: f64 = text.parse().expect("a number");
        let bits = mesh.ok().map(|mesh| mesh.vertices.at(0)[0].to_bits());
        prop_assert_eq!(bits, Some(value.to_bits()));
    }
}

#[test]
fn usual_files_are_read_in_one_pass_and_by_tobj_alike() {
    for end in ["\n", "\r\n"] {
        let lines = [
            "# a file #",
            "mtllib a b.mtl",
            "o one",
            "v 0 0 0",
            "\tv  1 0 0 1.0 # a vertex",
            "vn 0 0 1",
            "vt 0 0",
            "v 1 1 0 0.5 0.5 .5",
            "v 0 1 0 1 1 1 1e0",
            "g",
            "usemtl",
            "s off",
            "f 4/1 2//1 -2 +1#",
            "",
        ];
        let text = lines.join(end);
        let limits = MeshLimits::SUGGESTED;
        let mesh = plain::read(text.as_bytes(), &limits).expect("a usual file");
        let (mesh, incomplete) = mesh.expect("sound");
        assert_eq!(*mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.vertices.at(0), [0.0, 1.0, 0.0]);
        let again = by_tobj::read(text.as_bytes(), plain::OddLine(1), &limits);
        assert_eq!(again, Ok((mesh, incomplete)));
    }
    let points = read("v 0 0 0\nv 1 0 0").expect("points");
    assert_eq!(points.vertices, vec![[0.0; 3], [1.0, 0.0, 0.0]].into());
    assert!(points.triangles.is_empty());
}
