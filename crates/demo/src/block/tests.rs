//! Tests of whole worlds: what the files contain agrees with the truth.

use std::collections::HashMap;
use std::sync::LazyLock;

use super::{BlockKind, BlockOptions, BlockTruth, BlockWorld, FaceSide};
use mocban_core::mesh::{Mesh, MeshLimits, read};
use mocban_core::raster::{Grid, ImageLimits, decode};

const SPACING_MM: f64 = 0.6;

fn world(seed: u64, kind: BlockKind, spacing_mm: f64) -> BlockWorld {
    BlockWorld::new(BlockOptions {
        kind,
        seed,
        spacing_mm,
    })
}

/// A block with text on both sides, whose page is of the back.
static BACK: LazyLock<BlockWorld> = LazyLock::new(|| world(5, BlockKind::Back, SPACING_MM));

fn mesh_bytes(world: &BlockWorld) -> Vec<u8> {
    let mut bytes = Vec::new();
    world
        .write_mesh(&mut bytes)
        .expect("memory takes every byte");
    bytes
}

fn mesh_of(world: &BlockWorld) -> Mesh {
    let bytes = mesh_bytes(world);
    read(&bytes, "block", &MeshLimits::SUGGESTED).expect("a complete mesh")
}

fn applied(matrix: &[[f64; 4]; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| {
        let [a, b, c, d] = matrix[i];
        a * x + b * y + c * z + d
    })
}

/// The heights of the printed side's vertices, in cells of the spacing: the highest of each cell, mm.
fn heights(mesh: &Mesh, truth: &BlockTruth) -> HashMap<[i64; 2], f64> {
    let mut heights = HashMap::new();
    for index in 0..mesh.vertices.len() {
        let [u, v, height] = applied(&truth.face_from_mesh, mesh.vertices.at(index));
        let cell = [u, v].map(|c| (c / SPACING_MM).floor() as i64);
        let highest = heights.entry(cell).or_insert(f64::NEG_INFINITY);
        *highest = height.max(*highest);
    }
    heights
}

/// Returns the grey values of the page, 0..=255.
fn grey_page(world: &BlockWorld) -> Grid<f64> {
    let page = decode(&world.page().bytes, &ImageLimits::SUGGESTED).expect("an image");
    page.rgb
        .map(|pixel| pixel.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0 / 257.0)
}

/// Returns the fraction of the pixels of a box that are darker than `limit`. The box includes its last column and row
/// and must lie in the image.
fn dark_share(page: &Grid<f64>, [x0, y0, x1, y1]: [i64; 4], limit: f64) -> f64 {
    let pixels = (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| (x, y)));
    let found: Vec<f64> = pixels.filter_map(|(x, y)| page.get(x, y)).collect();
    found.iter().filter(|grey| **grey < limit).count() as f64 / found.len() as f64
}

#[test]
fn landmarks_lie_on_stroke_tops_of_the_written_mesh() {
    let truth = BACK.truth();
    let mesh = mesh_of(&BACK);
    assert_eq!(mesh.triangles.len(), truth.triangles);
    let heights = heights(&mesh, &truth);
    let (mut near, mut all) = (0, 0);
    for character in truth
        .characters
        .iter()
        .filter(|character| !character.damaged)
    {
        assert_eq!(character.landmarks.len(), 12, "{}", character.name);
        for landmark in &character.landmarks {
            let [u, v, top] = applied(&truth.face_from_mesh, landmark.mesh);
            let [left, up, right, down] = character.box_mm;
            assert!((left..=right).contains(&u) && (up..=down).contains(&v));
            let [x, y] = [u, v].map(|c| (c / SPACING_MM).floor() as i64);
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
            let highest = around.filter_map(|cell| heights.get(&cell).copied());
            let highest = highest.fold(f64::NEG_INFINITY, f64::max);
            near += u32::from((highest - top).abs() < 0.3);
            all += 1;
        }
    }
    assert!(near * 100 >= all * 98, "{near} of {all}");
    // The ground between the strokes is lower.
    let low = heights.values().filter(|height| **height < -1.0).count();
    assert!(low * 3 > heights.len(), "{low} of {}", heights.len());
}

