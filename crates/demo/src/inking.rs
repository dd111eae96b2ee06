//! Ink on the print: spread, gaps, dry patches and specks.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::conditions::InkAmount;
use super::ellipse::{Axis, Ellipse};
use super::noise::{Noise, lerp, smoothstep};
use super::scalar_field::ScalarField;
use super::scene::Scene;
use super::tier::Tier;

/// Amount of ink on the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum InkLoad {
    Normal,
    Heavy,
    Faint,
}

/// One inked impression of a block.
pub(super) struct Inking {
    /// Signed distance to the printed area, mm, positive inside, with corners filled by ink.
    printed: ScalarField,
    spread_mm: f64,
    spread: Noise,
    rim: Noise,
    strength: f64,
    blotches: Noise,
    dryness: f64,
    dry_patches: Noise,
    bristles: Noise,
    gaps: Vec<Ellipse>,
    specks: Vec<Ellipse>,
    /// Amount of ink that the tier's kind prescribes. `None` for tiers without a kind.
    amount: Option<InkAmount>,
}

impl Inking {
    /// Inks the strokes and their neighbours.
    pub(super) fn draw(scene: &Scene, rng: &mut ChaCha8Rng) -> Self {
        let (tier, strokes) = (scene.tier, &scene.artwork.strokes);
        let load = draw_ink_load(tier, rng);
        let union = strokes.union(&scene.print_neighbours);
        let gap_count = rng.random_range(0..if tier.is_damaged() { 9 } else { 5 });
        let gaps = (0..gap_count)
            .filter_map(|_| draw_gap(strokes, rng))
            .collect();
        let speck_count = rng.random_range(4..if tier.is_damaged() { 45 } else { 22 });
        let specks = (0..speck_count).map(|_| draw_speck(strokes, rng)).collect();
        let drawn = Self {
            printed: fill_corners(&union),
            spread_mm: match load {
                InkLoad::Normal => rng.random_range(0.0..0.05),
                InkLoad::Heavy => rng.random_range(0.08..0.16),
                InkLoad::Faint => rng.random_range(-0.03..0.02),
            },
            spread: Noise::draw(rng),
            rim: Noise::draw(rng),
            strength: match load {
                InkLoad::Normal => rng.random_range(0.80..0.97),
                InkLoad::Heavy => rng.random_range(0.93..0.99),
                InkLoad::Faint => rng.random_range(0.45..0.68),
            },
            blotches: Noise::draw(rng),
            dryness: match load {
                InkLoad::Normal => rng.random_range(0.1..0.8),
                InkLoad::Heavy => 0.0,
                InkLoad::Faint => rng.random_range(0.6..1.0),
            },
            dry_patches: Noise::draw(rng),
            bristles: Noise::draw(rng),
            gaps,
            specks,
            amount: scene.conditions.ink,
        };
        match drawn.amount {
            None => drawn,
            Some(amount) => Self {
                spread_mm: amount.spread_mm,
                strength: amount.strength,
                dryness: amount.dryness,
                ..drawn
            },
        }
    }

    /// Returns the ink density, 0..=1, at a point, averaged over a square pixel with sides of `px_mm`.
    pub(super) fn at(&self, point: [f64; 2], px_mm: f64) -> f64 {
        let [u, v] = point;
        let spread = self.spread_mm
            + 0.03 * self.spread.at(u / 1.4, v / 1.4)
            + 0.022 * self.rim.two_octaves(u / 0.16, v / 0.16);
        let cover = |inside_mm: f64| (0.5 + inside_mm / (1.4 * px_mm)).clamp(0.0, 1.0);
        let stroke =
            cover(self.printed.value(point) + spread) * (1.0 - self.missing_share(point, px_mm));
        let speck = self
            .specks
            .iter()
            .map(|spot| cover(inside_spot_mm(spot, point)));
        let blotch = 1.0 - 0.12 * (1.0 + self.blotches.two_octaves(u / 0.7, v / 0.7)).max(0.0);
        let ink = self.strength * (stroke * blotch.min(1.0)).max(0.8 * speck.fold(0.0, f64::max));
        self.amount.map_or(ink, |amount| {
            let contact = smoothstep(-0.9, 0.5, amount.contact.two_octaves(u / 3.2, v / 3.2));
            let smeared = smoothstep(0.1, 0.9, amount.smears.two_octaves(u / 1.7, v / 1.7));
            (ink * lerp(1.0 - amount.uneven, 1.0, contact)).max(amount.smear * smeared)
        })
    }

