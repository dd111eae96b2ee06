//! Ground truth of a pair: one line of `truth.jsonl` and the mask of the stroke tops.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::rendered_print::PrintFrame;
use super::scalar_field::ScalarField;
use super::scan_pose::{ScanPose, TopsPlane};
use super::scene::Scene;
use mocban_core::domain::PrintFromMesh;
use mocban_core::raster::Grid;

/// Mask value of a stroke top.
pub(super) const STROKE_TOP: u8 = 255;
/// Mask value of pixels that are excluded from the score: neighbouring characters, column rules, lost strokes and
/// cracks in strokes.
pub(super) const IGNORED: u8 = 128;

/// Width in mm of the excluded band around neighbours. Their carved walls are neither stroke top nor background.
const NEIGHBOUR_MARGIN_MM: f64 = 0.2;
/// Distance from a part that slid within which tops are excluded from the score, mm.
const SLID_MARGIN_MM: f64 = 0.2;

/// One line of `truth.jsonl`.
#[derive(Debug, Clone, Serialize)]
pub struct TruthLine {
    /// Id of the pair.
    pub id: String,
    /// Maps mesh coordinates to print pixels, and to the height over the plane of the stroke tops in mesh units.
    pub print_from_mesh: PrintFromMesh,
    /// The plane of the stroke tops, in mesh coordinates.
    pub plane: TopsPlane,
    /// Points on stroke tops, in mesh coordinates.
    pub landmarks: Vec<[f64; 3]>,
    /// Height of the true stroke bounding box, in print pixels. Errors are measured relative to it.
    pub char_height_px: f64,
    /// Path of the tops mask, relative to `truth.jsonl`, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tops_mask: Option<String>,
}

/// The geometry of a pair before it is posed and printed.
pub(super) struct TruthSource<'a> {
    /// Character, neighbours and damage.
    pub scene: &'a Scene,
    /// Signed distance to the strokes left on the block, mm.
    pub remaining: &'a ScalarField,
    /// Heights of the surface, mm.
    pub surface: &'a ScalarField,
}

/// Returns the path of the tops mask of a pair below the dataset.
pub(super) fn tops_file(id: &str) -> String {
    format!("tops/{id}.png")
}

impl TruthSource<'_> {
    /// Computes the ground truth of the pair from its pose and print frame.
    pub(super) fn line(
        &self,
        pose: &ScanPose,
        frame: &PrintFrame,
        rng: &mut ChaCha8Rng,
    ) -> TruthLine {
        let id = &self.scene.id;
        TruthLine {
            id: id.clone(),
            print_from_mesh: pose.print_from_mesh(&frame.print_from_uv),
            plane: pose.tops_plane(),
            landmarks: self.landmarks(pose, rng),
            char_height_px: self.character_height_px(frame),
            tops_mask: Some(tops_file(id)),
        }
    }

    /// Renders the tops mask in the print frame.
    pub(super) fn tops_mask(&self, frame: &PrintFrame) -> Grid<u8> {
        Grid::from_fn(frame.width, frame.height, |x, y| self.label(frame.uv(x, y)))
    }

    /// Returns whether a point of the print lies on a part that slid, or near it.
    fn has_slid(&self, point: [f64; 2]) -> bool {
        let slid = self.scene.conditions.slid;
        slid.is_some_and(|slid| slid.is_near(point, SLID_MARGIN_MM))
    }

    fn label(&self, point: [f64; 2]) -> u8 {
        let scene = self.scene;
        if self.has_slid(point) {
            return IGNORED;
        }
        let is_near = |field: &ScalarField| field.value(point) > -NEIGHBOUR_MARGIN_MM;
        if self.remaining.value(point) > 0.0 && !scene.damage.is_cracked(point, 0.02) {
            STROKE_TOP
        } else if scene.artwork.strokes.value(point) > 0.0
            || is_near(&scene.block_neighbours)
            || is_near(&scene.print_neighbours)
        {
            IGNORED
        } else {
            0
        }
    }

    /// Returns the height of the strokes' bounding box in print pixels.
    fn character_height_px(&self, frame: &PrintFrame) -> f64 {
        let ink = Grid::from_fn(frame.width, frame.height, |x, y| {
            self.scene.artwork.strokes.value(frame.uv(x, y)) > 0.0
        });
        ink.bounding_box()
            .map_or(0.0, |found| found.height() as f64)
    }

    /// Draws 16 to 36 well-separated points on the remaining stroke tops, in mesh coordinates. Returns fewer points if
    /// the search finds no more.
    fn landmarks(&self, pose: &ScanPose, rng: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
        let wanted = rng.random_range(16..=36_usize);
        let mut chosen: Vec<[f64; 2]> = Vec::new();
        for (inside_mm, apart_mm) in [(0.12, 1.0), (0.08, 0.6), (0.04, 0.3), (0.02, 0.1)] {
            for _ in 0..6000 {
                if chosen.len() >= wanted {
                    break;
                }
                let point = self.remaining.frame.random_position(rng);
                let is_far =
                    |other: &[f64; 2]| (other[0] - point[0]).hypot(other[1] - point[1]) > apart_mm;
                if self.remaining.value(point) > inside_mm
                    && !self.scene.damage.is_cracked(point, 0.05)
                    && !self.has_slid(point)
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
}
