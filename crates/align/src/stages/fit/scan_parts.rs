//! Finds the parts of a scan that may be the block. Debris and a table below the block are left out.

use nalgebra::Vector3;

use super::directions::{Facet, facets, large_planes};
use super::pca::Axes;
use crate::stages::scan::{of_faces, part_of};
use crate::stages::zbuffer::IndexedSurface;
use mocban_core::domain::cancel::{PollCounter, polled};
use mocban_core::mesh::Mesh;
use mocban_core::mesh::robust_bounds::is_in_box;

/// A connected piece counts if its area is at least this fraction of the largest one's.
const LEAST_PIECE: f64 = 0.2;
/// More pieces than this are strokes or repeated faces, not blocks.
const MOST_PIECES: usize = 6;
/// Number of points that show where a piece lies.
const SOME: usize = 4000;
/// Number of cells along the longest side of a scan. Surfaces in neighbouring cells are connected.
const CELLS: f64 = 64.0;
/// Approximate limit of the number of points at which cells are marked.
const MARKS: f64 = 2e7;
/// A component is debris if its area is below this fraction of the largest component's area.
const DEBRIS: f64 = 0.05;
/// A face is narrow at a corner if both edges there are more than this many times as long as the third edge.
const NARROW: f64 = 2.5;
/// Least fraction of the area that lies in a support, the plane on which a block stands.
const LEAST_SUPPORT: f64 = 0.2;
/// Largest fraction of the remaining area that may lie below a support.
const WRONG_SIDE: f64 = 0.03;
/// Number of layers into which a scan is cut to find the height of a support.
const LAYERS: usize = 96;
/// Faces within this many layers of a support belong to it.
const THICKNESS: f64 = 1.6;
/// A part with a smaller fraction of the scan's faces is not a block.
const LEAST_PART: f64 = 0.02;

/// A part of a scan that may be the block.
pub(super) struct CandidatePart {
    pub(super) mesh: Mesh,
    /// Some points of the other pieces, if the part is one of several connected pieces.
    pub(super) beside: Vec<[f64; 3]>,
}

/// Returns the parts that may be the block: first the scan without spikes and debris, then the part above each large
/// plane that may be a support, then the connected pieces.
pub(super) fn parts(mesh: &Mesh, indexed: &IndexedSurface) -> Vec<CandidatePart> {
    let whole = without_debris(&without_spikes(mesh), indexed);
    let all = facets(&whole);
    let mut parts = Vec::new();
    for normal in large_planes(&all) {
        if let Some((normal, height)) = support(&all, normal) {
            let above = part_of(&whole, |corner| normal.dot(&Vector3::from(corner)) > height);
            if above.triangles.len() as f64 > LEAST_PART * whole.triangles.len() as f64 {
                let indexed = IndexedSurface::new(&above);
                parts.push(without_debris(&above, &indexed));
            }
        }
    }
    parts.insert(0, whole);
    let pieces = pieces(&parts[0]);
    let alone = |mesh| CandidatePart {
        mesh,
        beside: Vec::new(),
    };
    let mut parts: Vec<CandidatePart> = parts.into_iter().map(alone).collect();
    let points: Vec<Vec<[f64; 3]>> = pieces.iter().map(some_points).collect();
    for (k, mesh) in pieces.into_iter().enumerate() {
        let others = points.iter().enumerate().filter(|(other, _)| *other != k);
        let beside = others.flat_map(|(_, points)| points).copied().collect();
        parts.push(CandidatePart { mesh, beside });
    }
    parts
}

/// Returns at most [`SOME`] vertices of a mesh.
pub(super) fn some_points(mesh: &Mesh) -> Vec<[f64; 3]> {
    let step = mesh.vertices.len().div_ceil(SOME).max(1);
    mesh.vertices.iter().step_by(step).collect()
}

