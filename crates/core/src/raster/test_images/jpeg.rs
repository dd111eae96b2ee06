//! Writes JPEG files whose scans can be chosen, for tests.

use std::f64::consts::PI;

use crate::raster::Grid;

/// How the coefficients are divided into scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestScans {
    /// All components in one scan.
    Interleaved,
    /// A scan for each component, in this order.
    Separate([usize; 3]),
    /// The averages of all blocks, then the rest of each component.
    Progressive,
}

/// A JPEG of luma and chroma.
#[derive(Debug, Clone, Copy)]
pub struct TestJpeg {
    /// Columns and rows of luma samples for each chroma sample.
    pub shared: [usize; 2],
    /// The scans.
    pub scans: TestScans,
}

const QUANTIZATION: i32 = 2;

/// Positions of the coefficients in their order in the file.
const ZIGZAG: [usize; 64] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20,
    13, 6, 7, 14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59,
    52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55, 62, 63,
];

/// Entropy-coded bits. The codes of a symbol are its position in its table: 4 bits for averages, 8 for the rest.
#[derive(Default)]
struct ScanBits {
    bits: Vec<bool>,
}

impl ScanBits {
    fn add(&mut self, value: u32, count: usize) {
        self.bits
            .extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
    }

    /// Adds the bits of a number whose size is known.
    fn add_number(&mut self, value: i32, size: u32) {
        let bits = if value < 0 { value - 1 } else { value };
        self.add((bits & ((1 << size) - 1)) as u32, size as usize);
    }

    fn average(&mut self, difference: i32) {
        let size = 32 - difference.unsigned_abs().leading_zeros();
        self.add(size, 4);
        self.add_number(difference, size);
    }

    fn rest(&mut self, block: &[i32; 64]) {
        let mut zeros = 0;
        for value in &block[1..] {
            if *value == 0 {
                zeros += 1;
                continue;
            }
            // Sixteen zeros have a symbol.
            (0..zeros / 16).for_each(|_| self.add(1, 8));
            let size = 32 - value.unsigned_abs().leading_zeros();
            self.add(2 + zeros % 16 * 10 + size - 1, 8);
            self.add_number(*value, size);
            zeros = 0;
        }
        if zeros > 0 {
            self.add(0, 8);
        }
    }

    /// Returns the bytes, with a zero after each 255.
    fn bytes(mut self) -> Vec<u8> {
        self.bits.resize(self.bits.len().next_multiple_of(8), true);
        let bytes = self
            .bits
            .chunks(8)
            .map(|bits| bits.iter().fold(0, |sum, bit| sum << 1 | u8::from(*bit)));
        bytes
            .flat_map(|byte| {
                if byte == 255 {
                    vec![255, 0]
                } else {
                    vec![byte]
                }
            })
            .collect()
    }
}

/// Returns the symbols of coefficients: zeros before them, and their size.
fn rest_symbols() -> Vec<u8> {
    let pairs = (0..16).flat_map(|zeros| (1..11).map(move |size| zeros << 4 | size));
    [0, 0xf0].into_iter().chain(pairs).collect()
}

fn segment(marker: u8, body: &[u8]) -> Vec<u8> {
    let len = (body.len() as u16 + 2).to_be_bytes();
    [&[0xff, marker], &len[..], body].concat()
}

/// A component: its blocks of quantized coefficients, and how many rows and columns of them an interleaved unit has.
struct TestComponent {
    sampling: [usize; 2],
    /// Blocks that its own scan has.
    own: [usize; 2],
    blocks: Grid<[i32; 64]>,
}

/// Returns the cosine of each frequency at each position.
fn waves() -> [[f64; 8]; 8] {
    let wave = |frequency: usize, at: usize| ((2 * at + 1) * frequency) as f64 * PI / 16.0;
    std::array::from_fn(|frequency| std::array::from_fn(|at| wave(frequency, at).cos()))
}

fn block(samples: &Grid<f64>, waves: &[[f64; 8]; 8], left: usize, top: usize) -> [i32; 64] {
    let at = |x: usize, y: usize| {
        let (right, bottom) = (samples.width() - 1, samples.height() - 1);
        samples.at((left + x).min(right), (top + y).min(bottom)) - 128.0
    };
    let scale = |frequency: usize| if frequency == 0 { 0.5_f64.sqrt() } else { 1.0 };
    let mut coefficients = [0; 64];
    for (target, position) in coefficients.iter_mut().zip(ZIGZAG) {
        let (u, v) = (position % 8, position / 8);
        let row = |y| (0..8).map(|x| at(x, y) * waves[u][x]).sum::<f64>() * waves[v][y];
        let sum = (0..8).map(row).sum::<f64>() * scale(u) * scale(v) / 4.0;
        *target = (sum / f64::from(QUANTIZATION)).round() as i32;
    }
    coefficients
}

