//! A smooth field of shifts from the matches of windows: moving least squares, robust against wrong matches.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::windows::WindowMatch;
use mocban_core::domain::cancel::ThreadToken;

/// Windows below this correlation are left out.
pub(super) const MIN_NCC: f64 = 0.35;
/// Ridge on the slopes of the local fit, as a fraction of its weight.
const RIDGE: f64 = 0.05;
/// Weight of "no shift" in the local fit, as a fraction of one sure window: far from all windows the field is 0.
const PRIOR: f64 = 1e-4;
/// Rounds of reweighting.
const ROUNDS: usize = 4;
/// Least residual at which a window counts a quarter, mm.
const MIN_SCALE_MM: f64 = 0.06;
/// Least fraction of the sharper direction's certainty that the weaker direction counts with.
const MIN_CERTAINTY: f64 = 0.02;

/// One window in the fit.
#[derive(Debug, Clone, Copy)]
struct Sample {
    at: [f64; 2],
    shift: [f64; 2],
    /// Certainty along xx, yy and xy; its larger eigenvalue is at most 1.
    certainty: [f64; 3],
    weight: f64,
}

/// Unknowns of a local fit: shift, slope along u and along v, for both components.
type Vector6 = SVector<f64, 6>;
type Matrix6 = SMatrix<f64, 6, 6>;

/// A smooth field of shifts over the face.
#[derive(Debug, Clone)]
pub(super) struct ShiftField {
    samples: Vec<Sample>,
    sigma_mm: f64,
    /// A second, finer field of the residuals.
    fine: Option<Box<ShiftField>>,
}

impl ShiftField {
    /// Fits a field that is locally linear over `sigma_mm`. If `fine_sigma_mm` is given, the residuals are fitted again
    /// over that distance. Returns `None` with fewer than three windows.
    pub(super) fn fit(
        matches: &[WindowMatch],
        sigma_mm: f64,
        fine_sigma_mm: Option<f64>,
    ) -> Option<Self> {
        let mut field = Self {
            samples: samples_of(matches),
            sigma_mm,
            fine: None,
        };
        if field.samples.len() < 3 {
            return None;
        }
        field.reweight();
        if let Some(fine_sigma_mm) = fine_sigma_mm {
            let positions: Vec<[f64; 2]> = field.samples.iter().map(|s| s.at).collect();
            let coarse = field.at_all(&positions);
            let mut fine = Self {
                samples: field.samples.clone(),
                sigma_mm: fine_sigma_mm,
                fine: None,
            };
            for (sample, coarse) in fine.samples.iter_mut().zip(&coarse) {
                sample.shift = [sample.shift[0] - coarse[0], sample.shift[1] - coarse[1]];
            }
            field.fine = Some(Box::new(fine));
        }
        Some(field)
    }

    /// Lowers the weights of windows that disagree with the others.
    fn reweight(&mut self) {
        let full: Vec<f64> = self.samples.iter().map(|s| s.weight).collect();
        let positions: Vec<[f64; 2]> = self.samples.iter().map(|s| s.at).collect();
        for _ in 0..ROUNDS {
            let fitted = self.at_all(&positions);
            let residuals: Vec<f64> = self
                .samples
                .iter()
                .zip(&fitted)
                .map(|(sample, fitted)| sample.residual(*fitted))
                .collect();
            let mut sorted = residuals.clone();
            let middle = sorted.len() / 2;
            let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
            let scale = (2.5 * median).max(MIN_SCALE_MM);
            for ((sample, full), residual) in self.samples.iter_mut().zip(&full).zip(&residuals) {
                let ratio = residual / scale;
                sample.weight = full / (1.0 + ratio * ratio).powi(2);
            }
        }
    }

    /// Returns the shifts at many points, mm.
    pub(super) fn at_all(&self, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let token = ThreadToken::current();
        let shift = |point: &[f64; 2]| token.scope(|| self.at(*point));
        points.par_iter().map(shift).collect()
    }

