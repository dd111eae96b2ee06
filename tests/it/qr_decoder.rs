//! Reads the text of a QR code in a page (ISO/IEC 18004): versions 2 to 5 of error correction level L, which have one block.

use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Light border of a code, in modules.
const BORDER: usize = 4;
/// Data bytes of the versions from 2 on.
const DATA_BYTES: [usize; 4] = [34, 55, 80, 108];
/// The bits that hide those of the format.
const FORMAT_MASK: usize = 0x5412;
/// Level L in the bits of the format.
const LEVEL_L: usize = 1;
/// Characters of the alphanumeric mode, by value.
const ALPHANUMERIC: &[u8; 45] = b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ $%*+-./:";

/// The modules of a code, without its border.
struct QrModules {
    side: usize,
    /// Row and column of each dark module.
    dark: BTreeSet<[usize; 2]>,
}

/// The data of a code, bit by bit.
struct QrBits(std::vec::IntoIter<bool>);

impl QrBits {
    fn number(&mut self, bits: usize) -> usize {
        let bits = self.0.by_ref().take(bits);
        bits.fold(0, |number, bit| 2 * number + usize::from(bit))
    }

    fn is_at_end(&self) -> bool {
        self.0.len() < 4
    }
}

impl QrModules {
    /// Reads a picture in which each dark module is a path `MX Yh1v1h-1z`.
    fn of(svg: &str) -> Self {
        let size = svg.split("viewBox=\"0 0 ").nth(1).expect("a size");
        let size = size.split(' ').next().expect("a width");
        let size: usize = size.parse().expect("a number");
        let path = svg.split(" d=\"").nth(1).expect("a path");
        let path = path.split('"').next().expect("its end");
        let modules = path.split("h1v1h-1z").filter(|module| !module.is_empty());
        let place = |module: &str| {
            let (x, y) = module.strip_prefix('M')?.split_once(' ')?;
            let place = [y, x].map(|at| at.parse::<usize>().expect("a place"));
            Some(place.map(|at| at - BORDER))
        };
        Self {
            side: size - 2 * BORDER,
            dark: modules
                .map(|module| place(module).expect("a module"))
                .collect(),
        }
    }

    fn is_dark(&self, row: usize, column: usize) -> bool {
        self.dark.contains(&[row, column])
    }

    /// Returns the level of error correction and the mask, from the bits around the upper left finder pattern.
    fn format(&self) -> [usize; 2] {
        let along_row = [0, 1, 2, 3, 4, 5, 7, 8].map(|column| [8, column]);
        let along_column = [7, 5, 4, 3, 2, 1, 0].map(|row| [row, 8]);
        let bits = along_row.into_iter().chain(along_column);
        let bits = bits.fold(0, |number, place| {
            2 * number + usize::from(self.dark.contains(&place))
        });
        let format = (bits ^ FORMAT_MASK) >> 10;
        [format >> 3, format & 7]
    }

    /// Returns whether a module belongs to a pattern or to the format.
    fn is_fixed(&self, row: usize, column: usize) -> bool {
        let [near, far] = [9, self.side - 8];
        let is_finder =
            (row < near && (column < near || column >= far)) || (row >= far && column < near);
        let middle = self.side - 7;
        let is_alignment = row.abs_diff(middle) <= 2 && column.abs_diff(middle) <= 2;
        is_finder || is_alignment || row == 6 || column == 6
    }

    /// Returns the bits of the data: pairs of columns from the right, upwards and downwards in turn.
    fn bits(&self, mask: usize) -> Vec<bool> {
        let mut bits = Vec::new();
        let rights = (0..self.side)
            .rev()
            .filter(|column| *column > 6 && column.is_multiple_of(2));
        let rights = rights.chain([5, 3, 1]);
        for (turn, right) in rights.enumerate() {
            for step in 0..self.side {
                let row = if turn.is_multiple_of(2) {
                    self.side - 1 - step
                } else {
                    step
                };
                for column in [right, right - 1] {
                    if !self.is_fixed(row, column) {
                        bits.push(self.is_dark(row, column) != is_inverted(mask, row, column));
                    }
                }
            }
        }
        bits
    }
}

/// Returns whether a mask inverts a module.
fn is_inverted(mask: usize, row: usize, column: usize) -> bool {
    let (sum, product) = (row + column, row * column);
    match mask {
        0 => sum.is_multiple_of(2),
        1 => row.is_multiple_of(2),
        2 => column.is_multiple_of(3),
        3 => sum.is_multiple_of(3),
        4 => (row / 2 + column / 3).is_multiple_of(2),
        5 => product.is_multiple_of(6),
        6 => (product % 2 + product % 3).is_multiple_of(2),
        _ => (sum % 2 + product % 3).is_multiple_of(2),
    }
}

/// Returns the text of a code that a page shows as SVG.
pub(crate) fn decoded(svg: &str) -> String {
    let modules = QrModules::of(svg);
    let version = (modules.side - 17) / 4;
    let [level, mask] = modules.format();
    assert_eq!(level, LEVEL_L, "version {version}");
    let bytes = DATA_BYTES.get(version - 2).expect("a version from 2 to 5");
    let mut bits = modules.bits(mask);
    bits.truncate(8 * bytes);
    let mut bits = QrBits(bits.into_iter());
    let mut text = String::new();
    while !bits.is_at_end() {
        match bits.number(4) {
            0 => break,
            1 => numeric(&mut bits, &mut text),
            2 => alphanumeric(&mut bits, &mut text),
            4 => {
                let count = bits.number(8);
                text.extend((0..count).map(|_| bits.number(8) as u8 as char));
            }
            mode => unreachable!("no link has the mode {mode}"),
        }
    }
    text
}

/// Reads groups of three digits, of which the last may be shorter.
fn numeric(bits: &mut QrBits, text: &mut String) {
    let mut left = bits.number(10);
    while left > 0 {
        let digits = left.min(3);
        let number = bits.number([0, 4, 7, 10][digits]);
        let _ = write!(text, "{number:0digits$}");
        left -= digits;
    }
}

/// Reads pairs of characters, and a last one.
fn alphanumeric(bits: &mut QrBits, text: &mut String) {
    let mut left = bits.number(9);
    let letter = |value: usize| ALPHANUMERIC[value] as char;
    while left > 1 {
        let value = bits.number(11);
        text.extend([letter(value / 45), letter(value % 45)]);
        left -= 2;
    }
    if left == 1 {
        text.push(letter(bits.number(6)));
    }
}
