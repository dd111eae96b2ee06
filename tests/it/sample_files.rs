//! Small valid files of every input format, for tests that corrupt them.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat};
use mocban::mesh::Mesh;
use mocban::mesh::write::MeshFormat;

use super::tiff_file::TiffFile;

/// A file name with extension, and the content.
pub(crate) type NamedFile = (String, Vec<u8>);

fn named(name: &str, bytes: impl Into<Vec<u8>>) -> NamedFile {
    (name.to_owned(), bytes.into())
}

/// Asserts that a message is one readable line.
pub(crate) fn assert_one_sentence(message: &str) {
    assert!(!message.trim().is_empty(), "an empty message");
    assert!(message.len() < 1000, "{} bytes: {message}", message.len());
    assert!(!message.contains(char::is_control), "{message:?}");
}

/// Returns a plate of `side` by `side` vertices with two strokes.
pub(crate) fn relief(side: u32) -> Mesh {
    let stroke = |at: u32, across: u32| at.abs_diff(across) <= side / 12;
    let height = |x: u32, y: u32| {
        let inside =
            (side / 6..side - side / 6).contains(&x) && (side / 6..side - side / 6).contains(&y);
        f64::from(u8::from(
            inside && (stroke(x, side / 3) || stroke(y, side / 2)),
        )) * 2.0
    };
    let vertices = (0..side * side)
        .map(|at| (at % side, at / side))
        .map(|(x, y)| [f64::from(x), f64::from(y), height(x, y)])
        .collect();
    let triangles = (0..(side - 1) * (side - 1))
        .map(|at| at % (side - 1) + at / (side - 1) * side)
        .flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]])
        .collect();
    Mesh {
        vertices,
        triangles,
    }
}

/// Returns meshes and point sets in every format and encoding.
pub(crate) fn meshes() -> Vec<NamedFile> {
    let mesh = relief(12);
    let mut files: Vec<_> = MeshFormat::ALL
        .iter()
        .map(|format| {
            named(
                &format!("{format:?}.{}", format.extension()),
                format.encode(&mesh),
            )
        })
        .collect();
    let line = |[x, y, z]: [f64; 3]| format!("{x} {y} {z}\n");
    let points: Vec<_> = mesh.vertices.iter().map(line).collect();
    files.push(named("points.xyz", points.concat()));
    files.push(named("rich.obj", RICH_OBJ));
    files.push(named("rich.ply", RICH_PLY));
    files
}

const RICH_OBJ: &str = "# a scan\nmtllib a.mtl\no plate\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 .5 1\nv 0 1 -2e-1\nvt 0 0\n\
    vn 0 0 1\ng one\nusemtl red\ns 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -4//-1 \\\n -3//1 -2//1\nl 1 2\n";

const RICH_PLY: &str = "ply\nformat ascii 1.0\ncomment sample\nelement camera 1\nproperty list uchar float k\n\
    element vertex 4\nproperty uchar red\nproperty double x\nproperty float y\nproperty float z\n\
    element face 2\nproperty uchar flags\nproperty list uchar int vertex_index\nelement tristrips 1\n\
    property list int int vertex_indices\nend_header\n2 1 .5\n9 0 0 0\n9 1 0 0\n9 1 1 0\n9 0 1 1\n\
    0 4 0 1 2 3\n0 3 0 1 2\n5 0 1 2 -1 3\n";

/// Returns a print with two strokes.
fn print(side: u32) -> image::RgbImage {
    let ink = |at: u32| at.abs_diff(side / 2) <= side / 10;
    image::RgbImage::from_fn(side, side, |x, y| {
        let dark = (ink(x) || ink(y)) && x > side / 6 && y > side / 6;
        image::Rgb(if dark { [20, 15, 10] } else { [230, 225, 200] })
    })
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    image.write_to(&mut out, format).expect("encodes");
    out.into_inner()
}

