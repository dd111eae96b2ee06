//! A generated page that is registered with its block.

use std::fs;
use std::path::{Path, PathBuf};

use mocban_align::block::{
    CarvedFace, CharacterBox, FoundBox, HEIGHT_STEP_MM, HeightHeader, MAX_MAP_PIXELS, Orientation,
    PageInk, PageMap, PlacedCharacters, StoredHeights, StoredPageMap, Support, align_at,
    draw_height_maps, find_boxes, place_characters,
};
use mocban_core::domain::{Affine2, ControlPoint};
use mocban_core::mesh::{MeshLimits, read};
use mocban_core::raster::{ImageLimits, PrintImage, decode, decode_grey16, png_grey16};
use mocban_demo::block::{BlockKind, BlockOptions, BlockTruth, BlockWorld};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Spacing of the scan, mm: coarser than a usual scan, which finds the same boxes faster.
const SPACING_MM: f64 = 0.4;

/// A page and the face that printed it.
pub(super) struct RegisteredPage {
    pub(super) face: CarvedFace,
    pub(super) image: PrintImage,
    pub(super) ink: PageInk,
    pub(super) map: PageMap,
    pub(super) support: Support,
    pub(super) truth: BlockTruth,
}

/// What is stored of a page beside its images.
#[derive(Serialize, Deserialize)]
struct Stored {
    header: HeightHeader,
    map: StoredPageMap,
    support: Support,
    truth: BlockTruth,
}

impl RegisteredPage {
    /// Makes a page, or reads it from a folder; `None` if it is refused.
    pub(super) fn of(kind: BlockKind, seed: u64, dir: Option<&Path>) -> Option<Self> {
        let stem = dir.map(|dir| dir.join("registered").join(format!("{kind}-{seed}")));
        if let Some(page) = stem.as_deref().and_then(Self::read) {
            return Some(page);
        }
        let world = BlockWorld::new(BlockOptions {
            kind,
            seed,
            spacing_mm: SPACING_MM,
        });
        let image = decode(&world.page().bytes, &ImageLimits::SUGGESTED).expect("an image");
        let ink = PageInk::of(&image).ok()?;
        let truth = world.truth();
        let stored = faces(&world);
        let carved = stored.iter().filter_map(CarvedFace::of);
        let points = landmarks(&truth);
        let (side, face) = carved
            .enumerate()
            .max_by_key(|(_, face)| shown(face, &truth))?;
        let (map, support) = registered(&face, &ink, &points, &truth);
        let page = Self {
            face,
            image,
            ink,
            map,
            support,
            truth,
        };
        if let Some(stem) = stem {
            page.write(&stem, &stored[side], &world.page().bytes);
        }
        Some(page)
    }

    fn write(&self, stem: &Path, heights: &StoredHeights, image: &[u8]) {
        let stored = Stored {
            header: heights.header,
            map: StoredPageMap::from(&self.map),
            support: self.support.clone(),
            truth: self.truth.clone(),
        };
        fs::create_dir_all(stem.parent().expect("a folder")).expect("created");
        let write = |extension: &str, bytes: &[u8]| {
            fs::write(stem.with_extension(extension), bytes).expect("written");
        };
        write("heights", &png_grey16(&heights.values));
        write("image", image);
        write("json", &serde_json::to_vec(&stored).expect("JSON"));
    }

    fn read(stem: &Path) -> Option<Self> {
        let read = |extension: &str| fs::read(PathBuf::from(stem).with_extension(extension)).ok();
        let stored: Stored = serde_json::from_slice(&read("json")?).ok()?;
        let heights = StoredHeights {
            header: stored.header,
            values: decode_grey16(&read("heights")?).ok()?,
        };
        let image = decode(&read("image")?, &ImageLimits::SUGGESTED).ok()?;
        Some(Self {
            face: CarvedFace::of(&heights)?,
            ink: PageInk::of(&image).ok()?,
            image,
            map: PageMap::try_from(stored.map).ok()?,
            support: stored.support,
            truth: stored.truth,
        })
    }

    /// Finds the characters.
    pub(super) fn find(&self) -> Vec<FoundBox> {
        find_boxes(&self.face, &self.ink, &self.map)
    }

    /// Places boxes on the face.
    pub(super) fn place(&self, boxes: &[CharacterBox]) -> PlacedCharacters {
        place_characters(&self.face, &self.ink, (&self.map, &self.support), boxes)
    }
}

