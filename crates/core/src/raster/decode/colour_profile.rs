//! Converts colours from the ICC profile of a file to sRGB.

use moxcms::{ColorProfile, DataColorSpace, Layout, ProfileText, ToneReprCurve, TransformOptions};

use super::light_curve::srgb_level;
use crate::domain::cancel::poll;
use crate::domain::sanitize;
use crate::raster::{Colours, Grid};

/// Largest difference of a colour from the same numbers in sRGB that is not worth a conversion: three levels of 255. The
/// profiles that programs call sRGB differ by one or two.
const TOLERANCE: f64 = 3.0 / 255.0;

/// Levels of red, green and blue for which a profile is compared with sRGB.
const PROBES: [f32; 5] = [0.0, 0.12, 0.35, 0.67, 1.0];

/// The ICC profile of a file.
pub(super) struct FileProfile {
    /// Bytes of the profile; empty if the file does not have all of them.
    pub(super) bytes: Vec<u8>,
    /// Whether the pixels are stored as inks, such as CMYK. They are decoded to RGB without a profile.
    pub(super) is_of_inks: bool,
}

impl FileProfile {
    /// Converts all decoded colours to sRGB.
    ///
    /// # Errors
    /// Returns the name of a profile that cannot be read or applied, or is for colours of another kind.
    pub(super) fn apply(&self, rgb: &mut Colours) -> Result<(), String> {
        if self.is_of_inks {
            return Err(with_colours(&read(&self.bytes)?, &self.bytes));
        }
        apply(&self.bytes, rgb)
    }
}

fn read(bytes: &[u8]) -> Result<ColorProfile, String> {
    let profile = ColorProfile::new_from_slice(bytes).ok();
    profile.ok_or_else(|| "an ICC profile that cannot be read".to_owned())
}

/// Returns the name of a profile and the kind of its colours.
fn with_colours(profile: &ColorProfile, bytes: &[u8]) -> String {
    let space = bytes.get(16..20).unwrap_or_default();
    let space = sanitize(String::from_utf8_lossy(space).trim_end(), 4);
    format!("{}, for {space} colours", name(profile))
}

/// Converts all colours from a profile to sRGB. Does nothing if the profile nearly is sRGB.
///
/// # Errors
/// Returns the name of a profile that cannot be read or applied, or is for colours of another kind than the image has.
fn apply(bytes: &[u8], rgb: &mut Colours) -> Result<(), String> {
    let profile = read(bytes)?;
    let layout = match profile.color_space {
        DataColorSpace::Rgb => Layout::Rgb,
        DataColorSpace::Gray if rgb.is_grey() => Layout::Gray,
        _ => return Err(with_colours(&profile, bytes)),
    };
    if is_nearly_srgb(&profile, layout) {
        return Ok(());
    }
    let converted = rgb.change(|rgb| convert(&profile, layout, rgb));
    converted.ok_or_else(|| name(&profile))
}

/// Returns whether colours hardly change. A profile of tables, and one that cannot be applied, is no such profile.
///
/// Computes a few colours as the profile defines them, because the tables of a conversion take longer than the decoding
/// of a small image.
fn is_nearly_srgb(profile: &ColorProfile, layout: Layout) -> bool {
    if profile.pcs != DataColorSpace::Xyz {
        return false;
    }
    let lights = |curve: &Option<ToneReprCurve>| {
        let curve = curve.as_ref()?.make_linear_evaluator().ok()?;
        Some(PROBES.map(|level| f64::from(curve.evaluate_value(level))))
    };
    if layout == Layout::Gray {
        let greys = lights(&profile.gray_trc);
        return greys.is_some_and(|greys| {
            let mut pairs = greys.into_iter().zip(PROBES);
            pairs.all(|(light, level)| is_level(light, level))
        });
    }
    let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc];
    let [Some(reds), Some(greens), Some(blues)] = curves.map(lights) else {
        return false;
    };
    let srgb_from_profile = profile.transform_matrix(&ColorProfile::new_srgb()).v;
    let count = PROBES.len();
    (0..count.pow(3)).all(|at| {
        let at = [at % count, at / count % count, at / count / count];
        let light = [reds[at[0]], greens[at[1]], blues[at[2]]];
        let rows = srgb_from_profile.iter().zip(at);
        rows.into_iter().all(|(row, at)| {
            let sum = row.iter().zip(light).map(|(a, b)| a * b).sum();
            is_level(sum, PROBES[at])
        })
    })
}

/// Returns whether a light has nearly a level in sRGB.
fn is_level(light: f64, level: f32) -> bool {
    let found = srgb_level(light);
    (found - f64::from(level)).abs() <= TOLERANCE
}

/// Converts all colours. Returns `None` if the profile cannot be applied.
fn convert(profile: &ColorProfile, layout: Layout, rgb: &mut Grid<[u16; 3]>) -> Option<()> {
    let srgb = ColorProfile::new_srgb();
    let options = TransformOptions::default();
    let transform = profile.create_transform_16bit(layout, &srgb, Layout::Rgb, options);
    let transform = transform.ok()?;
    let width = rgb.width();
    let mut from = Vec::with_capacity(3 * width);
    for row in rgb.data_mut().chunks_exact_mut(width) {
        poll();
        from.clear();
        match layout {
            Layout::Gray => from.extend(row.iter().map(|[grey, ..]| *grey)),
            _ => from.extend_from_slice(row.as_flattened()),
        }
        transform.transform(&from, row.as_flattened_mut()).ok()?;
    }
    Some(())
}

