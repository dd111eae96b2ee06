//! Corrupts valid files in the ways that disks, programs and people do. The same seed gives the same corruption.

use rand::{Rng as _, RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Replacement values of counts, sizes and indices.
const NUMBERS: [u64; 10] = [
    0,
    1,
    0x7f,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
];

/// Replacement words of text files.
const WORDS: [&str; 22] = [
    "0",
    "-1",
    "1",
    "65536",
    "2147483648",
    "4294967295",
    "18446744073709551616",
    "nan",
    "inf",
    "-inf",
    "1e999",
    "-1e-999",
    "1e30",
    "1e-30",
    "0x10",
    "1,5",
    "",
    "\u{0}",
    "\"",
    "\u{fffd}\u{202e}",
    "[",
    "9999999999999999999999",
];

/// A random generator of corruptions.
pub(crate) struct Corruptor {
    rng: ChaCha8Rng,
}

impl Corruptor {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Returns a copy with one to four corruptions.
    pub(crate) fn corrupt(&mut self, valid: &[u8]) -> Vec<u8> {
        let mut bytes = valid.to_vec();
        for _ in 0..self.rng.random_range(1..5) {
            self.fault(&mut bytes);
        }
        bytes
    }

    /// Applies one corruption.
    fn fault(&mut self, bytes: &mut Vec<u8>) {
        match self.rng.random_range(0..10) {
            0 => bytes.truncate(self.below(bytes.len() + 1)),
            1 => self.flip(bytes),
            2 => self.number(bytes),
            3 => self.float(bytes),
            4 | 5 => self.word(bytes),
            6 => self.repeat(bytes),
            7 => {
                let (from, to) = self.range(bytes.len());
                bytes.drain(from..to);
            }
            8 => self.line(bytes),
            _ => self.noise(bytes),
        }
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        self.rng.random_range(0..limit.max(1))
    }

    fn range(&mut self, len: usize) -> (usize, usize) {
        let from = self.below(len + 1);
        let max = if self.rng.random() { 16 } else { len };
        (from, (from + self.below(max + 1)).min(len))
    }

    fn flip(&mut self, bytes: &mut [u8]) {
        for _ in 0..self.rng.random_range(1..9) {
            let at = self.below(bytes.len());
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << self.rng.random_range(0..8);
            }
        }
    }

    /// Overwrites bytes with a number. Half of the time, these bytes are among the first 200, where headers are.
    fn number(&mut self, bytes: &mut [u8]) {
        let value = NUMBERS[self.below(NUMBERS.len())];
        let width = [1, 2, 4, 8][self.below(4)];
        let field = if self.rng.random() {
            value.to_le_bytes()
        } else {
            value.to_be_bytes()
        };
        let field = if field[7] == 0 {
            &field[..width]
        } else {
            &field[8 - width..]
        };
        self.write(bytes, field);
    }

    fn float(&mut self, bytes: &mut [u8]) {
        let value = [f32::NAN, f32::INFINITY, -0.0, 1e30, 1e-30, f32::MAX][self.below(6)];
        let field = if self.rng.random() {
            value.to_le_bytes()
        } else {
            value.to_be_bytes()
        };
        self.write(bytes, &field);
    }

    fn write(&mut self, bytes: &mut [u8], field: &[u8]) {
        let limit = if self.rng.random() {
            bytes.len().min(200)
        } else {
            bytes.len()
        };
        let at = self.below(limit);
        for (byte, new) in bytes.iter_mut().skip(at).zip(field) {
            *byte = *new;
        }
    }

    /// Replaces a word.
    fn word(&mut self, bytes: &mut Vec<u8>) {
        let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || b".-+_".contains(byte);
        let limit = if self.rng.random() {
            bytes.len().min(400)
        } else {
            bytes.len()
        };
        let at = self.below(limit);
        let from = bytes[..at]
            .iter()
            .rposition(|byte| !is_word(byte))
            .map_or(0, |end| end + 1);
        let to = bytes[at..]
            .iter()
            .position(|byte| !is_word(byte))
            .map_or(bytes.len(), |end| at + end);
        let word = WORDS[self.below(WORDS.len())];
        bytes.splice(from..to.max(from), word.bytes());
    }

    /// Repeats a piece once or 64 times.
    fn repeat(&mut self, bytes: &mut Vec<u8>) {
        let (from, to) = self.range(bytes.len());
        let often = if self.rng.random() { 1 } else { 64 };
        let piece = bytes[from..to].repeat(often);
        bytes.splice(to..to, piece.into_iter().take(1 << 16));
    }

    /// Removes, duplicates or swaps lines.
    fn line(&mut self, bytes: &mut Vec<u8>) {
        let mut lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
        let (from, to) = (self.below(lines.len()), self.below(lines.len()));
        if lines.is_empty() {
            return;
        }
        match self.rng.random_range(0..3) {
            0 => drop(lines.remove(from)),
            1 => lines.insert(to, lines[from]),
            _ => lines.swap(from, to),
        }
        *bytes = lines.concat();
    }

    fn noise(&mut self, bytes: &mut Vec<u8>) {
        let mut noise = vec![0; self.below(40)];
        self.rng.fill_bytes(&mut noise);
        let at = self.below(bytes.len() + 1);
        bytes.splice(at..at, noise);
    }
}
