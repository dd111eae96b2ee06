//! Sizes of meshes by parts of their files.

use std::io::Cursor;

use super::WHOLE_BYTES;
use crate::domain::LengthUnit;
use crate::mesh::write::MeshFormat;
use crate::mesh::{Mesh, MeshExtent, MeshLimits, MeshReadError, extent, visit_some_vertices};

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

fn found(bytes: &[u8], name: &str) -> Result<MeshExtent, MeshReadError> {
    let len = bytes.len() as u64;
    extent(&mut Cursor::new(bytes), len, name, &MeshLimits::SUGGESTED)
}

/// Returns the size of a file that is too long to be read as a whole.
fn long_sides(bytes: &[u8], name: &str) -> Option<[f64; 3]> {
    assert!(bytes.len() as u64 > WHOLE_BYTES, "{name} is short");
    found(bytes, name).expect("a mesh").sides
}

/// Asserts that the sides are those of the sheet, or a little shorter.
fn assert_sheet(sides: Option<[f64; 3]>, name: &str) {
    let sides = sides.expect(name);
    let usual = [[34.0, 40.01], [24.0, 30.01], [1.5, 4.01]];
    for (side, [low, high]) in sides.into_iter().zip(usual) {
        assert!((low..=high).contains(&side), "{name}: {sides:?}");
    }
}

/// Returns a PLY with a type of coordinates and some rows of one element of vertices.
fn ply(format: &str, scalar: &str, vertices: usize, faces: usize, rows: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty {scalar} x\nproperty {scalar} y\n\
        property {scalar} z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    [header.as_bytes(), rows].concat()
}

/// Returns the points of a sheet as lines.
fn lines(side: usize, row: impl Fn(usize, [f64; 3]) -> String) -> String {
    let mesh = sheet(side);
    let rows = mesh.vertices.iter().enumerate();
    rows.map(|(k, position)| row(k, position)).collect()
}

#[test]
fn the_size_of_long_and_short_files_is_found_in_every_format() {
    for side in [20, 420] {
        let mesh = sheet(side);
        for format in MeshFormat::ALL {
            let bytes = format.encode(&mesh);
            let name = format!("a.{}", format.extension());
            let whole = found(&bytes, &name).expect("a mesh");
            assert_eq!(whole.is_exact, bytes.len() as u64 <= WHOLE_BYTES, "{name}");
            assert_sheet(whole.sides, &name);
            if let (true, Some([x, y, _])) = (whole.is_exact, whole.sides) {
                let is_whole = (x - 40.0).abs() < 1e-3 && (y - 30.0).abs() < 1e-3;
                assert!(is_whole, "{name}: {x} {y}");
            }
            assert_eq!(whole.longest(), whole.sides.map(|sides| sides[0]), "{name}");
            // A binary file that is cut shows it by its header. A text has fewer vertices.
            let is_text = bytes.is_ascii();
            if let Ok(cut) = found(&bytes[..bytes.len() / 3], &name) {
                assert!(is_text, "{name} cut");
                let longest = cut.longest().unwrap_or_default();
                assert!(longest <= 40.01, "{name} cut: {cut:?}");
            }
        }
    }
}

#[test]
fn repeated_origins_of_a_long_point_cloud_are_no_positions() {
    let rows = |origins: usize| {
        let row = |k: usize, [x, y, z]: [f64; 3]| {
            if k % 99 < origins {
                "0 0 0\n".to_owned()
            } else {
                format!("{:.6} {:.6} {:.6}\n", x + 500.0, y + 500.0, z + 500.0)
            }
        };
        lines(420, row)
    };
    let [clouds, whole] = [9, 0].map(rows);
    for text in [clouds, whole] {
        assert_sheet(long_sides(text.as_bytes(), "a.xyz"), "XYZ");
        let obj = format!("v {}\n", text.trim_end().replace('\n', "\nv "));
        assert_sheet(long_sides(obj.as_bytes(), "a.obj"), "OBJ");
    }
}