/// Returns points of the mesh and of the page, one of each character.
fn landmarks(truth: &BlockTruth) -> Vec<ControlPoint> {
    let first = truth
        .characters
        .iter()
        .filter_map(|one| one.landmarks.first());
    let points = first.filter_map(|one| {
        Some(ControlPoint {
            mesh: one.mesh,
            page: one.page?,
        })
    });
    points.collect()
}

/// Returns 1 for the side that is printed, 0 for the other one.
fn shown(face: &CarvedFace, truth: &BlockTruth) -> u8 {
    let normal = face.map.frame.axes[2];
    u8::from((0..3).map(|k| normal[k] * truth.normal[k]).sum::<f64>() > 0.0)
}

/// Registers a page from the true positions. Pages with too few characters for it get the true map.
fn registered(
    face: &CarvedFace,
    ink: &PageInk,
    points: &[ControlPoint],
    truth: &BlockTruth,
) -> (PageMap, Support) {
    if let Ok(found) = align_at(face, ink, points) {
        return (found.map, found.support);
    }
    let on_face = |mesh: [f64; 3]| {
        let [u, v, _] = face.map.frame.face_from_mesh(mesh);
        [u, v]
    };
    let affine = fitted(points.iter().map(|point| (on_face(point.mesh), point.page)));
    let true_from_face = fitted(truth.characters.iter().map(|one| {
        let [left, top, right, bottom] = one.box_mm;
        let middle = [f64::midpoint(left, right), f64::midpoint(top, bottom)];
        (on_face(one.centre), middle)
    }));
    let soft = &face.relief.soft;
    let size = [soft.width(), soft.height()].map(|pixels| pixels as f64 * HEIGHT_STEP_MM);
    let origin = face.map.origin_mm;
    let end = [origin[0] + size[0], origin[1] + size[1]];
    let columns = (size[0] / 10.0) as usize + 2;
    let support = Support {
        origin_mm: origin,
        columns,
        percent: vec![100; columns * ((size[1] / 10.0) as usize + 2)],
    };
    let map = PageMap::affine(&affine, origin, end);
    let face_from_page = affine.inverse().expect("an invertible map");
    let shifts: Vec<[f64; 2]> = map
        .node_positions()
        .into_iter()
        .map(|node| {
            let target = face_from_page.apply(true_page(truth, true_from_face.apply(node)));
            [target[0] - node[0], target[1] - node[1]]
        })
        .collect();
    (map.shifted(&shifts), support)
}

/// Fits an affine map to pairs of points by least squares.
fn fitted(pairs: impl Iterator<Item = ([f64; 2], [f64; 2])>) -> Affine2 {
    let (mut normal, mut right) = (Matrix3::zeros(), [Vector3::zeros(); 2]);
    for ([u, v], page) in pairs {
        let row = Vector3::new(u, v, 1.0);
        normal += row * row.transpose();
        (0..2).for_each(|k| right[k] += row * page[k]);
    }
    let inverse = normal.try_inverse().expect("points that span the page");
    Affine2(right.map(|right| (inverse * right).into()))
}

/// Interpolates the true map between its recorded points, and continues it beyond them.
fn true_page(truth: &BlockTruth, point: [f64; 2]) -> [f64; 2] {
    let map = &truth.map;
    let columns = map.iter().take_while(|at| at[1] == map[0][1]).count();
    let rows = map.len() / columns;
    let step = map[1][0] - map[0][0];
    let cell = |k: usize, count: usize| {
        let at = (point[k] - map[0][k]) / step;
        let first = at.floor().clamp(0.0, count as f64 - 2.0);
        (first as usize, at - first)
    };
    let ((x, right), (y, down)) = (cell(0, columns), cell(1, rows));
    let at = |dx: usize, dy: usize| map[(y + dy) * columns + x + dx];
    [2, 3].map(|k: usize| {
        let row = |dy: usize| at(0, dy)[k] + right * (at(1, dy)[k] - at(0, dy)[k]);
        row(0) + down * (row(1) - row(0))
    })
}

/// Returns the heights of the faces of a block.
fn faces(world: &BlockWorld) -> Vec<StoredHeights> {
    let mut bytes = Vec::new();
    world
        .write_mesh(&mut bytes)
        .expect("memory takes every byte");
    let mesh = read(&bytes, "block", &MeshLimits::SUGGESTED).expect("a mesh");
    drop(bytes);
    let unit = Some(world.truth().unit);
    let (frame, part) = Orientation::find(&mut &mesh, unit).expect("an orientation");
    let maps = draw_height_maps(&mut &mesh, (&frame, &part), MAX_MAP_PIXELS).expect("heights");
    maps.into_iter().filter_map(|map| map.face()).collect()
}
