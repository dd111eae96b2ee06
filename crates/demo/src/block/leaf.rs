//! The printed leaves that a page image shows, and which part of each.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::block_damage::BlockDamage;
use super::face_field::FaceField;
use super::kind::{BlockRanges, PageExtent};
use super::layout::PageLayout;
use crate::draw::within;
use crate::polygon::BoundsMm;

/// Margin of the sheet beyond the image if the image does not show the edges of the sheet, mm.
const HIDDEN_SHEET_MM: f64 = 30.0;

/// A leaf that was printed from one side of a block.
#[derive(Debug, Clone)]
pub(super) struct PrintedLeaf<'a> {
    pub field: &'a FaceField,
    /// Damage of the block, if the block has any.
    pub damage: Option<&'a BlockDamage>,
    /// Part that is visible, in the face frame.
    pub clip_u: [f64; 2],
    /// Sine and cosine of the rotation from the page's plane to the face frame, and the point about which it turns.
    turn: [f64; 2],
    pivot: [f64; 2],
    shift: [f64; 2],
}

impl<'a> PrintedLeaf<'a> {
    /// Creates the leaf whose face frame is the page's plane.
    pub(super) const fn of_page(
        field: &'a FaceField,
        damage: Option<&'a BlockDamage>,
        clip_u: [f64; 2],
    ) -> Self {
        Self {
            field,
            damage,
            clip_u,
            turn: [0.0, 1.0],
            pivot: [0.0, 0.0],
            shift: [0.0, 0.0],
        }
    }

    /// Converts a point of the page's plane to the face frame of this leaf. Returns `None` outside the visible part.
    pub(super) fn face_from_plane(&self, point: [f64; 2]) -> Option<[f64; 2]> {
        let [sin, cos] = self.turn;
        let [du, dv] = [0, 1].map(|i| point[i] - self.pivot[i]);
        let face = [
            cos * du - sin * dv + self.pivot[0] + self.shift[0],
            sin * du + cos * dv + self.pivot[1] + self.shift[1],
        ];
        (face[0] >= self.clip_u[0] && face[0] <= self.clip_u[1]).then_some(face)
    }
}

/// What a page image shows, in the page's plane, mm.
#[derive(Debug, Clone)]
pub(super) struct PageScene {
    /// Part of the block's own leaf that is visible, along u.
    pub clip_u: [f64; 2],
    /// The sheet or the two sheets side by side.
    pub sheet: BoundsMm,
    /// What the image shows at least.
    pub view: BoundsMm,
    /// u of the gutter of an opened book.
    pub gutter_u: Option<f64>,
    /// The visible part of the other leaf and its shift from the page's plane.
    other: Option<([f64; 2], [f64; 2], f64)>,
}

impl PageScene {
    /// Draws which part of a page an image shows. `other` is the layout of the other leaf of an opened book.
    pub(super) fn draw(
        ranges: &BlockRanges,
        layout: &PageLayout,
        other: Option<&PageLayout>,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let fold = layout.fold_u.unwrap_or_default();
        let is_left = rng.random_bool(0.5);
        let mut clip_u = [f64::NEG_INFINITY, f64::INFINITY];
        let mut text = layout.outer;
        if ranges.extent != PageExtent::Whole {
            clip_u[usize::from(is_left)] = fold;
            if is_left {
                text.max[0] = fold;
            } else {
                text.min[0] = fold;
            }
        }
        let mut scene = Self {
            clip_u,
            sheet: text,
            view: text,
            gutter_u: None,
            other: None,
        };
        if let (PageExtent::OpenedBook, Some(other)) = (ranges.extent, other) {
            text = scene.open_book(layout, other, is_left, rng);
        }
        scene.add_margins(text, ranges, is_left, rng);
        scene
    }

    /// Sets the edges of the sheet and of the image around a text. `is_left` says that the block's left half is shown.
    fn add_margins(
        &mut self,
        text: BoundsMm,
        ranges: &BlockRanges,
        is_left: bool,
        rng: &mut ChaCha8Rng,
    ) {
        let bed_mm = within(ranges.bed_mm, rng);
        for (axis, is_max) in [(0, false), (0, true), (1, false), (1, true)] {
            let is_fold = axis == 0
                && match ranges.extent {
                    PageExtent::Whole => false,
                    PageExtent::Half => is_max == is_left,
                    PageExtent::OpenedBook => true,
                };
            let margin = rng.random_range(4.0..16.0);
            let (sheet, view) = if is_fold {
                (0.0, bed_mm + rng.random_range(-0.3..4.0))
            } else if bed_mm > 0.0 {
                (margin, margin + bed_mm)
            } else {
                (margin + HIDDEN_SHEET_MM, margin)
            };
            if is_max {
                self.sheet.max[axis] = text.max[axis] + sheet;
                self.view.max[axis] = text.max[axis] + view;
            } else {
                self.sheet.min[axis] = text.min[axis] - sheet;
                self.view.min[axis] = text.min[axis] - view;
            }
        }
    }

    /// Places a half of another leaf beside the visible half. In a book, the outer margins of both meet at the gutter.
    /// Returns the box of both texts.
    fn open_book(
        &mut self,
        layout: &PageLayout,
        other: &PageLayout,
        is_left: bool,
        rng: &mut ChaCha8Rng,
    ) -> BoundsMm {
        let margin = rng.random_range(7.0..15.0);
        let other_fold = other.fold_u.unwrap_or_default();
        let (gutter, clip, shift_u, text_u) = if is_left {
            let gutter = layout.outer.min[0] - margin;
            let shift = other.outer.max[0] + margin - gutter;
            let clip = [other_fold, other.outer.max[0] + margin];
            (gutter, clip, shift, [other_fold - shift, self.sheet.max[0]])
        } else {
            let gutter = layout.outer.max[0] + margin;
            let shift = other.outer.min[0] - margin - gutter;
            let clip = [other.outer.min[0] - margin, other_fold];
            (gutter, clip, shift, [self.sheet.min[0], other_fold - shift])
        };
        self.gutter_u = Some(gutter);
        // Beyond the gutter lies the other leaf.
        self.clip_u[usize::from(!is_left)] = gutter;
        let shift_v = rng.random_range(-3.0..3.0);
        let angle = rng.random_range(-0.008..0.008);
        self.other = Some((clip, [shift_u, shift_v], angle));
        BoundsMm {
            min: [
                text_u[0],
                layout.outer.min[1].min(other.outer.min[1] - shift_v),
            ],
            max: [
                text_u[1],
                layout.outer.max[1].max(other.outer.max[1] - shift_v),
            ],
        }
    }

    /// Returns the visible half of the other leaf of an opened book.
    pub(super) fn other_leaf<'a>(&self, field: &'a FaceField) -> Option<PrintedLeaf<'a>> {
        let (clip_u, shift, angle) = self.other?;
        let (sin, cos) = angle.sin_cos();
        Some(PrintedLeaf {
            field,
            damage: None,
            clip_u,
            turn: [sin, cos],
            pivot: [self.gutter_u.unwrap_or_default(), 0.0],
            shift,
        })
    }
}
