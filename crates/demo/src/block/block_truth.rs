//! Ground truth of a block and its page.

use serde::{Deserialize, Serialize};

use super::kind::BlockKind;
use super::page_image::InkBox;
use super::pose::FaceSide;
use super::relief::BlockRelief;
use super::solid::BlockSolid;
use super::text_cell::TextCell;
use super::true_map::TruePageMap;
use crate::polygon::BoundsMm;
use mocban_core::domain::{LengthUnit, TrueBox};

/// Number of landmarks of a character.
const LANDMARKS: usize = 12;
/// Spacing of the points among which landmarks are chosen, mm.
const CANDIDATE_MM: f64 = 0.12;
/// Least distance of landmarks from the edge of the stroke, mm, in the order in which they are tried.
const INSIDE_MM: [f64; 4] = [0.18, 0.12, 0.06, 0.02];
/// Fraction of a character's stroke area that must be lost before it counts as damaged.
const DAMAGED_SHARE: f64 = 0.25;
/// Spacing of the points at which the map is recorded, mm.
const MAP_STEP_MM: f64 = 20.0;

/// The true alignment of a block and its page.
///
/// Positions on the page are in pixels; (0, 0) is the middle of the first pixel, so a box of whole pixels ends at
/// half-integers. The face frame of the printed side has u to the right and v down as the print is read, in mm.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BlockTruth {
    /// Version of this structure.
    pub schema: u32,
    /// The kind.
    pub kind: BlockKind,
    /// Seed of the world.
    pub seed: u64,
    /// Spacing of the mesh's vertices, mm.
    pub spacing_mm: f64,
    /// Number of triangles of the mesh.
    pub triangles: usize,
    /// Name of the page's file.
    pub page: String,
    /// Width and height of the page image, pixels.
    pub page_size: [usize; 2],
    /// Resolution of the page image before perspective, pixels per mm.
    pub px_per_mm: f64,
    /// Clockwise quarter turns of the page image.
    pub quarter_turns: u32,
    /// Whether the page was printed from the block.
    pub belongs: bool,
    /// Whether both sides of the block are carved and scanned.
    pub double_faced: bool,
    /// Part of the printed side that the page shows, along u, mm; `null` where it is not cut.
    pub visible_u: [Option<f64>; 2],
    /// Unit of the mesh.
    pub unit: LengthUnit,
    /// The printed side.
    pub side: FaceSide,
    /// Outward normal of the printed side in the mesh frame.
    pub normal: [f64; 3],
    /// 4 x 4 matrix, row by row, from mesh coordinates to u, v and height on the printed side, mm.
    pub face_from_mesh: [[f64; 4]; 4],
    /// Width and height of the block, mm.
    pub block_mm: [f64; 2],
    /// Edges of the page's outer frame in the face frame, mm: left, top, right, bottom.
    pub frame_mm: [f64; 4],
    /// u, v in mm and x, y in pixels at points every 20 mm, whether visible or not. Empty if the page does not belong
    /// to the block.
    pub map: Vec<[f64; 4]>,
    /// The characters of the printed side, column by column from the right, each from the top.
    pub characters: Vec<BlockCharacterTruth>,
}

/// The true position of a character.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BlockCharacterTruth {
    /// Name by column and row, such as `c03-r12` or, for notes, `c03-r12a`.
    pub name: String,
    /// The character.
    pub character: String,
    /// Side of its em square, mm.
    pub em_mm: f64,
    /// Bounding box of its ink on the page, pixels: left, top, right, bottom. `null` if the page does not show it.
    pub box_px: Option<[f64; 4]>,
    /// Bounding box of its strokes as they were carved, in the face frame, mm: left, top, right, bottom.
    pub box_mm: [f64; 4],
    /// Middle of `box_mm` at the height of the stroke tops, in the mesh's frame and unit.
    pub centre: [f64; 3],
    /// Points on its strokes.
    pub landmarks: Vec<BlockLandmark>,
    /// To which part of the text it belongs.
    #[serde(flatten)]
    pub part: BlockTextPart,
    /// Fraction of its stroke area that the block lost.
    pub lost: f64,
    /// Whether more than a quarter of its stroke area is lost.
    pub damaged: bool,
    /// Whether the page shows all of it.
    pub on_page: bool,
}

