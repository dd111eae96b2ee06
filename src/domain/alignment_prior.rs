//! The alignment that the registration of a whole block expects of one of its characters.

use serde::{Deserialize, Serialize};

use super::transform::PrintFromMesh;

/// The expected alignment of a pair that was cut from a block.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AlignmentPrior {
    /// Maps points of the mesh to pixels of the print.
    pub print_from_mesh: PrintFromMesh,
    /// How sure the position is, 0..=1.
    pub confidence: f64,
}

/// Largest difference of two near priors, as a share of the longer edge of the print.
const NEAR_SHARE: f64 = 0.003;
/// Largest difference of the confidences of two near priors.
const NEAR_CONFIDENCE: f64 = 0.05;

impl AlignmentPrior {
    /// Returns whether two priors of a print of about `size` pixels (width, height) are so near that the alignment does
    /// not depend on which of them is used: the corners and the middle differ by at most 0.3 % of the longer edge.
    pub fn is_near(&self, other: &Self, [width, height]: [f64; 2]) -> bool {
        let limit = NEAR_SHARE * width.max(height);
        let places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]];
        let is_near = |[u, v]: [f64; 2]| {
            let (x, y) = (u * width, v * height);
            self.mesh_point(x, y).is_some_and(|point| {
                let [there_x, there_y, _] = other.print_from_mesh.apply(point);
                (there_x - x).hypot(there_y - y) <= limit
            })
        };
        (self.confidence - other.confidence).abs() <= NEAR_CONFIDENCE
            && places.into_iter().all(is_near)
    }

    /// Returns the point of the mesh at the height 0 that is mapped to a pixel of the print. `None` if the map has no
    /// inverse.
    fn mesh_point(&self, x: f64, y: f64) -> Option<[f64; 3]> {
        let rows = self.print_from_mesh.0;
        let [a, b, c] = rows.map(|[i, j, k, _]| [i, j, k]);
        let [x, y, z] = [x - rows[0][3], y - rows[1][3], -rows[2][3]];
        let columns = [cross(b, c), cross(c, a), cross(a, b)];
        let determinant: f64 = (0..3).map(|at| a[at] * columns[0][at]).sum();
        if determinant == 0.0 {
            return None;
        }
        Some(std::array::from_fn(|at| {
            (columns[0][at] * x + columns[1][at] * y + columns[2][at] * z) / determinant
        }))
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::{AlignmentPrior, PrintFromMesh};

    /// A prior whose print is 100 px wide, with another shift in pixels.
    fn prior(shift: f64, scale: f64) -> AlignmentPrior {
        AlignmentPrior {
            print_from_mesh: PrintFromMesh([
                [10.0 * scale, 0.0, 0.5, -1200.0 + shift],
                [0.0, -10.0, 0.1, 1500.0],
                [0.01, 0.0, 1.0, -4.0],
            ]),
            confidence: 0.9,
        }
    }

    #[test]
    fn only_small_differences_are_near() {
        let here = prior(0.0, 1.0);
        assert!(here.is_near(&prior(0.02, 1.0), [100.0, 100.0]));
        assert!(!here.is_near(&prior(0.5, 1.0), [100.0, 100.0]));
        // The scale matters by its effect on the print, which is far from the origin of the mesh.
        assert!(!here.is_near(&prior(0.0, 1.001), [100.0, 100.0]));
        let unsure = AlignmentPrior {
            confidence: 0.5,
            ..here
        };
        assert!(!here.is_near(&unsure, [100.0, 100.0]));
        assert!(!here.is_near(&prior(f64::NAN, 1.0), [100.0, 100.0]));
    }

    #[test]
    fn a_point_of_the_mesh_is_mapped_back() {
        let here = prior(0.0, 1.0);
        let point = here.mesh_point(30.0, 70.0).expect("an inverse");
        let [x, y, height] = here.print_from_mesh.apply(point);
        assert!((x - 30.0).abs() < 1e-9 && (y - 70.0).abs() < 1e-9 && height.abs() < 1e-9);
    }
}
