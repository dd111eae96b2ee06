//! Simplifies a mesh by merging the vertices in each cell of a grid.

use foldhash::{HashMap, HashMapExt, HashSet, HashSetExt};

use super::robust_bounds::{Bounds, bulk_box, is_in_box};
use super::triangle_mesh::{Mesh, Vertices};
use crate::domain::cancel::polled;

/// Cells along the longest side of the finest grid.
const MAX_CELLS: u32 = 1 << 16;
/// Bits of a coordinate of a cell. Three coordinates fit into 64 bits.
const CELL_BITS: u32 = 21;

impl Mesh {
    /// Returns a mesh of at most `max_elements` triangles, or points if it is a point set. Returns the mesh itself if
    /// it has no more.
    ///
    /// The vertices in each cell of a cubic grid become one vertex at their mean (Rossignac and Borrel 1993). The grid is
    /// the finest that satisfies the limit. Triangles with two corners in one cell are removed, and of triangles with
    /// equal corners and winding, the first is kept. The result depends only on the mesh, lies within its bounding box,
    /// and reaches each side of the box up to one cell. Specks far away keep their places and do not make the grid
    /// coarser: its cells are chosen for the bulk of the mesh.
    ///
    /// ```
    /// use mocban_core::mesh::Mesh;
    ///
    /// let grid = |k: u32| [f64::from(k % 100), f64::from(k / 100), 0.0];
    /// let cells = (0..9_900).filter(|k| k % 100 < 99);
    /// let mesh = Mesh {
    ///     vertices: (0..10_000).map(grid).collect(),
    ///     triangles: cells.flat_map(|k| [[k, k + 1, k + 100], [k + 1, k + 101, k + 100]]).collect(),
    /// };
    /// assert_eq!(mesh.triangles.len(), 19_602);
    /// let small = mesh.clustered(5_000);
    /// assert!((4_000..=5_000).contains(&small.triangles.len()));
    /// ```
    #[must_use]
    pub fn clustered(self, max_elements: usize) -> Self {
        let is_point_set = self.triangles.is_empty();
        let count = if is_point_set {
            self.vertices.len()
        } else {
            self.triangles.len()
        };
        if count <= max_elements {
            return self;
        }
        let bulk = bulk_bounds(&self.vertices);
        // Coarser grids leave fewer elements, apart from effects of single cells. With 0 cells, all vertices merge.
        let (mut fits, mut exceeds) = (0, MAX_CELLS + 1);
        while exceeds - fits > 1 {
            let middle = fits.midpoint(exceeds);
            let cells = CellGrid::new(bulk, middle).cells(&self);
            let left = if is_point_set {
                polled(&cells).collect::<HashSet<_>>().len()
            } else {
                self.triangles_left(&cells)
            };
            if left <= max_elements {
                fits = middle;
            } else {
                exceeds = middle;
            }
        }
        let cells = CellGrid::new(bulk, fits).cells(&self);
        self.merged(&cells)
    }

    /// Counts the triangles with corners in three cells.
    fn triangles_left(&self, cells: &[u64]) -> usize {
        let triangles = polled(&self.triangles);
        triangles
            .filter(|triangle| {
                let [a, b, c] = triangle.map(|corner| cells[corner as usize]);
                a != b && b != c && c != a
            })
            .count()
    }

