//! Simulated scanner: turns the part of a surface inside a polygon into an irregular triangle mesh.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::block_body::{BlockBody, add_patch};
use super::conditions::ScanErrors;
use super::debris::{add_blobs, add_far_spikes};
use super::mesh_of_points::MeshOfPoints;
use super::noise::{Noise, normal};
use super::polygon::Polygon;
use super::scalar_field::ScalarField;
use mocban_core::mesh::Mesh;

/// Size of smooth scan errors, mm.
const RIPPLE_MM: f64 = 0.5;

/// Properties of a simulated scan.
#[derive(Debug, Clone)]
pub(super) struct ScanStyle {
    /// What the scan contains besides the carved face.
    pub body: BlockBody,
    /// Errors beyond those of every scan.
    pub errors: ScanErrors,
    /// Approximate number of vertices.
    pub vertices: f64,
    /// Standard deviation of the height noise, mm.
    pub noise_mm: f64,
    /// Number of slightly displaced outlier vertices.
    pub spikes: u32,
    /// Number of small holes in deep regions.
    pub holes: u32,
    /// Whether the faces are wound inward.
    pub is_inside_out: bool,
}

impl ScanStyle {
    /// Draws the properties of a scan with about `vertices` vertices. If `vertices` is `None`, draws a number from
    /// 22,000 to 132,000, in which small numbers are more likely.
    pub(super) fn draw(
        is_damaged_scan: bool,
        errors: ScanErrors,
        vertices: Option<u32>,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let is_closed = rng.random_bool(0.125);
        let body = if is_closed {
            BlockBody::thin()
        } else {
            BlockBody::Open
        };
        let share: f64 = rng.random_range(0.0..1.0);
        Self {
            body,
            errors,
            vertices: vertices.map_or_else(|| 22_000.0 * 6.0_f64.powf(share * share), f64::from),
            noise_mm: errors.noise * rng.random_range(0.005..0.010),
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
    let small = holes(surface, style, rng);
    let large = large_holes(outline, style.errors.holes, rng);
    let triangles = sampled.triangles(outline, &small, rng);
    let is_seen = |triangle: &&[usize; 3]| {
        large.is_empty() || triangle.iter().all(|i| !sampled.is_in_any(*i, &large))
    };
    let seen: Vec<[usize; 3]> = triangles.iter().filter(is_seen).copied().collect();
    let mut mesh = MeshOfPoints::new(&sampled.points);
    mesh.add(&seen);
    add_spikes(&mut mesh.mesh, style.spikes, rng);
    add_far_spikes(&mut mesh.mesh, style.errors.spikes, rng);
    let mut mesh = style
        .body
        .complete(mesh, &triangles, outline, style.noise_mm, rng);
    if let BlockBody::SeenThroughHoles { depth_mm } = style.body {
        for hole in &large {
            add_patch(&mut mesh, hole.centre, hole.radius_mm, depth_mm, rng);
        }
    }
    add_blobs(&mut mesh, style.errors.blobs, outline, rng);
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
        let [width, height] = bounds.size();
        // The polygon fills about 84 % of its bounding box. A closed scan has a base, which uses half of the vertices.
        let wanted = style.vertices * if style.body.has_bottom() { 0.5 } else { 1.0 };
        let spacing = (width * height * 0.84 / wanted).sqrt();
        let columns = (width / spacing) as usize + 9;
        let rows = (height / spacing) as usize + 9;
        let warp = [Noise::draw(rng), Noise::draw(rng)];
        let ripple_mm = style.errors.ripple_mm;
        let ripple = (ripple_mm > 0.0).then(|| Noise::draw(rng));
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
                let z = z + style.errors.slow.map_or(0.0, |slow| slow.at([u, v]));
                let z = ripple.map_or(z, |noise| {
                    z + ripple_mm * noise.at(u / RIPPLE_MM, v / RIPPLE_MM)
                });
                points.push([-u, -v, z]);
            }
        }
        Self { columns, points }
    }

    /// Returns whether a point lies in any of the holes.
    fn is_in_any(&self, index: usize, holes: &[ScanHole]) -> bool {
        let [x, y, _] = self.points[index];
        holes.iter().any(|hole| hole.contains([-x, -y]))
    }

    /// Triangulates the points inside the outline and outside the holes.
    fn triangles(
        &self,
        outline: &Polygon,
        holes: &[ScanHole],
        rng: &mut ChaCha8Rng,
    ) -> Vec<[usize; 3]> {
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
        kept
    }
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

/// Draws large holes anywhere inside the outline.
fn large_holes(outline: &Polygon, count: u32, rng: &mut ChaCha8Rng) -> Vec<ScanHole> {
    let bounds = outline.bounds();
    let hole = |rng: &mut ChaCha8Rng| {
        let radius_mm = rng.random_range(0.2..0.75);
        let centre = [0, 1].map(|i| rng.random_range(bounds.min[i]..bounds.max[i]));
        let is_inside = [[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]]
            .iter()
            .all(|way| outline.contains([0, 1].map(|i| centre[i] + 1.4 * radius_mm * way[i])));
        is_inside.then_some(ScanHole { centre, radius_mm })
    };
    (0..count)
        .filter_map(|_| (0..50).find_map(|_| hole(rng)))
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

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::{ScanStyle, scan};
    use crate::block_body::{BlockBody, boundary_edges};
    use crate::conditions::Conditions;
    use crate::polygon::{BoundsMm, Polygon};
    use crate::scalar_field::{SampleFrame, ScalarField};
    use mocban_core::mesh::Mesh;

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

    fn style(body: BlockBody) -> ScanStyle {
        ScanStyle {
            body,
            errors: Conditions::default().scan,
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
        let mesh = bump(&style(BlockBody::thin()));
        assert!(boundary_edges(&mesh.triangles).is_empty());
        assert!(volume(&mesh) > 0.0);
    }

    #[test]
    fn open_scan_has_about_the_requested_vertices_and_faces_outward() {
        let mesh = bump(&style(BlockBody::Open));
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
