//! Workbooks for tests.

use std::fmt::Write as _;
use std::io::Write as _;

use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};

/// Returns a ZIP archive of named files, deflated or stored.
pub fn archive(files: &[(&str, &str)], is_deflated: bool) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, text) in files {
        let mut checksum = Crc::new();
        checksum.update(text.as_bytes());
        let packed = if is_deflated {
            let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
            encoder
                .write_all(text.as_bytes())
                .expect("memory takes all");
            encoder.finish().expect("memory takes all")
        } else {
            text.as_bytes().to_vec()
        };
        let method = if is_deflated { 8_u16 } else { 0 };
        let mut fields = Vec::new();
        fields.extend_from_slice(&20_u16.to_le_bytes());
        fields.extend_from_slice(&0_u16.to_le_bytes());
        fields.extend_from_slice(&method.to_le_bytes());
        fields.extend_from_slice(&[0; 4]);
        for number in [checksum.sum(), packed.len() as u32, text.len() as u32] {
            fields.extend_from_slice(&number.to_le_bytes());
        }
        fields.extend_from_slice(&(name.len() as u16).to_le_bytes());
        fields.extend_from_slice(&[0; 2]);
        directory.extend_from_slice(b"PK\x01\x02\x14\0");
        directory.extend_from_slice(&fields);
        directory.extend_from_slice(&[0; 10]);
        directory.extend_from_slice(&(bytes.len() as u32).to_le_bytes());
        directory.extend_from_slice(name.as_bytes());
        bytes.extend_from_slice(b"PK\x03\x04");
        bytes.extend_from_slice(&fields);
        bytes.extend_from_slice(name.as_bytes());
        bytes.extend_from_slice(&packed);
    }
    let start = bytes.len() as u32;
    bytes.extend_from_slice(&directory);
    bytes.extend_from_slice(b"PK\x05\x06\0\0\0\0");
    let count = (files.len() as u16).to_le_bytes();
    bytes.extend_from_slice(&[count, count].concat());
    bytes.extend_from_slice(&(directory.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&start.to_le_bytes());
    bytes.extend_from_slice(&[0; 2]);
    bytes
}

/// Returns a workbook of sheets with names and the XML of their rows, and the XML of shared strings and styles.
pub fn workbook(sheets: &[(&str, &str)], strings: &str, styles: &str) -> Vec<u8> {
    const ROOT: &str = "http://schemas.openxmlformats.org";
    let (mut names, mut relations) = (String::new(), String::new());
    let mut files = Vec::new();
    for (k, (name, rows)) in (1..).zip(sheets) {
        let _ = write!(
            names,
            "<sheet name=\"{name}\" sheetId=\"{k}\" r:id=\"rId{k}\"/>"
        );
        let kind = "officeDocument/2006/relationships/worksheet";
        let _ = write!(
            relations,
            "<Relationship Id=\"rId{k}\" Type=\"{ROOT}/{kind}\" Target=\"worksheets/sheet{k}.xml\"/>"
        );
        let sheet =
            format!("<?xml version=\"1.0\"?><worksheet><sheetData>{rows}</sheetData></worksheet>");
        files.push((format!("xl/worksheets/sheet{k}.xml"), sheet));
    }
    for (kind, file, text) in [
        ("sharedStrings", "sharedStrings.xml", strings),
        ("styles", "styles.xml", styles),
    ] {
        if !text.is_empty() {
            let _ = write!(
                relations,
                "<Relationship Id=\"{kind}\" Type=\"{ROOT}/officeDocument/2006/relationships/{kind}\" Target=\"/xl/{file}\"/>"
            );
            files.push((format!("xl/{file}"), text.to_owned()));
        }
    }
    let workbook = format!("<workbook><sheets>{names}</sheets></workbook>");
    files.push(("xl/workbook.xml".to_owned(), workbook));
    let relations = format!("<Relationships>{relations}</Relationships>");
    files.push(("xl/_rels/workbook.xml.rels".to_owned(), relations));
    let files: Vec<(&str, &str)> = files
        .iter()
        .map(|(name, text)| (name.as_str(), text.as_str()))
        .collect();
    archive(&files, true)
}

/// Returns the XML of rows of cells with texts.
pub fn text_rows(rows: &[&[&str]]) -> String {
    let mut xml = String::new();
    for cells in rows {
        xml += "<row>";
        for text in *cells {
            let text = text.replace('&', "&amp;").replace('<', "&lt;");
            let _ = write!(xml, "<c t=\"inlineStr\"><is><t>{text}</t></is></c>");
        }
        xml += "</row>";
    }
    xml
}
