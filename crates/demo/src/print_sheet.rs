//! The sheet that is printed on: colour, texture and stains.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draw::{one_of, within};
use super::kind::{DemoKind, NumberRange};
use super::noise::{Noise, lerp, smoothstep};

/// What stains of an ordinary sheet leave of red, green and blue: they are brown and absorb blue most.
const BROWN: [f64; 3] = [1.0, 0.94, 0.82];
/// Range of what stains of a coloured sheet leave of red, green and blue.
const STAIN_HUE: NumberRange = [0.7, 1.0];
/// Range of the brightness of a coloured sheet minus that of its ink, of 255.
const CONTRAST: NumberRange = [-6.0, 24.0];
/// Weights of red, green and blue in the brightness.
const BRIGHTNESS: [f64; 3] = [0.299, 0.587, 0.114];

/// A sheet of old paper.
pub(super) struct PrintSheet {
    colour: [f64; 3],
    slope: [f64; 2],
    clouds: Noise,
    fibres: Noise,
    grain: Noise,
    stains: Vec<Stain>,
    /// What the stains leave of red, green and blue.
    stain_hue: [f64; 3],
}

/// A stain with a ragged edge.
struct Stain {
    centre: [f64; 2],
    radius_mm: f64,
    min_transmittance: f64,
    edge_noise: Noise,
}

/// Colours of coloured ink on a coloured sheet, 0..=255.
pub(super) struct ColouredPrint {
    pub sheet: [f64; 3],
    pub ink: [f64; 3],
}

impl ColouredPrint {
    /// Draws the colours of a kind. Returns `None` and draws no random numbers if the kind has none.
    pub(super) fn draw(kind: Option<&DemoKind>, rng: &mut ChaCha8Rng) -> Option<Self> {
        let colours = kind?.colours;
        if colours.is_empty() {
            return None;
        }
        let of = one_of(colours, rng);
        let brightness =
            |colour: [f64; 3]| -> f64 { (0..3).map(|i| BRIGHTNESS[i] * colour[i]).sum() };
        let sheet = of.sheet.map(|c: f64| c + rng.random_range(-12.0..12.0));
        let lighter = brightness(sheet) - within(CONTRAST, rng) - brightness(of.ink);
        Some(Self {
            sheet,
            ink: of.ink.map(|c| c + lighter),
        })
    }
}

impl PrintSheet {
    /// Draws a yellowish, bluish or greyish sheet. Its stains lie within `half_mm` of the centre.
    pub(super) fn draw(stains: u32, half_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        let base = match rng.random_range(0..10_u32) {
            0..=5 => [228.0, 210.0, 172.0],
            6..=7 => [196.0, 208.0, 216.0],
            _ => [222.0, 220.0, 212.0],
        };
        let light = rng.random_range(-18.0..14.0);
        Self {
            colour: base.map(|c: f64| c + light + rng.random_range(-6.0..6.0)),
            slope: [0; 2].map(|_: i32| rng.random_range(-1.6..1.6)),
            clouds: Noise::draw(rng),
            fibres: Noise::draw(rng),
            grain: Noise::draw(rng),
            stains: (0..stains).map(|_| Stain::draw(half_mm, rng)).collect(),
            stain_hue: BROWN,
        }
    }

    /// Returns the sheet in another colour, with up to two stains of any colour.
    pub(super) fn coloured(self, colour: [f64; 3], half_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        let stain_hue = [0; 3].map(|_: i32| within(STAIN_HUE, rng));
        let stains = (0..rng.random_range(0..3_u32)).map(|_| Stain::draw(half_mm, rng));
        Self {
            stains: stains.collect(),
            stain_hue,
            colour,
            ..self
        }
    }

    /// Returns the colour at a point, 0..=255 per channel.
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let shade = self.slope[0] * u
            + self.slope[1] * v
            + 5.0 * self.clouds.two_octaves(u / 3.0, v / 3.0)
            + 5.0 * self.fibres.at(u / 0.9, v / 0.09)
            + 4.0 * self.grain.at(u / 0.1, v / 0.1);
        let stained: f64 = self
            .stains
            .iter()
            .map(|stain| stain.transmittance([u, v]))
            .product();
        let hues = self
            .stain_hue
            .map(|hue| lerp(hue, 1.0, smoothstep(0.6, 1.0, stained)));
        [0, 1, 2].map(|i| (self.colour[i] + shade) * hues[i] * stained)
    }
}

impl Stain {
    fn draw(half_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            centre: [0; 2].map(|_: i32| rng.random_range(-half_mm..half_mm)),
            radius_mm: rng.random_range(1.0..3.5),
            min_transmittance: rng.random_range(0.68..0.88),
            edge_noise: Noise::draw(rng),
        }
    }

    /// Returns the fraction of reflected light, 0..=1.
    fn transmittance(&self, [u, v]: [f64; 2]) -> f64 {
        let distance = (u - self.centre[0]).hypot(v - self.centre[1]);
        let rim = self.radius_mm + 0.6 * self.edge_noise.two_octaves(u / 1.1, v / 1.1);
        lerp(
            self.min_transmittance,
            1.0,
            smoothstep(rim - 0.5, rim, distance),
        )
    }
}