    /// Merges the vertices of each cell. Vertices are numbered in the order of the first vertex of their cells.
    fn merged(&self, cells: &[u64]) -> Self {
        let mut numbers: HashMap<u64, u32> = HashMap::new();
        let mut sums: Vec<([f64; 3], f64)> = Vec::new();
        let mut number_of_vertex = Vec::with_capacity(cells.len());
        for (vertex, cell) in polled(self.vertices.iter()).zip(cells) {
            let number = *numbers.entry(*cell).or_insert(sums.len() as u32);
            if number as usize == sums.len() {
                sums.push(([0.0; 3], 0.0));
            }
            let (sum, count) = &mut sums[number as usize];
            for (total, c) in sum.iter_mut().zip(vertex) {
                *total += c;
            }
            *count += 1.0;
            number_of_vertex.push(number);
        }
        let mut known = HashSet::new();
        let triangles = polled(&self.triangles);
        let triangles = triangles.map(|face| face.map(|corner| number_of_vertex[corner as usize]));
        Self {
            triangles: triangles
                .filter(|[a, b, c]| a != b && b != c && c != a)
                .filter(|triangle| known.insert(smallest_first(*triangle)))
                .collect(),
            vertices: sums
                .into_iter()
                .map(|(sum, count)| sum.map(|c| c / count))
                .collect(),
        }
    }
}

/// Rotates the corners so that the smallest is first. The winding is kept.
fn smallest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Returns the exact bounds of the vertices that are no specks.
fn bulk_bounds(vertices: &Vertices) -> Bounds<3> {
    let limits = match vertices {
        Vertices::Single(all) => bulk_box(all),
        Vertices::Double(all) => bulk_box(all),
    };
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for vertex in polled(vertices.iter()).filter(|vertex| is_in_box(&limits, vertex)) {
        for k in 0..3 {
            bounds[0][k] = bounds[0][k].min(vertex[k]);
            bounds[1][k] = bounds[1][k].max(vertex[k]);
        }
    }
    bounds
}

/// A cubic grid over the bulk of a mesh, which continues outside of it.
struct CellGrid {
    bulk: Bounds<3>,
    cells_per_unit: f64,
    last: f64,
}

impl CellGrid {
    /// Creates the grid with `count` cells along the longest side of the bulk; 0 for one cell that holds everything.
    fn new(bulk: Bounds<3>, count: u32) -> Self {
        let [low, high] = bulk;
        let sides = [0, 1, 2].map(|k| high[k] - low[k]);
        let longest = sides.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        Self {
            bulk,
            cells_per_unit: f64::from(count) / longest,
            last: f64::from(count.max(1) - 1),
        }
    }

