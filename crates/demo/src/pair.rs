//! Makes one pair of the dataset: carves, scans and prints a character and records the ground truth.

use image::ImageError;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::artwork::WIDE_MARGIN;
use super::block_body::BlockBody;
use super::carved_block::CarvedBlock;
use super::carving::carve;
use super::glyph::Glyphs;
use super::kind::{Base, Crop};
use super::other_pieces::add_other_pieces;
use super::polygon::Polygon;
use super::print_format::encode_print;
use super::rendered_print::{PrintFrame, render_print};
use super::scan_pose::ScanPose;
use super::scanner::{ScanStyle, scan};
use super::scene::{Scene, pair_rng};
use super::solvable::{is_legible, is_solvable};
use super::tear::SheetTear;
use super::tier::Tier;
use super::truth_line::TruthLine;
use mocban_core::domain::LengthUnit;
use mocban_core::mesh::Mesh;
use mocban_core::mesh::write::MeshFormat;
use mocban_core::raster::Grid;

/// A pair in memory.
pub struct DemoPair {
    /// Manifest id and file stem.
    pub id: String,
    /// The character, as text.
    pub character: String,
    /// Name of the length unit, if the manifest gives it.
    pub unit: Option<&'static str>,
    /// Whether the carved side faces down, if the manifest says so.
    pub scanned_face_down: Option<bool>,
    /// Whether the mesh has side walls and a base.
    pub is_closed: bool,
    /// The mesh, in mesh coordinates.
    pub mesh: Mesh,
    /// File format of the mesh.
    pub mesh_format: MeshFormat,
    /// Encoded print image.
    pub print: Vec<u8>,
    /// File name extension of the print.
    pub print_extension: &'static str,
    /// Mask of the true stroke tops, with the size of the print image: 255 = stroke top, 0 = background, 128 = excluded
    /// from the score.
    pub tops: Grid<u8>,
    /// Ground truth.
    pub truth: TruthLine,
}

/// An encoded print and its frame.
pub(super) struct Printed {
    /// Size and true map of the image.
    pub frame: PrintFrame,
    /// Encoded image.
    pub bytes: Vec<u8>,
    /// File name extension.
    pub extension: &'static str,
}

/// Makes a pair whose print is drawn, so not a photograph. The character is one of `characters`, which are in the font.
/// If the tier has a kind, draws again until print and relief both show the character.
pub(super) fn drawn_pair(
    glyphs: &Glyphs,
    characters: &[char],
    tier: Tier,
    seed: u64,
    index: u64,
    vertices: Option<u32>,
) -> Result<DemoPair, ImageError> {
    let mut attempt = 0;
    loop {
        let mut rng = pair_rng(seed, tier, index, attempt);
        let scene = Scene::draw(glyphs, characters, tier, index, &mut rng);
        if let Some(printed) = print(&scene, &mut rng)? {
            let block = CarvedBlock::draw(&scene, &mut rng);
            let tops = block.truth(&scene).tops_mask(&printed.frame);
            if tier.kind().is_none() || is_solvable(&block, &printed.frame, &tops) {
                return Ok(finish_pair(
                    glyphs, &scene, &block, printed, vertices, &mut rng,
                ));
            }
        }
        attempt += 1;
    }
}

/// Prints what another hand wrote: the character of a pair with strokes of other widths, lengths and places.
pub(super) fn print_by_another_hand(
    glyphs: &Glyphs,
    character: char,
    tier: Tier,
    seed: u64,
    index: u64,
) -> Result<Vec<u8>, ImageError> {
    let mut attempt = 0;
    loop {
        let mut rng = pair_rng(seed, tier, index, attempt);
        let mut scene = Scene::draw(glyphs, &[character], tier, index, &mut rng);
        scene.artwork = scene.artwork.by_another_hand(&mut rng);
        if let Some(printed) = print(&scene, &mut rng)? {
            return Ok(printed.bytes);
        }
        attempt += 1;
    }
}

/// Prints the block and cuts the character out of the print. Returns `None` if a kind's print is not legible.
fn print(scene: &Scene, rng: &mut ChaCha8Rng) -> Result<Option<Printed>, ImageError> {
    let outline = cut_outline(scene, Crop::WidePrint, rng);
    let tear = SheetTear::draw(scene, rng);
    let frame = PrintFrame::draw(&outline, scene, tear.as_ref(), rng);
    let picture = render_print(scene, &outline, &frame, tear.as_ref(), rng);
    if scene.tier.kind().is_some() && !is_legible(scene, &frame, tear.as_ref(), &picture) {
        return Ok(None);
    }
    let has_colours = scene
        .tier
        .kind()
        .is_some_and(|kind| !kind.colours.is_empty());
    let (bytes, extension) = encode_print(&picture, has_colours, rng)?;
    Ok(Some(Printed {
        frame,
        bytes,
        extension,
    }))
}

