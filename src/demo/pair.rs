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
use crate::domain::{ContentHash, LengthUnit};
use crate::mesh::Mesh;
use crate::mesh::write::MeshFormat;
use crate::raster::Grid;

/// Everything about a pair in memory.
pub struct Pair {
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
    /// The tops mask in the print's frame: 255 a stroke top, 0 none, 128 left out of the score.
    pub tops: Grid<u8>,
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

/// What a pair is made from: a character, what stands around it, what became of the block.
pub(super) struct Scene {
    /// Manifest id and file stem.
    pub id: String,
    /// How hard.
    pub tier: Tier,
    /// The character.
    pub character: char,
    /// Its strokes.
    pub artwork: Artwork,
    /// Neighbours and rules on the block.
    pub block_around: Field,
    /// Neighbours and rules on the print.
    pub print_around: Field,
    /// Damage to the block since it was printed.
    pub damage: Damage,
}

/// A print and its frame.
pub(super) struct Printed {
    /// Size and true map.
    pub frame: PrintFrame,
    /// The file's bytes.
    pub bytes: Vec<u8>,
    /// The file's ending.
    pub extension: &'static str,
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
    vertices: Option<u32>,
) -> Result<Pair, ImageError> {
    let mut rng = rng_of(seed, tier, index);
    let scene = Scene::draw(glyphs, tier, id_of(tier, index), &mut rng);
    let printed = scene.printed(&mut rng)?;
    Ok(scene.carved(printed, vertices, &mut rng))
}

impl Scene {
    fn draw(glyphs: &Glyphs, tier: Tier, id: String, rng: &mut ChaCha8Rng) -> Self {
        let characters = glyphs.characters();
        let character = characters[rng.random_range(0..characters.len())];
        let artwork = Artwork::of_glyph(glyphs, character, rng);
        let block_around = artwork.surroundings(glyphs, rng);
        let (print_around, damage) = if tier.is_damaged() {
            let other = artwork.surroundings(glyphs, rng);
            (other, Damage::draw(&artwork, rng))
        } else {
            (block_around.clone(), Damage::default())
        };
        Self {
            id,
            tier,
            character,
            artwork,
            block_around,
            print_around,
            damage,
        }
    }

    /// Prints the whole block on paper and cuts the character out.
    fn printed(&self, rng: &mut ChaCha8Rng) -> Result<Printed, ImageError> {
        let outline = cut(&self.artwork, rng);
        let frame = PrintFrame::draw(&outline, rng);
        let strokes = &self.artwork.strokes;
        let impression = Impression {
            inking: &Inking::draw(strokes, &self.print_around, self.tier, rng),
            damage: &self.damage,
            outline: &outline,
            tier: self.tier,
        };
        let picture = print(&impression, &frame, rng);
        let format = PictureFormat::draw(rng);
        Ok(Printed {
            frame,
            bytes: format.encode(&picture)?,
            extension: format.extension(),
        })
    }

    /// Carves and scans the block as it is now, and writes down the truth.
    pub(super) fn carved(
        self,
        printed: Printed,
        vertices: Option<u32>,
        rng: &mut ChaCha8Rng,
    ) -> Pair {
        let remaining = self.damage.remaining(&self.artwork.strokes);
        let surface = self.surface(&remaining, rng);
        let style = ScanStyle::draw(self.tier.is_damaged(), vertices, rng);
        let mut mesh = scan(&surface, &cut(&self.artwork, rng), &style, rng);
        let pose = Pose::draw(self.tier, rng);
        mesh.vertices.change(|vertex| pose.mesh_from_block(vertex));
        let known = Known {
            strokes: &self.artwork.strokes,
            remaining: &remaining,
            around: [&self.block_around, &self.print_around],
            damage: &self.damage,
            surface: &surface,
        };
        let frame = &printed.frame;
        Pair {
            truth: TruthLine::new(&self.id, &known, &pose, frame, rng),
            tops: known.tops_mask(frame),
            scanned_face_down: rng.random_bool(0.3).then(|| pose.is_face_down()),
            mesh_format: draw_format(mesh.vertices.len(), rng),
            id: self.id,
            character: self.character.to_string(),
            unit: pose.unit.map(LengthUnit::name),
            is_closed: style.is_closed,
            mesh,
            print: printed.bytes,
            print_extension: printed.extension,
        }
    }

    /// The carved surface with the strokes that are left.
    fn surface(&self, remaining: &Field, rng: &mut ChaCha8Rng) -> Field {
        let carving = Carving {
            strokes: remaining,
            around: &self.block_around,
            damage: &self.damage,
            bow_mm: self.tier.bow_mm(),
        };
        relief(&carving, rng)
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
    use super::Pair;
    use crate::demo::Pairs;
    use crate::demo::tier::Tier;
    use crate::demo::truth::{LEFT_OUT, TOP};
    use crate::raster::Grid;

    fn pair(tier: Tier, index: u64) -> Pair {
        Pairs::new(tier, 11).pair(index).expect("pictures encode")
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
                // A bend of 0.8 mm is a tenth of a character of 8 mm.
                let level = if tier == Tier::Hard { 0.12 } else { 0.025 };
                assert!((12..=40).contains(&pair.truth.landmarks.len()));
                for landmark in &pair.truth.landmarks {
                    let (value, height) =
                        seen(&pair, &pair.tops, *landmark).expect("inside the print");
                    assert_eq!(value, TOP, "{}", pair.id);
                    assert!(height.abs() < level, "{}: {height}", pair.id);
                }
            }
        }
    }

    /// The mask without its pixels that touch another value: a wall begins at half a pixel from the rim.
    fn without_rims(tops: &Grid<u8>) -> Grid<u8> {
        Grid::from_fn(tops.width(), tops.height(), |x, y| {
            let value = tops.at(x, y);
            let near = |i: i64| tops.get(x as i64 + i % 3 - 1, y as i64 + i / 3 - 1);
            let is_inner = (0..9).all(|i| near(i).is_none_or(|other| other == value));
            if is_inner { value } else { LEFT_OUT }
        })
    }

    #[test]
    fn mesh_is_high_where_the_tops_mask_says_so_and_low_elsewhere() {
        for tier in [Tier::Upright, Tier::Pose, Tier::Real] {
            let pair = pair(tier, 1);
            let tops = without_rims(&pair.tops);
            let (mut tops_high, mut tops_all, mut ground_low, mut ground_all) = (0, 0, 0, 0);
            for vertex in pair.mesh.vertices.iter() {
                match seen(&pair, &tops, vertex) {
                    // Below the ground there are only side walls and foot.
                    Some((_, height)) if height < -0.175 => {}
                    Some((TOP, height)) => {
                        tops_all += 1;
                        tops_high += i32::from(height > -0.02);
                    }
                    Some((0, height)) => {
                        ground_all += 1;
                        ground_low += i32::from(height < -0.01);
                    }
                    Some(_) | None => {}
                }
            }
            let share = |part: i32, all: i32| f64::from(part) / f64::from(all);
            assert!(tops_all > 500 && ground_all > 5000, "{tier}");
            assert!(
                share(tops_high, tops_all) > 0.99,
                "{tier}: {tops_high} of {tops_all}"
            );
            assert!(
                share(ground_low, ground_all) > 0.99,
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
