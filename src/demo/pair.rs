//! Makes one pair of the dataset: carves, scans and prints a character and records the ground truth.

use image::ImageError;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::artwork::Artwork;
use super::carving::carve;
use super::glyph::Glyphs;
use super::polygon::Polygon;
use super::print_format::encode_print;
use super::rendered_print::{PrintFrame, render_print};
use super::scan_pose::ScanPose;
use super::scanner::{ScanStyle, scan};
use super::scene::{Scene, pair_rng};
use super::tier::Tier;
use super::truth_line::{TruthLine, TruthSource};
use crate::domain::LengthUnit;
use crate::mesh::Mesh;
use crate::mesh::write::MeshFormat;
use crate::raster::Grid;

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
    /// Mask of the stroke tops in the print frame: 255 = stroke top, 0 = background, 128 = excluded from the score.
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

/// Makes a pair of a tier other than `real`: the character comes from the font.
///
/// # Errors
/// Returns an error if the print cannot be encoded.
pub(super) fn drawn_pair(
    glyphs: &Glyphs,
    tier: Tier,
    seed: u64,
    index: u64,
    vertices: Option<u32>,
) -> Result<DemoPair, ImageError> {
    let mut rng = pair_rng(seed, tier, index);
    let scene = Scene::draw(glyphs, tier, index, &mut rng);
    let printed = print(&scene, &mut rng)?;
    Ok(finish_pair(&scene, printed, vertices, &mut rng))
}

/// Prints the block and cuts the character out of the print.
fn print(scene: &Scene, rng: &mut ChaCha8Rng) -> Result<Printed, ImageError> {
    let outline = cut_outline(&scene.artwork, rng);
    let frame = PrintFrame::draw(&outline, rng);
    let picture = render_print(scene, &outline, &frame, rng);
    let (bytes, extension) = encode_print(&picture, rng)?;
    Ok(Printed {
        frame,
        bytes,
        extension,
    })
}

/// Carves and scans the damaged block and records the ground truth.
pub(super) fn finish_pair(
    scene: &Scene,
    printed: Printed,
    vertices: Option<u32>,
    rng: &mut ChaCha8Rng,
) -> DemoPair {
    let remaining = scene.damage.remaining(&scene.artwork.strokes);
    let surface = carve(scene, &remaining, rng);
    let style = ScanStyle::draw(scene.tier.is_damaged(), vertices, rng);
    let mut mesh = scan(&surface, &cut_outline(&scene.artwork, rng), &style, rng);
    let pose = ScanPose::draw(scene.tier, rng);
    mesh.vertices
        .map_in_place(|vertex| pose.mesh_from_block(vertex));
    let truth_source = TruthSource {
        scene,
        remaining: &remaining,
        surface: &surface,
    };
    let frame = &printed.frame;
    DemoPair {
        truth: truth_source.line(&pose, frame, rng),
        tops: truth_source.tops_mask(frame),
        scanned_face_down: rng.random_bool(0.3).then(|| pose.is_face_down()),
        mesh_format: draw_mesh_format(mesh.vertices.len(), rng),
        id: scene.id.clone(),
        character: scene.character.to_string(),
        unit: pose.unit.map(LengthUnit::name),
        is_closed: style.is_closed,
        mesh,
        print: printed.bytes,
        print_extension: printed.extension,
    }
}

/// Draws the polygon along which a scan or a print is cut.
fn cut_outline(artwork: &Artwork, rng: &mut ChaCha8Rng) -> Polygon {
    let margin_mm = rng.random_range(0.3..0.75);
    Polygon::around(artwork.stroke_bounds, margin_mm, 1.1, rng)
}

/// Draws a mesh format, mostly binary STL as in published data.
fn draw_mesh_format(vertices: usize, rng: &mut ChaCha8Rng) -> MeshFormat {
    match rng.random_range(0..20_u32) {
        10..=12 => MeshFormat::PlyLittleEndian,
        13..=14 => MeshFormat::PlyBigEndian,
        15..=16 => MeshFormat::PlyAscii,
        // ASCII STL is six times larger, so it is used for small scans only.
        17 if vertices < 40_000 => MeshFormat::StlAscii,
        18..=19 => MeshFormat::Obj,
        _ => MeshFormat::StlBinary,
    }
}

#[cfg(test)]
mod tests {
    use super::DemoPair;
    use crate::demo::PairGenerator;
    use crate::demo::tier::Tier;
    use crate::demo::truth_line::{IGNORED, STROKE_TOP};
    use crate::raster::Grid;

    fn pair(tier: Tier, index: u64) -> DemoPair {
        PairGenerator::new(tier, 11)
            .pair(index)
            .expect("images encode")
    }

    /// Maps a mesh point to the print by the ground truth. Returns the mask's value there, and the point's height over
    /// the true plane as a share of the character's height. Returns `None` outside the mask.
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
            for index in 0..3 {
                let pair = pair(tier, index);
                // A bend of 0.8 mm is a tenth of an 8 mm character.
                let level = if tier == Tier::Hard { 0.12 } else { 0.025 };
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
