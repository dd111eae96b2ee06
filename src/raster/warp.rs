//! Bringing grids into another frame. Each output pixel looks back through the inverse map, so nothing has holes.
//!
//! When the map shrinks, a pixel averages several looks spread over its square; outside the source there is nothing.

use std::ops::Range;

use super::{DepthMap, Grid, Mask};
use crate::domain::Affine2;

/// Most looks along one side of an output pixel; beyond this a shrinking map begins to alias.
const MAX_LOOKS: usize = 8;
/// A look mixes the pixels around it, so looks this far apart in the source miss nothing between them.
const APART_PX: f64 = 1.5;
/// So many output pixels of a row are first asked for together whether what they see is all alike.
const RUN: usize = 8;

/// A mask in another frame: a pixel is set when at least half of its square is covered.
///
/// `to_from` maps source pixels to output pixels. A map without inverse gives an empty mask.
pub fn warp_mask(mask: &Mask, to_from: &Affine2, width: usize, height: usize) -> Mask {
    let Some(from_to) = to_from.inverse() else {
        return Mask::new(width, height, false);
    };
    let looks = Looks::new(&from_to);
    let bits = Bits::of(mask);
    let look = |x, y| {
        let set = |p| Some(coverage(mask, p));
        looks.mean(x, y, set) >= Some(0.5)
    };
    let mut out = Mask::new(width, height, false);
    for y in 0..height {
        for first in (0..width).step_by(RUN) {
            let run = first..(first + RUN).min(width);
            let alike = bits.alike(looks.reach(&run, y));
            for x in run {
                let one = || bits.alike(looks.reach(&(x..x + 1), y));
                out.set(x, y, alike.or_else(one).unwrap_or_else(|| look(x, y)));
            }
        }
    }
    out
}

/// Heights in another frame as levels of the same scale; 0 where less than half of a pixel's square holds data.
///
/// `to_from` maps depth-map pixels to output pixels.
pub fn warp_depth(depth: &DepthMap, to_from: &Affine2, width: usize, height: usize) -> Grid<u16> {
    let Some(from_to) = to_from.inverse() else {
        return Grid::new(width, height, 0);
    };
    let looks = Looks::new(&from_to);
    Grid::from_fn(width, height, |x, y| {
        looks
            .mean(x, y, |p| level_at(&depth.levels, p))
            .map_or(0, |level| level.round().clamp(1.0, 65535.0) as u16)
    })
}

/// Where an output pixel looks in the source.
struct Looks {
    from_to: Affine2,
    per_side: usize,
    /// Where the looks lie along a side, output pixels from the middle; the first `per_side` of them count.
    offsets: [f64; MAX_LOOKS],
    /// How far the outermost looks lie from the middle one, source pixels along x and y.
    spread: [f64; 2],
}

impl Looks {
    fn new(from_to: &Affine2) -> Self {
        let per_side = ((from_to.scale() / APART_PX).ceil() as usize).clamp(1, MAX_LOOKS);
        let outermost = 0.5 - 0.5 / per_side as f64;
        Self {
            from_to: *from_to,
            per_side,
            offsets: std::array::from_fn(|i| (i as f64 + 0.5) / per_side as f64 - 0.5),
            spread: from_to
                .0
                .map(|row| outermost * (row[0].abs() + row[1].abs())),
        }
    }

    /// Mean of what the looks find; `None` when half of them or more find nothing.
    fn mean(&self, x: usize, y: usize, value: impl Fn([f64; 2]) -> Option<f64>) -> Option<f64> {
        let n = self.per_side;
        let offsets = &self.offsets[..n];
        let (mut sum, mut found) = (0.0, 0_usize);
        for down in offsets {
            for across in offsets {
                let p = [x as f64 + across, y as f64 + down];
                if let Some(v) = value(self.from_to.apply(p)) {
                    sum += v;
                    found += 1;
                }
            }
        }
        (2 * found > n * n || (n == 1 && found == 1)).then(|| sum / found as f64)
    }