/// Part of the text of a page; neither for the main text.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct BlockTextPart {
    /// A note of half the size.
    pub note: bool,
    /// The middle strip.
    pub strip: bool,
}

/// A point on a stroke.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct BlockLandmark {
    /// The point at the height of the stroke tops, in the mesh's frame and unit.
    pub mesh: [f64; 3],
    /// The same point on the page, pixels; may lie outside the image. `null` if the page does not belong to the block.
    pub page: Option<[f64; 2]>,
}

impl BlockTruth {
    /// Returns the boxes of the characters on the page.
    pub fn true_boxes(&self) -> Vec<TrueBox> {
        let shown = self.characters.iter().filter_map(|character| {
            Some(TrueBox {
                bounds: character.box_px?,
                is_partial: !character.on_page,
            })
        });
        shown.collect()
    }
}

/// The side of which truth is recorded, and the map to its page if the page belongs to it.
pub(super) struct TruthSide<'a> {
    pub solid: &'a BlockSolid,
    pub side: FaceSide,
    pub relief: &'a BlockRelief,
    pub map: Option<&'a TruePageMap>,
    /// Visible part along u.
    pub clip_u: [f64; 2],
    /// Width and height of the page image, pixels.
    pub page_size: [usize; 2],
}

impl TruthSide<'_> {
    /// Returns the truth of a character. `ink` is the box of its ink on the page.
    pub(super) fn character(
        &self,
        index: usize,
        cell: &TextCell,
        ink: InkBox,
    ) -> BlockCharacterTruth {
        let bounds = self.relief.field.bounds(index);
        let [u0, v0] = bounds.min;
        let [u1, v1] = bounds.max;
        let middle = [f64::midpoint(u0, u1), f64::midpoint(v0, v1)];
        let lost = self.lost_share(index, bounds);
        let ink = ink.filter(|_| self.map.is_some());
        BlockCharacterTruth {
            name: cell.name.clone(),
            character: cell.character.to_string(),
            em_mm: cell.em_mm,
            box_px: ink.map(box_edges),
            box_mm: [u0, v0, u1, v1],
            centre: self.mesh_point(middle),
            landmarks: self.landmarks(index, bounds),
            part: BlockTextPart {
                note: cell.is_note,
                strip: cell.is_strip,
            },
            lost,
            damaged: lost > DAMAGED_SHARE,
            on_page: ink.is_some() && self.shows(index),
        }
    }

    /// Returns the map at points every 20 mm within a box.
    pub(super) fn map_samples(&self, area: BoundsMm) -> Vec<[f64; 4]> {
        let Some(map) = self.map else {
            return Vec::new();
        };
        let steps = area
            .size()
            .map(|length| (length / MAP_STEP_MM).ceil() as usize);
        let points = (0..=steps[1]).flat_map(|j| (0..=steps[0]).map(move |i| [i, j]));
        let record = |index: [usize; 2]| {
            let [u, v] = [0, 1].map(|i| area.min[i] + index[i] as f64 * MAP_STEP_MM);
            let [x, y] = map.page_from_face([u, v]);
            [u, v, x, y]
        };
        points.map(record).collect()
    }

    /// Returns the point of the stroke tops at a position of the side, in mesh coordinates.
    fn mesh_point(&self, uv: [f64; 2]) -> [f64; 3] {
        let frame = self.solid.frame(self.side);
        let height = self.relief.top_mm(uv);
        let point = frame.block_from_face(uv, height);
        self.solid.pose.mesh_from_block(point)
    }

    /// Returns whether the page shows all of a character.
    pub(super) fn shows(&self, index: usize) -> bool {
        self.is_visible(self.relief.field.bounds(index))
    }

    /// Returns whether a box lies in the visible part of the page and in the image.
    fn is_visible(&self, bounds: BoundsMm) -> bool {
        let Some(map) = self.map else {
            return false;
        };
        let last = self.page_size.map(|side| side as f64 - 1.0);
        let is_in_image = |corner: &[f64; 2]| {
            let pixel = map.page_from_face(*corner);
            (0..2).all(|i| (0.0..=last[i]).contains(&pixel[i]))
        };
        bounds.min[0] >= self.clip_u[0]
            && bounds.max[0] <= self.clip_u[1]
            && bounds.corners().iter().all(is_in_image)
    }

    /// Returns the points of a regular grid that lie in the strokes of a character as they were carved, with their
    /// distance from the edge of the stroke, mm.
    fn stroke_points(&self, index: usize, bounds: BoundsMm) -> Vec<([f64; 2], f64)> {
        let field = &self.relief.field;
        let count = bounds
            .size()
            .map(|length| (length / CANDIDATE_MM) as usize + 1);
        (0..count[1])
            .flat_map(|j| (0..count[0]).map(move |i| [i, j]))
            .map(|at| [0, 1].map(|i| bounds.min[i] + at[i] as f64 * CANDIDATE_MM))
            .filter(|point| field.owner(*point) == Some(index))
            .map(|point| (point, field.value(point)))
            .filter(|(_, inside)| *inside > 0.0)
            .collect()
    }

    fn lost_share(&self, index: usize, bounds: BoundsMm) -> f64 {
        let points = self.stroke_points(index, bounds);
        let is_lost = |point: [f64; 2]| self.relief.damage.lost_mm(point, false) > 0.0;
        let lost = points.iter().filter(|(point, _)| is_lost(*point)).count();
        lost as f64 / points.len().max(1) as f64
    }

    /// Returns points spread over the strokes of a character, on strokes that are left if there are enough.
    fn landmarks(&self, index: usize, bounds: BoundsMm) -> Vec<BlockLandmark> {
        let carved = self.stroke_points(index, bounds);
        let damage = &self.relief.damage;
        let is_intact = |point: [f64; 2], inside: f64| {
            damage.lost_mm(point, false) < -inside && damage.crack_depth_mm(point) < 0.02
        };
        let choices = INSIDE_MM.map(|least| {
            let deep = carved.iter().filter(|(_, inside)| *inside > least);
            let intact = deep.filter(|(point, _)| is_intact(*point, least));
            intact.map(|(point, _)| *point).collect::<Vec<_>>()
        });
        let enough = choices
            .into_iter()
            .find(|points| points.len() >= 3 * LANDMARKS);
        let points = enough.unwrap_or_else(|| carved.iter().map(|(point, _)| *point).collect());
        spread(&points, LANDMARKS)
            .into_iter()
            .map(|uv| BlockLandmark {
                mesh: self.mesh_point(uv),
                page: self.map.map(|map| map.page_from_face(uv)),
            })
            .collect()
    }
}

/// Converts a box of whole pixels to its left, top, right and bottom edge. (0, 0) is the middle of the first pixel.
pub(super) fn box_edges([x0, x1, y0, y1]: [u32; 4]) -> [f64; 4] {
    [
        f64::from(x0) - 0.5,
        f64::from(y0) - 0.5,
        f64::from(x1) + 0.5,
        f64::from(y1) + 0.5,
    ]
}

/// Chooses points that are far from each other: each is the farthest from those before.
fn spread(points: &[[f64; 2]], count: usize) -> Vec<[f64; 2]> {
    let mut chosen = Vec::with_capacity(count);
    let mut distances = vec![f64::INFINITY; points.len()];
    let mut next = points.first().copied();
    while let Some(point) = next {
        chosen.push(point);
        if chosen.len() >= count {
            break;
        }
        for (distance, other) in distances.iter_mut().zip(points) {
            let to_point = (other[0] - point[0]).hypot(other[1] - point[1]);
            *distance = distance.min(to_point);
        }
        let farthest = distances
            .iter()
            .zip(points)
            .max_by(|a, b| a.0.total_cmp(b.0));
        next = farthest
            .filter(|(distance, _)| **distance > 0.0)
            .map(|(_, point)| *point);
    }
    chosen
}
