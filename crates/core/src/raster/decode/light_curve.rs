//! Converts levels to sRGB if a file without a profile states how its levels stand for light.

use super::png_chunks::png_colour_chunk;
use crate::domain::cancel::poll;
use crate::raster::Colours;

/// The power of light that programs state for sRGB, and the largest difference from it that is not worth a conversion.
const USUAL_GAMMA: f64 = 1.0 / 2.2;
const GAMMA_TOLERANCE: f64 = 0.02;
/// Largest difference of a level from that of sRGB, or of the usual gamma, that is not worth a conversion: three of 255.
const LEVEL_TOLERANCE: f64 = 3.0 / 255.0;

/// How the levels of a file stand for light.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum LightCurve {
    /// A level is the light to this power.
    Gamma(f64),
    /// The light of evenly spaced levels, 0 to 65535: one table for all colours, or one each for red, green and blue.
    Tables(Vec<Vec<u16>>),
    /// In a way that is not applied, with its name.
    Unread(String),
}

impl LightCurve {
    /// Returns the curve of a PNG without an ICC profile; `None` for sRGB.
    pub(super) fn of_png(bytes: &[u8]) -> Option<Self> {
        if let Some(&[primaries, transfer, _, full_range]) = png_colour_chunk(bytes, *b"cICP") {
            return match (primaries, transfer, full_range) {
                // The primaries of sRGB or unspecified ones, with the curve of sRGB or of television.
                (1 | 2, 1 | 2 | 6 | 13..=15, 1) => None,
                (1 | 2, 4, 1) => Some(Self::Gamma(USUAL_GAMMA)),
                (1 | 2, 5, 1) => Some(Self::Gamma(1.0 / 2.8)),
                (1 | 2, 8, 1) => Some(Self::Gamma(1.0)),
                _ => Some(Self::Unread(format!("cICP {primaries}/{transfer}"))),
            };
        }
        if png_colour_chunk(bytes, *b"sRGB").is_some() {
            return None;
        }
        let stored = png_colour_chunk(bytes, *b"gAMA")?.first_chunk()?;
        let gamma = f64::from(u32::from_be_bytes(*stored)) / 100_000.0;
        (gamma > 0.0).then_some(Self::Gamma(gamma))
    }

    /// Converts all colours to sRGB. Does nothing if they nearly are.
    ///
    /// # Errors
    /// Returns the name of what is not applied.
    pub(super) fn apply(&self, rgb: &mut Colours) -> Result<(), String> {
        let levels: Vec<Vec<u16>> = match self {
            Self::Unread(name) => return Err(name.clone()),
            Self::Gamma(gamma) if (gamma - USUAL_GAMMA).abs() < GAMMA_TOLERANCE => return Ok(()),
            Self::Gamma(gamma) => vec![levels(|level| level.powf(1.0 / gamma))],
            Self::Tables(tables) if tables.iter().all(|table| is_usual(table)) => return Ok(()),
            Self::Tables(tables) => {
                let tables = tables.iter();
                tables
                    .map(|table| levels(|level| light(table, level)))
                    .collect()
            }
        };
        let [red, green, blue] = [0, 1, 2].map(|colour| levels.get(colour).unwrap_or(&levels[0]));
        rgb.change(|rgb| {
            let width = rgb.width();
            for row in rgb.data_mut().chunks_exact_mut(width) {
                poll();
                for [r, g, b] in row {
                    *r = red[usize::from(*r)];
                    *g = green[usize::from(*g)];
                    *b = blue[usize::from(*b)];
                }
            }
        });
        Ok(())
    }
}

/// Returns the level of sRGB, 0 to 65535, for each level of a file. `light` maps a level to its light, both 0 to 1.
fn levels(light: impl Fn(f64) -> f64) -> Vec<u16> {
    let full = f64::from(u16::MAX);
    let of = |level: u16| (srgb_level(light(f64::from(level) / full)) * full).round() as u16;
    (0..=u16::MAX).map(of).collect()
}

/// Returns the light of a level by a table.
fn light(table: &[u16], level: f64) -> f64 {
    let place = level * (table.len() - 1) as f64;
    let at = (place as usize).min(table.len() - 1);
    let [low, high] = [at, (at + 1).min(table.len() - 1)].map(|at| f64::from(table[at]));
    (low + (high - low) * (place - at as f64)) / f64::from(u16::MAX)
}

/// Returns whether a table is nearly that of sRGB or of the usual gamma.
fn is_usual(table: &[u16]) -> bool {
    let probes = || (0..=16).map(|at| f64::from(at) / 16.0);
    let is_close = |level: f64, found: f64| (level - found).abs() <= LEVEL_TOLERANCE;
    let is_srgb = probes().all(|level| is_close(level, srgb_level(light(table, level))));
    is_srgb || probes().all(|level| is_close(level, light(table, level).powf(USUAL_GAMMA)))
}

