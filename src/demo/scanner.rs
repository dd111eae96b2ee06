//! Simulated scanner: turns the part of a surface inside a polygon into an irregular triangle mesh.

use std::collections::{BTreeMap, HashSet};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::noise::{Noise, normal};
use super::polygon::Polygon;
use super::scalar_field::ScalarField;
use crate::mesh::Mesh;

/// Height of a scan with walls and base, mm.
const BODY_MM: f64 = 1.9;
/// Rows of vertices on a side wall.
const WALL_ROWS: u32 = 5;

/// Properties of a simulated scan.
#[derive(Debug, Clone)]
pub(super) struct ScanStyle {
    /// Whether the scan includes side walls and base.
    pub is_closed: bool,
    /// Approximate number of vertices.
    pub vertices: f64,
    /// Standard deviation of the height noise, mm.
    pub noise_mm: f64,
    /// Number of outlier vertices.
    pub spikes: u32,
    /// Number of holes.
    pub holes: u32,
    /// Whether the faces are wound inward.
    pub is_inside_out: bool,
}

impl ScanStyle {
    /// Draws the properties of a scan with about `vertices` vertices. If `vertices` is `None`, their number is drawn as
    /// well: 22,000 to 132,000, with small numbers more likely.
    pub(super) fn draw(is_damaged_scan: bool, vertices: Option<u32>, rng: &mut ChaCha8Rng) -> Self {
        let is_closed = rng.random_bool(0.125);
        let share: f64 = rng.random_range(0.0..1.0);
        Self {
            is_closed,
            vertices: vertices.map_or_else(|| 22_000.0 * 6.0_f64.powf(share * share), f64::from),
            noise_mm: rng.random_range(0.005..0.010),
            spikes: rng.random_range(0..if is_damaged_scan { 40 } else { 6 }),
            holes: if is_closed { 0 } else { rng.random_range(0..5) },
            is_inside_out: rng.random_bool(0.15),
        }
    }
}

/// Scans the part of `surface` inside `outline`. Returns vertices in the block frame, in mm. Faces are wound outward
/// unless `style.is_inside_out` is set.
pub(super) fn scan(
    surface: &ScalarField,
    outline: &Polygon,
    style: &ScanStyle,
    rng: &mut ChaCha8Rng,
) -> Mesh {
    let sampled = SampledSurface::sample(surface, outline, style, rng);
    let mut mesh = sampled.triangles(outline, &holes(surface, style, rng), rng);
    add_spikes(&mut mesh, style.spikes, rng);
    if style.is_closed {
        close_body(&mut mesh, style.noise_mm, rng);
    }
    if style.is_inside_out {
        for [_, b, c] in mesh.triangles.iter_mut() {
            std::mem::swap(b, c);
        }
    }
    mesh
}

/// A warped grid of surface points with uneven density.
struct SampledSurface {
    columns: usize,
    points: Vec<[f64; 3]>,
}

impl SampledSurface {
    fn sample(
        surface: &ScalarField,
        outline: &Polygon,
        style: &ScanStyle,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let bounds = outline.bounds();
        let [width, height] = [0, 1].map(|i| bounds.max[i] - bounds.min[i]);
        // The polygon fills about 84 % of its bounding box. A closed scan has a base, which uses half of the vertices.
        let wanted = style.vertices * if style.is_closed { 0.5 } else { 1.0 };
        let spacing = (width * height * 0.84 / wanted).sqrt();
        let columns = (width / spacing) as usize + 9;
        let rows = (height / spacing) as usize + 9;
        let warp = [Noise::draw(rng), Noise::draw(rng)];
        let mut points = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                let u = bounds.min[0] + (column as f64 - 4.0) * spacing;
                let v = bounds.min[1] + (row as f64 - 4.0) * spacing;
                let shift = warp.map(|noise| {
                    0.3 * noise.at(u / 2.0, v / 2.0) + spacing * rng.random_range(-0.22..0.22)
                });
                let (u, v) = (u + shift[0], v + shift[1]);
                let z = surface.value([u, v]) + style.noise_mm * normal(rng);
                points.push([-u, -v, z]);
            }
        }
        Self { columns, points }
    }

    /// Triangulates the points inside the outline and outside the holes. Drops the points that no triangle uses.
    fn triangles(&self, outline: &Polygon, holes: &[ScanHole], rng: &mut ChaCha8Rng) -> Mesh {
        let is_visible: Vec<bool> = self
            .points
            .iter()
            .map(|[x, y, _]| {
                let point = [-x, -y];
                outline.contains(point) && !holes.iter().any(|hole| hole.contains(point))
            })
            .collect();
        let mut kept = Vec::new();
        for row in 0..self.points.len() / self.columns - 1 {
            for column in 0..self.columns - 1 {
                let a = row * self.columns + column;
                let (b, c, d) = (a + 1, a + self.columns + 1, a + self.columns);
                let halves = if rng.random_bool(0.5) {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                };
                let visible = |half: &[usize; 3]| half.iter().all(|corner| is_visible[*corner]);
                kept.extend(halves.into_iter().filter(visible));
            }
        }
        mesh_of(&self.points, &kept)
    }
}

/// Returns a mesh of the triangles. Its vertices are the points that the triangles use, in the order of first use.
fn mesh_of(points: &[[f64; 3]], triangles: &[[usize; 3]]) -> Mesh {
    let mut index = vec![u32::MAX; points.len()];
    let mut mesh = Mesh::default();
    for triangle in triangles {
        let corners = triangle.map(|corner| {
            if index[corner] == u32::MAX {
                index[corner] = mesh.vertices.len() as u32;
                mesh.vertices.push(points[corner]);
            }
            index[corner]
        });
        mesh.triangles.push(corners);
    }
    mesh
}

