//! Compares the sizes of scans and pages before blocks are imported, which shows a unit that is wrong but possible.

use std::io::BufReader;
use std::path::Path;

use crate::file_heads::{ScanKind, image_size, scan_extent};
use crate::manifest_file::place_of;
use mocban_align::scan_size::nearest_unit;
use mocban_core::InputLimits;
use mocban_core::domain::LengthUnit;
use mocban_core::raster::{ImageLimits, file_dpi};
use mocban_lists::manifest::BlockRow;
use mocban_store::{Project, open_regular};

/// Most blocks of a list whose files are compared, because parts of each scan are read.
const MAX_COMPARED: usize = 50;
/// Largest factor between the sizes of a block and its page, which has margins and shows no handles.
const MAX_RATIO: f64 = 1.5;
/// Lower resolutions are not measured: cameras and screens state 72 and 96 for any image.
const MIN_DPI: f64 = 100.0;
const MM_PER_INCH: f64 = 25.4;

/// Returns a warning for each block whose scan would have the size of its page in another unit only. Says nothing of other
/// differences, because cameras state resolutions that do not fit the page.
pub(crate) fn doubts(
    rows: &[BlockRow],
    label: &str,
    project: &Project,
    limits: &InputLimits,
) -> Vec<String> {
    let compared = rows.iter().take(MAX_COMPARED);
    let doubts = compared.filter_map(|row| {
        let page_mm = page_mm(&place_of(&row.page, project), &limits.image)?;
        let scan = scan_extent(&place_of(&row.mesh, project), &limits.mesh).ok()?;
        let unit = ScanKind::Block.unit(&scan, row.unit)?.unit;
        let doubt = other_unit(row.name.as_str(), scan.longest()?, unit, page_mm)?;
        Some(format!("{label} {}: {doubt}", row.line))
    });
    doubts.collect()
}

/// Returns the length of the longer side of a page, mm, if its file states a resolution that may be measured.
fn page_mm(path: &Path, limits: &ImageLimits) -> Option<f64> {
    let (file, _) = open_regular(path).ok()?;
    let [x, y] = file_dpi(BufReader::new(file))?;
    // They are equal nearly always, so it does not matter whether the image is stored turned.
    let dpi = x.min(y);
    let [width, height] = image_size(path, limits).ok()?;
    (dpi >= MIN_DPI).then(|| f64::from(width.max(height)) / dpi * MM_PER_INCH)
}

/// Returns a sentence if the scan of a block has the size of its page in another unit only. `length` is in units of the mesh.
fn other_unit(name: &str, length: f64, unit: LengthUnit, page_mm: f64) -> Option<String> {
    let fits = |unit: LengthUnit| {
        let ratio = length * unit.mm() / page_mm;
        (1.0 / MAX_RATIO..=MAX_RATIO).contains(&ratio)
    };
    let likely = nearest_unit(length, page_mm);
    (!fits(unit) && fits(likely)).then(|| {
        let [scan_mm, likely_mm] = [unit, likely].map(|unit| length * unit.mm());
        format!(
            "with the unit {unit}, the scan of {name} is {scan_mm:.0} mm long, but its page {page_mm:.0} mm by the resolution of the image; \
             is the unit {likely} ({likely_mm:.0} mm)?"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::{doubts, other_unit};
    use mocban_core::InputLimits;
    use mocban_core::domain::LengthUnit;
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

    #[test]
    fn sizes_that_no_unit_makes_equal_are_no_doubt() {
        for (length, unit, likely) in [
            (13.0, LengthUnit::Cm, Some(LengthUnit::In)),
            (0.33, LengthUnit::Cm, Some(LengthUnit::M)),
            (330.0, LengthUnit::Mm, None),
            (460.0, LengthUnit::Mm, None),
            (200.0, LengthUnit::Mm, None),
            (5.0, LengthUnit::Cm, None),
        ] {
            let found = other_unit("a", length, unit, 330.0);
            assert_eq!(found.is_some(), likely.is_some(), "{length} {found:?}");
            if let Some((found, likely)) = found.zip(likely) {
                let end = format!("is the unit {likely} (330 mm)?");
                assert!(found.ends_with(&end), "{found}");
            }
        }
    }
}
