//! What a scan contains besides the carved face: side walls, bottom, second face, table.

use std::collections::{BTreeMap, HashSet};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::mesh_of_points::MeshOfPoints;
use super::noise::{Noise, normal};
use super::polygon::Polygon;
use super::scalar_field::ScalarField;
use mocban_core::mesh::Mesh;

/// Height of an ordinary scan with walls and base, mm.
const THIN_MM: f64 = 1.9;
/// Rows of vertices on a side wall of an ordinary scan.
const THIN_ROWS: u32 = 5;
/// Approximate height of a row of faces on other side walls, mm.
const ROW_MM: f64 = 0.4;
/// Spacing of the vertices of tables and patches, mm. Large tables have a wider spacing, and small patches a narrower
/// one.
const COARSE_MM: f64 = 0.4;

/// What a scan contains besides the carved face. Depths are in mm below the plane of the stroke tops.
#[derive(Debug, Clone)]
pub(super) enum BlockBody {
    /// Nothing.
    Open,
    /// Side walls and bottom.
    Foot {
        depth_mm: f64,
        /// Amplitude in mm and shape of the bottom's roughness, if it is rough.
        roughness: Option<(f64, Noise)>,
        rows: u32,
    },
    /// Side walls and a second carved face, with heights in its own frame.
    SecondFace { depth_mm: f64, surface: ScalarField },
    /// Side walls and the table around the block.
    Table {
        depth_mm: f64,
        /// Slope of the table along x and along y.
        slope: [f64; 2],
        texture: Noise,
        /// Half the side of the table, mm.
        half_mm: f64,
    },
    /// Pieces of a surface behind the holes of the scan.
    SeenThroughHoles { depth_mm: f64 },
}

impl BlockBody {
    /// Returns the thin flat body of ordinary closed scans.
    pub(super) fn thin() -> Self {
        Self::Foot {
            depth_mm: THIN_MM,
            roughness: None,
            rows: THIN_ROWS,
        }
    }

    /// Draws a body with a rough bottom.
    pub(super) fn foot(depth_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        Self::Foot {
            depth_mm,
            roughness: Some((rng.random_range(0.0..0.2), Noise::draw(rng))),
            rows: rows(depth_mm),
        }
    }

    /// Draws a table whose plane differs from that of the stroke tops by a few degrees.
    pub(super) fn table(depth_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        Self::Table {
            depth_mm: depth_mm.max(2.5),
            slope: [0; 2].map(|_: i32| rng.random_range(-0.06..0.06)),
            texture: Noise::draw(rng),
            half_mm: rng.random_range(8.0..25.0),
        }
    }

    /// Returns whether the scan includes the bottom.
    pub(super) fn has_bottom(&self) -> bool {
        matches!(self, Self::Foot { .. } | Self::SecondFace { .. })
    }

    /// Returns the height of the bottom or table at a position on the block, mm.
    fn bottom_mm(&self, x: f64, y: f64) -> f64 {
        match self {
            Self::Open => 0.0,
            Self::Foot {
                depth_mm,
                roughness,
                ..
            } => roughness.map_or(-depth_mm, |(amplitude_mm, noise)| {
                -depth_mm + amplitude_mm * noise.two_octaves(x / 1.5, y / 0.6)
            }),
            // The second face is seen from below: its frame is rotated by 180 degrees about the y axis.
            Self::SecondFace { depth_mm, surface } => -depth_mm - surface.value([x, -y]),
            Self::Table {
                depth_mm,
                slope,
                texture,
                ..
            } => {
                let plane = -depth_mm + slope[0] * x + slope[1] * y;
                plane + 0.06 * texture.two_octaves(x / 2.5, y / 2.5)
            }
            Self::SeenThroughHoles { depth_mm } => -depth_mm,
        }
    }

    fn wall_rows(&self) -> u32 {
        match self {
            Self::Open | Self::SeenThroughHoles { .. } => 0,
            Self::Foot { rows, .. } => *rows,
            Self::SecondFace { depth_mm, .. } | Self::Table { depth_mm, .. } => rows(*depth_mm),
        }
    }

    /// Adds walls and bottom or table to the carved face. `all` has the face's triangles and those inside its large
    /// holes, so that walls are built only at the outer boundary and at small holes.
    pub(super) fn complete(
        &self,
        mut face: MeshOfPoints,
        all: &[[usize; 3]],
        outline: &Polygon,
        noise_mm: f64,
        rng: &mut ChaCha8Rng,
    ) -> Mesh {
        if self.wall_rows() == 0 {
            return face.mesh;
        }
        let top: Vec<[u32; 3]> = all
            .iter()
            .map(|triangle| triangle.map(|corner| face.vertex(corner)))
            .collect();
        let mut mesh = face.mesh;
        let top_count = mesh.vertices.len() as u32;
        let base: Vec<[f64; 3]> = mesh
            .vertices
            .iter()
            .map(|[x, y, _]| [x, y, self.bottom_mm(x, y) + noise_mm * normal(rng)])
            .collect();
        if self.has_bottom() {
            mesh.vertices.extend(base.iter().copied());
            let under = top
                .iter()
                .map(|[a, b, c]| [a, c, b].map(|corner| corner + top_count));
            mesh.triangles.extend(under);
        }
        self.add_walls(&mut mesh, &boundary_edges(&top), &base, noise_mm, rng);
        if !self.has_bottom() {
            drop_unused(&mut mesh);
        }
        if let Self::Table { half_mm, .. } = self {
            self.add_table(&mut mesh, *half_mm, outline, noise_mm, rng);
        }
        mesh
    }

