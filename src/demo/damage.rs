//! What happened to the block after it was printed: strokes broken off, cracks.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::artwork::Artwork;
use super::field::Field;
use super::noise::Noise;

/// Least and greatest share of the stroke area that a damaged block has lost.
const LOST_SHARE: [f64; 2] = [0.05, 0.20];

/// Damage to one block.
#[derive(Debug, Clone, Default)]
pub(super) struct Damage {
    /// Signed distance in mm to the broken places, positive in them; none when nothing is lost.
    pub lost: Option<Field>,
    /// Cracks through the wood.
    pub cracks: Vec<Crack>,
}

/// A crack across the whole square, nearly straight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crack {
    normal: [f64; 2],
    offset_mm: f64,
    wander: Noise,
    /// Half its width at the top, mm.
    pub half_width_mm: f64,
    /// Its depth, mm.
    pub depth_mm: f64,
}

impl Damage {
    /// Damage of a block of the hard tier.
    pub(super) fn draw(artwork: &Artwork, rng: &mut ChaCha8Rng) -> Self {
        let lost = Some(broken_places(artwork, rng));
        let cracks = (0..rng.random_range(0..3_u32))
            .map(|_| Crack::draw(rng))
            .collect();
        Self { lost, cracks }
    }

    /// The strokes that are left on the block, as signed distance.
    pub(super) fn remaining(&self, strokes: &Field) -> Field {
        Field::from_fn(strokes.frame, |_, x, y| {
            let gone = self
                .lost
                .as_ref()
                .map_or(f64::NEG_INFINITY, |lost| lost.at(x, y));
            strokes.at(x, y).min(-gone)
        })
    }

    /// Whether a point lies in a crack or within `margin_mm` of one.
    pub(super) fn is_cracked(&self, point: [f64; 2], margin_mm: f64) -> bool {
        self.cracks
            .iter()
            .any(|crack| crack.distance_mm(point) < crack.half_width_mm + margin_mm)
    }
}

impl Crack {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        let angle = rng.random_range(0.0..std::f64::consts::PI);
        Self {
            normal: [angle.cos(), angle.sin()],
            offset_mm: rng.random_range(-4.0..4.0),
            wander: Noise::draw(rng),
            half_width_mm: rng.random_range(0.03..0.09),
            depth_mm: rng.random_range(0.3..1.0),
        }
    }

    /// Distance of a point to the crack's middle line, mm.
    pub(super) fn distance_mm(&self, [u, v]: [f64; 2]) -> f64 {
        let [nu, nv] = self.normal;
        let along = u * nv - v * nu;
        let wander = 0.35 * self.wander.rough(along / 1.7, 0.0);
        (u * nu + v * nv - self.offset_mm - wander).abs()
    }
}

/// Blobs with ragged rims, laid on the strokes until enough is lost.
fn broken_places(artwork: &Artwork, rng: &mut ChaCha8Rng) -> Field {
    let strokes = &artwork.strokes;
    let frame = strokes.frame;
    let ink: Vec<(usize, usize)> = (0..frame.side * frame.side)
        .map(|i| (i % frame.side, i / frame.side))
        .filter(|(x, y)| strokes.at(*x, *y) > 0.0)
        .collect();
    let target = rng.random_range(LOST_SHARE[0]..LOST_SHARE[1] - 0.04);
    let rag = Noise::draw(rng);
    let mut lost = Field::from_fn(frame, |_, _, _| -9.0);
    for _ in 0..200 {
        if share_lost(&lost, &ink) >= target || ink.is_empty() {
            break;
        }
        let (x, y) = ink[rng.random_range(0..ink.len())];
        let blob = Blob::draw(frame.position(x, y), rng);
        let with_blob = Field::from_fn(frame, |point, x, y| {
            lost.at(x, y).max(blob.inside_mm(point, rag))
        });
        if share_lost(&with_blob, &ink) <= LOST_SHARE[1] {
            lost = with_blob;
        }
    }
    lost
}

fn share_lost(lost: &Field, ink: &[(usize, usize)]) -> f64 {
    let gone = ink.iter().filter(|(x, y)| lost.at(*x, *y) > 0.0).count();
    gone as f64 / ink.len().max(1) as f64
}

/// A broken place: an ellipse.
struct Blob {
    centre: [f64; 2],
    axis: [f64; 2],
    long_mm: f64,
    short_mm: f64,
}

impl Blob {
    fn draw(centre: [f64; 2], rng: &mut ChaCha8Rng) -> Self {
        let angle = rng.random_range(0.0..std::f64::consts::PI);
        let long_mm = rng.random_range(0.5..1.5);
        Self {
            centre,
            axis: [angle.cos(), angle.sin()],
            long_mm,
            short_mm: long_mm * rng.random_range(0.4..0.9),
        }
    }

    fn inside_mm(&self, [u, v]: [f64; 2], rag: Noise) -> f64 {
        let (du, dv) = (u - self.centre[0], v - self.centre[1]);
        let along = (du * self.axis[0] + dv * self.axis[1]) / self.long_mm;
        let across = (dv * self.axis[0] - du * self.axis[1]) / self.short_mm;
        self.short_mm * (1.0 - along.hypot(across)) + 0.15 * rag.rough(u / 0.5, v / 0.5)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::Damage;
    use crate::demo::artwork::Artwork;
    use crate::demo::glyph::Glyphs;

    #[test]
    fn between_a_twentieth_and_a_fifth_of_the_strokes_is_lost() {
        let glyphs = Glyphs::embedded();
        for seed in 0..4 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let artwork = Artwork::of_glyph(&glyphs, '國', &mut rng);
            let damage = Damage::draw(&artwork, &mut rng);
            let area = |field: &crate::demo::field::Field| {
                field.values.data().iter().filter(|d| **d > 0.0).count() as f64
            };
            let left = area(&damage.remaining(&artwork.strokes)) / area(&artwork.strokes);
            assert!((0.80..=0.95).contains(&left), "seed {seed}: {left}");
        }
    }
}
