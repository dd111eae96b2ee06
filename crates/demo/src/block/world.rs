//! A whole block with its page, made from a seed.

use std::io::{self, Write};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::block_truth::{BlockTruth, TruthSide};
use super::carved_page::carve_page;
use super::face_field::FaceField;
use super::facets::triangle_count;
use super::impression::Impression;
use super::kind::{BlockOptions, BlockSupport, PageExtent};
use super::layout::PageLayout;
use super::leaf::{PageScene, PrintedLeaf};
use super::page_appearance::PageAppearance;
use super::page_file::{PageFileBytes, encode_page};
use super::page_image::{InkBox, PageRendering};
use super::page_marks::PageMarks;
use super::page_sheet::PageSheet;
use super::ply_file::write_ply;
use super::pose::{BlockPose, FaceSide, SideFrame};
use super::relief::BlockRelief;
use super::solid::{BlockSolid, ScanNoise, ScannedPart};
use super::support::SupportMesh;
use super::text_source::TextSource;
use super::true_map::TruePageMap;
use super::via_labels::{LabelledBox, via_project};
use crate::draw::within;
use crate::glyph::Glyphs;

/// Parts of a world with random numbers of their own.
mod part {
    pub(super) const CONDITIONS: u64 = 1;
    pub(super) const TEXT: u64 = 2;
    pub(super) const LAYOUTS: [u64; 3] = [3, 4, 5];
    pub(super) const RELIEFS: [u64; 2] = [6, 7];
    pub(super) const SCAN: u64 = 8;
    pub(super) const PAGE: u64 = 9;
    pub(super) const FILE: u64 = 10;
    pub(super) const LABELS: u64 = 11;
    pub(super) const APPEARANCE: [u64; 3] = [12, 13, 14];
    pub(super) const MARKS: u64 = 15;
    pub(super) const THIN_INK: u64 = 16;
    /// First part of a field; each character has the next number.
    pub(super) const FIELDS: [u64; 3] = [1 << 20, 2 << 20, 3 << 20];
}

/// A generated block, its page and their true alignment.
pub struct BlockWorld {
    choice: BlockOptions,
    solid: BlockSolid,
    /// The layout of the printed side.
    layout: PageLayout,
    side: FaceSide,
    map: TruePageMap,
    scene: PageScene,
    page: PageFileBytes,
    /// The layout on the page, which is another one if the page does not belong to the block.
    printed: PageLayout,
    boxes: Vec<InkBox>,
}

/// A layout and its strokes.
type Text = (PageLayout, FaceField);

impl BlockWorld {
    /// Makes a world.
    pub fn new(choice: BlockOptions) -> Self {
        let ranges = choice.kind.ranges();
        let glyphs = Glyphs::embedded();
        let mut rng = choice.rng(part::CONDITIONS);
        let is_folded = rng.random_bool(ranges.folded);
        let is_double = rng.random_bool(ranges.double_faced);
        let texts = TextSource::draw(&glyphs, &mut choice.rng(part::TEXT));
        let text = |index: usize| {
            let mut rng = choice.rng(part::LAYOUTS[index]);
            let appearance =
                PageAppearance::draw(&ranges.appearance, &mut choice.rng(part::APPEARANCE[index]));
            let layout = PageLayout::draw(ranges, is_folded, &appearance, &texts, &mut rng);
            let field = carve_page(&layout, &glyphs, choice.part_seed(), part::FIELDS[index]);
            (layout, field)
        };
        let front = text(0);
        let back = is_double.then(|| text(1));
        let needs_other = ranges.page_of_other || ranges.extent == PageExtent::OpenedBook;
        let other = needs_other.then(|| text(2));
        let side = match back {
            Some(_) if ranges.page_of_back => FaceSide::Back,
            Some(_) | None => FaceSide::Front,
        };
        let layout = match (&back, side) {
            (Some((layout, _)), FaceSide::Back) => layout.clone(),
            _ => front.0.clone(),
        };
        let solid = scan_block(choice, front, back, &mut rng);
        Self::print(choice, solid, layout, side, other.as_ref())
    }

    /// Prints a side of a block, or the other text if the page is not of the block.
    fn print(
        choice: BlockOptions,
        solid: BlockSolid,
        layout: PageLayout,
        side: FaceSide,
        other: Option<&Text>,
    ) -> Self {
        let ranges = choice.kind.ranges();
        let mut rng = choice.rng(part::PAGE);
        let relief = solid.relief(side).unwrap_or(&solid.front);
        let printed = match other {
            Some((layout, _)) if ranges.page_of_other => layout.clone(),
            Some(_) | None => layout.clone(),
        };
        let beside = other.map(|(layout, _)| layout);
        let scene = PageScene::draw(ranges, &printed, beside, &mut rng);
        let (map, size) = TruePageMap::draw(ranges, scene.view, &mut rng);
        let sheet = PageSheet::draw(scene.sheet, scene.gutter_u, &mut rng);
        let marks = PageMarks::draw(
            &ranges.appearance,
            printed.outer,
            &mut choice.rng(part::MARKS),
        );
        let mut ink = Impression::draw(&mut rng);
        let mut ink_rng = choice.rng(part::THIN_INK);
        if ink_rng.random_bool(ranges.appearance.thin_ink) {
            ink = ink.thinned(&mut ink_rng);
        }
        let own = match other {
            Some((_, field)) if ranges.page_of_other => {
                PrintedLeaf::of_page(field, None, scene.clip_u)
            }
            Some(_) | None => {
                PrintedLeaf::of_page(&relief.field, Some(&relief.damage), scene.clip_u)
            }
        };
        let beside = other.and_then(|(_, field)| scene.other_leaf(field));
        let rendering = PageRendering {
            leaves: [Some(own), beside].into_iter().flatten().collect(),
            sheet: &sheet,
            marks: &marks,
            ink: &ink,
            map: &map,
            size,
            characters: printed.cells.len(),
        };
        let (picture, boxes) = rendering.render();
        let page = encode_page(&picture, &mut choice.rng(part::FILE));
        Self {
            choice,
            solid,
            layout,
            side,
            map,
            scene,
            page,
            printed,
            boxes,
        }
    }