/// Scans the block and records the ground truth.
pub(super) fn finish_pair(
    glyphs: &Glyphs,
    scene: &Scene,
    block: &CarvedBlock,
    printed: Printed,
    vertices: Option<u32>,
    rng: &mut ChaCha8Rng,
) -> DemoPair {
    let (is_damaged, errors) = (scene.tier.is_damaged(), scene.conditions.scan);
    let mut style = ScanStyle::draw(is_damaged, errors, vertices, rng);
    if scene.conditions.base != Base::Ordinary {
        style.body = draw_body(glyphs, scene, rng);
    }
    let outline = cut_outline(scene, Crop::WideMesh, rng);
    let mut mesh = scan(block.scanned(), &outline, &style, rng);
    if let Some(slid) = &scene.conditions.slid {
        slid.slide(&mut mesh);
    }
    if scene.conditions.base == Base::OtherPieces {
        add_other_pieces(&mut mesh, glyphs, scene, &style, rng);
    }
    let pose = ScanPose::draw(scene.tier, rng);
    mesh.vertices
        .map_in_place(|vertex| pose.mesh_from_block(vertex));
    let truth_source = block.truth(scene);
    let frame = &printed.frame;
    DemoPair {
        truth: truth_source.line(&pose, frame, rng),
        tops: truth_source.tops_mask(frame),
        scanned_face_down: rng.random_bool(0.3).then(|| pose.is_face_down()),
        mesh_format: draw_mesh_format(mesh.vertices.len(), rng),
        id: scene.id.clone(),
        character: scene.character.to_string(),
        unit: pose.unit.map(LengthUnit::name),
        is_closed: style.body.has_bottom(),
        mesh,
        print: printed.bytes,
        print_extension: printed.extension,
    }
}

/// Draws what the scan contains besides the carved face.
fn draw_body(glyphs: &Glyphs, scene: &Scene, rng: &mut ChaCha8Rng) -> BlockBody {
    let depth_mm = scene.conditions.thickness * scene.artwork.size_mm;
    match scene.conditions.base {
        Base::Ordinary | Base::OtherPieces => BlockBody::Open,
        Base::Foot => BlockBody::foot(depth_mm, rng),
        Base::SecondFace => {
            let back = scene.another(glyphs, rng);
            BlockBody::SecondFace {
                depth_mm: depth_mm.max(3.5),
                surface: carve(&back, &back.artwork.strokes, rng),
            }
        }
        Base::Table => BlockBody::table(depth_mm, rng),
        Base::SeenThroughHoles => BlockBody::SeenThroughHoles { depth_mm },
    }
}

/// Draws the polygon along which a scan or a print is cut. If the scene's crop is `wide`, the polygon contains 3 x 3
/// characters.
fn cut_outline(scene: &Scene, wide: Crop, rng: &mut ChaCha8Rng) -> Polygon {
    let artwork = &scene.artwork;
    if scene.conditions.crop == Crop::WideRim && wide == Crop::WideMesh {
        let mut inner = artwork.stroke_bounds;
        for k in 0..2 {
            inner.min[k] -= artwork.size_mm * rng.random_range(0.2..WIDE_MARGIN);
            inner.max[k] += artwork.size_mm * rng.random_range(0.2..WIDE_MARGIN);
        }
        return Polygon::around(inner, 0.0, 1.1, rng);
    }
    let margin_mm = rng.random_range(0.3..0.75);
    if scene.conditions.crop == wide {
        let margin_mm = WIDE_MARGIN * artwork.size_mm;
        return Polygon::around(artwork.stroke_bounds, margin_mm, 1.1, rng);
    }
    Polygon::around(artwork.stroke_bounds, margin_mm, 1.1, rng)
}

/// Draws a mesh format, mostly binary STL as in published data.
fn draw_mesh_format(vertices: usize, rng: &mut ChaCha8Rng) -> MeshFormat {
    match rng.random_range(0..20_u32) {
        10..=12 => MeshFormat::PlyLittleEndian,
        13..=14 => MeshFormat::PlyBigEndian,
        15..=16 => MeshFormat::PlyAscii,
        // ASCII STL files are about six times as large as binary ones, so only small scans use them.
        17 if vertices < 40_000 => MeshFormat::StlAscii,
        18..=19 => MeshFormat::Obj,
        _ => MeshFormat::StlBinary,
    }
}

