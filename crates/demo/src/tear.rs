//! A sheet torn or folded through the character: its smaller part is displaced or missing.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draw::within;
use super::ellipse::Axis;
use super::kind::NumberRange;
use super::noise::Noise;
use super::scalar_field::ScalarField;
use super::scene::Scene;

/// Fraction of the strokes on the larger part.
const LARGER_PART: NumberRange = [0.55, 0.78];
/// Largest angle between the two parts, degrees.
const MAX_TURN_DEG: f64 = 3.0;
/// Largest width of the strip that a fold hides, mm.
const MAX_HIDDEN_MM: f64 = 1.2;
/// Fraction of the torn sheets that lie on a dark ground.
const DARK_GROUND: f64 = 0.3;

/// The line of the tear, and what lies beyond it.
pub(super) struct SheetTear {
    /// Direction of the line. The larger part lies on its negative side.
    line: Axis,
    offset_mm: f64,
    ragged: Noise,
    /// How the smaller part is displaced. `None` if it is missing.
    displaced: Option<Displacement>,
    ground: f64,
    texture: Noise,
}

/// A rotation about a point of the line, then a shift.
#[derive(Debug, Clone, Copy)]
struct Displacement {
    turn: Axis,
    middle: [f64; 2],
    shift_mm: [f64; 2],
}

impl SheetTear {
    /// Draws the tear of a scene's kind. Returns `None` and draws no random numbers if the kind has whole sheets.
    pub(super) fn draw(scene: &Scene, rng: &mut ChaCha8Rng) -> Option<Self> {
        let kind = scene.tier.kind()?;
        if !kind.is_half && kind.displaced_mm[1] <= 0.0 {
            return None;
        }
        let line = Axis::at(rng.random_range(0.0..std::f64::consts::TAU));
        let offset_mm = offset_of(within(LARGER_PART, rng), line, &scene.artwork.strokes);
        let dark = rng.random_range(12.0..70.0);
        let light = rng.random_range(225.0..250.0);
        let distance_mm = within(kind.displaced_mm, rng);
        let angle = rng.random_range(0.0..std::f64::consts::TAU);
        let turn_deg = rng.random_range(-MAX_TURN_DEG..MAX_TURN_DEG);
        let is_dark = rng.random_bool(DARK_GROUND);
        let hidden_mm = (distance_mm * angle.sin()).max(-MAX_HIDDEN_MM);
        Some(Self {
            line,
            offset_mm,
            ragged: Noise::draw(rng),
            displaced: (!kind.is_half).then(|| Displacement {
                turn: Axis::at(f64::to_radians(turn_deg)),
                middle: line.point([0.0, offset_mm]),
                shift_mm: line.point([distance_mm * angle.cos(), hidden_mm]),
            }),
            ground: if kind.is_half || is_dark { dark } else { light },
            texture: Noise::draw(rng),
        })
    }

    /// Returns whether one part is missing, so that the ground surrounds the other.
    pub(super) const fn is_half(&self) -> bool {
        self.displaced.is_none()
    }

    /// Returns the grey of the ground at a point, 0..=255.
    pub(super) fn ground_at(&self, [u, v]: [f64; 2]) -> f64 {
        self.ground + 5.0 * self.texture.two_octaves(u / 0.6, v / 0.6)
    }

    /// Returns which point of the whole sheet is seen at a point of the torn one, mm. Returns `None` for the ground.
    pub(super) fn source(&self, point: [f64; 2]) -> Option<[f64; 2]> {
        if !self.is_beyond(point) {
            return Some(point);
        }
        let source = self.displaced?.undone(point);
        self.is_beyond(source).then_some(source)
    }

    /// Returns where a point of the whole sheet lies on the torn one, mm.
    pub(super) fn place(&self, point: [f64; 2]) -> [f64; 2] {
        match self.displaced {
            Some(displaced) if self.is_beyond(point) => displaced.applied(point),
            _ => point,
        }
    }

    /// Returns whether a point of the whole sheet belongs to the smaller part.
    fn is_beyond(&self, point: [f64; 2]) -> bool {
        let [along, across] = self.line.along_across(point);
        across > self.offset_mm + 0.12 * self.ragged.two_octaves(along / 0.7, 0.0)
    }
}

impl Displacement {
    fn applied(self, point: [f64; 2]) -> [f64; 2] {
        let turned = self.turn.point([0, 1].map(|i| point[i] - self.middle[i]));
        [0, 1].map(|i| turned[i] + self.middle[i] + self.shift_mm[i])
    }

    fn undone(self, point: [f64; 2]) -> [f64; 2] {
        let moved = [0, 1].map(|i| point[i] - self.middle[i] - self.shift_mm[i]);
        let turned = self.turn.along_across(moved);
        [0, 1].map(|i| turned[i] + self.middle[i])
    }
}

/// Returns the offset across a line below which a fraction of the strokes lies, mm.
fn offset_of(share: f64, line: Axis, strokes: &ScalarField) -> f64 {
    let frame = strokes.frame;
    let inside = frame.samples().filter(|(x, y)| strokes.at(*x, *y) > 0.0);
    let mut across: Vec<f64> = inside
        .map(|(x, y)| line.along_across(frame.position(x, y))[1])
        .collect();
    across.sort_by(f64::total_cmp);
    let at = (share * across.len() as f64) as usize;
    across.get(at).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::{Displacement, SheetTear};
    use crate::ellipse::Axis;
    use crate::noise::Noise;

    fn tear(displaced: Option<Displacement>) -> SheetTear {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        SheetTear {
            line: Axis::at(0.4),
            offset_mm: 0.7,
            ragged: Noise::draw(&mut rng),
            displaced,
            ground: 30.0,
            texture: Noise::draw(&mut rng),
        }
    }

    #[test]
    fn displaced_points_are_seen_where_they_lie() {
        let torn = tear(Some(Displacement {
            turn: Axis::at(0.04),
            middle: [0.2, 0.5],
            shift_mm: [1.3, 1.9],
        }));
        for point in [[0.0, 4.0], [2.5, 3.0]] {
            let placed = torn.place(point);
            assert!((placed[0] - point[0]).hypot(placed[1] - point[1]) > 1.0);
            let source = torn.source(placed).expect("the smaller part");
            assert!((source[0] - point[0]).hypot(source[1] - point[1]) < 1e-9);
        }
        assert_eq!(torn.source([0.0, -3.0]), Some([0.0, -3.0]));
        // The gap between the parts.
        assert_eq!(torn.source([0.0, 1.6]), None);
    }

    #[test]
    fn a_missing_part_shows_the_ground() {
        let half = tear(None);
        assert!(half.is_half());
        assert_eq!(half.source([0.0, 4.0]), None);
        assert_eq!(half.source([0.0, -3.0]), Some([0.0, -3.0]));
    }
}