    /// Returns the page image.
    pub const fn page(&self) -> &PageFileBytes {
        &self.page
    }

    /// Returns the name of the page's file.
    pub fn page_name(&self) -> String {
        format!("page.{}", self.page.extension)
    }

    /// Returns the number of triangles of the mesh.
    pub fn triangles(&self) -> usize {
        triangle_count(&self.solid)
    }

    /// Writes the mesh as binary PLY, row by row, so that the memory does not grow with the file.
    pub fn write_mesh(&self, out: &mut impl Write) -> io::Result<()> {
        write_ply(&self.solid, out)
    }

    /// Returns the true alignment.
    pub fn truth(&self) -> BlockTruth {
        let side = self.truth_side();
        let cells = self.layout.cells.iter().enumerate();
        let ink = |index: usize| self.boxes.get(index).copied().flatten();
        let frame = self.solid.frame(self.side);
        let outer = self.layout.outer;
        BlockTruth {
            schema: 1,
            kind: self.choice.kind,
            seed: self.choice.seed,
            spacing_mm: self.choice.spacing_mm,
            triangles: self.triangles(),
            page: self.page_name(),
            page_size: self.page.size,
            px_per_mm: self.map.px_per_mm,
            quarter_turns: self.map.turns,
            belongs: side.map.is_some(),
            double_faced: self.solid.back.is_some(),
            visible_u: self.scene.clip_u.map(|u| u.is_finite().then_some(u)),
            unit: self.solid.pose.unit,
            side: self.side,
            normal: self.solid.pose.normal(frame),
            face_from_mesh: self.solid.pose.face_from_mesh(frame),
            block_mm: self.solid.half_mm.map(|half| 2.0 * half),
            frame_mm: [outer.min[0], outer.min[1], outer.max[0], outer.max[1]],
            map: side.map_samples(outer),
            characters: cells
                .map(|(index, cell)| side.character(index, cell, ink(index)))
                .collect(),
        }
    }

    /// Returns roughly drawn boxes of the characters that the page shows, as a VIA 2 project. If the page does not
    /// belong to the block, they are the boxes of the page.
    pub fn labels_via(&self) -> Vec<u8> {
        let side = self.truth_side();
        let shown = self.printed.cells.iter().zip(&self.boxes).enumerate();
        let shown = shown.filter_map(|(index, (cell, ink))| {
            let is_whole = side.map.is_none() || side.shows(index);
            ink.filter(|_| is_whole).map(|ink| (cell, ink))
        });
        let boxes: Vec<LabelledBox> = shown.map(|(cell, ink)| LabelledBox { cell, ink }).collect();
        let mut rng = self.choice.rng(part::LABELS);
        via_project(&self.page_name(), self.page.bytes.len(), &boxes, &mut rng)
    }

    /// Returns the printed side with the map to its page, if the page is of the block.
    fn truth_side(&self) -> TruthSide<'_> {
        let belongs = !self.choice.kind.ranges().page_of_other;
        TruthSide {
            solid: &self.solid,
            side: self.side,
            relief: self.solid.relief(self.side).unwrap_or(&self.solid.front),
            map: belongs.then_some(&self.map),
            clip_u: self.scene.clip_u,
            page_size: self.page.size,
        }
    }
}

/// Carves the texts into a block and scans it.
fn scan_block(
    choice: BlockOptions,
    front: Text,
    back: Option<Text>,
    rng: &mut ChaCha8Rng,
) -> BlockSolid {
    let ranges = choice.kind.ranges();
    let texts = [Some(&front), back.as_ref()];
    let half_mm = [0, 1].map(|axis| {
        let reach = texts
            .iter()
            .flatten()
            .map(|(layout, _)| layout.outer.max[axis].max(-layout.outer.min[axis]));
        reach.fold(0.0, f64::max) + rng.random_range(5.0..14.0)
    });
    let thickness_mm = rng.random_range(18.0..25.0);
    let part = match (&back, ranges.support) {
        (Some(_), _) => ScannedPart::Everything,
        (None, BlockSupport::Holder | BlockSupport::Turntable) => ScannedPart::FaceAndWalls,
        (None, BlockSupport::Nothing) => {
            let parts = [
                ScannedPart::Face,
                ScannedPart::FaceAndWalls,
                ScannedPart::Everything,
            ];
            parts[rng.random_range(0..parts.len())]
        }
    };
    let frames = [
        SideFrame::front(),
        SideFrame::back(thickness_mm, rng.random_bool(0.5)),
    ];
    let support = SupportMesh::draw(ranges.support, half_mm, thickness_mm, rng);
    let carve = |field: FaceField, index: usize| {
        let mut rng = choice.rng(part::RELIEFS[index]);
        BlockRelief::carve(field, ranges, half_mm, &mut rng)
    };
    let mut scan_rng = choice.rng(part::SCAN);
    BlockSolid {
        size: half_mm.map(|half| ((2.0 * half / choice.spacing_mm).ceil() as usize).max(2) + 1),
        half_mm,
        thickness_mm,
        part,
        front: carve(front.1, 0),
        back: back.map(|(_, field)| carve(field, 1)),
        frames,
        pose: BlockPose::draw(&mut scan_rng),
        scan: ScanNoise::draw(within(ranges.noise_mm, &mut scan_rng), &mut scan_rng),
        support,
    }
}
