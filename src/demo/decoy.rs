//! Pairs that have no right answer, to see whether they are told from those that have one.

use image::ImageError;

use super::field::{Field, Frame};
use super::pair::{Pair, rng_of};
use super::pairs::Pairs;
use super::polygon::{BoxMm, Polygon};
use super::pose::Pose;
use super::scan::{ScanStyle, scan};
use crate::mesh::Mesh;

/// Half the side of a plate without carving, mm: about that of a character.
const PLATE_HALF_MM: f64 = 4.5;
/// Half the side of the frame a plate is cut from, mm.
const PLATE_FRAME_MM: f64 = 7.5;

/// What is wrong with a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Decoy {
    /// The print of another character.
    WrongPrint,
    /// The mesh in mirror writing, its faces wound as before.
    Mirrored,
    /// A flat plate with the scanner's noise in place of the block.
    Uncarved,
}

impl Decoy {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::WrongPrint, Self::Mirrored, Self::Uncarved];

    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::WrongPrint => "wrong print",
            Self::Mirrored => "mirrored mesh",
            Self::Uncarved => "uncarved mesh",
        }
    }
}

/// A mesh and a print that do not belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct DecoyPair {
    /// The mesh, in mesh coordinates.
    pub mesh: Mesh,
    /// The print's file.
    pub print: Vec<u8>,
}

impl Pairs {
    /// Makes a decoy out of a pair.
    ///
    /// # Errors
    /// When a picture cannot be encoded or, from the program itself, decoded.
    pub fn decoy(&self, kind: Decoy, index: u64) -> Result<DecoyPair, ImageError> {
        let Pair {
            mesh,
            print,
            character,
            ..
        } = self.pair(index)?;
        Ok(match kind {
            Decoy::WrongPrint => DecoyPair {
                mesh,
                print: self.print_of_another(&character, index)?,
            },
            Decoy::Mirrored => DecoyPair {
                mesh: mirrored(mesh),
                print,
            },
            Decoy::Uncarved => DecoyPair {
                mesh: self.plate(index),
                print,
            },
        })
    }

    /// The print of the next pair of another character.
    fn print_of_another(&self, character: &str, index: u64) -> Result<Vec<u8>, ImageError> {
        let mut next = index + 1;
        loop {
            let other = self.pair(next)?;
            if other.character != character {
                return Ok(other.print);
            }
            next += 1;
        }
    }

    /// A scan of a plate that nobody carved, in a pose of the tier.
    fn plate(&self, index: u64) -> Mesh {
        let mut rng = rng_of(self.seed(), self.tier(), index);
        let surface = Field::from_fn(Frame::covering(PLATE_FRAME_MM, 0.1), |_, _, _| 0.0);
        let face = BoxMm {
            min: [-PLATE_HALF_MM; 2],
            max: [PLATE_HALF_MM; 2],
        };
        let outline = Polygon::around(face, 0.5, 1.1, &mut rng);
        let style = ScanStyle::draw(self.tier().is_damaged(), self.vertices(), &mut rng);
        let mut mesh = scan(&surface, &outline, &style, &mut rng);
        let pose = Pose::draw(self.tier(), &mut rng);
        mesh.vertices.change(|vertex| pose.mesh_from_block(vertex));
        mesh
    }
}

/// The mesh reflected in x. Faces turn their corners round, so that outside stays outside.
fn mirrored(mut mesh: Mesh) -> Mesh {
    mesh.vertices.change(|[x, y, z]| [-x, y, z]);
    for [_, b, c] in &mut mesh.triangles {
        std::mem::swap(b, c);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::{Decoy, mirrored};
    use crate::demo::{Pairs, Tier};
    use crate::mesh::Mesh;

    fn area_vector(mesh: &Mesh, triangle: [u32; 3]) -> [f64; 3] {
        let [a, b, c] = triangle.map(|corner| mesh.vertices.at(corner as usize));
        let side = |p: [f64; 3]| [0, 1, 2].map(|i| p[i] - a[i]);
        let (u, v) = (side(b), side(c));
        [0, 1, 2].map(|i| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3])
    }

    #[test]
    fn mirroring_reflects_each_face_with_its_outer_side() {
        let mesh = Pairs::new(Tier::Pose, 3).pair(0).expect("made").mesh;
        let reflected = mirrored(mesh.clone());
        for (before, after) in mesh.triangles.iter().zip(&reflected.triangles) {
            let [x, y, z] = area_vector(&mesh, *before);
            let found = area_vector(&reflected, *after);
            let size = x.hypot(y).hypot(z);
            for (value, wanted) in found.into_iter().zip([-x, y, z]) {
                assert!((value - wanted).abs() <= 1e-9 * size);
            }
        }
    }

    #[test]
    fn wrong_print_is_the_print_of_another_pair() {
        for tier in [Tier::Upright, Tier::Real] {
            let pairs = Pairs::new(tier, 3);
            let (own, decoy) = (pairs.pair(19), pairs.decoy(Decoy::WrongPrint, 19));
            let (own, decoy) = (own.expect("made"), decoy.expect("made"));
            assert!(decoy.mesh == own.mesh);
            assert!(decoy.print != own.print);
        }
    }

    #[test]
    fn plate_is_flat_to_the_noise() {
        // Upright meshes are in millimetres. The areas of the faces add up to the normal of the plate.
        let pairs = Pairs::new(Tier::Upright, 3);
        let decoys = (0..8).map(|index| pairs.decoy(Decoy::Uncarved, index).expect("made").mesh);
        for mesh in decoys {
            let sum = mesh
                .triangles
                .iter()
                .map(|t| area_vector(&mesh, *t))
                .fold([0.0; 3], |sum, part| [0, 1, 2].map(|i| sum[i] + part[i]));
            let length = sum.iter().map(|c| c * c).sum::<f64>().sqrt();
            if length < 40.0 {
                // Walls and foot close it: the faces cancel each other.
                continue;
            }
            let mut heights: Vec<f64> = mesh
                .vertices
                .iter()
                .map(|vertex| (0..3).map(|i| vertex[i] * sum[i] / length).sum())
                .collect();
            heights.sort_by(f64::total_cmp);
            let count = heights.len();
            let spread = heights[count * 99 / 100] - heights[count / 100];
            assert!(spread < 0.06, "{spread} mm");
        }
    }
}
