//! One pair of the dataset, from its seed: carve, scan, print, and the truth about it.

use image::ImageError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::artwork::Artwork;
use super::damage::Damage;
use super::field::Field;
use super::glyph::Glyphs;
use super::ink::Inking;
use super::picture_file::{PictureFormat, grey_png};
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
    finish(relics, tier, rng)
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
pub(super) fn finish(relics: Relics, tier: Tier, rng: &mut ChaCha8Rng) -> Result<Pair, ImageError> {
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
    Ok(Pair {
        id: relics.id,
        character: relics.character.to_string(),
        unit: pose.unit.map(crate::domain::LengthUnit::name),
        scanned_face_down: rng.random_bool(0.3).then(|| pose.is_face_down()),
        is_closed: style.is_closed,
        mesh_format: draw_format(mesh.vertices.len(), rng),
        mesh,
        print: relics.print,
        print_extension: relics.print_extension,
        tops: grey_png(&known.tops_mask(relics.frame))?,
        truth,
    })
}

/// The polygon along which a scan or a print is cut out.
fn cut(artwork: &Artwork, rng: &mut ChaCha8Rng) -> Polygon {
    let margin_mm = rng.random_range(0.3..0.75);
    Polygon::around(artwork.ink_box, margin_mm, 1.1, rng)
}

/// Mostly binary STL, as in the field.
fn draw_format(vertices: usize, rng: &mut ChaCha8Rng) -> MeshFormat {
    match rng.random_range(0..20_u32) {
        0..=9 => MeshFormat::StlBinary,
        10..=12 => MeshFormat::PlyLittleEndian,
        13..=14 => MeshFormat::PlyBigEndian,
        15..=16 => MeshFormat::PlyAscii,
        // Text triangle by triangle is six times the size: small scans only.
        17 if vertices < 40_000 => MeshFormat::StlAscii,
        17 => MeshFormat::StlBinary,
        _ => MeshFormat::Obj,
    }
}