    /// Returns the shift at a point, mm.
    pub(super) fn at(&self, point: [f64; 2]) -> [f64; 2] {
        // Sums over the products of the basis 1, u and v, for each part of the certainty.
        let (mut by_xx, mut by_yy, mut by_xy) = ([0.0; 6], [0.0; 6], [0.0; 6]);
        let mut right = Vector6::zeros();
        let mut total = 0.0;
        for sample in &self.samples {
            let offset = [0, 1].map(|k: usize| (sample.at[k] - point[k]) / self.sigma_mm);
            let distance = offset[0] * offset[0] + offset[1] * offset[1];
            // A Gaussian with compact support: 0 from 3.3 sigma on.
            if distance > 11.0 {
                continue;
            }
            let near = (1.0 - distance / 11.0).powi(5);
            let weight = sample.weight * near;
            total += weight;
            let [xx, yy, xy] = sample.certainty.map(|c| c * weight);
            let [u, v] = offset;
            let products = [1.0, u, v, u * u, u * v, v * v];
            for (k, product) in products.into_iter().enumerate() {
                by_xx[k] += xx * product;
                by_yy[k] += yy * product;
                by_xy[k] += xy * product;
            }
            let pull = [
                xx * sample.shift[0] + xy * sample.shift[1],
                xy * sample.shift[0] + yy * sample.shift[1],
            ];
            for (i, basis) in [1.0, u, v].into_iter().enumerate() {
                right[i] += basis * pull[0];
                right[i + 3] += basis * pull[1];
            }
        }
        // Which product belongs to two elements of the basis.
        let product = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];
        let mut normal = Matrix6::from_fn(|i, j| {
            let sums = match (i / 3, j / 3) {
                (0, 0) => &by_xx,
                (1, 1) => &by_yy,
                _ => &by_xy,
            };
            sums[product[i % 3][j % 3]]
        });
        for k in [0, 3] {
            normal[(k, k)] += PRIOR;
            normal[(k + 1, k + 1)] += RIDGE * total + PRIOR;
            normal[(k + 2, k + 2)] += RIDGE * total + PRIOR;
        }
        let Some(cholesky) = normal.cholesky() else {
            return [0.0; 2];
        };
        let fitted = cholesky.solve(&right);
        let fine = self.fine.as_ref().map_or([0.0; 2], |fine| fine.at(point));
        [fitted[0] + fine[0], fitted[3] + fine[1]]
    }
}

impl Sample {
    /// Returns the residual along the directions that the window shows, mm.
    fn residual(&self, fitted: [f64; 2]) -> f64 {
        let [dx, dy] = [0, 1].map(|k: usize| self.shift[k] - fitted[k]);
        let [xx, yy, xy] = self.certainty;
        (xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy)
            .max(0.0)
            .sqrt()
    }
}

/// Returns the windows with enough correlation, with weights.
fn samples_of(matches: &[WindowMatch]) -> Vec<Sample> {
    let usable = || matches.iter().filter(|m| m.ncc > MIN_NCC);
    let mut sharpest: Vec<f64> = usable().map(|m| eigenvalues(m.curvature)[1]).collect();
    if sharpest.is_empty() {
        return Vec::new();
    }
    let middle = sharpest.len() / 2;
    let typical = *sharpest.select_nth_unstable_by(middle, f64::total_cmp).1;
    usable()
        .map(|window| Sample {
            at: window.at,
            shift: window.shift,
            certainty: certainty(window.curvature, typical),
            weight: (window.ncc - MIN_NCC) / (1.0 - MIN_NCC),
        })
        .collect()
}

/// Returns the eigenvalues of a symmetric matrix given as xx, yy, xy; the smaller one first.
fn eigenvalues([xx, yy, xy]: [f64; 3]) -> [f64; 2] {
    let (mean, half) = (f64::midpoint(xx, yy), (xx - yy) / 2.0);
    let radius = half.hypot(xy);
    [mean - radius, mean + radius]
}

