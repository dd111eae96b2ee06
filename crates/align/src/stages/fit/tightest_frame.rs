//! Finds the frame in which the bounding box of a flat scan is smallest.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use super::pca::{Axes, frame, frame_along};
use super::scan_parts::some_points;
use mocban_core::domain::Rigid3;
use mocban_core::domain::cancel::polled;
use mocban_core::mesh::Mesh;

/// Number of angles, from 0 to a right angle, that are tried to find the edges of a grid.
pub(super) const ANGLES: i32 = 30;
/// Number of directions along which the corners of a polygon inside the mesh are found.
const DIRECTIONS: usize = 32;
/// A vertex lies inside the polygon if its distance from all sides is at least this fraction of the polygon's size, far more
/// than what is lost by rounding.
const MARGIN: f64 = 1e-4;

/// Returns the frame with the least principal axis as z whose x and y axes give the bounding box of the mesh the
/// smallest area, and the bounds of the mesh in x and y of the frame.
pub(super) fn tightest_frame(mesh: &Mesh, axes: &Axes) -> (Rigid3, [[f64; 2]; 2]) {
    let normal = axes.normal();
    let level = frame(normal, axes.centre);
    let outermost = outermost(mesh, &level);
    let [x, y] = [0, 1].map(|k| Vector3::new(level.0[k][0], level.0[k][1], level.0[k][2]));
    let turned = (0..ANGLES).map(|step| {
        let angle = FRAC_PI_2 * f64::from(step) / f64::from(ANGLES);
        frame_along(normal, x * angle.cos() + y * angle.sin(), axes.centre)
    });
    let area = |frame: &Rigid3| {
        let [low, high] = bounds(outermost.iter().copied(), frame);
        (high[0] - low[0]) * (high[1] - low[1])
    };
    let areas = turned.map(|frame| (area(&frame), frame));
    let tightest = areas.min_by(|a, b| a.0.total_cmp(&b.0));
    let tightest = tightest.map_or(level, |(_, frame)| frame);
    let [low, high] = bounds(outermost.iter().copied(), &tightest);
    (tightest, [[low[0], low[1]], [high[0], high[1]]])
}

/// Returns the lowest and the highest coordinates of points in a frame.
pub(super) fn bounds(points: impl Iterator<Item = [f64; 3]>, frame: &Rigid3) -> [[f64; 3]; 2] {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for at in polled(points).map(|point| frame.apply(point)) {
        for k in 0..3 {
            bounds[0][k] = bounds[0][k].min(at[k]);
            bounds[1][k] = bounds[1][k].max(at[k]);
        }
    }
    bounds
}

/// Returns the vertices that may be the outermost ones along some direction in the plane of a frame: those outside a polygon of
/// some of the vertices. The others are never the outermost ones.
fn outermost(mesh: &Mesh, level: &Rigid3) -> Vec<[f64; 3]> {
    let place = |vertex: [f64; 3]| {
        let [x, y, _] = level.apply(vertex);
        [x, y]
    };
    let some: Vec<[f64; 2]> = some_points(mesh).into_iter().map(place).collect();
    let polygon = InnerPolygon::around(&some);
    polled(mesh.vertices.iter())
        .filter(|vertex| !polygon.contains(place(*vertex)))
        .collect()
}

/// A convex polygon.
struct InnerPolygon {
    /// A point and the unit normal, which points inward, of each side.
    sides: Vec<[[f64; 2]; 2]>,
    /// Centre and square of the radius of a circle inside.
    centre: [f64; 2],
    square_radius: f64,
    margin: f64,
}

