//! Pairs without a correct alignment, which the stages must refuse. Used by tests and by the accuracy bench.

use image::ImageError;
use mocban::demo::{DemoPair, PairGenerator, Tier};
use mocban::mesh::Mesh;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Range of the height noise of an uncarved plate, as a share of the character's height (about 15 µm).
const PLATE_NOISE: f64 = 0.0016;
/// Depth, as a share of the character's height, below which the vertices of a closed scan belong to its base or walls.
const BASE_DEPTH: f64 = 0.165;

/// Similar characters of the demo's font, most of which differ by one stroke or by its length.
pub(crate) const LOOK_ALIKES: [[char; 2]; 60] = [
    ['申', '甲'],
    ['太', '大'],
    ['土', '士'],
    ['日', '曰'],
    ['天', '夫'],
    ['木', '本'],
    ['王', '玉'],
    ['己', '已'],
    ['人', '入'],
    ['田', '由'],
    ['由', '甲'],
    ['白', '自'],
    ['水', '永'],
    ['問', '間'],
    ['待', '侍'],
    ['石', '右'],
    ['主', '王'],
    ['夫', '失'],
    ['旦', '且'],
    ['史', '吏'],
    ['壬', '王'],
    ['戊', '戌'],
    ['今', '令'],
    ['季', '李'],
    ['木', '未'],
    ['日', '白'],
    ['百', '白'],
    ['百', '自'],
    ['田', '甲'],
    ['申', '由'],
    ['丁', '于'],
    ['三', '王'],
    ['上', '土'],
    ['不', '木'],
    ['心', '必'],
    ['月', '用'],
    ['八', '入'],
    ['人', '大'],
    ['大', '天'],
    ['天', '元'],
    ['夫', '未'],
    ['古', '右'],
    ['右', '有'],
    ['名', '各'],
    ['口', '日'],
    ['回', '田'],
    ['仁', '仕'],
    ['車', '申'],
    ['門', '問'],
    ['門', '間'],
    ['間', '聞'],
    ['情', '清'],
    ['待', '特'],
    ['見', '貝'],
    ['具', '貝'],
    ['全', '王'],
    ['主', '玉'],
    ['生', '主'],
    ['光', '先'],
    ['考', '老'],
];

/// Distance to the index of another block with the same character.
const OTHER_BLOCK: u64 = 1_000_000;

/// A kind of pair without a correct alignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Decoy {
    /// The print of another character.
    WrongPrint,
    /// The print of another character with nearly the same strokes. The mesh shows a character that has such a partner.
    LookAlike,
    /// The print of another block with the same character, which another hand wrote.
    AnotherHand,
    /// The character in brush writing. The mesh shows a character of which there is a photograph.
    BrushWriting,
    /// A mesh that is not in mirror writing, with outward faces.
    Mirrored,
    /// A flat plate with scanner noise instead of the carved block.
    Uncarved,
}

impl Decoy {
    /// All kinds.
    pub(crate) const ALL: [Self; 6] = [
        Self::WrongPrint,
        Self::LookAlike,
        Self::AnotherHand,
        Self::BrushWriting,
        Self::Mirrored,
        Self::Uncarved,
    ];

    /// Returns the name used in tables.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::WrongPrint => "wrong print",
            Self::LookAlike => "look-alike print",
            Self::AnotherHand => "another hand",
            Self::BrushWriting => "brush writing",
            Self::Mirrored => "mirrored mesh",
            Self::Uncarved => "uncarved mesh",
        }
    }
}

/// A mesh and a print that do not belong together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DecoyPair {
    /// The mesh, in mesh coordinates.
    pub(crate) mesh: Mesh,
    /// The encoded print image.
    pub(crate) print: Vec<u8>,
}

