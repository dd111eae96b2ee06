//! Files as programs write them: each is read like its usual twin, or refused with one true sentence.

use super::{Mesh, MeshError, MeshLimits, MeshRead, read, read_from};
use crate::mesh::write::MeshFormat;

/// Reads a file both ways.
fn open(bytes: &[u8], name: &str) -> Result<MeshRead, String> {
    let limits = MeshLimits::SUGGESTED;
    let from = read_from(&mut &*bytes, bytes.len() as u64, name, &limits);
    let from = from.map_err(|error| error.to_string());
    let plain = read(bytes, name, &limits).map_err(|error| error.to_string());
    assert_eq!(from.clone().map(|read| read.mesh), plain, "{name}");
    from
}

fn opened(bytes: &[u8], name: &str) -> MeshRead {
    open(bytes, name)
        .unwrap_or_else(|error| panic!("{name}: {error}: {}", String::from_utf8_lossy(bytes)))
}

fn refused(bytes: &[u8], name: &str) -> String {
    open(bytes, name).expect_err(name)
}

/// Two triangles over a square, whose corners are not at the origin.
fn square() -> Mesh {
    Mesh {
        vertices: vec![
            [1.0, 1.0, 0.5],
            [2.0, 1.0, 0.5],
            [2.0, 2.0, 0.25],
            [1.0, 2.0, 0.5],
        ]
        .into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]].into(),
    }
}

/// Returns the corners of all triangles.
fn soup(mesh: &Mesh) -> Vec<[f64; 3]> {
    let corners = mesh.triangles.as_flattened().iter();
    corners
        .map(|corner| mesh.vertices.at(*corner as usize))
        .collect()
}

/// The square as a text of each format, with its name.
fn texts() -> Vec<(&'static str, String)> {
    let text = |format: MeshFormat| String::from_utf8(format.encode(&square())).expect("text");
    let points: Vec<String> = square()
        .vertices
        .iter()
        .map(|[x, y, z]| format!("{x} {y} {z}\n"))
        .collect();
    vec![
        ("a.obj", text(MeshFormat::Obj)),
        ("a.ply", text(MeshFormat::PlyAscii)),
        ("a.stl", text(MeshFormat::StlAscii)),
        ("a.xyz", format!("# points\n{}", points.concat())),
    ]
}

#[test]
fn line_ends_of_every_system_are_read_in_every_text_format() {
    for (name, text) in texts() {
        let usual = opened(text.as_bytes(), name);
        let (first, rest) = text.split_once('\n').expect("lines");
        let mac = text.replace('\n', "\r");
        for odd in [
            text.replace('\n', "\r\n"),
            text.replace('\n', "\n\r"),
            text.replace('\n', "\r\r\n"),
            mac.clone(),
            format!("{mac}\n"),
            format!("{first}\n{}", rest.replace('\n', "\r")),
            format!("{first}\r\n{}", rest.replace('\n', "\r")),
            text.trim_end().to_owned(),
            format!("\u{feff}{text}"),
        ] {
            assert_eq!(opened(odd.as_bytes(), name), usual, "{name} {odd:?}");
        }
    }
}

#[test]
fn vertices_that_are_not_numbers_are_left_out_in_every_text_format() {
    for spelling in [
        "nan",
        "NaN",
        "-nan",
        "-nan(ind)",
        "NAN(IND)",
        "1.#QNAN",
        "-1.#IND00",
        "1.#INF",
        "inf",
        "1e999",
    ] {
        for (name, text) in texts() {
            // The corner at (2, 2), which both triangles have.
            let odd = text.replace("2 2 0.25", &format!("2 2 {spelling}"));
            assert_ne!(odd, text);
            if name == "a.xyz" {
                let read = opened(odd.as_bytes(), name);
                assert_eq!(
                    (read.mesh.vertices.len(), read.losses.missing_vertices),
                    (3, 1),
                    "{spelling}"
                );
            } else {
                let said = refused(odd.as_bytes(), name);
                assert!(said.contains("have no position"), "{said}");
            }
            // The last corner, which one triangle has.
            let odd = text.replace("1 2 0.5", &format!("{spelling} 2 0.5"));
            let read = opened(odd.as_bytes(), name);
            assert_eq!(read.losses.missing_vertices, 1, "{name} {spelling}");
            let first = Mesh {
                triangles: vec![[0, 1, 2]].into(),
                ..square()
            };
            assert!(
                name == "a.xyz" || soup(&read.mesh) == soup(&first),
                "{name}"
            );
        }
    }
}

