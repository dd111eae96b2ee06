//! The decoded print image: colours on white.

use image::DynamicImage;

use crate::domain::cancel::poll;
use crate::raster::{Colours, Grid};

/// A print with what its file says about its colours.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintImage {
    /// Colour of each pixel; a transparent pixel is white.
    pub rgb: Colours,
    /// EXIF orientation of the file (2 to 8), if its pixels were turned to make the image upright.
    pub turned: Option<u8>,
    /// Name of the colour profile of the file, if it could not be applied.
    pub ignored_profile: Option<String>,
}

impl PrintImage {
    /// Returns a warning if the colours may differ from what the file means.
    pub fn profile_warning(&self) -> Option<String> {
        self.ignored_profile.as_deref().map(profile_warning)
    }
}

/// Returns the warning about an image whose colour profile could not be applied.
pub fn profile_warning(profile: &str) -> String {
    format!(
        "the image's colour profile ({profile}) cannot be applied, so its colours are read as sRGB; if they look wrong, \
         convert the image to sRGB"
    )
}

impl From<Grid<[u16; 3]>> for PrintImage {
    fn from(rgb: Grid<[u16; 3]>) -> Self {
        Colours::from(rgb).into()
    }
}

impl From<Colours> for PrintImage {
    fn from(rgb: Colours) -> Self {
        Self {
            rgb,
            turned: None,
            ignored_profile: None,
        }
    }
}

/// Composites a colour with the alpha `a` on white: `(c a + 65535 (65535 - a)) / 65535`, rounded.
pub(super) fn on_white([c @ .., a]: [u16; 4]) -> [u16; 3] {
    const FULL: u64 = u16::MAX as u64;
    let a = u64::from(a);
    c.map(|c| ((u64::from(c) * a + FULL * (FULL - a) + FULL / 2) / FULL) as u16)
}

/// Rows that are converted between two polls for a cancellation.
const BAND_ROWS: u32 = 16;

/// Returns the colours of a decoded image, composited on white.
pub(super) fn colours_on_white(image: DynamicImage) -> Colours {
    let size = [image.width() as usize, image.height() as usize];
    let narrow = |channels, samples| {
        let colours = Colours::of_samples(size, channels, samples);
        colours.expect("samples for each pixel")
    };
    match image {
        DynamicImage::ImageLuma8(image) => narrow(1, image.into_raw()),
        DynamicImage::ImageRgb8(image) => narrow(3, image.into_raw()),
        // The cost of a copy does not matter for other kinds (16 bits, transparency), which are rare.
        other => {
            let mut colours = Vec::with_capacity(size[0] * size[1]);
            for top in (0..other.height()).step_by(BAND_ROWS as usize) {
                poll();
                let rows = BAND_ROWS.min(other.height() - top);
                let band = other.crop_imm(0, top, other.width(), rows).to_rgba16();
                colours.extend(band.pixels().map(|p| on_white(p.0)));
            }
            let colours = Grid::from_vec(size[0], size[1], colours);
            colours.expect("one colour for each pixel").into()
        }
    }
}

/// Scales the colours of an image of 16 bits if none needs more than 12 of them: cameras of 10 and 12 bits store their
/// numbers without scaling, and the paper of a print is never as dark as a sixteenth of white. If white was stored as 0, the
/// numbers are those of the ink, which takes more than a sixteenth of the light.
pub(super) fn widen_narrow(rgb: &mut Grid<[u16; 3]>, is_inverted: bool) {
    const TEN_BITS: u16 = (1 << 10) - 1;
    const TWELVE_BITS: u16 = (1 << 12) - 1;
    let flip = if is_inverted { u16::MAX } else { 0 };
    let mut most = 0;
    for row in 0..rgb.height() {
        most = rgb
            .row(row)
            .as_flattened()
            .iter()
            .fold(most, |most, c| most.max(*c ^ flip));
        if most > TWELVE_BITS {
            return;
        }
    }
    let white = if most > TEN_BITS {
        TWELVE_BITS
    } else {
        TEN_BITS
    };
    let scale = |level: u16| {
        let scaled = u32::from(level ^ flip) * u32::from(u16::MAX) / u32::from(white);
        scaled as u16 ^ flip
    };
    *rgb = rgb.map(|colour| colour.map(scale));
}
