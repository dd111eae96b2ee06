//! Principal axes of points and of surfaces.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::params::FitError;
use crate::stages::zbuffer::{IndexedSurface, Moments};
use mocban_core::domain::Rigid3;
use mocban_core::domain::cancel::polled;
use mocban_core::mesh::Mesh;
use mocban_core::mesh::robust_bounds::is_in_box;

/// A mesh without faces needs at least this many points, about 25 along a side, to show one or two strokes.
const LEAST_POINTS: usize = 600;

/// Centre and principal axes, longest first, with the variance along each.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axes {
    pub(crate) centre: Vector3<f64>,
    pub(crate) directions: [Vector3<f64>; 3],
    pub(crate) variances: [f64; 3],
}

impl Axes {
    /// Computes the axes of weighted points.
    pub(crate) fn of_points(points: impl Iterator<Item = ([f64; 3], f64)> + Clone) -> Self {
        let mut total = 0.0;
        let mut sum = Vector3::zeros();
        for (p, w) in polled(points.clone()) {
            total += w;
            sum += Vector3::from(p) * w;
        }
        let centre = sum / total;
        let mut spread = Matrix3::zeros();
        for (p, w) in polled(points) {
            let d = Vector3::from(p) - centre;
            spread += d * d.transpose() * w;
        }
        Self::from_moments(centre, spread / total)
    }

    /// Computes the axes of a surface, weighted by area, without distant specks. Uses the vertices if the area is zero.
    pub(crate) fn of_surface(mesh: &Mesh, indexed: &IndexedSurface) -> Self {
        if let Some(moments) = Moments::of(indexed) {
            return Self::from_moments(moments.centre, moments.covariance);
        }
        let kept = mesh.vertices.iter().filter(|v| is_in_box(&indexed.bulk, v));
        Self::of_points(kept.map(|v| (v, 1.0)))
    }

    fn from_moments(centre: Vector3<f64>, covariance: Matrix3<f64>) -> Self {
        if !covariance.iter().all(|value| value.is_finite()) {
            // The matrix has no eigenvalues.
            return Self {
                centre,
                directions: [Vector3::x(), Vector3::y(), Vector3::z()],
                variances: [f64::NAN; 3],
            };
        }
        let eigen = SymmetricEigen::new(covariance);
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        Self {
            centre,
            directions: order.map(|i| eigen.eigenvectors.column(i).into_owned()),
            variances: order.map(|i| eigen.eigenvalues[i].max(0.0)),
        }
    }

    /// Returns an error for points that span no surface.
    pub(crate) fn require_surface(&self, mesh: &Mesh) -> Result<(), FitError> {
        let count = mesh.vertices.len();
        let scale = self.centre.norm_squared().max(1e-300);
        let [first, second, _] = self.variances;
        if !first.is_finite() {
            return Err(FitError::TooLarge(count));
        }
        if first <= scale * 1e-24 {
            return Err(FitError::OnePoint(count));
        }
        if second <= first * 1e-10 {
            return Err(FitError::OneLine(count));
        }
        if mesh.triangles.is_empty() && count < LEAST_POINTS {
            return Err(FitError::NoFaces(count));
        }
        Ok(())
    }

    /// Returns the direction with the least variance, the normal of the best-fitting plane.
    pub(crate) fn normal(&self) -> Vector3<f64> {
        self.directions[2]
    }
}

/// Returns a right-handed plane frame with this normal. The x axis is as close as possible to the mesh's x, so an
/// upright scan stays upright. If the normal is close to the mesh's x, the mesh's y is used instead.
pub(crate) fn frame(normal: Vector3<f64>, origin: Vector3<f64>) -> Rigid3 {
    let along = if normal.normalize().x.abs() < 0.9 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    frame_along(normal, along, origin)
}

/// Returns a right-handed plane frame with this normal. Its x axis is as close as possible to `along`.
pub(crate) fn frame_along(
    normal: Vector3<f64>,
    along: Vector3<f64>,
    origin: Vector3<f64>,
) -> Rigid3 {
    let z = normal.normalize();
    let x = (along - z * along.dot(&z)).normalize();
    let y = z.cross(&x);
    Rigid3::to_frame([x.into(), y.into(), z.into()], origin.into())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::{Axes, frame};
    use crate::stages::zbuffer::IndexedSurface;
    use mocban_core::mesh::Mesh;

    #[test]
    fn axes_do_not_depend_on_shared_vertices() {
        let corners = vec![
            [0.0, 0.0, 0.0],
            [4.0, 0.0, 0.0],
            [4.0, 2.0, 0.1],
            [0.0, 2.0, 0.0],
        ];
        let shared = Mesh {
            vertices: corners.clone().into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]].into(),
        };
        let vertices: Vec<[f64; 3]> = [0, 1, 2, 0, 2, 3].iter().map(|i| corners[*i]).collect();
        let soup = Mesh {
            vertices: vertices.into(),
            triangles: vec![[0, 1, 2], [3, 4, 5]].into(),
        };
        let axes = |mesh: &Mesh| Axes::of_surface(mesh, &IndexedSurface::new(mesh));
        let (a, b) = (axes(&shared), axes(&soup));
        assert!((a.centre - b.centre).norm() < 1e-12);
        assert!(a.normal().cross(&b.normal()).norm() < 1e-9);
    }

    #[test]
    fn frame_keeps_x_and_puts_the_origin_at_zero() {
        let motion = frame(Vector3::new(0.1, 0.0, 1.0), Vector3::new(5.0, 6.0, 7.0));
        assert!(
            motion
                .apply([5.0, 6.0, 7.0])
                .iter()
                .all(|v| v.abs() < 1e-12)
        );
        let [x, y, _] = motion.apply([6.0, 6.0, 7.0]);
        assert!(x > 0.9 && y.abs() < 1e-12);
    }
}