    /// Returns the fraction of ink that is missing inside a stroke because of dry patches and gaps.
    fn missing_share(&self, point: [f64; 2], px_mm: f64) -> f64 {
        let [u, v] = point;
        let dry = self.dryness * smoothstep(0.0, 0.8, self.dry_patches.at(u / 2.4, v / 2.4));
        let bristle = self.bristles.two_octaves(u / 0.2, v / 0.2);
        let edge = lerp(1.4, 0.15, dry);
        let patchy = 0.85 * smoothstep(edge, edge + 0.45, bristle);
        let ragged_mm = 0.05 * bristle;
        let broken = self.gaps.iter().map(|spot| {
            (0.5 + (inside_spot_mm(spot, point) + ragged_mm) / (1.4 * px_mm)).clamp(0.0, 0.9)
        });
        broken.fold(patchy, f64::max)
    }
}

/// Draws the amount of ink for the tiers without a kind. Of these, only `hard` has too much or too little ink.
fn draw_ink_load(tier: Tier, rng: &mut ChaCha8Rng) -> InkLoad {
    let share: f64 = rng.random();
    match share {
        ..0.35 if tier.is_damaged() => InkLoad::Heavy,
        ..0.7 if tier.is_damaged() => InkLoad::Faint,
        _ => InkLoad::Normal,
    }
}

/// Averages the signed distance with a second estimate from a blurred mask. The blur fills notches and rounds corners.
fn fill_corners(printed: &ScalarField) -> ScalarField {
    const SIGMA_MM: f64 = 0.12;
    let ink = ScalarField::from_fn(printed.frame, |_, x, y| f64::from(printed.at(x, y) > 0.0));
    let blurred = ink.blurred(SIGMA_MM);
    ScalarField::from_fn(printed.frame, |_, x, y| {
        // At a straight edge, the blurred coverage changes by 1 / (sigma sqrt(2 pi)) per mm. Dividing by this slope
        // gives mm.
        let blurred_mm = (blurred.at(x, y) - 0.45) * SIGMA_MM * (std::f64::consts::TAU).sqrt();
        0.5 * printed.at(x, y) + 0.5 * blurred_mm
    })
}

/// Draws a gap inside a stroke.
fn draw_gap(strokes: &ScalarField, rng: &mut ChaCha8Rng) -> Option<Ellipse> {
    let centre = (0..200).find_map(|_| {
        let point = strokes.frame.random_position(rng);
        (strokes.value(point) > 0.05).then_some(point)
    })?;
    let short_mm = rng.random_range(0.04..0.14);
    Some(Ellipse {
        centre,
        short_mm,
        long_mm: rng.random_range(0.3..0.8),
        axis: Axis::draw_any(rng),
    })
}

/// Draws a speck of ink anywhere.
fn draw_speck(strokes: &ScalarField, rng: &mut ChaCha8Rng) -> Ellipse {
    let long_mm = 0.02 * 9.0_f64.powf(rng.random());
    Ellipse {
        long_mm,
        short_mm: long_mm * rng.random_range(0.5..1.0),
        centre: strokes.frame.random_position(rng),
        axis: Axis::draw_any(rng),
    }
}

/// Returns the approximate signed distance to the edge of a spot in mm, positive inside. Returns -1 far outside.
fn inside_spot_mm(spot: &Ellipse, [u, v]: [f64; 2]) -> f64 {
    let (du, dv) = (u - spot.centre[0], v - spot.centre[1]);
    if du * du + dv * dv > (spot.long_mm + 1.0).powi(2) {
        return -1.0;
    }
    spot.inside_mm([u, v])
}