impl TestJpeg {
    fn component(&self, picture: &Grid<[u8; 3]>, channel: usize) -> TestComponent {
        let shared = if channel == 0 { [1, 1] } else { self.shared };
        let sampling = if channel == 0 { self.shared } else { [1, 1] };
        let coded = picture.map(|[r, g, b]| {
            let [r, g, b] = [r, g, b].map(|c| f64::from(*c));
            let y = 0.299 * r + 0.587 * g + 0.114 * b;
            [y, 128.0 + (b - y) / 1.772, 128.0 + (r - y) / 1.402][channel]
        });
        let sides = [picture.width(), picture.height()];
        let size = [0, 1].map(|axis| sides[axis].div_ceil(shared[axis]));
        let samples = Grid::from_fn(size[0], size[1], |x, y| {
            let pixel = |x: usize, y: usize| coded.at(x.min(sides[0] - 1), y.min(sides[1] - 1));
            let all = (0..shared[1]).flat_map(|dy| (0..shared[0]).map(move |dx| (dx, dy)));
            let sum: f64 = all
                .map(|(dx, dy)| pixel(x * shared[0] + dx, y * shared[1] + dy))
                .sum();
            sum / (shared[0] * shared[1]) as f64
        });
        let waves = waves();
        let units = [0, 1].map(|axis| sides[axis].div_ceil(8 * self.shared[axis]) * sampling[axis]);
        TestComponent {
            sampling,
            own: size.map(|side| side.div_ceil(8)),
            blocks: Grid::from_fn(units[0], units[1], |x, y| {
                block(&samples, &waves, 8 * x, 8 * y)
            }),
        }
    }

    /// Encodes a picture. `before_scans` are segments in front of the first scan.
    pub fn encode(&self, picture: &Grid<[u8; 3]>, before_scans: &[Vec<u8>]) -> Vec<u8> {
        let components = [0, 1, 2].map(|channel| self.component(picture, channel));
        let mut file = vec![0xff, 0xd8];
        file.extend(segment(
            0xdb,
            &[&[0][..], &[QUANTIZATION as u8; 64]].concat(),
        ));
        let [height, width] =
            [picture.height(), picture.width()].map(|side| (side as u16).to_be_bytes());
        let mut frame = [&[8][..], &height, &width, &[3]].concat();
        for (id, component) in (1..).zip(&components) {
            frame.extend([
                id,
                (component.sampling[0] << 4 | component.sampling[1]) as u8,
                0,
            ]);
        }
        let is_progressive = self.scans == TestScans::Progressive;
        file.extend(segment(if is_progressive { 0xc2 } else { 0xc0 }, &frame));
        file.extend(before_scans.concat());
        let mut counts = [0; 16];
        counts[3] = 12;
        file.extend(segment(
            0xc4,
            &[&[0][..], &counts, &(0..12).collect::<Vec<u8>>()].concat(),
        ));
        let rest = rest_symbols();
        let mut counts = [0; 16];
        counts[7] = rest.len() as u8;
        file.extend(segment(0xc4, &[&[0x10][..], &counts, &rest].concat()));
        match self.scans {
            TestScans::Interleaved => file.extend(scan(&components, &[0, 1, 2], [0, 63])),
            TestScans::Separate(order) => {
                for component in order {
                    // Tables may be defined again between scans.
                    file.extend(segment(0xfe, b"a comment"));
                    file.extend(scan(&components, &[component], [0, 63]));
                }
            }
            TestScans::Progressive => {
                file.extend(scan(&components, &[0, 1, 2], [0, 0]));
                for component in [0, 1, 2] {
                    file.extend(scan(&components, &[component], [1, 63]));
                }
            }
        }
        file.extend([0xff, 0xd9]);
        file
    }
}

/// Writes the coefficients of a band of some components.
fn scan(components: &[TestComponent; 3], which: &[usize], [first, last]: [u8; 2]) -> Vec<u8> {
    let mut header = vec![which.len() as u8];
    header.extend(which.iter().flat_map(|at| [*at as u8 + 1, 0]));
    header.extend([first, last, 0]);
    let mut bits = ScanBits::default();
    let mut previous = [0; 3];
    let mut add = |at: usize, x: usize, y: usize| {
        let block = components[at].blocks.at(x, y);
        if first == 0 {
            bits.average(block[0] - previous[at]);
            previous[at] = block[0];
        }
        if last > 0 {
            bits.rest(&block);
        }
    };
    if let [at] = which {
        let [width, height] = components[*at].own;
        (0..height).for_each(|y| (0..width).for_each(|x| add(*at, x, y)));
    } else {
        let TestComponent {
            blocks, sampling, ..
        } = &components[0];
        for unit_y in 0..blocks.height() / sampling[1] {
            for unit_x in 0..blocks.width() / sampling[0] {
                for at in which {
                    let [across, down] = components[*at].sampling;
                    for y in 0..down {
                        (0..across).for_each(|x| add(*at, unit_x * across + x, unit_y * down + y));
                    }
                }
            }
        }
    }
    [segment(0xda, &header), bits.bytes()].concat()
}
