//! Ground truth of a pair: one line of `truth.jsonl` and the mask of the stroke tops.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::damage::Damage;
use super::rendered_print::PrintFrame;
use super::scalar_field::ScalarField;
use super::scan_pose::{ScanPose, TopsPlane};
use crate::domain::PrintFromMesh;
use crate::raster::Grid;

/// Mask value of a stroke top.
pub(super) const STROKE_TOP: u8 = 255;
/// Mask value of pixels excluded from the score: neighbours, rules, lost strokes, cracks.
pub(super) const IGNORED: u8 = 128;

/// Width of the excluded band around neighbours, mm: their walls are neither stroke top nor background.
const NEIGHBOUR_MARGIN_MM: f64 = 0.2;

/// One line of `truth.jsonl`.
#[derive(Debug, Clone, Serialize)]
pub struct TruthLine {
    /// Id of the pair.
    pub id: String,
    /// Maps mesh coordinates to print pixels and height.
    pub print_from_mesh: PrintFromMesh,
    /// The plane of the stroke tops, in mesh coordinates.
    pub plane: TopsPlane,
    /// Points on stroke tops, in mesh coordinates.
    pub landmarks: Vec<[f64; 3]>,
    /// Height of the true stroke bounding box, in print pixels.
    pub char_height_px: f64,
    /// Path of the tops mask, relative to `truth.jsonl`.
    pub tops_mask: String,
}

impl TruthLine {
    /// Computes the ground truth of a pair from its pose and print frame.
    pub(super) fn new(
        id: &str,
        source: &TruthSource,
        pose: &ScanPose,
        frame: &PrintFrame,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        Self {
            id: id.to_owned(),
            print_from_mesh: pose.print_from_mesh(&frame.print_from_uv),
            plane: pose.tops_plane(),
            landmarks: source.landmarks(pose, rng),
            char_height_px: source.character_height_px(frame),
            tops_mask: format!("tops/{id}.png"),
        }
    }
}

/// The geometry of a pair before it is posed and printed.
pub(super) struct TruthSource<'a> {
    /// Signed distance to the strokes as carved, mm.
    pub strokes: &'a ScalarField,
    /// Signed distance to the strokes left on the block, mm.
    pub remaining: &'a ScalarField,
    /// Signed distance to the neighbours on the block and on the print, mm.
    pub neighbours: [&'a ScalarField; 2],
    /// Damage of the block.
    pub damage: &'a Damage,
    /// Heights of the surface, mm.
    pub surface: &'a ScalarField,
}

impl TruthSource<'_> {
    /// Renders the tops mask in the print frame.
    pub(super) fn tops_mask(&self, frame: &PrintFrame) -> Grid<u8> {
        Grid::from_fn(frame.width, frame.height, |x, y| self.label(frame.uv(x, y)))
    }

    fn label(&self, point: [f64; 2]) -> u8 {
        let cracked = self.damage.is_cracked(point, 0.02);
        let is_near = |field: &&ScalarField| field.value(point) > -NEIGHBOUR_MARGIN_MM;
        if self.remaining.value(point) > 0.0 && !cracked {
            STROKE_TOP
        } else if self.strokes.value(point) > 0.0 || self.neighbours.iter().any(is_near) {
            IGNORED
        } else {
            0
        }
    }

    /// Returns the height of the strokes' bounding box in print pixels.
    pub(super) fn character_height_px(&self, frame: &PrintFrame) -> f64 {
        let ink = Grid::from_fn(frame.width, frame.height, |x, y| {
            self.strokes.value(frame.uv(x, y)) > 0.0
        });
        ink.bounding_box()
            .map_or(0.0, |found| found.height() as f64)
    }

    /// Draws 12 to 40 well-separated points on the remaining stroke tops, in mesh coordinates.
    pub(super) fn landmarks(&self, pose: &ScanPose, rng: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
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
