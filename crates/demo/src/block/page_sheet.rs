//! The sheet of a page, the scanner's bed around it, and the light.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::noise::{Noise, lerp, smoothstep};
use crate::polygon::BoundsMm;

/// A sheet of old paper with its surroundings.
#[derive(Debug, Clone)]
pub(super) struct PageSheet {
    /// Edges of the sheet, mm.
    pub area: BoundsMm,
    colour: [f64; 3],
    bed: f64,
    clouds: Noise,
    shades: Noise,
    fibres: Noise,
    grain: Noise,
    edge: Noise,
    stains: Vec<WaterStain>,
    /// Change of brightness over 100 mm along u and v.
    light: [f64; 2],
    /// u of the gutter of an opened book, mm.
    gutter_u: Option<f64>,
}

/// A stain with a darker rim.
#[derive(Debug, Clone, Copy)]
struct WaterStain {
    centre: [f64; 2],
    radius_mm: f64,
    darkness: f64,
    rim: f64,
    edge: Noise,
}

impl PageSheet {
    /// Draws a sheet that covers `area`.
    pub(super) fn draw(area: BoundsMm, gutter_u: Option<f64>, rng: &mut ChaCha8Rng) -> Self {
        let base = match rng.random_range(0..10_u32) {
            0..=6 => [226.0, 209.0, 174.0],
            7 => [200.0, 207.0, 210.0],
            _ => [224.0, 221.0, 212.0],
        };
        let light = rng.random_range(-16.0..14.0);
        let stains = rng.random_range(0..7_usize);
        Self {
            area,
            colour: base.map(|c: f64| c + light + rng.random_range(-6.0..6.0)),
            bed: if rng.random_bool(0.6) {
                rng.random_range(10.0..48.0)
            } else {
                rng.random_range(228.0..252.0)
            },
            clouds: Noise::draw(rng),
            shades: Noise::draw(rng),
            fibres: Noise::draw(rng),
            grain: Noise::draw(rng),
            edge: Noise::draw(rng),
            stains: (0..stains).map(|_| WaterStain::draw(area, rng)).collect(),
            light: [0; 2].map(|_: i32| rng.random_range(-0.04..0.04)),
            gutter_u,
        }
    }

    /// Returns the colour of the sheet or the bed at a point, 0..=255 per channel, and the fraction of the point that
    /// the sheet covers.
    pub(super) fn at(&self, point: [f64; 2], px_mm: f64) -> ([f64; 3], f64) {
        let cover = self.cover(point, px_mm);
        let [u, v] = point;
        let grain = self.grain.at(u / 0.16, v / 0.16);
        let bed = (self.bed + 2.5 * grain).clamp(0.0, 255.0);
        if cover <= 0.0 {
            return ([bed; 3], 0.0);
        }
        let shade = 7.0 * self.shades.two_octaves(u / 55.0, v / 55.0)
            + 4.0 * self.clouds.two_octaves(u / 4.0, v / 4.0)
            + 4.5 * self.fibres.at(u / 2.2, v / 0.22)
            + 3.5 * grain;
        let mut transmitted = 1.0 + self.light[0] * u / 100.0 + self.light[1] * v / 100.0;
        if let Some(gutter) = self.gutter_u {
            let share = (u - gutter) / 7.0;
            transmitted *= 1.0 - 0.55 * (-share * share).exp();
        }
        let stained: f64 = self.stains.iter().map(|stain| stain.at(point)).product();
        // Stains are brown: they absorb blue most.
        let hues = [1.0, 0.96, 0.88].map(|hue| lerp(hue, 1.0, smoothstep(0.6, 1.0, stained)));
        let sheet = [0, 1, 2].map(|i| (self.colour[i] + shade) * hues[i] * stained * transmitted);
        (sheet.map(|c| lerp(bed, c, cover)), cover)
    }

    /// Returns the fraction of a pixel that the sheet covers. The edges are slightly ragged.
    fn cover(&self, [u, v]: [f64; 2], px_mm: f64) -> f64 {
        let from_edge = (u - self.area.min[0])
            .min(self.area.max[0] - u)
            .min(v - self.area.min[1])
            .min(self.area.max[1] - v);
        if from_edge > 2.0 {
            return 1.0;
        }
        let ragged = 0.25 * self.edge.two_octaves(u / 6.0, v / 6.0);
        (0.5 + (from_edge - 0.5 + ragged) / px_mm).clamp(0.0, 1.0)
    }
}

impl WaterStain {
    fn draw(area: BoundsMm, rng: &mut ChaCha8Rng) -> Self {
        Self {
            centre: [0, 1].map(|i| rng.random_range(area.min[i]..area.max[i])),
            radius_mm: 2.0 * 20.0_f64.powf(rng.random()),
            darkness: rng.random_range(0.04..0.25),
            rim: rng.random_range(0.0..0.12),
            edge: Noise::draw(rng),
        }
    }

    /// Returns the fraction of reflected light, 0..=1.
    fn at(&self, [u, v]: [f64; 2]) -> f64 {
        let [du, dv] = [u - self.centre[0], v - self.centre[1]];
        let reach = 1.6 * self.radius_mm + 4.0;
        if du * du + dv * dv > reach * reach {
            return 1.0;
        }
        let size = 0.6 * self.radius_mm;
        let rough = 0.3 * self.radius_mm * self.edge.two_octaves(du / size, dv / size);
        let inside = self.radius_mm + rough - du.hypot(dv);
        let body = self.darkness * smoothstep(-0.8, 0.8, inside);
        let share = inside / 1.2;
        1.0 - body - self.rim * (-share * share).exp()
    }
}
