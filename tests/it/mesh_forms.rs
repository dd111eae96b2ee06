//! A scan in files as other programs write them, each of which is read like its plain twin.

use std::fmt::Write as _;

use mocban::mesh::Mesh;
use mocban::mesh::write::MeshFormat;

/// A scan in an unusual form.
pub(crate) struct MeshForm {
    /// Name of the file, and the id of its pair.
    pub(crate) name: &'static str,
    pub(crate) bytes: Vec<u8>,
    /// Vertices without a position.
    pub(crate) missing: u64,
    /// Faces with fewer than three corners.
    pub(crate) incomplete: u64,
}

fn form(name: &'static str, bytes: impl Into<Vec<u8>>, missing: u64) -> MeshForm {
    MeshForm {
        name,
        bytes: bytes.into(),
        missing,
        incomplete: 0,
    }
}

fn text(format: MeshFormat, mesh: &Mesh) -> String {
    String::from_utf8(format.encode(mesh)).expect("text")
}

/// Returns the mesh with three more vertices that no face uses and that have no position.
fn with_missing(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.vertices.extend([[f64::NAN; 3], [0.0; 3], [0.0; 3]]);
    mesh
}

/// Returns the forms of a mesh with faces. The first is plain.
pub(crate) fn with_faces(mesh: &Mesh) -> Vec<MeshForm> {
    let plain = MeshFormat::PlyLittleEndian.encode(mesh);
    let mut forms = vec![form("plain.ply", plain, 0)];
    forms.extend(ply(mesh));
    forms.extend(obj(mesh));
    forms.extend(stl(mesh));
    forms.extend(two_corners(mesh));
    forms
}

/// Returns the mesh with edges that are written as faces.
fn two_corners(mesh: &Mesh) -> [MeshForm; 3] {
    let obj = text(MeshFormat::Obj, mesh) + "f 1 2\nf 2//1 3//1\n";
    let count = |faces: usize| format!("element face {faces}\n");
    let faces = mesh.triangles.len();
    let ply = text(MeshFormat::PlyAscii, mesh).replace(&count(faces), &count(faces + 2));
    let forms = [
        form("two-corners.obj", obj.clone(), 0),
        // Lines that only the slow reader takes.
        form("two-corners-slow.obj", format!("lod 1\n{obj}"), 0),
        form("two-corners.ply", ply + "2 0 1\n2 1 2\n", 0),
    ];
    forms.map(|form| MeshForm {
        incomplete: 2,
        ..form
    })
}

fn ply(mesh: &Mesh) -> Vec<MeshForm> {
    let missing = with_missing(mesh);
    let ascii = text(MeshFormat::PlyAscii, mesh);
    let (header, rows) = ascii.split_once("end_header\n").expect("a header");
    let mut with_quality = header.replace(
        "property float z\n",
        "property float z\nproperty float quality\n",
    );
    with_quality += "end_header\n";
    for (row, line) in rows.lines().enumerate() {
        let quality = [" -nan(ind)", " -1.#IND"][row % 2];
        let quality = if row < mesh.vertices.len() {
            quality
        } else {
            ""
        };
        writeln!(with_quality, "{line}{quality}").expect("a String takes any text");
    }
    let binary = MeshFormat::PlyBigEndian.encode(mesh);
    let end = b"end_header\n";
    let start = binary.windows(end.len()).position(|part| part == end);
    let (header, body) = binary.split_at(start.expect("a header") + end.len());
    let header = String::from_utf8_lossy(header).replace('\n', "\n\r");
    vec![
        form(
            "missing.ply",
            MeshFormat::PlyLittleEndian.encode(&missing),
            3,
        ),
        form("missing-text.ply", MeshFormat::PlyAscii.encode(&missing), 3),
        form("unused-columns.ply", with_quality, 0),
        form("lf-cr.ply", [header.as_bytes(), body].concat(), 0),
    ]
}

fn obj(mesh: &Mesh) -> Vec<MeshForm> {
    let plain = text(MeshFormat::Obj, mesh);
    let (vertices, faces) = plain.split_at(plain.find("\nf ").expect("faces") + 1);
    let materials = "# C:\\scans\\\nmtllib C:\\mat\\\n";
    let before_faces = "usemtl C:\\mat\\\n";
    vec![
        form(
            "backslashes.obj",
            format!("{materials}{vertices}{before_faces}{faces}"),
            0,
        ),
        form("cr.obj", plain.replace('\n', "\r") + "\n", 0),
        form("keyword.obj", format!("lod 1\nmg 0\n{plain}"), 0),
        form(
            "unused.obj",
            format!("{vertices}v nan nan nan\nv -nan(ind) 0 1.#QNAN\n{faces}"),
            0,
        ),
    ]
}

fn stl(mesh: &Mesh) -> Vec<MeshForm> {
    let plain = text(MeshFormat::StlAscii, mesh);
    let odd_words = plain
        .replace("endloop\nendfacet", "end loop end facet")
        .replace("outer loop\n", "outer loop ")
        .replacen("solid scan", "solid scan\0\0", 1);
    let binary = MeshFormat::StlBinary.encode(mesh);
    let (header, facets) = binary.split_at(84);
    let (mut attributes, mut missing) = (header.to_vec(), binary.clone());
    for facet in facets.chunks(50) {
        attributes.extend([&facet[..48], &4_u16.to_le_bytes(), b"abcd"].concat());
    }
    // One coordinate of the first corner.
    missing[84 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    vec![
        form("odd-words.stl", odd_words, 0),
        form("attributes.stl", attributes, 0),
        form("missing.stl", missing, 1),
    ]
}

/// Returns the forms of a point set. The first is plain.
pub(crate) fn points(mesh: &Mesh) -> Vec<MeshForm> {
    let rows = |row: &dyn Fn(usize, [f64; 3]) -> String| -> String {
        let rows = mesh.vertices.iter().enumerate();
        rows.map(|(index, point)| row(index, point)).collect()
    };
    let plain = rows(&|_, [x, y, z]| format!("{x} {y} {z}\n"));
    let commas = rows(&|_, [x, y, z]| format!("{x:.6};{y:.6};{z:.6}\n").replace('.', ","));
    let spaced = rows(&|_, [x, y, z]| format!("{x:.6} {y:.6} {z:.6}\n").replace('.', ","));
    let numbered = rows(&|index, [x, y, z]| format!("{} {x} {y} {z}\n", index + 1));
    let tabs = rows(&|_, [x, y, z]| format!("{x}\t{y}\t{z}\t128\n"));
    let mut organized = Mesh {
        vertices: mesh.vertices.clone(),
        ..Mesh::default()
    };
    let absent = organized.vertices.len() / 50;
    organized.vertices.extend(vec![[0.0; 3]; absent]);
    vec![
        form("plain.xyz", plain.clone(), 0),
        form(
            "organized.ply",
            MeshFormat::PlyLittleEndian.encode(&organized),
            absent as u64,
        ),
        form("commas.xyz", commas, 0),
        form("spaced-commas.xyz", spaced, 0),
        form("numbered.xyz", numbered, 0),
        form("tabs.xyz", format!("{tabs}1\t\t2\t128\n\t\t\t128\n"), 2),
        form(
            "titles.xyz",
            format!("% made by a scanner\n\"block 4\"\nX [mm] Y [mm] Z [mm]\n{plain}"),
            0,
        ),
        form("nan.xyz", format!("{plain}1 2 nan\n-1.#IND 0 0\n"), 2),
    ]
}
