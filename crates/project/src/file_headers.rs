//! What files say of themselves before an import stores anything: sizes of scans and images, or why they cannot be used.

use std::io::BufReader;
use std::ops::RangeInclusive;
use std::path::Path;

use mocban_align::scan_size::{TYPICAL_BLOCK_MM, TYPICAL_CHARACTER_MM, nearest_unit};
use mocban_core::domain::LengthUnit;
use mocban_core::mesh::{self, MeshExtent, MeshLimits};
use mocban_core::raster::{DecodeError, ImageLimits, PrintImage, decode, file_dpi, header_size};
use mocban_lists::labels::{self, Labels, MAX_BYTES, PageFile};
use mocban_store::{open_regular, read_up_to};

/// Usual longest sides of the scan of one character, with the wood around it, mm.
const USUAL_CHARACTER_MM: RangeInclusive<f64> = 4.0..=200.0;
/// Usual longest sides of the scan of a whole block, mm.
const USUAL_BLOCK_MM: RangeInclusive<f64> = 80.0..=1500.0;
/// Largest factor between the sizes of a block and its page, which has margins and shows no handles.
const MAX_RATIO: f64 = 1.5;
/// Lower resolutions are not measured: cameras and screens state 72 and 96 for any image.
const MIN_DPI: f64 = 100.0;
const MM_PER_INCH: f64 = 25.4;
/// Most vertices that are kept for a picture of a scan.
const MAX_POINTS: usize = 1 << 21;

/// What a scan shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScanKind {
    /// One character.
    Character,
    /// A whole block.
    Block,
}

/// Where a unit comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitOrigin {
    /// A person or a list gives it.
    Given,
    /// The file names it.
    File,
    /// The longest side is then usual.
    Guess,
}

/// The unit of a scan, known or guessed before an import.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScanUnit {
    /// The unit.
    pub unit: LengthUnit,
    /// Where it comes from.
    pub origin: UnitOrigin,
    /// The unit that is likelier by the longest side, if the given one or that of the file makes the side unusual.
    pub likelier: Option<LengthUnit>,
}

impl ScanKind {
    /// Returns the unit of a scan: the given one, that of its file, or the one in which its longest side is usual.
    pub fn unit(self, extent: &MeshExtent, given: Option<LengthUnit>) -> Option<ScanUnit> {
        let (typical_mm, usual_mm) = match self {
            Self::Character => (TYPICAL_CHARACTER_MM, USUAL_CHARACTER_MM),
            Self::Block => (TYPICAL_BLOCK_MM, USUAL_BLOCK_MM),
        };
        let longest = extent.longest().filter(|longest| *longest > 0.0);
        let is_usual = |unit: &LengthUnit| {
            longest.is_none_or(|longest| usual_mm.contains(&(longest * unit.mm())))
        };
        let guess = longest.map(|longest| nearest_unit(longest, typical_mm));
        let guess = guess.filter(is_usual);
        let of_file = extent.unit.map(|unit| (unit, UnitOrigin::File));
        let known = given.map(|unit| (unit, UnitOrigin::Given)).or(of_file);
        let (unit, origin) = known.or(guess.map(|unit| (unit, UnitOrigin::Guess)))?;
        let likelier = guess.filter(|_| !is_usual(&unit));
        Some(ScanUnit {
            unit,
            origin,
            likelier,
        })
    }
}

/// Describes a scan by its file, of which little is read if it is long.
///
/// # Errors
/// Returns the reason if the file cannot be used.
pub fn scan_extent(path: &Path, limits: &MeshLimits) -> Result<MeshExtent, String> {
    let (mut file, meta) = open_regular(path).map_err(|error| error.to_string())?;
    let name = path.to_string_lossy();
    mesh::extent(&mut file, meta.len(), &name, limits).map_err(|error| error.to_string())
}

/// Returns width and height of an upright image in pixels, by the header of its file. Decodes a file that may be cut.
///
/// # Errors
/// Returns the reason if the file cannot be used.
pub fn image_size(path: &Path, limits: &ImageLimits) -> Result<[u32; 2], String> {
    let (file, meta) = open_regular(path).map_err(|error| error.to_string())?;
    match header_size(BufReader::new(file), meta.len(), limits) {
        // Some programs leave out the end of a file behind the last pixel.
        Err(DecodeError::Truncated(_)) => {
            let image = page_image(path, limits)?;
            Ok([image.rgb.width(), image.rgb.height()].map(|side| side as u32))
        }
        size => size.map_err(|error| error.to_string()),
    }
}

