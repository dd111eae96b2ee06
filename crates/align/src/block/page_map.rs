//! The map from the face of a block to the pixels of its page.

use serde::{Deserialize, Serialize};

use mocban_core::domain::Affine2;
use mocban_core::raster::{Grid, catmull_rom};

/// Spacing of the nodes, mm. Paper shrinks and warps smoothly over several centimetres.
const NODE_STEP_MM: f64 = 5.0;
/// Nodes beyond the face on each side, so that points at its edge have four nodes in each direction.
const MARGIN_NODES: usize = 3;
/// Points of a row that are mapped exactly; those between are interpolated linearly.
const ROW_STEP: usize = 8;
/// Steps of Newton's method that invert the map.
const INVERSE_STEPS: usize = 12;

/// Maps points of the face (u, v in mm) to pixels of the page: bicubic interpolation (Catmull-Rom) between nodes every
/// 5 mm.
#[derive(Debug, Clone, PartialEq)]
pub struct PageMap {
    /// Position of the first node, mm.
    origin_mm: [f64; 2],
    /// Page pixels of the nodes.
    nodes: Grid<[f64; 2]>,
}

/// The stored form of a [`PageMap`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredPageMap {
    /// Position of the first node, mm.
    pub origin_mm: [f64; 2],
    /// Number of columns.
    pub columns: usize,
    /// Page pixels of the nodes, row by row.
    pub nodes_px: Vec<[f64; 2]>,
}

impl From<&PageMap> for StoredPageMap {
    fn from(map: &PageMap) -> Self {
        Self {
            origin_mm: map.origin_mm,
            columns: map.nodes.width(),
            nodes_px: map.nodes.data().to_vec(),
        }
    }
}

impl TryFrom<StoredPageMap> for PageMap {
    type Error = String;

    fn try_from(stored: StoredPageMap) -> Result<Self, String> {
        let rows = stored
            .nodes_px
            .len()
            .checked_div(stored.columns)
            .unwrap_or(0);
        let nodes = Grid::from_vec(stored.columns, rows, stored.nodes_px);
        match nodes {
            Some(nodes) if stored.columns >= 4 && rows >= 4 => Ok(Self {
                origin_mm: stored.origin_mm,
                nodes,
            }),
            _ => Err("the nodes of a page map do not form a grid of at least 4 x 4".to_owned()),
        }
    }
}

impl PageMap {
    /// Creates the map of an affine transformation over a rectangle of the face, in mm.
    pub fn affine(page_from_face: &Affine2, low_mm: [f64; 2], high_mm: [f64; 2]) -> Self {
        let margin = MARGIN_NODES as f64 * NODE_STEP_MM;
        let origin_mm = low_mm.map(|low| low - margin);
        let count = |k: usize| {
            ((high_mm[k] - low_mm[k]) / NODE_STEP_MM).ceil() as usize + 2 * MARGIN_NODES + 1
        };
        let node = |x: usize, y: usize| {
            page_from_face.apply([
                origin_mm[0] + x as f64 * NODE_STEP_MM,
                origin_mm[1] + y as f64 * NODE_STEP_MM,
            ])
        };
        Self {
            origin_mm,
            nodes: Grid::from_fn(count(0), count(1), node),
        }
    }

    /// Returns the pixel of the page at a point of the face. Beyond the nodes, the map continues nearly linearly.
    pub fn page_from_face(&self, face: [f64; 2]) -> [f64; 2] {
        let (x, weights_x) = self.cell(face, 0);
        let (y, weights_y) = self.cell(face, 1);
        let mut page = [0.0; 2];
        for (row, down) in weights_y.iter().enumerate() {
            let nodes = &self.nodes.row(y + row)[x..x + 4];
            for (node, across) in nodes.iter().zip(&weights_x) {
                page[0] += down * across * node[0];
                page[1] += down * across * node[1];
            }
        }
        page
    }

