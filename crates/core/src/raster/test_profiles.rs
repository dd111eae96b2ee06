//! Colour profiles and images in them, for tests.

use super::Grid;

/// A colour space that is defined by a gamma and, unless it is grey, by three primaries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestProfile {
    gamma: f64,
    /// Columns: the colours of full red, green and blue in XYZ, adapted to D50. `None` for grey.
    primaries: Option<[[f64; 3]; 3]>,
}

/// The primaries of sRGB.
const SRGB: [[f64; 3]; 3] = [
    [0.436_074_7, 0.385_064_9, 0.143_080_4],
    [0.222_504_5, 0.716_878_6, 0.060_616_9],
    [0.013_932_2, 0.097_104_5, 0.714_173_3],
];

impl TestProfile {
    /// Grey with a gamma of 1.8, as old Macintosh programs write it.
    pub const GREY: Self = Self {
        gamma: 1.8,
        primaries: None,
    };
    /// Grey with a gamma of 1: numbers are proportional to light.
    pub const LINEAR_GREY: Self = Self {
        gamma: 1.0,
        primaries: None,
    };
    /// Adobe RGB (1998).
    pub const ADOBE: Self = Self {
        gamma: 563.0 / 256.0,
        primaries: Some([
            [0.609_741_2, 0.205_276_5, 0.149_181_5],
            [0.311_111_5, 0.625_671_4, 0.063_217_2],
            [0.019_470_2, 0.060_867_3, 0.744_567_9],
        ]),
    };
    /// `ProPhoto` RGB, whose primaries are no visible colours.
    pub const WIDE: Self = Self {
        gamma: 1.8,
        primaries: Some([
            [0.797_674_9, 0.135_191_7, 0.031_353_4],
            [0.288_040_2, 0.711_874_1, 0.000_085_7],
            [0.0, 0.0, 0.825_210_0],
        ]),
    };

    /// Returns the bytes of the ICC profile.
    pub fn icc(&self) -> Vec<u8> {
        const WHITE: [f64; 3] = [0.9642, 1.0, 0.8249];
        let fixed = |value: f64| ((value * 65536.0).round() as i32).to_be_bytes();
        let xyz = |values: [f64; 3]| [b"XYZ \0\0\0\0", values.map(fixed).as_flattened()].concat();
        let gamma = ((self.gamma * 256.0).round() as u16).to_be_bytes();
        let curve = [b"curv\0\0\0\0\0\0\0\x01", &gamma[..], &[0, 0]].concat();
        let text = b"text\0\0\0\0by a test\0\0\0".to_vec();
        let mut name = b"desc\0\0\0\0\0\0\0\x05test\0".to_vec();
        name.resize(name.len() + 4 + 4 + 2 + 1 + 67, 0);
        name.resize(name.len().next_multiple_of(4), 0);
        let mut tags = vec![(*b"desc", name), (*b"cprt", text), (*b"wtpt", xyz(WHITE))];
        match self.primaries {
            None => tags.push((*b"kTRC", curve)),
            Some(rows) => {
                for (at, letter) in b"rgb".iter().enumerate() {
                    tags.push(([*letter, b'X', b'Y', b'Z'], xyz(rows.map(|row| row[at]))));
                    tags.push(([*letter, b'T', b'R', b'C'], curve.clone()));
                }
            }
        }
        let mut directory = (tags.len() as u32).to_be_bytes().to_vec();
        let mut data: Vec<u8> = Vec::new();
        for (tag, value) in &tags {
            let at = 128 + 4 + 12 * tags.len() + data.len();
            directory.extend(tag);
            directory.extend((at as u32).to_be_bytes());
            directory.extend((value.len() as u32).to_be_bytes());
            data.extend(value);
        }
        let mut profile = vec![0; 128];
        profile[8..12].copy_from_slice(&[2, 0x40, 0, 0]);
        let space = if self.primaries.is_some() {
            b"RGB "
        } else {
            b"GRAY"
        };
        profile[12..24].copy_from_slice(&[b"mntr", &space[..], b"XYZ "].concat());
        profile[36..40].copy_from_slice(b"acsp");
        profile[68..80].copy_from_slice(WHITE.map(fixed).as_flattened());
        profile.extend(directory);
        profile.extend(data);
        let len = (profile.len() as u32).to_be_bytes();
        profile[..4].copy_from_slice(&len);
        profile
    }

    /// Returns an image of 16 bits in sRGB with the same colours in this space. If it is grey, so must be the image.
    pub fn twin(&self, srgb: &Grid<[u16; 3]>) -> Grid<[u16; 3]> {
        let own_from_xyz = self.primaries.map(inverse);
        srgb.map(|colour| {
            let light = colour.map(|level| srgb_light(f64::from(level) / 65535.0));
            let light = match own_from_xyz {
                None => light,
                Some(own_from_xyz) => product(own_from_xyz, product(SRGB, light)),
            };
            light.map(|light| {
                (light.clamp(0.0, 1.0).powf(1.0 / self.gamma) * 65535.0).round() as u16
            })
        })
    }
}

/// Returns the light of a level of sRGB.
fn srgb_light(level: f64) -> f64 {
    if level <= 0.04045 {
        level / 12.92
    } else {
        ((level + 0.055) / 1.055).powf(2.4)
    }
}

fn product(matrix: [[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| (0..3).map(|at| row[at] * vector[at]).sum())
}

fn inverse(matrix: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let inverse = nalgebra::Matrix3::from_fn(|row, column| matrix[row][column]).try_inverse();
    let inverse = inverse.expect("independent primaries");
    std::array::from_fn(|row| std::array::from_fn(|column| inverse[(row, column)]))
}