#[test]
fn boxes_contain_exactly_the_ink() {
    let truth = BACK.truth();
    let page = grey_page(&BACK);
    let mut sorted: Vec<f64> = page.data().iter().step_by(97).copied().collect();
    sorted.sort_by(f64::total_cmp);
    let paper = sorted[sorted.len() / 2];
    let ink = sorted[sorted.len() / 50];
    let limit = f64::midpoint(paper, ink);
    let (mut filled, mut clear, mut sides) = (0, 0, 0);
    for character in truth.characters.iter().filter(|c| c.on_page && !c.damaged) {
        let edges = character.box_px.expect("ink on the page");
        let [x0, y0, x1, y1] = [
            (edges[0] + 0.5) as i64,
            (edges[1] + 0.5) as i64,
            (edges[2] - 0.5) as i64,
            (edges[3] - 0.5) as i64,
        ];
        let just_inside = [
            [x0, y0, x0 + 2, y1],
            [x1 - 2, y0, x1, y1],
            [x0, y0, x1, y0 + 2],
            [x0, y1 - 2, x1, y1],
        ];
        let just_outside = [
            [x0 - 4, y0, x0 - 2, y1],
            [x1 + 2, y0, x1 + 4, y1],
            [x0, y0 - 4, x1, y0 - 2],
            [x0, y1 + 2, x1, y1 + 4],
        ];
        for side in just_inside {
            filled += u32::from(dark_share(&page, side, limit) > 0.01);
        }
        for side in just_outside {
            clear += u32::from(dark_share(&page, side, limit) < 0.01);
        }
        sides += 4;
    }
    assert!(sides > 300, "{sides}");
    assert!(
        filled * 100 >= sides * 95,
        "ink at {filled} of {sides} sides"
    );
    // Neighbours and rules come near a few boxes.
    assert!(
        clear * 100 >= sides * 80,
        "no ink beyond {clear} of {sides} sides"
    );
}

#[test]
fn page_landmarks_lie_in_their_boxes() {
    let truth = BACK.truth();
    for character in truth
        .characters
        .iter()
        .filter(|character| character.on_page)
    {
        let [x0, y0, x1, y1] = character.box_px.expect("ink on the page");
        for landmark in &character.landmarks {
            let [x, y] = landmark.page.expect("the page belongs to the block");
            let is_inside = x >= x0 - 3.0 && x <= x1 + 3.0 && y >= y0 - 3.0 && y <= y1 + 3.0;
            assert!(is_inside || character.lost > 0.0, "{}", character.name);
        }
    }
}

#[test]
fn text_is_carved_in_mirror_writing_on_both_sides() {
    for world in [&*BACK, &world(3, BlockKind::QuarterTurn, 2.0)] {
        let truth = world.truth();
        let characters = truth
            .characters
            .iter()
            .filter(|character| character.on_page);
        let corners: Vec<_> = characters.map(|c| (c.centre, c.landmarks[0])).collect();
        let [first, middle, last] = [0, corners.len() / 2, corners.len() - 1].map(|k| corners[k].1);
        let edges = [middle, last].map(|landmark| {
            let on_block = [0, 1, 2].map(|i| landmark.mesh[i] - first.mesh[i]);
            let (to, from) = (
                landmark.page.expect("on the page"),
                first.page.expect("on the page"),
            );
            (on_block, [to[0] - from[0], to[1] - from[1]])
        });
        let [(a, p), (b, q)] = edges;
        let outward: f64 = (0..3)
            .map(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                (a[j] * b[k] - a[k] * b[j]) * truth.normal[i]
            })
            .sum();
        // y points down on the page, so a positive cross product means clockwise, as seen by the reader. On the block,
        // it means counterclockwise, as seen from outside.
        let on_page = p[0] * q[1] - p[1] * q[0];
        assert!(outward * on_page > 0.0, "{:?}", truth.kind);
    }
    assert_eq!(BACK.truth().side, FaceSide::Back);
}