#[test]
fn vertices_that_are_not_numbers_are_left_out_in_every_binary_format() {
    for format in [
        MeshFormat::StlBinary,
        MeshFormat::PlyLittleEndian,
        MeshFormat::PlyBigEndian,
    ] {
        let name = format!("a.{}", format.extension());
        for value in [f64::NAN, f64::INFINITY] {
            let mut mesh = square();
            mesh.vertices.set(3, [1.0, value, 0.5]);
            let read = opened(&format.encode(&mesh), &name);
            assert_eq!(
                (soup(&read.mesh), read.losses.missing_vertices),
                (soup(&square())[..3].to_vec(), 1),
                "{name}"
            );
            assert_eq!(read.mesh.vertices.len(), 3);
        }
    }
}

#[test]
fn several_points_at_the_origin_are_left_out_in_every_format() {
    let mut cloud = square();
    cloud.triangles = Vec::new().into();
    let usual = cloud.vertices.clone();
    cloud.vertices.extend([[0.0; 3]; 2]);
    let text: Vec<String> = cloud
        .vertices
        .iter()
        .map(|[x, y, z]| format!("{x} {y} {z}\n"))
        .collect();
    let files = [
        ("a.xyz", text.concat().into_bytes()),
        ("a.obj", MeshFormat::Obj.encode(&cloud)),
        ("a.ply", MeshFormat::PlyAscii.encode(&cloud)),
        ("b.ply", MeshFormat::PlyLittleEndian.encode(&cloud)),
        ("c.ply", MeshFormat::PlyBigEndian.encode(&cloud)),
    ];
    for (name, bytes) in files {
        let read = opened(&bytes, name);
        assert_eq!(
            (&read.mesh.vertices, read.losses.missing_vertices),
            (&usual, 2),
            "{name}"
        );
    }
}

#[test]
fn words_in_columns_that_nobody_uses_do_not_matter() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float quality\nproperty float y\n\
        property float z\nproperty list uchar float extra\nelement other 1\nproperty float a\nend_header\n\
        1 -nan(ind) 2 3 1 1.#QNAN\n4 -1.#IND 5 6 0\n?\n";
    let xyz = "1 2 3 -nan(ind)\n4 5 6 -1.#IND\n";
    for (name, text) in [("a.ply", ply), ("a.xyz", xyz)] {
        let read = opened(text.as_bytes(), name);
        let points = vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
        assert_eq!(
            (read.mesh.vertices, read.losses.missing_vertices),
            (points.into(), 0),
            "{name}"
        );
    }
    let (_, stl) = texts().swap_remove(2);
    let odd = stl.replace("normal 0", "normal -nan(ind)");
    assert_eq!(
        opened(odd.as_bytes(), "a.stl"),
        opened(stl.as_bytes(), "a.stl")
    );
}

#[test]
fn keywords_of_an_ascii_stl_may_be_split_or_share_a_line() {
    let (name, text) = texts().swap_remove(2);
    let usual = opened(text.as_bytes(), name);
    for odd in [
        text.replace("endloop", "end loop"),
        text.replace("endfacet", "END FACET")
            .replace("endsolid scan", "End Solid scan"),
        text.replace('\n', " ").replace("endsolid", "\nendsolid"),
        text.replace("solid scan", "solid a facet of NORMAL facets")
            .replace('\n', "\r\n"),
        text.replacen("solid scan", "solid a\0\0\0", 1),
        text.replacen("solid scan", &format!("solid {}", "\0".repeat(74)), 1),
        text.replacen("solid scan\n", "solid scan ", 1),
        text.replace("outer loop\n", "outer loop "),
    ] {
        assert_eq!(opened(odd.as_bytes(), name), usual, "{odd:?}");
    }
    let odd = text.replacen("vertex", "vertx", 1);
    assert_eq!(
        refused(odd.as_bytes(), name),
        "line 4: \"vertx\" is not a word of ascii STL"
    );
    let odd = text.replace('\n', " ").replacen("vertex", "vertx", 1);
    assert_eq!(
        refused(odd.as_bytes(), name),
        "line 1: \"vertx\" is not a word of ascii STL"
    );
}