    /// Returns the first of the four nodes around a coordinate, and their weights.
    fn cell(&self, face: [f64; 2], k: usize) -> (usize, [f64; 4]) {
        let count = [self.nodes.width(), self.nodes.height()][k];
        let at = (face[k] - self.origin_mm[k]) / NODE_STEP_MM;
        let first = (at.floor() - 1.0).clamp(0.0, count as f64 - 4.0);
        let t = at - first - 1.0;
        let weights = if (0.0..=1.0).contains(&t) {
            catmull_rom(t)
        } else if t < 0.0 {
            // Continues the line through the first two nodes.
            [-t, 1.0 + t, 0.0, 0.0]
        } else {
            [0.0, 0.0, 2.0 - t, t - 1.0]
        };
        (first as usize, weights)
    }

    /// Returns the pixels of a row of points of the face: `count` points from `first`, `step_mm` apart along u.
    pub fn row(&self, first: [f64; 2], step_mm: f64, count: usize) -> Vec<[f64; 2]> {
        points_of_row(count, ROW_STEP, |k| {
            self.page_from_face([first[0] + k as f64 * step_mm, first[1]])
        })
    }

    /// Returns the derivative of the map at a point: page pixels per mm along u (first column) and v.
    pub fn derivative(&self, [u, v]: [f64; 2]) -> [[f64; 2]; 2] {
        let step = 0.5;
        let along = |du: f64, dv: f64| {
            let before = self.page_from_face([u - du, v - dv]);
            let after = self.page_from_face([u + du, v + dv]);
            [0, 1].map(|k: usize| (after[k] - before[k]) / (2.0 * step))
        };
        let (by_u, by_v) = (along(step, 0.0), along(0.0, step));
        [[by_u[0], by_v[0]], [by_u[1], by_v[1]]]
    }

    /// Returns the point of the face at a pixel of the page.
    pub fn face_from_page(&self, page: [f64; 2]) -> [f64; 2] {
        let mut face = self.middle();
        for _ in 0..INVERSE_STEPS {
            let at = self.page_from_face(face);
            let error = [page[0] - at[0], page[1] - at[1]];
            let [[a, b], [c, d]] = self.derivative(face);
            let determinant = a * d - b * c;
            if determinant == 0.0 {
                break;
            }
            let step = [
                (d * error[0] - b * error[1]) / determinant,
                (a * error[1] - c * error[0]) / determinant,
            ];
            face = [face[0] + step[0], face[1] + step[1]];
            if step[0].hypot(step[1]) < 1e-6 {
                break;
            }
        }
        face
    }

    /// Returns the mean scale at the middle of the map, page pixels per mm.
    pub fn scale(&self) -> f64 {
        let [[a, b], [c, d]] = self.derivative(self.middle());
        (a * d - b * c).abs().sqrt()
    }

    /// Returns the positions of the nodes on the face, row by row, mm.
    pub fn node_positions(&self) -> Vec<[f64; 2]> {
        let columns = self.nodes.width();
        let at = |k: usize| {
            [
                self.origin_mm[0] + (k % columns) as f64 * NODE_STEP_MM,
                self.origin_mm[1] + (k / columns) as f64 * NODE_STEP_MM,
            ]
        };
        (0..self.nodes.data().len()).map(at).collect()
    }

    /// Returns the map whose page pixel at each node is that of this map at the node plus a shift in mm.
    #[must_use]
    pub fn shifted(&self, shifts_mm: &[[f64; 2]]) -> Self {
        let positions = self.node_positions();
        let nodes: Vec<[f64; 2]> = positions
            .iter()
            .zip(shifts_mm)
            .map(|(at, shift)| self.page_from_face([at[0] + shift[0], at[1] + shift[1]]))
            .collect();
        let (width, height) = (self.nodes.width(), self.nodes.height());
        Self {
            origin_mm: self.origin_mm,
            nodes: Grid::from_vec(width, height, nodes).expect("one shift for each node"),
        }
    }

    /// Returns the rotation from the face to the page at the middle of the map, from x to y, radians.
    pub fn angle_rad(&self) -> f64 {
        self.angle_at(self.middle())
    }

