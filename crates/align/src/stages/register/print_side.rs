//! A straight line that divides a print in two, and the masks on one side of it.

use crate::stages::normalize::PrintMasks;
use crate::stages::pose::{PoseCandidate, PyramidLevel, Refiner};
use mocban_core::domain::cancel::poll;

/// Numbers of directions and offsets among which the line is placed.
const FINE_DIRECTIONS: usize = 48;
const FINE_OFFSETS: usize = 40;

/// A side of a line across the print.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    /// Unit vector away from the side.
    pub(super) normal: [f64; 2],
    /// Distance of the line from the origin along `normal`, pixels of the masks.
    pub(super) offset: f64,
}

impl Side {
    pub(super) fn contains(&self, point: [f64; 2]) -> bool {
        self.beyond(point) < 0.0
    }

    /// Returns the other side of the line.
    pub(super) fn opposite(&self) -> Self {
        Self {
            normal: self.normal.map(|part| -part),
            offset: -self.offset,
        }
    }

    /// Returns how far a point lies beyond the line, pixels.
    fn beyond(&self, [x, y]: [f64; 2]) -> f64 {
        self.normal[0] * x + self.normal[1] * y - self.offset
    }

    /// Returns the masks of a print, unknown beyond the line.
    pub(super) fn masks(&self, print: &PrintMasks) -> PrintMasks {
        let mut part = print.clone();
        for mask in [&mut part.ink, &mut part.specks, &mut part.known] {
            let width = mask.width();
            for (y, row) in mask.data_mut().chunks_exact_mut(width.max(1)).enumerate() {
                for (x, set) in row.iter_mut().enumerate() {
                    *set &= self.contains([x as f64, y as f64]);
                }
            }
        }
        part
    }

    /// Returns the side of the line on which `larger` predicts the ink, while `smaller` predicts it beyond the line, with the
    /// least squares of the differences. Only pixels count where the depth map has data in both poses.
    pub(super) fn between(
        whole: &Refiner,
        fixed: &PyramidLevel,
        larger: &PoseCandidate,
        smaller: &PoseCandidate,
    ) -> Option<Self> {
        let mut points = Vec::new();
        fixed.each_amount(|point, _| points.push(point))?;
        let mut gains = Vec::new();
        whole.each_difference([smaller, larger], |point, differences| {
            let [of_smaller, of_larger] = differences.map(|of| f64::from(of).powi(2));
            gains.push((point, of_smaller - of_larger));
        })?;
        let mut best: Option<(f64, Self)> = None;
        for k in 0..FINE_DIRECTIONS {
            poll();
            let (sin, cos) = (k as f64 * std::f64::consts::TAU / FINE_DIRECTIONS as f64).sin_cos();
            let along = |[x, y]: [f64; 2]| cos * x + sin * y;
            let range = points
                .iter()
                .fold([f64::MAX, f64::MIN], |[low, high], point| {
                    let at = along(*point);
                    [low.min(at), high.max(at)]
                });
            let width = (range[1] - range[0]).max(1e-9);
            let mut bins = [0.0; FINE_OFFSETS];
            for (point, gain) in &gains {
                let at = (along(*point) - range[0]) / width * FINE_OFFSETS as f64;
                bins[(at as usize).min(FINE_OFFSETS - 1)] += gain;
            }
            // A pixel on the larger side saves the square of the other pose's difference.
            let mut saved = 0.0;
            for (bin, gain) in bins.iter().enumerate() {
                saved += gain;
                if best.as_ref().is_none_or(|(most, _)| saved > *most) {
                    let offset = range[0] + width * (bin + 1) as f64 / FINE_OFFSETS as f64;
                    let normal = [cos, sin];
                    best = Some((saved, Self { normal, offset }));
                }
            }
        }
        best.map(|(_, side)| side)
    }
}