#[test]
fn numbers_for_missing_points_of_a_long_cloud_are_no_positions() {
    let row = |k: usize, [x, y, z]: [f64; 3]| {
        if k.is_multiple_of(50) {
            "-9999 -9999 -9999\n".to_owned()
        } else {
            format!("{:.7} {:.7} {:.7}\n", x + 500.0, y + 500.0, z + 500.0)
        }
    };
    let text = lines(420, row);
    assert_sheet(long_sides(text.as_bytes(), "a.xyz"), "XYZ");
    let limits = MeshLimits::SUGGESTED;
    let mut seen = 0;
    let mut add = |[x, ..]: [f64; 3]| {
        assert!(x >= 500.0, "{x}");
        seen += 1;
    };
    let mut file = Cursor::new(text.as_bytes());
    visit_some_vertices(&mut file, text.len() as u64, "a.xyz", &limits, &mut add).expect("points");
    assert!(seen > 1000, "{seen}");
}

#[test]
fn zeros_for_missing_heights_of_long_points_are_no_heights_but_the_ground_of_faces_is() {
    let position = |k: usize, [x, y, z]: [f64; 3]| {
        let z = if k.is_multiple_of(50) { 0.0 } else { z + 35.0 };
        format!("{:.7} {:.7} {z:.7}\n", x + 500.0, y + 500.0)
    };
    let rows = lines(420, position);
    let obj = format!("v {}\n", rows.trim_end().replace('\n', "\nv "));
    let count = 420 * 420;
    let short = |value: f64| (value * 100.0) as i16;
    let binary: Vec<u8> = (sheet(900).vertices.iter().enumerate())
        .flat_map(|(k, [x, y, z])| [x, y, if k % 50 == 0 { 0.0 } else { z + 35.0 }])
        .flat_map(|value| short(value).to_le_bytes())
        .collect();
    let points = [
        ("a.xyz", rows.clone().into_bytes()),
        ("a.obj", obj.clone().into_bytes()),
        ("a.ply", ply("ascii", "float", count, 0, rows.as_bytes())),
    ];
    for (name, bytes) in points {
        assert_sheet(long_sides(&bytes, name), name);
    }
    let bytes = ply("binary_little_endian", "short", 900 * 900, 0, &binary);
    let sides = long_sides(&bytes, "b.ply");
    assert_sheet(sides.map(|sides| sides.map(|side| side / 100.0)), "binary");
    let faces = "f 1 2 421\n".repeat(3);
    let rows = format!("{rows}{}", "3 0 1 420\n".repeat(3));
    let meshes = [
        ("a.obj", format!("{obj}{faces}").into_bytes()),
        ("a.ply", ply("ascii", "float", count, 3, rows.as_bytes())),
    ];
    for (name, bytes) in meshes {
        let [.., height] = long_sides(&bytes, name).expect(name);
        assert!(height > 34.0, "{name}: {height}");
    }
}

#[test]
fn facets_at_numbers_for_missing_points_of_a_long_stl_are_no_positions() {
    let mut mesh = sheet(420);
    for k in (0..mesh.vertices.len()).step_by(50) {
        let [x, y, _] = mesh.vertices.at(k);
        mesh.vertices.set(k, [x, y, -9999.0]);
    }
    for format in [MeshFormat::StlBinary, MeshFormat::StlAscii] {
        let name = format!("{format:?}");
        assert_sheet(long_sides(&format.encode(&mesh), "a.stl"), &name);
    }
}

#[test]
fn whole_coordinates_of_a_long_binary_ply_are_read() {
    let mesh = sheet(900);
    let count = mesh.vertices.len();
    let rows = |encode: &dyn Fn(i16) -> [u8; 2]| -> Vec<u8> {
        let whole = mesh.vertices.iter().flatten();
        whole
            .flat_map(|value| encode((value * 100.0) as i16 - 50))
            .collect()
    };
    for (format, rows) in [
        ("binary_little_endian", rows(&i16::to_le_bytes)),
        ("binary_big_endian", rows(&i16::to_be_bytes)),
    ] {
        let sides = long_sides(&ply(format, "short", count, 0, &rows), "a.ply");
        assert_sheet(sides.map(|sides| sides.map(|side| side / 100.0)), format);
    }
}