    /// Returns the rotation from the face to the page at a point of the face, from x to y, radians: that of the rotation
    /// nearest to the derivative.
    pub(super) fn angle_at(&self, face: [f64; 2]) -> f64 {
        let [[a, b], [c, d]] = self.derivative(face);
        (c - b).atan2(a + d)
    }

    /// Returns the middle of the map, mm.
    fn middle(&self) -> [f64; 2] {
        let sides = [self.nodes.width(), self.nodes.height()];
        [0, 1].map(|k: usize| self.origin_mm[k] + (sides[k] as f64 - 1.0) / 2.0 * NODE_STEP_MM)
    }
}

/// Returns the points of a row: every point at a multiple of `step` is computed exactly, and those between are
/// interpolated linearly.
pub(super) fn points_of_row(
    count: usize,
    step: usize,
    exact: impl Fn(usize) -> [f64; 2],
) -> Vec<[f64; 2]> {
    let mut points = Vec::with_capacity(count + step);
    let mut from = exact(0);
    for start in (0..count).step_by(step) {
        let to = exact(start + step);
        for k in 0..step {
            let share = k as f64 / step as f64;
            points.push([0, 1].map(|axis: usize| from[axis] + share * (to[axis] - from[axis])));
        }
        from = to;
    }
    points.truncate(count);
    points
}

#[cfg(test)]
mod tests {
    use super::{PageMap, StoredPageMap};
    use mocban_core::domain::Affine2;

    const LOW: [f64; 2] = [-20.0, 5.0];
    const HIGH: [f64; 2] = [95.0, 71.0];

    fn affine() -> (Affine2, PageMap) {
        let affine = Affine2([[9.0, 0.7, 100.0], [-0.6, 9.2, 50.0]]);
        (affine, PageMap::affine(&affine, LOW, HIGH))
    }

    fn warped() -> PageMap {
        let (_, map) = affine();
        let shifts: Vec<[f64; 2]> = map
            .node_positions()
            .iter()
            .map(|[u, v]| [(v / 20.0).sin(), 0.5 * (u / 30.0).cos()])
            .collect();
        map.shifted(&shifts)
    }

    fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
        (a[0] - b[0]).hypot(a[1] - b[1])
    }

    #[test]
    fn an_affine_map_is_kept_inside_and_outside_the_nodes() {
        let (affine, map) = affine();
        for face in [[0.0, 10.0], [37.3, 44.4], [95.0, 71.0], [-60.0, 140.0]] {
            assert!(distance(map.page_from_face(face), affine.apply(face)) < 1e-9);
        }
        let [[a, b], [c, d]] = map.derivative([20.0, 30.0]);
        assert!((a - 9.0).abs() < 1e-9 && (b - 0.7).abs() < 1e-9);
        assert!((c + 0.6).abs() < 1e-9 && (d - 9.2).abs() < 1e-9);
    }

    #[test]
    fn the_inverse_leads_back() {
        let map = warped();
        for face in [LOW, HIGH, [3.0, 70.0], [60.5, 22.2]] {
            let back = map.face_from_page(map.page_from_face(face));
            assert!(distance(back, face) < 1e-6);
        }
    }

    #[test]
    fn a_row_is_interpolated_to_a_twentieth_of_a_pixel() {
        let map = warped();
        let row = map.row([-20.0, 33.0], 0.3, 380);
        for (k, point) in row.iter().enumerate() {
            let exact = map.page_from_face([-20.0 + k as f64 * 0.3, 33.0]);
            assert!(distance(*point, exact) < 0.05, "{k}");
        }
    }

    #[test]
    fn a_stored_map_is_the_same_map() {
        let map = warped();
        let text = serde_json::to_string(&StoredPageMap::from(&map)).unwrap();
        let stored: StoredPageMap = serde_json::from_str(&text).unwrap();
        assert_eq!(PageMap::try_from(stored), Ok(map));
    }

    #[test]
    fn a_stored_map_without_a_grid_is_refused() {
        let stored = StoredPageMap {
            origin_mm: [0.0; 2],
            columns: 5,
            nodes_px: vec![[0.0; 2]; 21],
        };
        assert!(PageMap::try_from(stored).is_err());
    }
}
