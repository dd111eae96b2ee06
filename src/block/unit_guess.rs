//! The unit of a scan, guessed from the extent of its carving.
//!
//! The extent of the whole scan misleads if it shows a large turntable or table. The flanks of the strokes do not: they
//! are most of the steep area, and lie in one thin layer.

use nalgebra::{Matrix2, SymmetricEigen, Vector2, Vector3};

use super::orientation::{ALONG, SIDE_BY_DEVIATION, SampledTriangle};
use crate::domain::LengthUnit;

/// Typical long side of a carved page, mm. The unit is the one that brings the carving nearest to it.
const TYPICAL_LONG_SIDE_MM: f64 = 280.0;
/// Thickness of a layer, as a share of the long side of the scan: 6 mm of 320 mm.
const LAYER_SHARE: f64 = 0.019;

/// Area of a layer, and its moments along u and v.
#[derive(Debug, Clone, Copy, Default)]
struct SteepLayer {
    area: f64,
    first: Vector2<f64>,
    second: Matrix2<f64>,
}

impl SteepLayer {
    fn joined(&self, other: &Self) -> Self {
        Self {
            area: self.area + other.area,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }

    /// Returns the long side of a rectangle over which the area would be spread evenly.
    fn long_side(&self) -> f64 {
        let mean = self.first / self.area;
        let covariance = self.second / self.area - mean * mean.transpose();
        let variance = SymmetricEigen::new(covariance).eigenvalues.max();
        SIDE_BY_DEVIATION * variance.max(0.0).sqrt()
    }
}

/// Guesses the unit from a sample of the triangles. `axes` are u, v and n of the face; `long_side` is that of the whole
/// scan in units of the mesh, and decides alone if nothing is steep.
pub(super) fn guess_unit(
    axes: &[Vector3<f64>; 3],
    sample: &[SampledTriangle],
    long_side: f64,
) -> LengthUnit {
    nearest_unit(carved_long_side(axes, sample, long_side).unwrap_or(long_side))
}

/// Returns the long side of the layer with the largest steep area, in units of the mesh; `None` if nothing is steep.
fn carved_long_side(
    axes: &[Vector3<f64>; 3],
    sample: &[SampledTriangle],
    long_side: f64,
) -> Option<f64> {
    let [u, v, n] = axes;
    let steep = || {
        let vectors = sample.iter().map(|t| t.map(|vector| vector.cast::<f64>()));
        vectors
            .map(|[corner, normal]| (corner, normal, normal.norm()))
            .filter(|(_, normal, area)| normal.dot(n).abs() < ALONG * area)
            .map(|(corner, _, area)| (corner, area))
    };
    let heights = || steep().map(|(corner, _)| n.dot(&corner));
    let (low, high) = (heights().reduce(f64::min)?, heights().reduce(f64::max)?);
    // Layers overlap by half, so that one of them holds all strokes.
    let half = (LAYER_SHARE * long_side / 2.0).max((high - low) / sample.len() as f64);
    let index = |height: f64| ((height - low) / half.max(f64::MIN_POSITIVE)) as usize;
    let mut halves = vec![SteepLayer::default(); index(high) + 2];
    for (corner, area) in steep() {
        let at = Vector2::new(u.dot(&corner), v.dot(&corner));
        let layer = &mut halves[index(n.dot(&corner))];
        layer.area += area;
        layer.first += at * area;
        layer.second += at * at.transpose() * area;
    }
    halves
        .windows(2)
        .map(|pair| pair[0].joined(&pair[1]))
        .max_by(|a, b| a.area.total_cmp(&b.area))
        .map(|layer| layer.long_side())
}

/// Returns the unit in which a long side is nearest to that of a carved page.
fn nearest_unit(long_side: f64) -> LengthUnit {
    let distance = |unit: &LengthUnit| (long_side * unit.mm() / TYPICAL_LONG_SIDE_MM).ln().abs();
    LengthUnit::ALL
        .into_iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(LengthUnit::Mm)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::orientation::SampledTriangle;
    use super::guess_unit;
    use crate::domain::LengthUnit;

    /// Flanks of strokes on a face of 290 x 190 mm, with an equal area of tops, and a table of 900 x 900 mm 25 mm below.
    fn block_on_table(mm: f64) -> Vec<SampledTriangle> {
        let triangle = |at: [f64; 3], normal: [f64; 3]| {
            [Vector3::from(at) / mm, Vector3::from(normal) / (mm * mm)].map(|v| v.cast::<f32>())
        };
        let grid = |side: [i32; 2], step: i32| {
            (0..side[0] / step).flat_map(move |x| {
                (0..side[1] / step)
                    .map(move |y| [x * step - side[0] / 2, y * step - side[1] / 2].map(f64::from))
            })
        };
        let table = grid([900, 900], 10).map(|[x, y]| triangle([x, y, -25.0], [0.0, 0.0, 100.0]));
        let face = grid([290, 190], 5).flat_map(|[x, y]| {
            [
                triangle([x, y, 0.0], [0.0, 0.0, 25.0]),
                triangle([x, y, -1.5], [20.0, 15.0, 0.0]),
            ]
        });
        table.chain(face).collect()
    }

    #[test]
    fn a_large_table_does_not_change_the_unit() {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        for unit in LengthUnit::ALL {
            let sample = block_on_table(unit.mm());
            assert_eq!(guess_unit(&axes, &sample, 900.0 / unit.mm()), unit);
        }
    }

    #[test]
    fn a_scan_without_steep_area_is_measured_as_a_whole() {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut sample = block_on_table(10.0);
        sample.retain(|[_, normal]| normal.z > 0.0);
        assert_eq!(guess_unit(&axes, &sample, 32.0), LengthUnit::Cm);
        assert_eq!(guess_unit(&axes, &[], 0.32), LengthUnit::M);
    }
}
