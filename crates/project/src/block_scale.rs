//! Compares the sizes of scans and pages before blocks are imported, which shows a unit that is wrong but possible.

use crate::file_headers::{ScanKind, image_size, page_length_mm, scan_extent, unit_of_page};
use crate::missing_files::place_of;
use mocban_core::InputLimits;
use mocban_lists::manifest::BlockRow;
use mocban_store::Project;

/// Most blocks of a list whose files are compared, because parts of each scan are read.
const MAX_COMPARED: usize = 50;

/// Returns a warning for each block whose scan would have the size of its page in another unit only.
pub(crate) fn doubts(
    rows: &[BlockRow],
    label: &str,
    project: &Project,
    limits: &InputLimits,
) -> Vec<String> {
    let compared = rows.iter().take(MAX_COMPARED);
    let doubts = compared.filter_map(|row| {
        let page = place_of(&row.page, project);
        let page_mm = page_length_mm(&page, || image_size(&page, &limits.image).ok())?;
        let scan = scan_extent(&place_of(&row.mesh, project), &limits.mesh).ok()?;
        let (length, unit) = (scan.longest()?, ScanKind::Block.unit(&scan, row.unit)?.unit);
        let likely = unit_of_page(length, unit, page_mm)?;
        let [scan_mm, likely_mm] = [unit, likely].map(|unit| length * unit.mm());
        let (line, name) = (row.line, &row.name);
        Some(format!(
            "{label} {line}: with the unit {unit}, the scan of {name} is {scan_mm:.0} mm long, but its page {page_mm:.0} mm by the \
             resolution of the image; is the unit {likely} ({likely_mm:.0} mm)?"
        ))
    });
    doubts.collect()
}

#[cfg(test)]
mod tests {
    use super::doubts;
    use mocban_core::InputLimits;
    use mocban_core::raster::{Grid, jpeg_rgb8};
    use mocban_lists::manifest::parse_blocks;
    use mocban_store::Project;

    /// Position of the unit of the resolution in a JPEG file, behind which both numbers are.
    const RESOLUTION: usize = 13;

    /// Returns a page of 3000 pixels with a resolution, pixels per inch.
    fn page(dpi: u16) -> Vec<u8> {
        let mut file = jpeg_rgb8(&Grid::new(3000, 8, [255; 3]), 50);
        assert_eq!(&file[6..10], b"JFIF");
        let [high, low] = dpi.to_be_bytes();
        file[RESOLUTION..RESOLUTION + 5].copy_from_slice(&[1, high, low, high, low]);
        file
    }

    #[test]
    fn a_scan_with_the_size_of_its_page_in_another_unit_is_doubted() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let scan = "v 0 0 0\nv 32 0 0\nv 0 20 1\nf 1 2 3\n";
        std::fs::write(dir.path().join("b.obj"), scan).expect("written");
        std::fs::write(dir.path().join("b.jpg"), page(254)).expect("written");
        std::fs::write(dir.path().join("screen.jpg"), page(72)).expect("written");
        let list = "block,mesh,page,unit\na,b.obj,b.jpg,mm\nb,b.obj,b.jpg,cm\nc,b.obj,screen.jpg,mm\nd,b.obj,b.jpg,\n\
                    e,b.obj,gone.jpg,mm\n";
        let mut rows = parse_blocks(list.as_bytes()).expect("a list");
        for row in &mut rows {
            row.mesh = dir.path().join(&row.mesh);
            row.page = dir.path().join(&row.page);
        }
        let found = doubts(
            &rows,
            "blocks.csv: line",
            &Project::at(dir.path()),
            &InputLimits::SUGGESTED,
        );
        assert_eq!(
            found,
            [
                "blocks.csv: line 2: with the unit mm, the scan of a is 32 mm long, but its page 300 mm by the resolution of \
                 the image; is the unit cm (320 mm)?"
            ]
        );
    }
}