/// Returns the connected pieces of a scan, the largest first, if there are several of similar area. Returns none for a
/// scan of one piece, and for one of very many.
fn pieces(mesh: &Mesh) -> Vec<Mesh> {
    let points = mesh.position_numbers();
    let mut roots: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    for face in polled(&mesh.triangles) {
        let [a, b, c] = face.map(|corner| root(&mut roots, points[corner as usize]));
        let least = a.min(b).min(c);
        for other in [a, b, c] {
            roots[other as usize] = least;
        }
    }
    let mut areas = vec![0.0; mesh.vertices.len()];
    let mut piece_of = |face: &[u32; 3]| root(&mut roots, points[face[0] as usize]);
    for face in polled(&mesh.triangles) {
        let [a, b, c] = corners(mesh, face);
        areas[piece_of(face) as usize] += (b - a).cross(&(c - a)).norm();
    }
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let large = (0..).zip(areas);
    let large = large.filter(|(_, area)| *area > 0.0 && *area >= LEAST_PIECE * largest);
    let mut pieces: Vec<(u32, f64)> = large.take(MOST_PIECES + 1).collect();
    if !(2..=MOST_PIECES).contains(&pieces.len()) {
        return Vec::new();
    }
    pieces.sort_by(|a, b| b.1.total_cmp(&a.1));
    let part = |(piece, _): (u32, f64)| {
        let faces = polled(&mesh.triangles).filter(|face| piece_of(face) == piece);
        of_faces(mesh, faces)
    };
    pieces.into_iter().map(part).collect()
}

/// Returns the root of a point in a forest, and shortens the way to it.
fn root(roots: &mut [u32], mut at: u32) -> u32 {
    while roots[at as usize] != at {
        let next = roots[roots[at as usize] as usize];
        roots[at as usize] = next;
        at = next;
    }
    at
}

/// Finds a support: a plane, with about this normal, on which the rest of the scan stands. Returns the unit normal that
/// points to the rest, and a height in mesh units. The rest consists of the points whose product with the normal
/// exceeds this height. Returns `None` if the plane is small or the rest lies on both sides.
fn support(facets: &[Facet], normal: Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let total: f64 = facets.iter().map(|facet| facet.area).sum();
    let (layer, centre) = fullest_layer(facets, &normal)?;
    let near = |facet: &&Facet| (normal.dot(&facet.middle) - centre).abs() < 2.0 * layer;
    let slab = facets.iter().filter(near);
    let fitted = Axes::of_points(slab.map(|facet| (facet.middle.into(), facet.area))).normal();
    let normal = fitted * fitted.dot(&normal).signum();
    let (layer, centre) = fullest_layer(facets, &normal)?;
    let (mut on, mut above, mut below) = (0.0, 0.0, 0.0);
    for facet in facets {
        let over = (normal.dot(&facet.middle) - centre) / layer;
        let place = if over.abs() <= THICKNESS {
            &mut on
        } else if over > 0.0 {
            &mut above
        } else {
            &mut below
        };
        *place += facet.area;
    }
    let rest = above + below;
    if on < LEAST_SUPPORT * total || above.min(below) > WRONG_SIDE * rest {
        return None;
    }
    let up = if above >= below { normal } else { -normal };
    Some((up, up.dot(&normal) * centre + THICKNESS * layer))
}

/// Returns the thickness of a layer, and the height at which the two adjacent layers with the largest total area meet.
fn fullest_layer(facets: &[Facet], normal: &Vector3<f64>) -> Option<(f64, f64)> {
    let heights = || facets.iter().map(|facet| normal.dot(&facet.middle));
    let low = heights().fold(f64::INFINITY, f64::min);
    let high = heights().fold(f64::NEG_INFINITY, f64::max);
    let layer = (high - low) / LAYERS as f64;
    if layer.is_nan() || layer <= 0.0 {
        return None;
    }
    let mut areas = [0.0; LAYERS];
    for (height, facet) in heights().zip(facets) {
        let place = ((height - low) / layer) as usize;
        areas[place.min(LAYERS - 1)] += facet.area;
    }
    let pairs = areas.windows(2).map(|pair| pair[0] + pair[1]).enumerate();
    let (fullest, _) = pairs.max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((layer, low + (fullest + 1) as f64 * layer))
}