    /// Source pixels that the looks of a run may touch: first and last column and row, rather more than less.
    fn reach(&self, run: &Range<usize>, y: usize) -> [[i64; 2]; 2] {
        const SLACK: f64 = 1e-6;
        let first = self.from_to.apply([run.start as f64, y as f64]);
        let last = self.from_to.apply([run.end as f64 - 1.0, y as f64]);
        [0, 1].map(|k| {
            let reach = self.spread[k] + SLACK;
            let (low, high) = (first[k].min(last[k]), first[k].max(last[k]));
            [floor(low - reach), floor(high + reach) + 1]
        })
    }
}

/// A mask with 64 pixels of a row in a word, to ask for many of them at a time.
struct Bits {
    words: Vec<u64>,
    per_row: usize,
    width: usize,
    height: usize,
}

impl Bits {
    fn of(mask: &Mask) -> Self {
        let (width, height) = (mask.width(), mask.height());
        let rows = (0..height).map(|y| mask.row(y));
        Self {
            words: rows.flat_map(|row| row.chunks(64).map(word)).collect(),
            per_row: width.div_ceil(64),
            width,
            height,
        }
    }

    /// What all pixels of a box are, if they are all alike; what is outside the mask is not set.
    fn alike(&self, [[x0, x1], [y0, y1]]: [[i64; 2]; 2]) -> Option<bool> {
        let cut = |low: i64, high: i64, side: usize| {
            let side = side as i64;
            low.clamp(0, side) as usize..(high + 1).clamp(0, side) as usize
        };
        let (columns, rows) = (cut(x0, x1, self.width), cut(y0, y1, self.height));
        if columns.is_empty() || rows.is_empty() {
            return Some(false);
        }
        let area = (x1 - x0 + 1) * (y1 - y0 + 1);
        let is_cut = area != (columns.len() * rows.len()) as i64;
        let words = columns.start / 64..(columns.end - 1) / 64 + 1;
        let (mut set, mut clear) = (0, 0);
        for place in words {
            let within =
                columns.start.saturating_sub(place * 64)..(columns.end - place * 64).min(64);
            let wanted = (u64::MAX >> (64 - within.len())) << within.start;
            for row in rows.clone() {
                let word = self.words[row * self.per_row + place];
                set |= word & wanted;
                clear |= !word & wanted;
            }
        }
        match (set, clear) {
            (0, _) => Some(false),
            (_, 0) if !is_cut => Some(true),
            _ => None,
        }
    }
}

/// Up to 64 pixels of a row, the first one lowest.
fn word(pixels: &[bool]) -> u64 {
    // One in each byte times this gives the bytes' lowest bits side by side in the highest byte.
    const GATHER: u64 = 0x0102_0408_1020_4080;
    let eights = pixels.chunks(8).enumerate();
    eights.fold(0, |word, (k, eight)| {
        let mut bytes = [0; 8];
        for (byte, set) in bytes.iter_mut().zip(eight) {
            *byte = u8::from(*set);
        }
        word | (u64::from_le_bytes(bytes).wrapping_mul(GATHER) >> 56) << (8 * k)
    })
}

/// The whole number below; a plain cast and a comparison, where `f64::floor` would be a call.
fn floor(value: f64) -> i64 {
    let cut = value as i64;
    cut - i64::from(cut as f64 > value)
}

/// Bilinear coverage at a point; pixels outside the mask are not set.
fn coverage(mask: &Mask, [x, y]: [f64; 2]) -> f64 {
    let (x0, y0) = (floor(x), floor(y));
    let (fx, fy) = (x - x0 as f64, y - y0 as f64);
    let near = neighbours(mask, x0, y0, false).map(|set| f64::from(u8::from(set)));
    (near[0] * (1.0 - fx) + near[1] * fx) * (1.0 - fy) + (near[2] * (1.0 - fx) + near[3] * fx) * fy
}