/// Returns the name of a profile for messages.
fn name(profile: &ColorProfile) -> String {
    let name = match &profile.description {
        Some(ProfileText::PlainString(text)) => text,
        Some(ProfileText::Localizable(texts)) if !texts.is_empty() => &texts[0].value,
        Some(ProfileText::Description(text)) => &text.ascii_string,
        _ => "without a name",
    };
    sanitize(name, 80)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{FileProfile, apply};
    use crate::raster::test_profiles::TestProfile;
    use crate::raster::{Colours, Grid};

    /// Returns inks and papers of all kinds.
    fn picture() -> Grid<[u16; 3]> {
        Grid::from_fn(64, 64, |x, y| {
            let (x, y) = (x as u16 * 1040, y as u16 * 1040);
            [x, x / 2 + y / 2, y / 4 + x / 8 * 6]
        })
    }

    fn grey(picture: &Grid<[u16; 3]>) -> Grid<[u16; 3]> {
        picture.map(|[_, g, _]| [*g; 3])
    }

    fn most_different(a: &Grid<[u16; 3]>, b: &Grid<[u16; 3]>) -> u16 {
        let levels = a.data().as_flattened().iter().zip(b.data().as_flattened());
        levels.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
    }

    #[test]
    fn colours_in_a_profile_become_those_of_the_srgb_twin() {
        for profile in [
            TestProfile::GREY,
            TestProfile::LINEAR_GREY,
            TestProfile::ADOBE,
            TestProfile::WIDE,
        ] {
            let is_grey = [TestProfile::GREY, TestProfile::LINEAR_GREY].contains(&profile);
            let wanted = if is_grey { grey(&picture()) } else { picture() };
            let mut image = Colours::from(profile.twin(&wanted));
            let before = most_different(&image.to_rgb16(), &wanted);
            assert_eq!(apply(&profile.icc(), &mut image), Ok(()));
            let after = most_different(&image.to_rgb16(), &wanted);
            assert!(
                before > 3000 && after < 400,
                "{profile:?}: {before}, {after}"
            );
        }
    }

    #[test]
    fn an_image_in_srgb_stays() {
        let srgb = moxcms::ColorProfile::new_srgb().encode().expect("encodes");
        let mut image = Colours::from(picture());
        assert_eq!(apply(&srgb, &mut image), Ok(()));
        assert_eq!(image, picture().into());
    }

    #[test]
    fn a_profile_for_colours_of_another_kind_is_named_with_them() {
        let of_space = |space: &[u8; 4]| {
            let mut profile = TestProfile::WIDE.icc();
            profile[16..20].copy_from_slice(space);
            profile
        };
        for (profile, named) in [
            (of_space(b"Lab "), "test, for Lab colours"),
            (of_space(b"CMYK"), "test, for CMYK colours"),
            (of_space(b"XYZ "), "test, for XYZ colours"),
            (TestProfile::GREY.icc(), "test, for GRAY colours"),
        ] {
            let mut image = Colours::from(picture());
            assert_eq!(apply(&profile, &mut image), Err(named.to_owned()));
            assert_eq!(image, picture().into());
        }
    }

    #[test]
    fn a_profile_of_inks_is_named_whatever_its_colours() {
        let of_inks = |bytes: Vec<u8>| FileProfile {
            bytes,
            is_of_inks: true,
        };
        let mut of_cmyk = TestProfile::WIDE.icc();
        of_cmyk[16..20].copy_from_slice(b"CMYK");
        for (bytes, named) in [
            (of_cmyk, "test, for CMYK colours"),
            (TestProfile::WIDE.icc(), "test, for RGB colours"),
            (Vec::new(), "an ICC profile that cannot be read"),
        ] {
            let mut image = Colours::from(picture());
            assert_eq!(of_inks(bytes).apply(&mut image), Err(named.to_owned()));
            assert_eq!(image, picture().into());
        }
    }

    #[test]
    fn a_profile_that_cannot_be_applied_is_named() {
        let mut image = Colours::from(picture());
        let named = apply(b"no profile", &mut image);
        assert_eq!(named, Err("an ICC profile that cannot be read".to_owned()));
        let mut without_curves = TestProfile::ADOBE.icc();
        for at in 0..without_curves.len() - 4 {
            if without_curves[at + 1..at + 4] == *b"TRC" {
                without_curves[at + 1] = b'x';
            }
        }
        assert_eq!(apply(&without_curves, &mut image), Err("test".to_owned()));
        assert_eq!(image, picture().into());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn changed_bytes_of_a_profile_never_panic(
            profile in prop::sample::select(vec![TestProfile::WIDE, TestProfile::GREY]),
            flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        ) {
            let mut bytes = profile.icc();
            for (at, value) in flips {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            let mut image = Colours::from(Grid::new(3, 2, [9999; 3]));
            // Either the colours are converted, or the profile is named.
            let _ = apply(&bytes, &mut image);
        }
    }
}