/// Returns a mesh without the faces at spikes. A point is a spike if in most of its faces the two edges that meet there
/// are much longer than the third edge.
pub(super) fn without_spikes(mesh: &Mesh) -> Mesh {
    // STL files repeat a vertex in each of its faces.
    let points = mesh.position_numbers();
    // Number of faces at each point, and how many of them are narrow there.
    let mut faces = vec![[0_u32; 2]; mesh.vertices.len()];
    for face in polled(&mesh.triangles) {
        let at = corners(mesh, face);
        let edge = |from: usize, to: usize| (at[to % 3] - at[from % 3]).norm();
        for k in 0..3 {
            let [all, narrow] = &mut faces[points[face[k] as usize] as usize];
            let opposite = edge(k + 1, k + 2);
            *all += 1;
            *narrow += u32::from(edge(k, k + 1).min(edge(k + 2, k)) > NARROW * opposite);
        }
    }
    let is_spike = |corner: &u32| {
        let [all, narrow] = faces[points[*corner as usize] as usize];
        2 * narrow > all
    };
    let is_kept = |face: &&[u32; 3]| !face.iter().any(is_spike);
    let kept: Vec<[u32; 3]> = polled(&mesh.triangles).filter(is_kept).copied().collect();
    of_faces(mesh, &kept)
}

/// Returns a mesh without distant specks and without connected components that are smaller than [`DEBRIS`] of the
/// largest one.
fn without_debris(mesh: &Mesh, indexed: &IndexedSurface) -> Mesh {
    let inside = part_of(mesh, |corner| is_in_box(&indexed.bulk, &corner));
    if inside.triangles.is_empty() {
        return inside;
    }
    let cells = Cells::of(&inside);
    let labels: Vec<usize> = polled(&inside.triangles)
        .map(|face| cells.label(&inside, face))
        .collect();
    let mut areas = vec![0.0; cells.components];
    for (face, label) in polled(&inside.triangles).zip(&labels) {
        let [a, b, c] = corners(&inside, face);
        areas[*label] += (b - a).cross(&(c - a)).norm();
    }
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let kept: Vec<[u32; 3]> = inside
        .triangles
        .iter()
        .zip(&labels)
        .filter(|(_, label)| areas[**label] >= DEBRIS * largest)
        .map(|(face, _)| *face)
        .collect();
    of_faces(&inside, &kept)
}

fn corners(mesh: &Mesh, face: &[u32; 3]) -> [Vector3<f64>; 3] {
    face.map(|corner| Vector3::from(mesh.vertices.at(corner as usize)))
}

/// A grid of cells, labelled by connected components.
struct Cells {
    low: Vector3<f64>,
    cell: f64,
    size: [usize; 3],
    labels: Vec<u32>,
    components: usize,
}

impl Cells {
    /// Marks the cells of all faces and labels their components. Cells that share a corner are connected.
    fn of(mesh: &Mesh) -> Self {
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for vertex in polled(mesh.vertices.iter()).map(Vector3::from) {
            low = low.inf(&vertex);
            high = high.sup(&vertex);
        }
        let cell = ((high - low).max() / CELLS).max(f64::MIN_POSITIVE);
        let size = [0, 1, 2].map(|k| ((high[k] - low[k]) / cell) as usize + 1);
        let mut cells = Self {
            low,
            cell,
            size,
            labels: vec![u32::MAX; size.iter().product()],
            components: 0,
        };
        let most_steps = (MARKS / (mesh.triangles.len() + 1) as f64).sqrt() as usize + 1;
        let mut marked = vec![false; cells.labels.len()];
        let mut counter = PollCounter::default();
        for face in &mesh.triangles {
            let [a, b, c] = corners(mesh, face);
            let longest = (b - a).norm().max((c - a).norm()).max((c - b).norm());
            let steps = ((longest / cell).ceil() as usize).min(most_steps);
            for i in 0..=steps {
                counter.add((steps - i + 1) as u32);
                for j in 0..=steps - i {
                    let [u, v] = [i, j].map(|step| step as f64 / steps.max(1) as f64);
                    marked[cells.place(a + (b - a) * u + (c - a) * v)] = true;
                }
            }
        }
        cells.connect(&marked);
        cells
    }

    fn place(&self, point: Vector3<f64>) -> usize {
        let at = |k: usize| {
            let step = ((point[k] - self.low[k]) / self.cell) as usize;
            step.min(self.size[k] - 1)
        };
        (at(2) * self.size[1] + at(1)) * self.size[0] + at(0)
    }