/// Returns images in every format and pixel type.
pub(crate) fn images() -> Vec<NamedFile> {
    let rgb = DynamicImage::ImageRgb8(print(64));
    let mut files = vec![
        named("rgb8.jpeg", encoded(&rgb, ImageFormat::Jpeg)),
        named(
            "grey8.jpeg",
            encoded(&rgb.to_luma8().into(), ImageFormat::Jpeg),
        ),
    ];
    for (format, ending) in [(ImageFormat::Png, "png"), (ImageFormat::Tiff, "tif")] {
        for (name, image) in [
            ("rgb8", rgb.clone()),
            ("rgba16", rgb.to_rgba16().into()),
            ("grey16", rgb.to_luma16().into()),
        ] {
            files.push(named(&format!("{name}.{ending}"), encoded(&image, format)));
        }
    }
    files.push(named("indexed4.png", indexed_png()));
    files.extend(
        TiffFile::samples()
            .into_iter()
            .map(|(name, file)| named(name, file.encode())),
    );
    files
}

fn indexed_png() -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, 32, 32);
    encoder.set_depth(png::BitDepth::Four);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(vec![230, 225, 200, 20, 15, 10, 200, 0, 0]);
    encoder.set_trns(vec![255, 255, 0]);
    let mut writer = encoder.write_header().expect("writes");
    let rows: Vec<u8> = (0..32 * 16)
        .map(|at| if at % 16 < 8 { 0x01 } else { 0x12 })
        .collect();
    writer.write_image_data(&rows).expect("writes");
    writer.finish().expect("writes");
    out
}

fn utf16(text: &str, unit: fn(u16) -> [u8; 2]) -> Vec<u8> {
    "\u{feff}"
        .encode_utf16()
        .chain(text.encode_utf16())
        .flat_map(unit)
        .collect()
}

/// Returns manifests in every dialect.
pub(crate) fn lists() -> Vec<NamedFile> {
    let plain = "id,mesh,print,character,block,unit,scanned_face_down,folio\n\
        b1_0001,m/1.stl,p/1.png,\u{660e},b1,mm,yes,12r\n\nb1_0002,m/2.stl,\"p/2 \"\"b\"\".png\",,,IN,0,\"two\nlines\"\n";
    let tabs = plain.replace(',', "\t");
    vec![
        named("comma.csv", plain),
        named(
            "semicolon.csv",
            format!("\u{feff}{}", plain.replace(',', ";").replace('\n', "\r\n")),
        ),
        named("tab_utf16le.csv", utf16(&tabs, u16::to_le_bytes)),
        named("tab_utf16be.csv", utf16(&tabs, u16::to_be_bytes)),
        named(
            "objects.jsonl",
            "{\"id\":\"a\",\"mesh\":\"m.stl\",\"print\":\"p.png\",\"unit\":\"cm\",\"scanned_face_down\":true,\"x\":[1,{\"y\":null}]}\n\
             \n{\"id\":17,\"mesh\":\"n\",\"print\":\"q\",\"block\":null}",
        ),
    ]
}

/// Returns settings files; each line is also valid for `--set`.
pub(crate) fn settings() -> Vec<NamedFile> {
    vec![
        named("default.toml", include_str!("../../config/default.toml")),
        named("paper.toml", include_str!("../../config/paper.toml")),
        named(
            "preset.toml",
            "preset = \"paper\"\n[run]\nworkers = 2\nstage_timeout_s = 7\n",
        ),
        named(
            "sets.txt",
            "run.workers=2\nlimits.mesh.max_bytes=10\nfit.seed=9\nregister.smoothing_px=1.5\n",
        ),
    ]
}

/// Returns verdict files and a ground-truth file.
pub(crate) fn verdicts() -> Vec<NamedFile> {
    let plain = "pair,verdict,reviewer,metric,reason,note\n0001,pass,lan,,,\n\
        0002,fail,lan,density,strokes_lost,\"thin, broken\"\n0003,unsure,Tr\u{1ea7}n,nl_ssim,angle,\n";
    vec![
        named("comma.csv", plain),
        named("semicolon.csv", plain.replace(", ", " ").replace(',', ";")),
        named(
            "tab_utf16le.csv",
            utf16(
                &plain.replace(", ", " ").replace(',', "\t"),
                u16::to_le_bytes,
            ),
        ),
        named(
            "truth.jsonl",
            "{\"id\":\"a\",\"print_from_mesh\":[[1,0,0,0],[0,-1,0,0],[0,0,1,0]],\"plane\":{\"n\":[0,0,1],\"d\":0},\
             \"landmarks\":[[0,0,0]],\"char_height_px\":10,\"tops_mask\":\"tops/a.png\"}\n",
        ),
    ]
}
