//! What files say of themselves before an import stores anything: sizes of scans and images, or why they cannot be used.

use std::io::BufReader;
use std::path::Path;

use mocban_core::domain::LengthUnit;
use mocban_core::mesh::{self, MeshExtent, MeshLimits};
use mocban_core::raster::{ImageLimits, header_size};
use mocban_store::open_regular;

/// Shortest and longest usual side of the scan of one character, mm.
const CHARACTER_MM: [f64; 2] = [8.0, 150.0];
/// Shortest and longest usual side of the scan of a whole block, mm.
const BLOCK_MM: [f64; 2] = [100.0, 1500.0];

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

/// The unit of a scan, as far as it is known before an import.
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
        let usual_mm = match self {
            Self::Character => CHARACTER_MM,
            Self::Block => BLOCK_MM,
        };
        let longest = extent.longest();
        let guess = longest.and_then(|longest| LengthUnit::likely(longest, usual_mm));
        let of_file = extent.unit.map(|unit| (unit, UnitOrigin::File));
        let known = given.map(|unit| (unit, UnitOrigin::Given)).or(of_file);
        let (unit, origin) = known.or(guess.map(|unit| (unit, UnitOrigin::Guess)))?;
        let is_usual = longest
            .is_none_or(|longest| (usual_mm[0]..=usual_mm[1]).contains(&(longest * unit.mm())));
        let likelier = guess.filter(|_| !is_usual);
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

/// Returns width and height of an image in pixels, by the header of its file.
///
/// # Errors
/// Returns the reason if the file cannot be used.
pub fn image_size(path: &Path, limits: &ImageLimits) -> Result<[u32; 2], String> {
    let (file, meta) = open_regular(path).map_err(|error| error.to_string())?;
    header_size(BufReader::new(file), meta.len(), limits).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::{ScanKind, UnitOrigin, image_size, scan_extent};
    use mocban_core::domain::LengthUnit;
    use mocban_core::mesh::{MeshExtent, MeshLimits};
    use mocban_core::raster::ImageLimits;

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
}