/// Returns the length of the longer side of a page, mm, if its file states a resolution that may be measured. `size` returns its
/// width and height in pixels if the file can be used. It is called last, because it may decode the image.
pub fn page_length_mm(path: &Path, size: impl FnOnce() -> Option<[u32; 2]>) -> Option<f64> {
    let (file, _) = open_regular(path).ok()?;
    let [x, y] = file_dpi(BufReader::new(file))?;
    // They are equal nearly always, so it does not matter whether the image is stored turned.
    let dpi = Some(x.min(y)).filter(|dpi| *dpi >= MIN_DPI)?;
    let [width, height] = size()?;
    Some(f64::from(width.max(height)) / dpi * MM_PER_INCH)
}

/// Returns the unit in which a scan of a block is as long as its page, if it is not so in `unit`. `length` is in units of the
/// mesh. `None` also if no unit fits, because cameras state resolutions that say nothing of the page.
pub fn unit_of_page(length: f64, unit: LengthUnit, page_mm: f64) -> Option<LengthUnit> {
    let fits = |unit: LengthUnit| {
        let ratio = length * unit.mm() / page_mm;
        (1.0 / MAX_RATIO..=MAX_RATIO).contains(&ratio)
    };
    let likely = nearest_unit(length, page_mm);
    (!fits(unit) && fits(likely)).then_some(likely)
}

/// Returns vertices of a scan for a picture, relative to one of them: all of a short file, and some of a long one, spread over
/// the file. Leaves out vertices without a position, and those at the origin.
///
/// # Errors
/// Returns the reason if the file cannot be used.
pub fn scan_points(path: &Path, limits: &MeshLimits) -> Result<Vec<[f32; 3]>, String> {
    let (mut file, meta) = open_regular(path).map_err(|error| error.to_string())?;
    let (name, mut points) = (path.to_string_lossy(), Vec::new());
    let mut first = None;
    let mut add = |point: [f64; 3]| {
        let is_position = point != [0.0; 3] && point.iter().all(|value| value.is_finite());
        if is_position && points.len() < MAX_POINTS {
            // Coordinates of maps are too large for 32 bits.
            let origin = *first.get_or_insert(point);
            points.push([0, 1, 2].map(|axis| (point[axis] - origin[axis]) as f32));
        }
    };
    let read = mesh::visit_some_vertices(&mut file, meta.len(), &name, limits, &mut add);
    read.map_err(|error| error.to_string())?;
    Ok(points)
}

/// Reads the image of a page.
///
/// # Errors
/// Returns the reason if the file cannot be used.
pub fn page_image(path: &Path, limits: &ImageLimits) -> Result<PrintImage, String> {
    let (file, _) = open_regular(path).map_err(|error| error.to_string())?;
    let bytes = read_up_to(file, limits.max_bytes).map_err(|error| error.to_string())?;
    decode(&bytes, limits).map_err(|error| error.to_string())
}

