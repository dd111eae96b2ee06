//! The known answer of a pair: one line of `truth.jsonl`, and the mask of true stroke tops.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::damage::Damage;
use super::field::Field;
use super::pose::{Pose, TopsPlane};
use super::print::PrintFrame;
use crate::domain::PrintFromMesh;
use crate::raster::Grid;

/// A true stroke top in the tops mask.
pub(super) const TOP: u8 = 255;
/// Left out of the score: neighbours, rules, lost strokes, cracks.
pub(super) const LEFT_OUT: u8 = 128;

/// How far around a neighbour the mask is left out, mm: its wall is neither top nor the character's ground.
const NEIGHBOUR_RIM_MM: f64 = 0.2;

/// One line of `truth.jsonl`.
#[derive(Debug, Clone, Serialize)]
pub struct TruthLine {
    /// The pair.
    pub id: String,
    /// Print pixels and height from mesh coordinates.
    pub print_from_mesh: PrintFromMesh,
    /// The plane of the tops, mesh coordinates.
    pub plane: TopsPlane,
    /// Points on stroke tops, mesh coordinates.
    pub landmarks: Vec<[f64; 3]>,
    /// Height of the character's true ink box, print pixels.
    pub char_height_px: f64,
    /// The tops mask, relative to `truth.jsonl`.
    pub tops_mask: String,
}

impl TruthLine {
    /// The truth of a pair in its pose and print frame.
    pub(super) fn new(
        id: &str,
        known: &Known,
        pose: &Pose,
        frame: &PrintFrame,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        Self {
            id: id.to_owned(),
            print_from_mesh: pose.print_from_mesh(&frame.print_from_uv),
            plane: pose.tops_plane(),
            landmarks: known.landmarks(pose, rng),
            char_height_px: known.height_px(frame),
            tops_mask: format!("tops/{id}.png"),
        }
    }
}

/// What is known of a pair before it is posed and printed.
pub(super) struct Known<'a> {
    /// The strokes as carved, signed distance in mm.
    pub strokes: &'a Field,
    /// The strokes that are left.
    pub remaining: &'a Field,
    /// Neighbours on the block and on the print.
    pub around: [&'a Field; 2],
    /// Cracks.
    pub damage: &'a Damage,
    /// Heights of the surface, mm.
    pub surface: &'a Field,
}

impl Known<'_> {
    /// The tops mask in the print's frame.
    pub(super) fn tops_mask(&self, frame: &PrintFrame) -> Grid<u8> {
        Grid::from_fn(frame.width, frame.height, |x, y| self.label(frame.uv(x, y)))
    }

    fn label(&self, point: [f64; 2]) -> u8 {
        let cracked = self.damage.is_cracked(point, 0.02);
        let is_near = |field: &&Field| field.value(point) > -NEIGHBOUR_RIM_MM;
        if self.remaining.value(point) > 0.0 && !cracked {
            TOP
        } else if self.strokes.value(point) > 0.0 || self.around.iter().any(is_near) {
            LEFT_OUT
        } else {
            0
        }
    }

    /// Height of the strokes' box in print pixels.
    pub(super) fn height_px(&self, frame: &PrintFrame) -> f64 {
        let ink = Grid::from_fn(frame.width, frame.height, |x, y| {
            self.strokes.value(frame.uv(x, y)) > 0.0
        });
        ink.bounding_box()
            .map_or(0.0, |found| found.height() as f64)
    }

    /// 12 to 40 points on the tops that are left, spread over the character, in mesh coordinates.
    pub(super) fn landmarks(&self, pose: &Pose, rng: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
        let wanted = rng.random_range(16..=36_usize);
        let mut chosen: Vec<[f64; 2]> = Vec::new();
        for (inside_mm, apart_mm) in [(0.12, 1.0), (0.08, 0.6), (0.04, 0.3), (0.02, 0.1)] {
            for _ in 0..6000 {
                if chosen.len() >= wanted {
                    break;
                }
                let point = self.random_point(rng);
                let is_far =
                    |other: &[f64; 2]| (other[0] - point[0]).hypot(other[1] - point[1]) > apart_mm;
                if self.remaining.value(point) > inside_mm
                    && !self.damage.is_cracked(point, 0.05)
                    && chosen.iter().all(is_far)
                {
                    chosen.push(point);
                }
            }
        }
        let to_mesh =
            |[u, v]: &[f64; 2]| pose.mesh_from_block([-u, -v, self.surface.value([*u, *v])]);
        chosen.iter().map(to_mesh).collect()
    }

    fn random_point(&self, rng: &mut ChaCha8Rng) -> [f64; 2] {
        let half = self.strokes.frame.half_mm();
        [0; 2].map(|_: i32| rng.random_range(-half..half))
    }
}