impl InnerPolygon {
    /// Returns the polygon of the outermost points along some directions.
    fn around(points: &[[f64; 2]]) -> Self {
        let angles = (0..DIRECTIONS)
            .map(|k| (k as f64 / DIRECTIONS as f64 * std::f64::consts::TAU).sin_cos());
        let mut corners: Vec<[f64; 2]> = angles
            .filter_map(|(sin, cos)| {
                let along = |[x, y]: &[f64; 2]| cos * x + sin * y;
                let farthest = points.iter().max_by(|a, b| along(a).total_cmp(&along(b)));
                farthest.copied()
            })
            .collect();
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        let count = corners.len().max(1) as f64;
        let centre = [0, 1].map(|k| corners.iter().map(|corner| corner[k]).sum::<f64>() / count);
        let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let size = corners
            .iter()
            .map(|corner| distance(corner, &centre))
            .fold(0.0, f64::max);
        let next = corners.iter().cycle().skip(1);
        let sides: Vec<[[f64; 2]; 2]> = corners
            .iter()
            .zip(next)
            .map(|(from, to)| {
                let length = distance(from, to).max(f64::MIN_POSITIVE);
                [
                    *from,
                    [(from[1] - to[1]) / length, (to[0] - from[0]) / length],
                ]
            })
            .collect();
        let margin = MARGIN * size;
        let radius = sides
            .iter()
            .map(|side| inward(side, centre))
            .fold(size, f64::min)
            - margin;
        Self {
            sides,
            centre,
            square_radius: radius.max(0.0).powi(2),
            margin,
        }
    }

    /// Returns whether a point lies inside, away from all sides.
    fn contains(&self, point: [f64; 2]) -> bool {
        let [x, y] = [0, 1].map(|k| point[k] - self.centre[k]);
        x * x + y * y < self.square_radius
            || self.square_radius > 0.0
                && self
                    .sides
                    .iter()
                    .all(|side| inward(side, point) > self.margin)
    }
}

/// Returns how far inside a side a point lies.
fn inward([on, normal]: &[[f64; 2]; 2], point: [f64; 2]) -> f64 {
    normal[0] * (point[0] - on[0]) + normal[1] * (point[1] - on[1])
}

#[cfg(test)]
mod tests {
    use super::outermost;
    use mocban_core::domain::Rigid3;
    use mocban_core::mesh::Mesh;

    const LEVEL: Rigid3 = Rigid3([
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);

    fn mesh(vertices: Vec<[f64; 3]>) -> Mesh {
        Mesh {
            vertices: vertices.into(),
            triangles: Vec::new().into(),
        }
    }

    /// Returns the range along a direction.
    fn range(points: impl Iterator<Item = [f64; 3]>, angle: f64) -> [f64; 2] {
        let (sin, cos) = angle.sin_cos();
        points
            .map(|[x, y, _]| cos * x + sin * y)
            .fold([f64::MAX, f64::MIN], |[low, high], at| {
                [low.min(at), high.max(at)]
            })
    }

    #[test]
    fn few_vertices_have_the_same_range_along_every_direction() {
        let vertices = (0..90_000).map(|k| {
            let [x, y] = [k % 300, k / 300].map(f64::from);
            [1000.0 + 0.9 * x + 0.3 * y, 0.8 * y - 0.2 * x, (x * y).sin()]
        });
        let mesh = mesh(vertices.collect());
        let few = outermost(&mesh, &LEVEL);
        assert!((4..9_000).contains(&few.len()), "{}", few.len());
        for step in 0..50 {
            let angle = f64::from(step) * 0.13;
            let all = range(mesh.vertices.iter(), angle);
            assert_eq!(range(few.iter().copied(), angle), all, "{angle}");
        }
    }

    #[test]
    fn all_vertices_of_a_line_or_a_point_are_kept() {
        let line = mesh(
            (0..50)
                .map(|k| [f64::from(k), 2.0 * f64::from(k), 0.0])
                .collect(),
        );
        assert_eq!(outermost(&line, &LEVEL).len(), 50);
        assert_eq!(outermost(&mesh(vec![[3.0; 3]; 4]), &LEVEL).len(), 4);
        assert!(outermost(&mesh(Vec::new()), &LEVEL).is_empty());
    }
}