    fn add_walls(
        &self,
        mesh: &mut Mesh,
        boundary: &[(u32, u32)],
        base: &[[f64; 3]],
        noise_mm: f64,
        rng: &mut ChaCha8Rng,
    ) {
        let mut columns: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (a, b) in boundary {
            let [from, to] = [*a, *b].map(|corner| {
                let column = columns.entry(corner);
                let make = || self.wall_column(corner, base, mesh, noise_mm, rng);
                column.or_insert_with(make).clone()
            });
            for row in 0..from.len() - 1 {
                let (p, q, r, s) = (from[row], to[row], to[row + 1], from[row + 1]);
                mesh.triangles.extend([[q, p, s], [q, s, r]]);
            }
        }
    }

    /// Adds the wall vertices below a boundary vertex. Returns the column of vertices from the boundary down to the
    /// bottom.
    fn wall_column(
        &self,
        boundary: u32,
        base: &[[f64; 3]],
        mesh: &mut Mesh,
        noise_mm: f64,
        rng: &mut ChaCha8Rng,
    ) -> Vec<u32> {
        let rows = self.wall_rows();
        let [x, y, z] = mesh.vertices.at(boundary as usize);
        let bottom_mm = self.bottom_mm(x, y);
        let mut column = vec![boundary];
        for row in 1..rows {
            let share = f64::from(row) / f64::from(rows);
            column.push(mesh.vertices.len() as u32);
            mesh.vertices.push([
                x + noise_mm * normal(rng),
                y + noise_mm * normal(rng),
                z + (bottom_mm - z) * share,
            ]);
        }
        if self.has_bottom() {
            column.push(boundary + base.len() as u32);
        } else {
            column.push(mesh.vertices.len() as u32);
            mesh.vertices.push(base[boundary as usize]);
        }
        column
    }

    /// Adds the table around the block.
    fn add_table(
        &self,
        mesh: &mut Mesh,
        half_mm: f64,
        outline: &Polygon,
        noise_mm: f64,
        rng: &mut ChaCha8Rng,
    ) {
        let step_mm = COARSE_MM.max(half_mm / 40.0);
        let sheet = |[x, y]: [f64; 2], rng: &mut ChaCha8Rng| {
            (!outline.contains([-x, -y]))
                .then(|| [x, y, self.bottom_mm(x, y) + noise_mm * normal(rng)])
        };
        add_sheet(mesh, [0.0, 0.0], half_mm, step_mm, sheet, rng);
    }
}

/// Adds a rough disc `depth_mm` below the plane of the stroke tops, which is seen through a hole at (u, v).
pub(super) fn add_patch(
    mesh: &mut Mesh,
    [u, v]: [f64; 2],
    radius_mm: f64,
    depth_mm: f64,
    rng: &mut ChaCha8Rng,
) {
    let step_mm = COARSE_MM.min(radius_mm / 3.0);
    let centre = [-u, -v];
    let disc = |[x, y]: [f64; 2], rng: &mut ChaCha8Rng| {
        ((x - centre[0]).hypot(y - centre[1]) < radius_mm)
            .then(|| [x, y, -depth_mm + 0.05 * normal(rng)])
    };
    add_sheet(mesh, centre, radius_mm, step_mm, disc, rng);
}

/// Adds the points that `point` returns for the positions of a square grid, and the triangles whose three corners
/// exist. Then removes unused vertices from the whole mesh.
fn add_sheet(
    mesh: &mut Mesh,
    centre: [f64; 2],
    half_mm: f64,
    step_mm: f64,
    point: impl Fn([f64; 2], &mut ChaCha8Rng) -> Option<[f64; 3]>,
    rng: &mut ChaCha8Rng,
) {
    let count = (2.0 * half_mm / step_mm).ceil() as usize + 1;
    let at = |i: usize| (i as f64 - (count - 1) as f64 / 2.0) * step_mm;
    let mut index = vec![None; count * count];
    for (i, vertex) in index.iter_mut().enumerate() {
        let position = [centre[0] + at(i % count), centre[1] + at(i / count)];
        if let Some(point) = point(position, rng) {
            *vertex = Some(mesh.vertices.len() as u32);
            mesh.vertices.push(point);
        }
    }
    for i in 0..count * (count - 1) {
        if i % count + 1 == count {
            continue;
        }
        let (a, b, c, d) = (
            index[i],
            index[i + 1],
            index[i + count + 1],
            index[i + count],
        );
        for half in [[a, b, c], [a, c, d]] {
            if let [Some(p), Some(q), Some(r)] = half {
                mesh.triangles.push([p, q, r]);
            }
        }
    }
    drop_unused(mesh);
}

/// Returns the number of rows of vertices on a side wall.
fn rows(depth_mm: f64) -> u32 {
    (depth_mm / ROW_MM).ceil().max(2.0) as u32
}

/// Removes the vertices that no triangle uses.
fn drop_unused(mesh: &mut Mesh) {
    let points: Vec<[f64; 3]> = mesh.vertices.iter().collect();
    let mut kept = MeshOfPoints::new(&points);
    for triangle in &mesh.triangles {
        kept.add(&[triangle.map(|corner| corner as usize)]);
    }
    *mesh = kept.mesh;
}

/// Returns the edges that no other triangle shares in the opposite direction. Their direction and order are as in
/// `triangles`.
pub(super) fn boundary_edges(triangles: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let edges = || {
        triangles
            .iter()
            .flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)])
    };
    let directed: HashSet<(u32, u32)> = edges().collect();
    edges()
        .filter(|(a, b)| !directed.contains(&(*b, *a)))
        .collect()
}