/// A circular region without data.
struct ScanHole {
    centre: [f64; 2],
    radius_mm: f64,
}

impl ScanHole {
    fn contains(&self, [u, v]: [f64; 2]) -> bool {
        (u - self.centre[0]).hypot(v - self.centre[1]) < self.radius_mm
    }
}

/// Draws holes in deep regions, which scanners often miss.
fn holes(surface: &ScalarField, style: &ScanStyle, rng: &mut ChaCha8Rng) -> Vec<ScanHole> {
    (0..style.holes)
        .filter_map(|_| {
            (0..100).find_map(|_| {
                let centre = surface.frame.random_position(rng);
                let radius_mm = rng.random_range(0.05..0.2);
                (surface.value(centre) < -0.6).then_some(ScanHole { centre, radius_mm })
            })
        })
        .collect()
}

fn add_spikes(mesh: &mut Mesh, spikes: u32, rng: &mut ChaCha8Rng) {
    for _ in 0..spikes {
        if mesh.vertices.is_empty() {
            return;
        }
        let index = rng.random_range(0..mesh.vertices.len());
        let [x, y, z] = mesh.vertices.at(index);
        let spike = z + rng.random_range(-0.25..0.35);
        mesh.vertices.set(index, [x, y, spike]);
    }
}

/// Adds side walls and a base.
fn close_body(mesh: &mut Mesh, noise_mm: f64, rng: &mut ChaCha8Rng) {
    let top = mesh.triangles.clone();
    let boundary = boundary_edges(&top);
    let base_start = mesh.vertices.len() as u32;
    let base: Vec<[f64; 3]> = mesh
        .vertices
        .iter()
        .map(|[x, y, _]| [x, y, -BODY_MM + noise_mm * normal(rng)])
        .collect();
    mesh.vertices.extend(base);
    let under = top
        .iter()
        .map(|[a, b, c]| [a, c, b].map(|corner| corner + base_start));
    mesh.triangles.extend(under);
    let mut columns: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (a, b) in boundary {
        let [from, to] = [a, b].map(|corner| {
            let column = columns.entry(corner);
            let make = || wall_column(corner, base_start, mesh, noise_mm, rng);
            column.or_insert_with(make).clone()
        });
        for row in 0..from.len() - 1 {
            let (p, q, r, s) = (from[row], to[row], to[row + 1], from[row + 1]);
            mesh.triangles.extend([[q, p, s], [q, s, r]]);
        }
    }
}

/// Returns the edges that belong to only one triangle. Their direction and order are as in `triangles`.
fn boundary_edges(triangles: &[[u32; 3]]) -> Vec<(u32, u32)> {
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

/// Adds the wall vertices below a boundary vertex. Returns the column of vertices from the boundary down to the base.
fn wall_column(
    boundary: u32,
    base_start: u32,
    mesh: &mut Mesh,
    noise_mm: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<u32> {
    let [x, y, z] = mesh.vertices.at(boundary as usize);
    let mut column = vec![boundary];
    for row in 1..WALL_ROWS {
        let share = f64::from(row) / f64::from(WALL_ROWS);
        column.push(mesh.vertices.len() as u32);
        mesh.vertices.push([
            x + noise_mm * normal(rng),
            y + noise_mm * normal(rng),
            z + (-BODY_MM - z) * share,
        ]);
    }
    column.push(boundary + base_start);
    column
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::{ScanStyle, boundary_edges, scan};
    use crate::demo::polygon::{BoundsMm, Polygon};
    use crate::demo::scalar_field::{SampleFrame, ScalarField};
    use crate::mesh::Mesh;

    fn bump(style: &ScanStyle) -> Mesh {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let frame = SampleFrame::covering(4.0, 0.05);
        let surface = ScalarField::from_fn(frame, |[u, v], _, _| -0.1 * (u * u + v * v));
        let inner = BoundsMm {
            min: [-2.0; 2],
            max: [2.0; 2],
        };
        let outline = Polygon::around(inner, 0.2, 0.8, &mut rng);
        scan(&surface, &outline, style, &mut rng)
    }

    fn style(is_closed: bool) -> ScanStyle {
        ScanStyle {
            is_closed,
            vertices: 5000.0,
            noise_mm: 0.002,
            spikes: 0,
            holes: 0,
            is_inside_out: false,
        }
    }

    /// Returns six times the signed volume of the mesh.
    fn volume(mesh: &Mesh) -> f64 {
        mesh.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|corner| mesh.vertices.at(corner as usize));
                a[0] * (b[1] * c[2] - b[2] * c[1])
                    + a[1] * (b[2] * c[0] - b[0] * c[2])
                    + a[2] * (b[0] * c[1] - b[1] * c[0])
            })
            .sum()
    }

    #[test]
    fn closed_scan_has_no_boundary_and_a_positive_volume() {
        let mesh = bump(&style(true));
        assert!(boundary_edges(&mesh.triangles).is_empty());
        assert!(volume(&mesh) > 0.0);
    }

    #[test]
    fn open_scan_has_about_the_requested_vertices_and_faces_outward() {
        let mesh = bump(&style(false));
        assert!(
            (4000..6000).contains(&mesh.vertices.len()),
            "{}",
            mesh.vertices.len()
        );
        let up = mesh.triangles.iter().all(|t| {
            let [a, b, c] = t.map(|corner| mesh.vertices.at(corner as usize));
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
        });
        assert!(up);
    }
}
