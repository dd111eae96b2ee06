//! One pair of the dataset, from its seed: carve, scan, print, and the truth about it.

use image::ImageError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::artwork::Artwork;
use super::damage::Damage;
use super::field::Field;
use super::glyph::Glyphs;
use super::ink::Inking;
use super::picture_file::PictureFormat;
use super::polygon::Polygon;
use super::pose::Pose;
use super::print::{Impression, PrintFrame, print};
use super::relief::{Carving, relief};
use super::scan::{ScanStyle, scan};
use super::tier::Tier;
use super::truth::{Known, TruthLine};
use crate::domain::ContentHash;
use crate::mesh::Mesh;
use crate::mesh::write::MeshFormat;
use crate::raster::png_grey8;

/// Everything about a pair, its files as bytes.
pub(super) struct Pair {
    /// File stem and manifest id.
    pub id: String,
    /// The character, as text.
    pub character: String,
    /// The unit's name, if it is known.
    pub unit: Option<&'static str>,
    /// Whether the carved side looks down, where someone wrote it down.
    pub scanned_face_down: Option<bool>,
    /// Whether the mesh has walls and a foot.
    pub is_closed: bool,
    /// The mesh, in mesh coordinates.
    pub mesh: Mesh,
    /// How the mesh is stored.
    pub mesh_format: MeshFormat,
    /// The print's file.
    pub print: Vec<u8>,
    /// Its file name's ending.
    pub print_extension: &'static str,
    /// The tops mask's file.
    pub tops: Vec<u8>,
    /// The truth.
    pub truth: TruthLine,
}

/// The random numbers of one pair: a function of the seed, the tier and the pair's place alone.
pub(super) fn rng_of(seed: u64, tier: Tier, index: u64) -> ChaCha8Rng {
    let name = format!("mocban demo {tier} {seed} {index}");
    ChaCha8Rng::from_seed(*ContentHash::of(name.as_bytes()).as_bytes())
}

/// File stem of a pair.
pub(super) fn id_of(tier: Tier, index: u64) -> String {
    format!("{tier}-{index:04}")
}

/// Makes a pair of the tiers that are drawn from the font.
///
/// # Errors
/// When a picture cannot be encoded.
pub(super) fn drawn_pair(
    glyphs: &Glyphs,
    tier: Tier,
    seed: u64,
    index: u64,
) -> Result<Pair, ImageError> {
    let mut rng = rng_of(seed, tier, index);
    let rng = &mut rng;
    let characters = glyphs.characters();
    let character = characters[rng.random_range(0..characters.len())];
    let artwork = Artwork::of_glyph(glyphs, character, rng);
    let block_around = artwork.surroundings(glyphs, rng);
    let print_around = if tier.is_damaged() {
        artwork.surroundings(glyphs, rng)
    } else {
        block_around.clone()
    };
    let damage = if tier.is_damaged() {
        Damage::draw(&artwork, rng)
    } else {
        Damage::default()
    };
    let outline = cut(&artwork, rng);
    let frame = PrintFrame::draw(&outline, rng);
    let frame = frame.expect("a similarity of positive scale has an inverse");
    let inking = Inking::draw(&artwork.strokes, &print_around, tier, rng);
    let impression = Impression {
        inking: &inking,
        damage: &damage,
        outline: &outline,
        tier,
    };
    let picture = print(&impression, &frame, rng);
    let format = PictureFormat::draw(rng);
    let relics = Relics {
        id: id_of(tier, index),
        character,
        artwork: &artwork,
        around: [&block_around, &print_around],
        damage: &damage,
        frame: &frame,
        print: format.encode(&picture)?,
        print_extension: format.extension(),
    };
    Ok(finish(relics, tier, rng))
}

/// What is fixed once the print is there.
pub(super) struct Relics<'a> {
    /// File stem.
    pub id: String,
    /// The character.
    pub character: char,
    /// Its strokes.
    pub artwork: &'a Artwork,
    /// Neighbours on the block and on the print.
    pub around: [&'a Field; 2],
    /// Damage to the block.
    pub damage: &'a Damage,
    /// The print's frame.
    pub frame: &'a PrintFrame,
    /// The print's file.
    pub print: Vec<u8>,
    /// Its ending.
    pub print_extension: &'static str,
}