/// Makes a decoy from a pair.
///
/// # Errors
/// Returns an error if an image cannot be encoded or decoded.
pub(crate) fn decoy_pair(
    pairs: &PairGenerator,
    kind: Decoy,
    index: u64,
) -> Result<DecoyPair, ImageError> {
    let pair = pairs.pair(index)?;
    Ok(match kind {
        Decoy::LookAlike => look_alike(pairs, index)?,
        Decoy::AnotherHand => DecoyPair {
            print: by_another_hand(pairs, &pair.character, index)?,
            mesh: pair.mesh,
        },
        Decoy::BrushWriting => brush_writing(pairs, index)?,
        Decoy::WrongPrint => DecoyPair {
            print: print_of_another_character(pairs, &pair.character, index)?,
            mesh: pair.mesh,
        },
        Decoy::Mirrored => DecoyPair {
            mesh: mirrored(pair.mesh),
            print: pair.print,
        },
        Decoy::Uncarved => DecoyPair {
            mesh: flattened(&pair, index),
            print: pair.print,
        },
    })
}

/// Makes the mesh of a character and the print of its look-alike. Every second turn exchanges the two characters.
fn look_alike(pairs: &PairGenerator, index: u64) -> Result<DecoyPair, ImageError> {
    let count = LOOK_ALIKES.len() as u64;
    let [mut carved, mut printed] = LOOK_ALIKES[(index % count) as usize];
    if index / count % 2 == 1 {
        std::mem::swap(&mut carved, &mut printed);
    }
    Ok(DecoyPair {
        mesh: pairs.pair_of(carved, index)?.mesh,
        print: pairs.pair_of(printed, index + 1)?.print,
    })
}

/// Returns a print of another block with the same character.
fn by_another_hand(
    pairs: &PairGenerator,
    character: &str,
    index: u64,
) -> Result<Vec<u8>, ImageError> {
    let character = character.chars().next();
    let character = character.expect("a pair shows a character");
    pairs.print_by_another_hand(character, index + OTHER_BLOCK)
}

/// Makes the mesh of a character of the font and a photograph of the character in brush writing.
fn brush_writing(pairs: &PairGenerator, index: u64) -> Result<DecoyPair, ImageError> {
    let photographed = PairGenerator::new(Tier::Real, 1).pair(index)?;
    let character = photographed.character.chars().next();
    let character = character.expect("a pair shows a character");
    Ok(DecoyPair {
        mesh: pairs.pair_of(character, index)?.mesh,
        print: photographed.print,
    })
}

/// Returns the print of the next pair with another character.
fn print_of_another_character(
    pairs: &PairGenerator,
    character: &str,
    index: u64,
) -> Result<Vec<u8>, ImageError> {
    let mut next = index + 1;
    loop {
        let other = pairs.pair(next)?;
        if other.character != character {
            return Ok(other.print);
        }
        next += 1;
    }
}

/// Reflects the mesh in x and reverses its faces, so that all faces still face outward.
fn mirrored(mut mesh: Mesh) -> Mesh {
    mesh.vertices.map_in_place(|[x, y, z]| [-x, y, z]);
    for [_, b, c] in mesh.triangles.iter_mut() {
        std::mem::swap(b, c);
    }
    mesh
}

/// Flattens the carved face: moves its vertices onto the plane of the stroke tops and adds noise.
fn flattened(pair: &DemoPair, seed: u64) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut mesh = pair.mesh.clone();
    let plane = pair.truth.plane;
    let [a, b, c, _] = pair.truth.print_from_mesh.0[0];
    let character = pair.truth.char_height_px / (a * a + b * b + c * c).sqrt();
    for index in 0..mesh.vertices.len() {
        let vertex = mesh.vertices.at(index);
        let height = (0..3).map(|i| plane.n[i] * vertex[i]).sum::<f64>() + plane.d;
        let is_base = pair.is_closed && height < -BASE_DEPTH * character;
        if !is_base {
            let flat = character * PLATE_NOISE * rng.random_range(-0.5..0.5);
            let moved = [0, 1, 2].map(|i| vertex[i] + (flat - height) * plane.n[i]);
            mesh.vertices.set(index, moved);
        }
    }
    mesh
}
