//! Bringing grids into another frame. Each output pixel looks back through the inverse map, so nothing has holes.
//!
//! When the map shrinks, a pixel averages several looks spread over its square; outside the source there is nothing.

use super::{DepthMap, Grid, Mask};
use crate::domain::Affine2;

/// Most looks along one side of an output pixel; beyond this a shrinking map begins to alias.
const MAX_LOOKS: usize = 8;

/// A mask in another frame: a pixel is set when at least half of its square is covered.
///
/// `to_from` maps source pixels to output pixels. A map without inverse gives an empty mask.
pub fn warp_mask(mask: &Mask, to_from: &Affine2, width: usize, height: usize) -> Mask {
    let Some(from_to) = to_from.inverse() else {
        return Mask::new(width, height, false);
    };
    let looks = Looks::new(&from_to);
    Mask::from_fn(width, height, |x, y| {
        looks.mean(x, y, |p| {
            Some(bilinear(mask, p, |set| f64::from(u8::from(set))))
        }) >= Some(0.5)
    })
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

/// Values in another frame by bilinear look-up, averaged where the map shrinks; zero outside the source.
pub fn warp_values(
    values: &Grid<f32>,
    to_from: &Affine2,
    width: usize,
    height: usize,
) -> Grid<f32> {
    let Some(from_to) = to_from.inverse() else {
        return Grid::new(width, height, 0.0);
    };
    let looks = Looks::new(&from_to);
    Grid::from_fn(width, height, |x, y| {
        let mean = looks.mean(x, y, |p| Some(bilinear(values, p, f64::from)));
        mean.unwrap_or(0.0) as f32
    })
}

/// Where an output pixel looks in the source.
struct Looks {
    from_to: Affine2,
    per_side: usize,
}

impl Looks {
    fn new(from_to: &Affine2) -> Self {
        let per_side = (from_to.scale().ceil() as usize).clamp(1, MAX_LOOKS);
        Self {
            from_to: *from_to,
            per_side,
        }
    }

    /// Mean of what the looks find; `None` when half of them or more find nothing.
    fn mean(&self, x: usize, y: usize, value: impl Fn([f64; 2]) -> Option<f64>) -> Option<f64> {
        let n = self.per_side;
        let offset = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
        let (mut sum, mut found) = (0.0, 0_usize);
        for j in 0..n {
            for i in 0..n {
                let p = [x as f64 + offset(i), y as f64 + offset(j)];
                if let Some(v) = value(self.from_to.apply(p)) {
                    sum += v;
                    found += 1;
                }
            }
        }
        (2 * found > n * n || (n == 1 && found == 1)).then(|| sum / found as f64)
    }
}

/// Bilinear value at a point; cells outside the grid count as zero.
fn bilinear<T: Copy>(grid: &Grid<T>, [x, y]: [f64; 2], value: impl Fn(T) -> f64) -> f64 {
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let at = |dx: i64, dy: i64| grid.get(x0 as i64 + dx, y0 as i64 + dy).map_or(0.0, &value);
    (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy)
        + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
}

/// Bilinear level among the neighbours that hold data; `None` when they weigh less than half.
fn level_at(levels: &Grid<u16>, [x, y]: [f64; 2]) -> Option<f64> {
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (mut sum, mut weight) = (0.0, 0.0);
    for (dx, wx) in [(0, 1.0 - fx), (1, fx)] {
        for (dy, wy) in [(0, 1.0 - fy), (1, fy)] {
            match levels.get(x0 as i64 + dx, y0 as i64 + dy) {
                None | Some(0) => {}
                Some(level) => {
                    sum += wx * wy * f64::from(level);
                    weight += wx * wy;
                }
            }
        }
    }
    (weight >= 0.5).then(|| sum / weight)
}

#[cfg(test)]
mod tests {
    use super::{warp_mask, warp_values};
    use crate::domain::Affine2;
    use crate::raster::{Grid, Mask};

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
    fn shrinking_averages() {
        let stripes = Grid::from_fn(64, 64, |x, _| if x % 2 == 0 { 1.0_f32 } else { 0.0 });
        let small = warp_values(
            &stripes,
            &Affine2::scale_shift(0.25, [-0.375, -0.375]),
            16,
            16,
        );
        assert!(small.data().iter().all(|v| (v - 0.5).abs() < 1e-6));
    }
}