    /// Returns the cell of each vertex. Specks that are further away than any cell share the outermost cells.
    fn cells(&self, mesh: &Mesh) -> Vec<u64> {
        const MIDDLE: f64 = (1_u32 << (CELL_BITS - 1)) as f64;
        if self.cells_per_unit == 0.0 {
            return vec![0; mesh.vertices.len()];
        }
        let [low, high] = self.bulk;
        let cell = |vertex: [f64; 3]| {
            [0, 1, 2].into_iter().fold(0, |cell, k| {
                let place = ((vertex[k] - low[k]) * self.cells_per_unit).floor();
                // The upper border of the bulk belongs to its last cell.
                let is_at_most_high = vertex[k] <= high[k];
                let place = if is_at_most_high {
                    place.min(self.last)
                } else {
                    place
                };
                let shifted = (place + MIDDLE).clamp(0.0, 2.0 * MIDDLE - 1.0) as u64;
                (cell << CELL_BITS) | shifted
            })
        };
        polled(mesh.vertices.iter()).map(cell).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use crate::mesh::Mesh;

    /// Returns a wavy sheet of `side` by `side` vertices.
    fn sheet(side: u32) -> Mesh {
        let vertex = |k: u32| {
            let [x, y] = [k % side, k / side].map(f64::from);
            [x, y, (0.3 * x).sin() * (0.2 * y).cos()]
        };
        let squares = (0..side * (side - 1)).filter(|k| k % side < side - 1);
        Mesh {
            vertices: (0..side * side).map(vertex).collect(),
            triangles: squares
                .flat_map(|k| [[k, k + 1, k + side], [k + 1, k + side + 1, k + side]])
                .collect(),
        }
    }

    fn bounds(mesh: &Mesh) -> [[f64; 3]; 2] {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| {
            [0, 1, 2].map(|k| mesh.vertices.iter().map(|v| v[k]).fold(start, pick))
        };
        [
            fold(f64::INFINITY, f64::min),
            fold(f64::NEG_INFINITY, f64::max),
        ]
    }

    #[test]
    fn a_small_mesh_is_returned_unchanged() {
        let mesh = sheet(10);
        assert_eq!(mesh.clone().clustered(162), mesh);
        assert_ne!(mesh.clone().clustered(161), mesh);
    }

    #[test]
    fn the_limit_is_almost_reached_and_bounds_stay_within_a_cell() {
        let mesh = sheet(120);
        for max in [200, 3_000, 20_000] {
            let small = mesh.clone().clustered(max);
            let count = small.triangles.len();
            assert!(count <= max && 2 * count > max, "{count} of {max}");
            // A sheet of n triangles has cells of about sqrt(2 / n) of its side.
            let cell = 120.0 * (4.0 / count as f64).sqrt();
            let ([low, high], [low_small, high_small]) = (bounds(&mesh), bounds(&small));
            for k in 0..3 {
                assert!(low[k] <= low_small[k] && low_small[k] <= low[k] + cell);
                assert!(high_small[k] <= high[k] && high[k] - cell <= high_small[k]);
            }
        }
    }

    #[test]
    fn a_speck_far_away_makes_the_grid_no_coarser() {
        let mesh = sheet(120);
        for distance in [1e4, 1e9, 1e300] {
            let mut with_speck = mesh.clone();
            let speck = with_speck.vertices.len() as u32;
            with_speck.vertices.push([-distance, distance, 3.0]);
            with_speck.triangles.push([0, 1, speck]);
            let small = with_speck.clone().clustered(3_000);
            let count = small.triangles.len();
            assert!((1_500..=3_000).contains(&count), "{count} at {distance}");
            let points = Mesh {
                triangles: Vec::new().into(),
                ..with_speck
            };
            let cloud = points.clustered(3_000);
            let count = cloud.vertices.len();
            assert!((1_500..=3_000).contains(&count), "{count} at {distance}");
            for small in [small, cloud] {
                let [low, high] = bounds(&small);
                assert_eq!((low[0], high[1]), (-distance, distance));
                let in_sheet = |v: &[f64; 3]| v[0] >= -1e-9 && v[1] <= 119.0;
                let others = small.vertices.iter().filter(|v| !in_sheet(v)).count();
                assert_eq!(others, 1, "the speck keeps its place and no other moves");
            }
        }
    }

    #[test]
    fn triangles_keep_their_winding_and_name_existing_vertices() {
        let small = sheet(60).clustered(800);
        for [a, b, c] in small.triangles.iter().copied() {
            let [a, b, c] = [a, b, c].map(|corner| small.vertices.at(corner as usize));
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(area > -1e-9, "{area}");
        }
    }

    #[test]
    fn a_point_set_stays_a_point_set() {
        let points = Mesh {
            vertices: sheet(50).vertices,
            triangles: Vec::new().into(),
        };
        let small = points.clustered(400);
        assert!(small.triangles.is_empty());
        assert!((200..=400).contains(&small.vertices.len()));
    }

    proptest! {
        #[test]
        fn any_mesh_obeys_the_limit_and_gives_the_same_result_again(
            points in prop::collection::vec([-5.0..5.0, -5.0..5.0, -0.1..0.1], 3..60),
            corners in prop::collection::vec(any::<[prop::sample::Index; 3]>(), 1..80),
            max in 0_usize..40,
        ) {
            let count = points.len();
            let corners = corners.into_iter().map(|face| face.map(|corner| corner.index(count) as u32));
            let mesh = Mesh { vertices: points.into(), triangles: corners.collect() };
            let small = mesh.clone().clustered(max);
            prop_assert!(small.triangles.len() <= max);
            prop_assert!(small.triangles.iter().flatten().all(|corner| (*corner as usize) < small.vertices.len()));
            prop_assert_eq!(mesh.clustered(max), small);
        }
    }
}