/// Carves and scans the block and writes down the truth.
pub(super) fn finish(relics: Relics, tier: Tier, rng: &mut ChaCha8Rng) -> Pair {
    let remaining = relics.damage.remaining(&relics.artwork.strokes);
    let carving = Carving {
        strokes: &remaining,
        around: relics.around[0],
        damage: relics.damage,
        bow_mm: tier.bow_mm(),
    };
    let surface = relief(&carving, rng);
    let style = ScanStyle::draw(tier.is_damaged(), rng);
    let outline = cut(relics.artwork, rng);
    let mut mesh = scan(&surface, &outline, &style, rng);
    let pose = Pose::draw(tier, rng);
    for vertex in &mut mesh.vertices {
        *vertex = pose.mesh_from_block(*vertex);
    }
    let known = Known {
        strokes: &relics.artwork.strokes,
        remaining: &remaining,
        around: relics.around,
        damage: relics.damage,
        surface: &surface,
    };
    let truth = TruthLine {
        print_from_mesh: pose.print_from_mesh(&relics.frame.print_from_uv),
        plane: pose.tops_plane(),
        landmarks: known.landmarks(&pose, rng),
        char_height_px: known.height_px(relics.frame),
        tops_mask: format!("tops/{}.png", relics.id),
        id: relics.id.clone(),
    };
    Pair {
        id: relics.id,
        character: relics.character.to_string(),
        unit: pose.unit.map(crate::domain::LengthUnit::name),
        scanned_face_down: rng.random_bool(0.3).then(|| pose.is_face_down()),
        is_closed: style.is_closed,
        mesh_format: draw_format(mesh.vertices.len(), rng),
        mesh,
        print: relics.print,
        print_extension: relics.print_extension,
        tops: png_grey8(&known.tops_mask(relics.frame)),
        truth,
    }
}

/// The polygon along which a scan or a print is cut out.
fn cut(artwork: &Artwork, rng: &mut ChaCha8Rng) -> Polygon {
    let margin_mm = rng.random_range(0.3..0.75);
    Polygon::around(artwork.ink_box, margin_mm, 1.1, rng)
}

/// Mostly binary STL, as in the field.
fn draw_format(vertices: usize, rng: &mut ChaCha8Rng) -> MeshFormat {
    match rng.random_range(0..20_u32) {
        10..=12 => MeshFormat::PlyLittleEndian,
        13..=14 => MeshFormat::PlyBigEndian,
        15..=16 => MeshFormat::PlyAscii,
        // Text triangle by triangle is six times the size: small scans only.
        17 if vertices < 40_000 => MeshFormat::StlAscii,
        18..=19 => MeshFormat::Obj,
        _ => MeshFormat::StlBinary,
    }
}

#[cfg(test)]
mod tests {
    use super::{Pair, drawn_pair};
    use crate::demo::calligraphy;
    use crate::demo::glyph::Glyphs;
    use crate::demo::tier::Tier;
    use crate::demo::truth::TOP;
    use crate::raster::{Grid, decode_grey8};

    fn pair(tier: Tier, index: u64) -> Pair {
        match tier {
            Tier::Real => calligraphy::pair(11, index),
            Tier::Upright | Tier::Pose | Tier::Hard => {
                drawn_pair(&Glyphs::embedded(), tier, 11, index)
            }
        }
        .expect("pictures encode")
    }

    /// The mask's value where the true map sends a mesh point, and its height in shares of the character's height.
    fn seen(pair: &Pair, tops: &Grid<u8>, point: [f64; 3]) -> Option<(u8, f64)> {
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
                let tops = decode_grey8(&pair.tops).expect("the mask is a PNG");
                // A bend of 0.8 mm is a tenth of a character of 8 mm.
                let level = if tier == Tier::Hard { 0.12 } else { 0.025 };
                assert!((12..=40).contains(&pair.truth.landmarks.len()));
                for landmark in &pair.truth.landmarks {
                    let (value, height) = seen(&pair, &tops, *landmark).expect("inside the print");
                    assert_eq!(value, TOP, "{}", pair.id);
                    assert!(height.abs() < level, "{}: {height}", pair.id);
                }
            }
        }
    }

    #[test]
    fn mesh_is_high_where_the_tops_mask_says_so_and_low_elsewhere() {
        for tier in [Tier::Upright, Tier::Pose, Tier::Real] {
            let pair = pair(tier, 1);
            let tops = decode_grey8(&pair.tops).expect("the mask is a PNG");
            let (mut tops_high, mut tops_all, mut ground_low, mut ground_all) = (0, 0, 0, 0);
            for vertex in &pair.mesh.vertices {
                match seen(&pair, &tops, *vertex) {
                    // Below the ground there are only side walls and foot.
                    Some((_, height)) if height < -0.175 => {}
                    Some((TOP, height)) => {
                        tops_all += 1;
                        tops_high += i32::from(height > -0.03);
                    }
                    Some((0, height)) => {
                        ground_all += 1;
                        ground_low += i32::from(height < -0.01);
                    }
                    Some(_) | None => {}
                }
            }
            let share = |part: i32, all: i32| f64::from(part) / f64::from(all.max(1));
            assert!(
                share(tops_high, tops_all) > 0.97,
                "{tier}: {tops_high} of {tops_all}"
            );
            assert!(
                share(ground_low, ground_all) > 0.93,
                "{tier}: {ground_low} of {ground_all}"
            );
        }
    }

    #[test]
    fn scans_hold_twenty_to_a_hundred_and_fifty_thousand_vertices() {
        for index in 0..4 {
            let vertices = pair(Tier::Hard, index).mesh.vertices.len();
            assert!((18_000..165_000).contains(&vertices), "{vertices}");
        }
    }
}