/// Returns the certainty of a match: its curvature in relation to half of the typical one, limited to 1 in each
/// direction. A window that shows only a rule is certain across it, and not along it.
fn certainty(curvature: [f64; 3], typical: f64) -> [f64; 3] {
    let [xx, yy, xy] = curvature;
    let [low, high] = eigenvalues(curvature);
    let limited = [low, high].map(|value| (value / (0.5 * typical)).clamp(MIN_CERTAINTY, 1.0));
    let gap = high - low;
    if gap < 1e-12 {
        return [limited[1], limited[1], 0.0];
    }
    // P projects on the direction of the larger eigenvalue: (M - low I) / (high - low).
    let [pxx, pyy, pxy] = [(xx - low) / gap, (yy - low) / gap, xy / gap];
    let spread = limited[1] - limited[0];
    [
        limited[0] + spread * pxx,
        limited[0] + spread * pyy,
        spread * pxy,
    ]
}

#[cfg(test)]
mod tests {
    use super::ShiftField;
    use crate::block::WindowMatch;

    /// Windows every 10 mm over 150 x 100 mm.
    fn windows(shift: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<WindowMatch> {
        let places = (0..16).flat_map(|x| (0..11).map(move |y| [x, y]));
        places
            .map(|[x, y]| {
                let at = [f64::from(x) * 10.0, f64::from(y) * 10.0];
                WindowMatch {
                    at,
                    shift: shift(at),
                    ncc: 0.9,
                    curvature: [0.2, 0.2, 0.0],
                }
            })
            .collect()
    }

    fn linear([u, v]: [f64; 2]) -> [f64; 2] {
        [0.5 + 0.004 * u - 0.002 * v, -0.3 + 0.001 * u + 0.005 * v]
    }

    fn error(field: &ShiftField, at: [f64; 2], truth: [f64; 2]) -> f64 {
        let found = field.at(at);
        (found[0] - truth[0]).hypot(found[1] - truth[1])
    }

    #[test]
    fn a_linear_field_is_reproduced() {
        let field = ShiftField::fit(&windows(linear), 45.0, None).unwrap();
        for at in [[0.0, 0.0], [75.0, 50.0], [150.0, 100.0]] {
            assert!(error(&field, at, linear(at)) < 0.06, "{at:?}");
        }
    }

    #[test]
    fn a_third_of_wrong_windows_does_not_matter() {
        let mut windows = windows(linear);
        for (k, window) in windows.iter_mut().enumerate() {
            if k % 3 == 0 {
                window.shift = [
                    ((k * 7) % 11) as f64 / 2.0 - 2.5,
                    ((k * 5) % 13) as f64 / 2.0 - 3.0,
                ];
            }
        }
        let field = ShiftField::fit(&windows, 45.0, None).unwrap();
        for at in [[20.0, 30.0], [75.0, 50.0], [130.0, 80.0]] {
            assert!(
                error(&field, at, linear(at)) < 0.12,
                "{at:?} {:?}",
                field.at(at)
            );
        }
    }

    #[test]
    fn a_rule_decides_only_across_its_direction() {
        let mut windows = windows(|_| [0.4, 0.2]);
        for window in windows.iter_mut().filter(|window| window.at[0] == 70.0) {
            window.shift = [0.4, 1.9];
            window.curvature = [0.2, 0.0005, 0.0];
        }
        let field = ShiftField::fit(&windows, 15.0, None).unwrap();
        assert!(error(&field, [70.0, 50.0], [0.4, 0.2]) < 0.1);
    }

    #[test]
    fn details_are_added_by_the_finer_field() {
        let wave = |[u, v]: [f64; 2]| [0.3 * (u / 12.0).sin(), 0.3 * (v / 12.0).cos()];
        let [coarse, fine] = [None, Some(10.0)].map(|fine| {
            let field = ShiftField::fit(&windows(wave), 45.0, fine).unwrap();
            error(&field, [70.0, 50.0], wave([70.0, 50.0]))
        });
        assert!(fine < coarse / 2.0, "{fine} {coarse}");
    }

    #[test]
    fn two_windows_are_too_few() {
        let few = &windows(linear)[..2];
        assert!(ShiftField::fit(few, 45.0, None).is_none());
    }
}