#[cfg(test)]
mod tests {
    use super::DemoPair;
    use crate::PairGenerator;
    use crate::tier::Tier;
    use crate::truth_line::{IGNORED, STROKE_TOP};
    use mocban_core::raster::Grid;

    fn pair(tier: Tier, index: u64) -> DemoPair {
        PairGenerator::new(tier, 11)
            .pair(index)
            .expect("images encode")
    }

    /// Maps a mesh point to the print by the ground truth. Returns the mask's value there, and the point's height over
    /// the true plane as a fraction of the character's height. Returns `None` outside the mask.
    fn height_at(pair: &DemoPair, tops: &Grid<u8>, point: [f64; 3]) -> Option<(u8, f64)> {
        let map = pair.truth.print_from_mesh;
        let [x, y, height] = map.apply(point);
        let [a, b, c, _] = map.0[0];
        let px_per_unit = (a * a + b * b + c * c).sqrt();
        let value = tops.get(x.round() as i64, y.round() as i64)?;
        Some((value, height * px_per_unit / pair.truth.char_height_px))
    }

    #[test]
    fn landmarks_fall_on_stroke_tops_at_the_plane() {
        for tier in Tier::ALL {
            for index in 0..if tier.kind().is_none() { 3 } else { 1 } {
                let pair = pair(tier, index);
                let level = match tier {
                    // A bend of 0.8 mm is a tenth of an 8 mm character. Wear changes heights as much.
                    Tier::Hard | Tier::Field | Tier::Mixed | Tier::Worn => 0.12,
                    _ => 0.04,
                };
                assert!((12..=40).contains(&pair.truth.landmarks.len()));
                for landmark in &pair.truth.landmarks {
                    let (value, height) =
                        height_at(&pair, &pair.tops, *landmark).expect("inside the print");
                    assert_eq!(value, STROKE_TOP, "{}", pair.id);
                    assert!(height.abs() < level, "{}: {height}", pair.id);
                }
            }
        }
    }

    /// Returns the mask, with `IGNORED` in each pixel that has a neighbour with a different value. A mesh point near an
    /// edge may be rounded to a pixel across the edge.
    fn without_edges(tops: &Grid<u8>) -> Grid<u8> {
        Grid::from_fn(tops.width(), tops.height(), |x, y| {
            let value = tops.at(x, y);
            let near = |i: i64| tops.get(x as i64 + i % 3 - 1, y as i64 + i / 3 - 1);
            let is_inner = (0..9).all(|i| near(i).is_none_or(|other| other == value));
            if is_inner { value } else { IGNORED }
        })
    }

    #[test]
    fn mesh_is_high_inside_the_tops_mask_and_low_outside() {
        for tier in [Tier::Upright, Tier::Pose, Tier::Real] {
            let pair = pair(tier, 1);
            let tops = without_edges(&pair.tops);
            let (mut tops_high, mut tops_all, mut background_low, mut background_all) =
                (0, 0, 0, 0);
            for vertex in pair.mesh.vertices.iter() {
                match height_at(&pair, &tops, vertex) {
                    // Only side walls and base lie below the carved background.
                    Some((_, height)) if height < -0.175 => {}
                    Some((STROKE_TOP, height)) => {
                        tops_all += 1;
                        tops_high += i32::from(height > -0.02);
                    }
                    Some((0, height)) => {
                        background_all += 1;
                        background_low += i32::from(height < -0.01);
                    }
                    Some(_) | None => {}
                }
            }
            let share = |part: i32, all: i32| f64::from(part) / f64::from(all);
            assert!(tops_all > 500 && background_all > 5000, "{tier}");
            assert!(
                share(tops_high, tops_all) > 0.99,
                "{tier}: {tops_high} of {tops_all}"
            );
            assert!(
                share(background_low, background_all) > 0.99,
                "{tier}: {background_low} of {background_all}"
            );
        }
    }

    #[test]
    fn scans_have_20000_to_150000_vertices() {
        for index in 0..4 {
            let vertices = pair(Tier::Hard, index).mesh.vertices.len();
            assert!((18_000..165_000).contains(&vertices), "{vertices}");
        }
    }
}