    /// Labels the components of the marked cells.
    fn connect(&mut self, marked: &[bool]) {
        let mut queue = Vec::new();
        for start in 0..marked.len() {
            if !marked[start] || self.labels[start] != u32::MAX {
                continue;
            }
            let label = self.components as u32;
            self.components += 1;
            self.labels[start] = label;
            queue.push(start);
            while let Some(place) = queue.pop() {
                for next in self.around(place) {
                    if marked[next] && self.labels[next] == u32::MAX {
                        self.labels[next] = label;
                        queue.push(next);
                    }
                }
            }
        }
    }

    /// Returns a cell and all cells around it.
    fn around(&self, place: usize) -> impl Iterator<Item = usize> + use<> {
        let [width, height, depth] = self.size;
        let at = [
            place % width,
            place / width % height,
            place / width / height,
        ];
        let range = move |k: usize, side: usize| at[k].saturating_sub(1)..(at[k] + 2).min(side);
        range(2, depth).flat_map(move |z| {
            range(1, height)
                .flat_map(move |y| range(0, width).map(move |x| (z * height + y) * width + x))
        })
    }

    /// Returns the component of a face.
    fn label(&self, mesh: &Mesh, face: &[u32; 3]) -> usize {
        let [first, ..] = corners(mesh, face);
        self.labels[self.place(first)] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::{pieces, without_spikes};
    use mocban_core::mesh::Mesh;

    const SIDE: u32 = 9;

    /// Returns a sheet of narrow triangles, with one vertex pulled far out of the sheet.
    fn sheet_with_a_spike() -> Mesh {
        let vertices = (0..SIDE * SIDE).map(|k| {
            let [x, y] = [k % SIDE, k / SIDE].map(f64::from);
            let z = if k == SIDE * SIDE / 2 { 400.0 } else { 0.0 };
            [x, 4.0 * y, z]
        });
        let mut triangles = Vec::new();
        for y in 0..SIDE - 1 {
            for x in 0..SIDE - 1 {
                let a = y * SIDE + x;
                triangles.push([a, a + 1, a + SIDE]);
                triangles.push([a + 1, a + SIDE + 1, a + SIDE]);
            }
        }
        Mesh {
            vertices: vertices.collect(),
            triangles: triangles.into(),
        }
    }

    /// Returns a mesh in which each face has vertices of its own, as in an STL file.
    fn with_unshared_vertices(mesh: &Mesh) -> Mesh {
        let corners = mesh.triangles.iter().flatten();
        Mesh {
            vertices: corners.map(|k| mesh.vertices.at(*k as usize)).collect(),
            triangles: (0..mesh.triangles.len() as u32)
                .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
                .collect(),
        }
    }

    #[test]
    fn spikes_are_removed_whether_or_not_faces_share_vertices() {
        let sheet = sheet_with_a_spike();
        for mesh in [with_unshared_vertices(&sheet), sheet] {
            let kept = without_spikes(&mesh);
            // Six faces meet at the spike.
            assert_eq!(kept.triangles.len(), mesh.triangles.len() - 6);
        }
    }

    /// Returns `count` sheets beside each other.
    fn sheets(count: u32) -> Mesh {
        let sheet = sheet_with_a_spike();
        let mut all = Mesh::default();
        for k in 0..count {
            let first = all.vertices.len() as u32;
            for [x, y, z] in sheet.vertices.iter() {
                all.vertices.push([x + 9.0 * f64::from(k), y, z]);
            }
            let faces = sheet.triangles.iter().map(|face| face.map(|at| first + at));
            all.triangles.extend(faces);
        }
        all
    }

    #[test]
    fn separate_pieces_are_parts_whether_or_not_faces_share_vertices() {
        for mesh in [sheets(3), with_unshared_vertices(&sheets(3))] {
            let found = pieces(&mesh);
            assert_eq!(found.len(), 3);
            for piece in &found {
                assert_eq!(3 * piece.triangles.len(), mesh.triangles.len());
            }
        }
        assert!(pieces(&sheets(1)).is_empty());
        // Many equal components are strokes or loose faces.
        assert!(pieces(&sheets(20)).is_empty());
    }
}
