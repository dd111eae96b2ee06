//! How the ink took: where it spread, where it missed, what fell beside it.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::field::Field;
use super::noise::{Noise, mix, ramp};
use super::tier::Tier;

/// How much ink the printer used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Load {
    Fair,
    Heavy,
    Faint,
}

/// One inking of a block.
pub(super) struct Inking {
    /// Signed distance to what prints, corners filled as ink fills them, mm.
    printed: Field,
    spread_mm: f64,
    spread: Noise,
    rim: Noise,
    strength: f64,
    blotches: Noise,
    dryness: f64,
    dry_patches: Noise,
    bristles: Noise,
    gaps: Vec<Spot>,
    specks: Vec<Spot>,
}

/// A small ellipse of ink, or of none.
struct Spot {
    centre: [f64; 2],
    axis: [f64; 2],
    long_mm: f64,
    short_mm: f64,
}

impl Inking {
    /// Inks the strokes and what stands around them.
    pub(super) fn draw(strokes: &Field, around: &Field, tier: Tier, rng: &mut ChaCha8Rng) -> Self {
        let load = draw_load(tier, rng);
        let union = Field::from_fn(strokes.frame, |_, x, y| {
            strokes.at(x, y).max(around.at(x, y))
        });
        let gap_count = rng.random_range(0..if tier.is_damaged() { 9 } else { 5 });
        let gaps = (0..gap_count)
            .filter_map(|_| Spot::gap(strokes, rng))
            .collect();
        let speck_count = rng.random_range(4..if tier.is_damaged() { 45 } else { 22 });
        let specks = (0..speck_count)
            .map(|_| Spot::speck(strokes, rng))
            .collect();
        Self {
            printed: filled_corners(&union),
            spread_mm: match load {
                Load::Fair => rng.random_range(0.0..0.05),
                Load::Heavy => rng.random_range(0.08..0.16),
                Load::Faint => rng.random_range(-0.03..0.02),
            },
            spread: Noise::draw(rng),
            rim: Noise::draw(rng),
            strength: match load {
                Load::Fair => rng.random_range(0.80..0.97),
                Load::Heavy => rng.random_range(0.93..0.99),
                Load::Faint => rng.random_range(0.45..0.68),
            },
            blotches: Noise::draw(rng),
            dryness: match load {
                Load::Fair => rng.random_range(0.1..0.8),
                Load::Heavy => 0.0,
                Load::Faint => rng.random_range(0.6..1.0),
            },
            dry_patches: Noise::draw(rng),
            bristles: Noise::draw(rng),
            gaps,
            specks,
        }
    }

    /// Ink on the paper at a point, 0..=1, seen through a pixel of `px_mm`.
    pub(super) fn at(&self, point: [f64; 2], px_mm: f64) -> f64 {
        let [u, v] = point;
        let spread = self.spread_mm
            + 0.03 * self.spread.at(u / 1.4, v / 1.4)
            + 0.022 * self.rim.rough(u / 0.16, v / 0.16);
        let cover = |inside_mm: f64| (0.5 + inside_mm / (1.4 * px_mm)).clamp(0.0, 1.0);
        let stroke = cover(self.printed.value(point) + spread) * (1.0 - self.gap(point, px_mm));
        let speck = self.specks.iter().map(|spot| cover(spot.inside_mm(point)));
        let blotch = 1.0 - 0.12 * (1.0 + self.blotches.rough(u / 0.7, v / 0.7)).max(0.0);
        self.strength * (stroke * blotch.min(1.0)).max(0.8 * speck.fold(0.0, f64::max))
    }

    /// Share of the ink that is missing inside a stroke: dry patches and breaks.
    fn gap(&self, point: [f64; 2], px_mm: f64) -> f64 {
        let [u, v] = point;
        let dry = self.dryness * ramp(0.0, 0.8, self.dry_patches.at(u / 2.4, v / 2.4));
        let bristle = self.bristles.rough(u / 0.2, v / 0.2);
        let edge = mix(1.4, 0.15, dry);
        let patchy = 0.85 * ramp(edge, edge + 0.45, bristle);
        let rag_mm = 0.05 * bristle;
        let broken = self
            .gaps
            .iter()
            .map(|spot| (0.5 + (spot.inside_mm(point) + rag_mm) / (1.4 * px_mm)).clamp(0.0, 0.9));
        broken.fold(patchy, f64::max)
    }
}

/// Too much or too little ink is a matter of the hard tier.
fn draw_load(tier: Tier, rng: &mut ChaCha8Rng) -> Load {
    let share: f64 = rng.random();
    if !tier.is_damaged() {
        Load::Fair
    } else if share < 0.35 {
        Load::Heavy
    } else if share < 0.7 {
        Load::Faint
    } else {
        Load::Fair
    }
}

/// Distances bent towards what a blurred mask says, which fills notches and rounds corners.
fn filled_corners(printed: &Field) -> Field {
    const REACH_MM: f64 = 0.12;
    let ink = Field::from_fn(printed.frame, |_, x, y| f64::from(printed.at(x, y) > 0.0));
    let near = ink.blurred(REACH_MM);
    Field::from_fn(printed.frame, |_, x, y| {
        // The slope of the blurred rim is 1 / (sigma sqrt(2 pi)); its inverse turns shares into millimetres.
        let blurred_mm = (near.at(x, y) - 0.45) * REACH_MM * (std::f64::consts::TAU).sqrt();
        0.5 * printed.at(x, y) + 0.5 * blurred_mm
    })
}

impl Spot {
    fn gap(strokes: &Field, rng: &mut ChaCha8Rng) -> Option<Self> {
        let centre = (0..200).find_map(|_| {
            let point = random_point(strokes, rng);
            (strokes.value(point) > 0.05).then_some(point)
        })?;
        let short_mm = rng.random_range(0.04..0.14);
        Some(Self::turned(
            centre,
            rng.random_range(0.3..0.8),
            short_mm,
            rng,
        ))
    }

    fn speck(strokes: &Field, rng: &mut ChaCha8Rng) -> Self {
        let long_mm = 0.02 * 9.0_f64.powf(rng.random());
        let short_mm = long_mm * rng.random_range(0.5..1.0);
        Self::turned(random_point(strokes, rng), long_mm, short_mm, rng)
    }

    fn turned(centre: [f64; 2], long_mm: f64, short_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        let angle = rng.random_range(0.0..std::f64::consts::PI);
        Self {
            centre,
            axis: [angle.cos(), angle.sin()],
            long_mm,
            short_mm,
        }
    }

    /// About the distance to the rim, positive inside, mm.
    fn inside_mm(&self, [u, v]: [f64; 2]) -> f64 {
        let (du, dv) = (u - self.centre[0], v - self.centre[1]);
        if du * du + dv * dv > (self.long_mm + 1.0).powi(2) {
            return -1.0;
        }
        let along = (du * self.axis[0] + dv * self.axis[1]) / self.long_mm;
        let across = (dv * self.axis[0] - du * self.axis[1]) / self.short_mm;
        self.short_mm * (1.0 - along.hypot(across))
    }
}

fn random_point(field: &Field, rng: &mut ChaCha8Rng) -> [f64; 2] {
    let half = field.frame.half_mm();
    [0; 2].map(|_: i32| rng.random_range(-half..half))
}