#[test]
fn places_that_depend_on_lists_are_not_known() {
    let rows = vec![0; WHOLE_BYTES as usize];
    let bytes = ply("binary_little_endian", "float", 9, 900, &rows);
    let text = String::from_utf8_lossy(&bytes);
    let with_list = text.replacen(
        "element face",
        "property list uchar int more\nelement face",
        1,
    );
    assert_eq!(long_sides(with_list.as_bytes(), "a.ply"), None);
}

#[test]
fn faces_after_shorter_rows_of_a_long_text_ply_are_no_positions() {
    // The first rows are four times as long as the others.
    let row = |k: usize, [x, y, z]: [f64; 3]| {
        let digits = if k < 60_000 { 18 } else { 2 };
        format!("{x:.digits$} {y:.digits$} {z:.digits$}\n")
    };
    let vertices = lines(420, row);
    let face = |k: u32| format!("3 {k} {} {}\n2 {k} 7\n", k + 1, k + 2);
    let faces: Vec<String> = (0..90_000).map(face).collect();
    let rows = vertices + &faces.concat();
    let bytes = ply("ascii", "float", 420 * 420, 180_000, rows.as_bytes());
    assert_sheet(long_sides(&bytes, "a.ply"), "rows");
    let marked = [b"\xef\xbb\xbf", &bytes[..]].concat();
    assert_sheet(long_sides(&marked, "a.ply"), "after a byte order mark");
    let classic: Vec<u8> = bytes
        .iter()
        .map(|byte| if *byte == b'\n' { b'\r' } else { *byte })
        .collect();
    assert_sheet(
        long_sides(&classic, "a.ply"),
        "ends of lines of classic Mac OS",
    );
}

#[test]
fn the_title_of_long_points_names_their_columns_in_all_parts() {
    let titled = |k: usize, [x, y, z]: [f64; 3]| format!("{k};{z:.9};{y:.9};{x:.9}\n");
    let titled = format!("id;Z;Y;X\n{}", lines(420, titled));
    assert_sheet(long_sides(titled.as_bytes(), "a.xyz"), "a title");
    let commas = titled.replace('.', ",");
    assert_sheet(long_sides(commas.as_bytes(), "a.xyz"), "decimal commas");
    let numbered = lines(420, |k, [x, y, z]| format!("{k} {x:.9} {y:.9} {z:.9}\n"));
    assert_sheet(
        long_sides(numbered.as_bytes(), "a.xyz"),
        "numbers of points",
    );
}

#[test]
fn the_header_of_a_long_scan_of_ptx_has_no_points() {
    let row = |_: usize, [x, y, z]: [f64; 3]| {
        let [x, y] = [x, y].map(|value| value + 500.0);
        format!("{x:.9}\t{y:.9}\t{z:.9}\t0.5\n")
    };
    let rows = lines(420, row);
    assert_sheet(long_sides(rows.as_bytes(), "a.xyz"), "tabs");
    let scanner = "420\n420\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    let matrix = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let scan = format!("{scanner}{matrix}{rows}");
    assert_sheet(long_sides(scan.as_bytes(), "a.ptx"), "PTX");
}

#[test]
fn a_long_file_of_zeros_is_named() {
    let bytes = vec![0; WHOLE_BYTES as usize + 1];
    for name in ["a.stl", "a.ply", "a.xyz"] {
        let refused = found(&bytes, name).expect_err(name).to_string();
        assert_eq!(
            refused,
            "the file has only zeros; was the copy interrupted? copy it again"
        );
    }
    let other = [&bytes[..], b"v 1 2 3\n"].concat();
    let refused = found(&other, "a.ply").expect_err("no mesh").to_string();
    assert!(refused.starts_with("the file is binary data"), "{refused}");
}

#[test]
fn the_unit_and_all_vertices_of_a_short_file_are_known() {
    let xyz = b"# units: m\n0 0 0\n0.04 0.03 0\n0 0.01 0\n";
    let found = found(xyz, "a.xyz").expect("points");
    assert_eq!(found.unit, Some(LengthUnit::M));
    assert_eq!(found.sides, Some([0.04, 0.03, 0.0]));
}