/// Returns the level of sRGB that stands for a light.
pub(super) fn srgb_level(light: f64) -> f64 {
    let light = light.clamp(0.0, 1.0);
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::{LightCurve, srgb_level};
    use crate::raster::test_images::encoded_chunk;
    use crate::raster::{Colours, Grid, ImageLimits, PrintImage, decode, png_rgb8};

    /// Returns a PNG of one row with chunks before its pixels.
    fn png(levels: &[u8], chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let row = Grid::from_fn(levels.len(), 1, |x, _| [levels[x]; 3]);
        let plain = png_rgb8(&row);
        let mut bytes = plain[..33].to_vec();
        for (kind, content) in chunks {
            bytes.extend(encoded_chunk(**kind, content));
        }
        bytes.extend(&plain[33..]);
        bytes
    }

    const LEVELS: [u8; 5] = [0, 30, 100, 200, 255];

    fn read(chunks: &[(&[u8; 4], &[u8])]) -> PrintImage {
        decode(&png(&LEVELS, chunks), &ImageLimits::SUGGESTED).expect("decodes")
    }

    /// Returns the colours of the levels if light is the level to a power.
    fn with_power(power: f64) -> Colours {
        let level = |at: usize, _| {
            let light = (f64::from(LEVELS[at]) / 255.0).powf(power);
            [(srgb_level(light) * 65535.0).round() as u16; 3]
        };
        Grid::from_fn(LEVELS.len(), 1, level).into()
    }

    #[test]
    fn a_gamma_is_applied_unless_the_file_says_that_it_is_srgb() {
        let plain = read(&[]);
        assert_eq!(plain.rgb.at(1, 0), [30 * 257; 3]);
        let linear = &100_000_u32.to_be_bytes()[..];
        assert_eq!(read(&[(b"gAMA", linear)]).rgb, with_power(1.0));
        let mac = &55_556_u32.to_be_bytes()[..];
        let found = read(&[(b"gAMA", mac)]);
        assert_eq!(found.rgb, with_power(100_000.0 / 55_556.0));
        assert_eq!(found.ignored_profile, None);
        let usual = &45_455_u32.to_be_bytes()[..];
        for chunks in [
            &[(b"gAMA", usual)][..],
            &[(b"gAMA", &[0; 4][..])],
            &[(b"sRGB", &[0][..]), (b"gAMA", linear)],
            &[(b"cICP", &[1, 13, 0, 1][..]), (b"gAMA", linear)],
        ] {
            assert_eq!(read(chunks), plain);
        }
    }

    #[test]
    fn what_colours_mean_counts_only_before_the_palette_and_the_pixels() {
        let plain = read(&[]);
        let colours = [
            encoded_chunk(*b"gAMA", &100_000_u32.to_be_bytes()),
            encoded_chunk(*b"cICP", &[1, 8, 0, 1]),
            encoded_chunk(*b"iCCP", b"name\0\0no profile"),
        ];
        // The last chunk ends the file.
        let bytes = png(&LEVELS, &[]);
        let (pixels, end) = bytes.split_at(bytes.len() - 12);
        let palette = encoded_chunk(*b"PLTE", &[9; 6]);
        let (head, rest) = bytes.split_at(33);
        for chunk in &colours {
            for misplaced in [
                [pixels, chunk, end].concat(),
                [head, &palette, chunk, rest].concat(),
            ] {
                let found = decode(&misplaced, &ImageLimits::SUGGESTED).expect("decodes");
                assert_eq!(found, plain);
            }
            let placed = [head, chunk, rest].concat();
            let found = decode(&placed, &ImageLimits::SUGGESTED).expect("decodes");
            assert_ne!(found, plain);
        }
    }

    #[test]
    fn code_points_are_applied_or_named() {
        let found = read(&[(b"cICP", &[1, 8, 0, 1][..])]);
        assert_eq!(found.rgb, with_power(1.0));
        for (points, name) in [
            ([9, 16, 0, 1], "cICP 9/16"),
            ([12, 13, 0, 1], "cICP 12/13"),
            ([1, 13, 0, 0], "cICP 1/13"),
        ] {
            let found = read(&[(b"cICP", &points[..])]);
            assert_eq!(found.ignored_profile.as_deref(), Some(name));
            assert_eq!(found.rgb, read(&[]).rgb);
        }
    }

    #[test]
    fn tables_of_light_are_applied_to_their_colours() {
        let table = |power: f64| -> Vec<u16> {
            let light = |at: u32| (f64::from(at) / 255.0).powf(power) * 65535.0;
            (0..256).map(|at| light(at).round() as u16).collect()
        };
        let picture = Colours::from(Grid::from_fn(256, 1, |x, _| [x as u16 * 257; 3]));
        let applied = |tables: Vec<Vec<u16>>| {
            let mut image = picture.clone();
            LightCurve::Tables(tables)
                .apply(&mut image)
                .expect("applied");
            image
        };
        assert_eq!(applied(vec![table(2.2)]), picture);
        let linear = applied(vec![table(1.0)]);
        let mixed = applied(vec![table(2.2), table(1.0), table(2.2)]);
        for x in [0, 1, 77, 200, 255] {
            let wanted = srgb_level(x as f64 / 255.0) * 65535.0;
            let [r, g, b] = linear.at(x, 0);
            assert!(
                [r, g, b]
                    .iter()
                    .all(|c| (f64::from(*c) - wanted).abs() < 2.0)
            );
            assert_eq!(mixed.at(x, 0)[1], g);
        }
    }
}