/// Returns a binary STL with bytes after each facet, whose count the facet has if `is_counted`.
fn with_attributes(bytes_each: u16, is_counted: bool) -> Vec<u8> {
    let usual = MeshFormat::StlBinary.encode(&square());
    let mut bytes = usual[..84].to_vec();
    for facet in usual[84..].chunks(50) {
        bytes.extend(&facet[..48]);
        bytes.extend(u16::to_le_bytes(if is_counted { bytes_each } else { 0 }));
        bytes.extend(vec![7; bytes_each.into()]);
    }
    bytes
}

#[test]
fn attributes_of_a_binary_stl_are_skipped_or_named() {
    let usual = opened(&with_attributes(0, true), "a.stl");
    for bytes_each in [4, 50, 100] {
        assert_eq!(opened(&with_attributes(bytes_each, true), "a.stl"), usual);
    }
    assert_eq!(
        refused(&with_attributes(4, false), "a.stl"),
        "the binary STL has 54 bytes a triangle instead of 50; save it again without attributes, or as PLY"
    );
    let cut = with_attributes(30, true);
    assert_eq!(
        refused(&cut[..cut.len() - 1], "a.stl"),
        "the binary STL is truncated: it holds 1 of 2 triangles"
    );
}

#[test]
fn a_ply_header_may_end_in_lf_cr_before_binary_data() {
    let mut points = square();
    points.triangles = Vec::new().into();
    for format in [MeshFormat::PlyLittleEndian, MeshFormat::PlyBigEndian] {
        for mesh in [square(), points.clone()] {
            let bytes = format.encode(&mesh);
            let usual = opened(&bytes, "a.ply");
            let end = bytes
                .windows(11)
                .position(|word| word == b"end_header\n")
                .expect("an end")
                + 11;
            let (header, body) = bytes.split_at(end);
            let header = String::from_utf8_lossy(header);
            for (odd, is_clear) in [
                (header.replace('\n', "\n\r"), true),
                (header.replace('\n', "\r\n"), true),
                (header.replace('\n', "\r"), true),
                (format!("{header}\r"), !mesh.triangles.is_empty()),
            ] {
                let odd = [odd.as_bytes(), body].concat();
                if is_clear {
                    assert_eq!(opened(&odd, "a.ply"), usual);
                } else {
                    let said = refused(&odd, "a.ply");
                    assert!(said.contains("a line break follows end_header"), "{said}");
                }
            }
        }
    }
}

#[test]
fn an_obj_may_begin_with_any_keyword() {
    let (name, text) = texts().swap_remove(0);
    let usual = opened(text.as_bytes(), name);
    for start in [
        "lod 1\n",
        "mg 0\n",
        "cstype bezier\ndeg 3\n",
        "p 1\n",
        "vendor_word\n\n# a\n",
    ] {
        for name in [name, "a.txt"] {
            assert_eq!(
                opened(format!("{start}{text}").as_bytes(), name),
                usual,
                "{start}"
            );
        }
    }
    assert_eq!(
        refused(b"Dear reader,\nv is a letter.\n", "a.obj"),
        "the file is text; OBJ, PLY and STL meshes and XYZ points are read"
    );
}

#[test]
fn pointers_of_git_are_named_whatever_the_file_is_called() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b12\n\
        size 12345\n";
    for name in ["a.stl", "a.ply", "a.obj", "a.xyz", "a"] {
        for text in [
            pointer.to_owned(),
            pointer.replace('\n', "\r\n"),
            format!("\u{feff}{pointer}"),
        ] {
            assert_eq!(
                refused(text.as_bytes(), name),
                "the file is a pointer of Git LFS and does not hold the mesh; fetch the mesh with `git lfs pull`"
            );
        }
        let said = refused(b"/annex/objects/SHA256E-s12--ab.stl\n", name);
        assert!(said.contains("`git annex get`"), "{said}");
    }
}