/// Bilinear level among the neighbours that hold data; `None` when they weigh less than half.
fn level_at(levels: &Grid<u16>, [x, y]: [f64; 2]) -> Option<f64> {
    let (x0, y0) = (floor(x), floor(y));
    let (fx, fy) = (x - x0 as f64, y - y0 as f64);
    let near = neighbours(levels, x0, y0, 0).map(f64::from);
    if near == [0.0; 4] {
        return None;
    }
    let above = near[0] + (near[1] - near[0]) * fx;
    let below = near[2] + (near[3] - near[2]) * fx;
    let level = above + (below - above) * fy;
    if near.iter().all(|level| *level > 0.0) {
        return Some(level);
    }
    let held = near.map(|level| if level > 0.0 { 1.0 } else { 0.0 });
    let above = held[0] + (held[1] - held[0]) * fx;
    let below = held[2] + (held[3] - held[2]) * fx;
    let weight = above + (below - above) * fy;
    (weight >= 0.5).then(|| level / weight)
}

/// A pixel and those to its right and below, row after row; `outside` where there are none.
#[inline]
fn neighbours<T: Copy>(grid: &Grid<T>, x: i64, y: i64, outside: T) -> [T; 4] {
    let width = grid.width();
    let inside = |i: i64, side: usize| i >= 0 && i + 1 < side as i64;
    if inside(x, width) && inside(y, grid.height()) {
        let from = &grid.data()[y as usize * width + x as usize..][..width + 2];
        [from[0], from[1], from[width], from[width + 1]]
    } else {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| grid.get(x + dx, y + dy).unwrap_or(outside))
    }
}

#[cfg(test)]
mod tests {
    use super::{Looks, coverage, warp_mask};
    use crate::domain::Affine2;
    use crate::raster::Mask;

    fn blob() -> Mask {
        Mask::from_fn(40, 30, |x, y| {
            (8..25).contains(&x) && (5..19).contains(&y) && x + y > 20
        })
    }

    #[test]
    fn identity_changes_nothing() {
        let mask = blob();
        assert_eq!(warp_mask(&mask, &Affine2::IDENTITY, 40, 30), mask);
    }

    #[test]
    fn four_quarter_turns_lead_back() {
        let mask = blob();
        let turn = |m: &Mask| {
            let quarter = Affine2([[0.0, -1.0, (m.height() - 1) as f64], [1.0, 0.0, 0.0]]);
            warp_mask(m, &quarter, m.height(), m.width())
        };
        assert_ne!(turn(&mask), mask);
        assert_eq!(turn(&turn(&turn(&turn(&mask)))), mask);
    }

    #[test]
    fn there_and_back_keeps_the_inside() {
        let mask = blob();
        let there = Affine2::similarity(2.0, 0.5, [20.0, 10.0]);
        let back = there.inverse().expect("a similarity has an inverse");
        let again = warp_mask(&warp_mask(&mask, &there, 120, 120), &back, 40, 30);
        let differ = again
            .data()
            .iter()
            .zip(mask.data())
            .filter(|(a, b)| a != b)
            .count();
        assert!(differ <= 12, "{differ} pixels differ");
    }

    #[test]
    fn what_is_alike_all_over_equals_look_by_look() {
        let mask = Mask::from_fn(90, 70, |x, y| (x / 9 + y / 14) % 2 == 0 || x * y % 31 == 0);
        for (scale, angle) in [(0.3, 0.4), (0.8, 2.0), (1.7, -1.0)] {
            let map = Affine2::similarity(scale, angle, [20.0, 9.0]);
            let looks = Looks::new(&map.inverse().expect("a similarity has an inverse"));
            let plain = Mask::from_fn(50, 60, |x, y| {
                let set = |p| Some(coverage(&mask, p));
                looks.mean(x, y, set) >= Some(0.5)
            });
            assert_eq!(warp_mask(&mask, &map, 50, 60), plain);
        }
    }
}