/// Reads the boxes that labels have for a page, by the name that a list gives it, and its upright size in pixels.
///
/// # Errors
/// Returns the reason if the file cannot be used, or has no boxes for the page.
pub fn page_labels(file: &Path, page: &Path, [width, height]: [u32; 2]) -> Result<Labels, String> {
    let (opened, _) = open_regular(file).map_err(|error| error.to_string())?;
    let content = read_up_to(opened, MAX_BYTES as u64).map_err(|error| error.to_string())?;
    let bytes = std::fs::metadata(page).map_or(0, |meta| meta.len());
    let [file, name] = [file, page].map(|path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    });
    let page = PageFile {
        name: &name,
        bytes,
        width,
        height,
    };
    labels::read(&content, &file, &page).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::{
        ScanKind, UnitOrigin, image_size, page_labels, scan_extent, scan_points, unit_of_page,
    };
    use mocban_core::domain::LengthUnit;
    use mocban_core::mesh::{MeshExtent, MeshLimits};
    use mocban_core::raster::{Grid, ImageLimits, jpeg_rgb8};

    fn of_length(longest: f64) -> MeshExtent {
        MeshExtent {
            sides: Some([longest, longest / 2.0, longest / 10.0]),
            is_exact: true,
            unit: None,
        }
    }

    #[test]
    fn a_unit_is_guessed_by_what_is_scanned_and_a_given_one_is_doubted() {
        let unit = |kind: ScanKind, longest, given| {
            let found = kind.unit(&of_length(longest), given)?;
            Some((found.unit, found.origin, found.likelier))
        };
        let (character, block) = (ScanKind::Character, ScanKind::Block);
        let (mm, m) = (LengthUnit::Mm, LengthUnit::M);
        let guess = UnitOrigin::Guess;
        assert_eq!(unit(character, 42.0, None), Some((mm, guess, None)));
        assert_eq!(unit(block, 0.45, None), Some((m, guess, None)));
        assert_eq!(unit(character, 5e6, None), None);
        let given = UnitOrigin::Given;
        assert_eq!(unit(character, 42.0, Some(mm)), Some((mm, given, None)));
        assert_eq!(unit(character, 42.0, Some(m)), Some((m, given, Some(mm))));
        let named = MeshExtent {
            unit: Some(m),
            ..of_length(0.05)
        };
        let found = character.unit(&named, None).expect("a unit");
        assert_eq!((found.unit, found.origin), (m, UnitOrigin::File));
    }

    #[test]
    fn a_unit_of_the_page_is_another_one_that_fits() {
        let (mm, cm) = (LengthUnit::Mm, LengthUnit::Cm);
        for (length, unit, expected) in [
            (33.0, mm, Some(cm)),
            (13.0, cm, Some(LengthUnit::In)),
            (0.33, cm, Some(LengthUnit::M)),
            (330.0, mm, None),
            (460.0, mm, None),
            // The lengths differ in every unit.
            (200.0, mm, None),
            (5.0, cm, None),
            (0.0, mm, None),
        ] {
            assert_eq!(
                unit_of_page(length, unit, 330.0),
                expected,
                "{length} {unit}"
            );
        }
    }

    #[test]
    fn files_that_cannot_be_used_say_why() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.stl");
        let reason = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("written");
            let scan = scan_extent(&path, &MeshLimits::SUGGESTED);
            let image = image_size(&path, &ImageLimits::SUGGESTED);
            [scan.map(|_| ()), image.map(|_| ())].map(|refused| refused.expect_err("no file"))
        };
        for (bytes, part) in [
            (&b""[..], "empty"),
            (
                &b"version https://git-lfs.github.com/spec/v1\n"[..],
                "Git LFS",
            ),
        ] {
            assert!(reason(bytes).iter().all(|why| why.contains(part)), "{part}");
        }
        let mut cut = vec![0; 84];
        cut[80] = 9;
        assert!(reason(&cut)[0].contains("truncated"));
        let none = scan_extent(&dir.path().join("none"), &MeshLimits::SUGGESTED);
        assert!(none.expect_err("none").contains("not there"));
    }

    #[test]
    fn an_image_without_the_mark_of_its_end_is_used_if_all_pixels_are_there() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("1.jpg");
        let size = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("written");
            image_size(&path, &ImageLimits::SUGGESTED)
        };
        let picture = Grid::from_fn(120, 80, |x, y| [x as u8, y as u8, 50]);
        let whole = jpeg_rgb8(&picture, 85);
        assert_eq!(size(&whole[..whole.len() - 2]), Ok([120, 80]));
        let cut = size(&whole[..whole.len() / 2]).expect_err("cut");
        assert!(cut.contains("truncated"), "{cut}");
    }

    #[test]
    fn points_far_from_the_origin_keep_their_distances() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("map.xyz");
        let text = "0 0 0\n0 0 0\n500000.25 2300000.5 7\n500000.5 2300000.625 8\n";
        std::fs::write(&path, text).expect("written");
        let points = scan_points(&path, &MeshLimits::SUGGESTED).expect("points");
        assert_eq!(points, [[0.0; 3], [0.25, 0.125, 1.0]]);
    }

    #[test]
    fn labels_are_read_for_the_upright_page_by_its_name_in_a_list() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let labels = dir.path().join("labels.json");
        let text = r#"{"images":[{"id":1,"width":80,"height":120,"file_name":"p.jpg"}],"categories":[{"id":1,"name":"x"}],
            "annotations":[{"id":1,"image_id":1,"category_id":1,"bbox":[10,10,30,30],"segmentation":[],"area":900,"iscrowd":0}]}"#;
        std::fs::write(&labels, text).expect("written");
        let count = |size| {
            let found = page_labels(&labels, &dir.path().join("p.jpg"), size);
            found.map(|found| found.boxes.len())
        };
        assert_eq!(count([80, 120]), Ok(1));
        count([120, 80]).expect_err("turned");
    }
}