#[test]
fn all_files_of_another_3d_format_get_one_sentence_with_the_conversion() {
    for (file, kind) in [
        (&b"glTF\x02\0\0\0"[..], "a glTF scene"),
        (b"{\"asset\":{\"version\":\"2.0\"}}", "a glTF scene"),
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "an OFF mesh"),
        (b"# a scan\nCOFF 3 1 0\n0 0 0\n", "an OFF mesh"),
        (b"PK\x03\x04\x14\0 3D/3dmodel.model", "a 3MF model"),
    ] {
        for name in ["a.glb", "a.off", "a.stl", "a.xyz"] {
            assert_eq!(
                refused(file, name),
                format!(
                    "the file is {kind}; OBJ, PLY and STL meshes and XYZ points are read: open them in MeshLab, Blender or \
                     CloudCompare and export them as PLY"
                )
            );
        }
    }
}

#[test]
fn a_binary_stl_whose_facets_have_no_position_is_refused() {
    let mut mesh = square();
    for corner in [0, 2] {
        mesh.vertices.set(corner, [f64::NAN; 3]);
    }
    let bytes = MeshFormat::StlBinary.encode(&mesh);
    let error = read(&bytes, "a.stl", &MeshLimits::SUGGESTED);
    assert_eq!(
        error,
        Err(MeshError::NothingLeft {
            missing: 4,
            vertices: 6
        })
    );
}

#[test]
fn a_text_that_ends_within_a_line_is_named_as_cut_off() {
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
    let stl = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n";
    for (name, text, expected) in [
        (
            "a.obj",
            format!("{obj}f 2 1"),
            "line 5: the last line is a face with 2 corners; the file seems to be cut off",
        ),
        (
            "a.obj",
            format!("{obj}f"),
            "line 5: the last line is a face with 0 corners; the file seems to be cut off",
        ),
        (
            "a.obj",
            format!("{obj}v 1 2"),
            "line 5: 2 of 3 coordinates; it is the last line, so the file seems to be cut off",
        ),
        (
            "a.stl",
            format!("{stl}vertex 1 2"),
            "line 5: 2 of 3 coordinates; it is the last line, so the file seems to be cut off",
        ),
        (
            "a.xyz",
            "0 0 0\n0 1 0\n1".to_owned(),
            "line 3: 1 of 3 coordinates; it is the last line, so the file seems to be cut off",
        ),
        // A fault in a line that is ended.
        (
            "a.obj",
            format!("{obj}v 1 2\n"),
            "line 5: 2 of 3 coordinates",
        ),
    ] {
        let error = read(text.as_bytes(), name, &MeshLimits::SUGGESTED).expect_err("cut off");
        assert_eq!(error.to_string(), expected, "{text}");
    }
    for text in [format!("{obj}f 2 1\n"), format!("{obj}f 3 2 1")] {
        read(text.as_bytes(), "a.obj", &MeshLimits::SUGGESTED).expect("complete");
    }
}

#[test]
fn decimal_commas_are_named() {
    let advice = "\"1,5\" is not a number; save the file with decimal points instead of commas";
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nend_header\n1,5 0 0\n";
    let stl = "solid\nfacet normal 0 0 1\nouter loop\nvertex 1,5 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
        endloop\nendfacet\nendsolid\n";
    for (name, text, place) in [
        ("a.obj", "v 0 0 0\nv 1,5 0 0\nf 1 2 1\n", "line 2"),
        ("a.ply", ply, "vertex 1"),
        ("a.stl", stl, "line 4"),
    ] {
        let error = read(text.as_bytes(), name, &MeshLimits::SUGGESTED).expect_err("a comma");
        assert_eq!(error.to_string(), format!("{place}: {advice}"));
    }
}