#[test]
fn closed_mesh_is_watertight_and_encloses_a_block() {
    let mesh = mesh_of(&BACK);
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for triangle in &*mesh.triangles {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|balance| *balance == 0));
    assert_eq!(edges.len() * 2, mesh.triangles.len() * 3);
    let mut volume = 0.0;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.vertices.at(corner as usize));
        let cross = [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            b[j] * c[k] - b[k] * c[j]
        });
        volume += (0..3).map(|i| a[i] * cross[i]).sum::<f64>() / 6.0;
    }
    let truth = BACK.truth();
    let thickness = volume * truth.unit.mm().powi(3) / (truth.block_mm[0] * truth.block_mm[1]);
    assert!((10.0..25.0).contains(&thickness), "{thickness} mm");
}

#[test]
fn same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let again = pool.install(|| world(5, BlockKind::Back, SPACING_MM));
    assert!(again.page().bytes == BACK.page().bytes);
    assert!(again.labels_via() == BACK.labels_via());
    let truth = |world: &BlockWorld| serde_json::to_string(&world.truth()).expect("plain values");
    assert_eq!(truth(&again), truth(&BACK));
    assert!(pool.install(|| mesh_bytes(&again)) == mesh_bytes(&BACK));
}

#[test]
fn half_pages_show_about_half_of_the_characters() {
    for kind in [BlockKind::HalfPage, BlockKind::OpenedBook] {
        let truth = world(2, kind, 3.0).truth();
        let shown = truth
            .characters
            .iter()
            .filter(|character| character.on_page)
            .count();
        let share = shown as f64 / truth.characters.len() as f64;
        assert!((0.3..0.65).contains(&share), "{kind}: {share}");
        let middle = |c: &super::BlockCharacterTruth| f64::midpoint(c.box_mm[0], c.box_mm[2]);
        let us = truth
            .characters
            .iter()
            .filter(|character| character.on_page)
            .map(middle);
        let (least, most) = us.fold((f64::MAX, f64::MIN), |(a, b), u| (a.min(u), b.max(u)));
        assert!(least > 0.0 || most < 0.0, "{kind}: {least} to {most}");
    }
}

#[test]
fn page_of_another_block_has_labels_but_no_truth() {
    let world = world(2, BlockKind::WrongPage, 3.0);
    let truth = world.truth();
    assert!(!truth.belongs && truth.map.is_empty());
    assert!(
        truth
            .characters
            .iter()
            .all(|c| c.box_px.is_none() && !c.on_page)
    );
    assert!(truth.characters[0].landmarks[0].page.is_none());
    let labels: serde_json::Value = serde_json::from_slice(&world.labels_via()).expect("JSON");
    let key = format!("{}{}", world.page_name(), world.page().bytes.len());
    let regions = labels["_via_img_metadata"][key]["regions"]
        .as_array()
        .expect("regions");
    assert!(regions.len() > 80);
}

#[test]
fn labels_are_the_boxes_of_the_page_within_their_slack() {
    let truth = BACK.truth();
    let labels: serde_json::Value = serde_json::from_slice(&BACK.labels_via()).expect("JSON");
    let key = format!("{}{}", BACK.page_name(), BACK.page().bytes.len());
    let regions = labels["_via_img_metadata"][key]["regions"]
        .as_array()
        .expect("regions");
    let shown: Vec<_> = truth
        .characters
        .iter()
        .filter(|character| character.on_page)
        .collect();
    assert_eq!(regions.len(), shown.len());
    for (region, character) in regions.iter().zip(shown) {
        assert_eq!(region["region_attributes"]["name"], character.name);
        let number = |key: &str| region["shape_attributes"][key].as_f64().expect("a number");
        let [x0, y0, x1, y1] = character
            .box_px
            .expect("ink on the page")
            .map(|edge| edge + 0.5);
        let slack = [x1 - x0, y1 - y0].map(|size| 0.03 * size + 1.0);
        assert!((number("x") - x0).abs() <= slack[0] && (number("y") - y0).abs() <= slack[1]);
        assert!((number("x") + number("width") - x1).abs() <= slack[0] + 1.0);
        assert!((number("y") + number("height") - y1).abs() <= slack[1] + 1.0);
    }
}
