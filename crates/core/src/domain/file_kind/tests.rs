//! Tests of file types by content and by extension.

use super::{FileKind, UNREAD_IMAGES, UNREAD_MESHES};

#[test]
fn unread_types_are_known_by_extension_and_have_advice() {
    for (extensions, kind) in UNREAD_IMAGES {
        for extension in extensions {
            assert_eq!(FileKind::of_unread_extension(extension), Some(kind));
        }
        let advice = kind.image_advice().expect("advice");
        assert!(advice.contains(extensions[0]), "{advice}");
    }
    assert_eq!(
        FileKind::of_unread_extension("PDF"),
        Some(FileKind::Other("a PDF document"))
    );
    for (extensions, kind) in UNREAD_MESHES {
        for extension in extensions {
            assert_eq!(FileKind::of_unread_extension(extension), Some(kind));
        }
        assert!(kind.mesh_advice().is_some() && kind.image_advice().is_none());
    }
    assert_eq!(FileKind::of_unread_extension("png"), None);
    assert_eq!(FileKind::Text.image_advice(), None);
    let webp = FileKind::of(b"RIFF\x10\0\0\0WEBPVP8 ");
    let advice = webp.image_content_advice().expect("advice");
    assert!(advice.contains("-format png FILE`"), "{advice}");
    let pdf = FileKind::Other("a PDF document");
    assert_eq!(pdf.image_content_advice(), pdf.image_advice());
}

#[test]
fn types_are_detected_by_content() {
    assert_eq!(FileKind::of(b"\x89PNG\r\n\x1a\n...."), FileKind::Png);
    assert_eq!(FileKind::of(b"\xff\xd8\xff\xe0"), FileKind::Jpeg);
    assert_eq!(FileKind::of(b"MM\0*rest"), FileKind::Tiff);
    // A TIFF whose first directory is at 2.
    assert_eq!(FileKind::of(b"MM\0*\0\0\x02\0"), FileKind::Tiff);
    assert_eq!(FileKind::of(b"\xff\x0a\xfa\x1f\0").name(), "JPEG XL image");
    assert_eq!(FileKind::of(b"\xff\n1 2 3"), FileKind::Text);
    assert_eq!(
        FileKind::of(b"RIFF\0\0\0\0WEBPVP8 "),
        FileKind::OtherImage("a WebP image")
    );
    assert_eq!(
        FileKind::of(b"\0\0\0\x1cftypheic"),
        FileKind::OtherImage("a HEIC image")
    );
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n";
    assert_eq!(FileKind::of(pointer), FileKind::LfsPointer);
    assert_eq!(FileKind::of(b"hello there"), FileKind::Text);
    assert_eq!(FileKind::of(&[0, 1, 2]), FileKind::Binary);
}

#[test]
fn all_files_of_a_format_have_one_description() {
    let zip = |name: &str| {
        [
            b"PK\x03\x04".as_slice(),
            &vec![b'x'; 99_999],
            name.as_bytes(),
        ]
        .concat()
    };
    let embedded = format!(
        "{{\"buffers\":[{{\"uri\":\"data:{}\"}}],\"asset\":{{\"version\":\"2.0\"}}}}",
        "A".repeat(9999)
    );
    for (wanted, files) in [
        (
            "a glTF scene",
            vec![
                b"glTF\x02\0\0\0".to_vec(),
                b" {\n \"asset\": {\"version\": \"2.0\"}, \"meshes\": []}".to_vec(),
                b"{\"asset\": {\"extras\": {\"by\": \"x\"}, \"version\": \"2.0\"}}".to_vec(),
                embedded.into_bytes(),
            ],
        ),
        (
            "an OFF mesh",
            [
                "OFF\n3 1 0\n",
                "OFF\r\n3 1 0",
                "OFF 3 1 0\n",
                "# a scan\n\nOFF\n",
                "COFF\n3 1 0\n",
                "STCNOFF\n",
                "OFF BINARY\n",
            ]
            .map(|text| text.as_bytes().to_vec())
            .to_vec(),
        ),
        ("a 3MF model", vec![zip("3D/3dmodel.model")]),
        (
            "a 3DS scene",
            vec![
                b"MM\x20\0\0\0\x02\0\x0a\0\0\0".to_vec(),
                b"MM\x20\0\0\0==\x0a\0\0\0".to_vec(),
            ],
        ),
        (
            "an SVG image",
            vec![
                b"<svg xmlns=\"http://www.w3.org/2000/svg\"/>".to_vec(),
                b"<?xml version=\"1.0\"?>\n<!-- a -->\n<svg>".to_vec(),
            ],
        ),
        (
            "XML or HTML text",
            vec![b"<!DOCTYPE html>\n<html><body><svg/></body></html>".to_vec()],
        ),
        ("a ZIP archive", vec![zip("xl/workbook.xml")]),
        (
            "a COLLADA scene",
            vec![b"<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"\">".to_vec()],
        ),
        (
            "text",
            [
                "OFFICE\n",
                "off we go",
                "{\"images\": []}",
                "# OFF\n1 2 3\n",
                "BM,mesh,print\nvạn,a.stl,a.png\n",
                "GIF8,mesh\n",
                "{\"asset\": \"a1\", \"mesh\": \"a.stl\", \"version\": 2}\n",
                "{\"asset\": {\"name\": \"p1.jpg\"}, \"regions\": [], \"version\": \"2.1\"}",
            ]
            .map(|text| text.as_bytes().to_vec())
            .to_vec(),
        ),
    ] {
        for file in files {
            let said = FileKind::of(&file).to_string();
            assert_eq!(
                said,
                wanted,
                "{}",
                String::from_utf8_lossy(&file[..20.min(file.len())])
            );
        }
    }
}
