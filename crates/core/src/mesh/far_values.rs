//! Numbers below 1e15 that stand for a missing position, such as -9999 in all coordinates or in the height alone.

use super::triangle_mesh::Vertices;
use crate::domain::cancel::polled;

/// Vertices that are compared. More are only counted if one of these is far from the others.
const SAMPLES: usize = 1024;
/// Fewest vertices of a mesh in which some may stand for missing ones.
const FEWEST_VERTICES: usize = 100;
/// Fewest vertices that share a number that stands for a missing one, and their smallest share of all.
const FEWEST_MISSING: usize = 8;
const LEAST_SHARE: usize = 1000;
/// Corners of triangles that meet at a vertex, about, if each triangle has corners of its own.
pub(super) const CORNERS_OF_VERTEX: usize = 6;
/// Distance of such a number from the box around the other vertices, as a multiple of its longest side.
const FAR: f64 = 10.0;

/// What vertices without a position have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FarValue {
    /// All coordinates.
    Position([f64; 3]),
    /// The last coordinate.
    Height(f64),
}

impl FarValue {
    /// Returns whether a vertex has no position.
    pub(super) fn is_at(self, vertex: [f64; 3]) -> bool {
        match self {
            Self::Position(missing) => vertex == missing,
            Self::Height(missing) => vertex[2] == missing,
        }
    }
}

/// What stands for a missing position in one mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FarValues(pub(super) Vec<FarValue>);

impl FarValues {
    /// Returns whether a vertex has no position.
    pub(super) fn are_at(&self, vertex: [f64; 3]) -> bool {
        self.0.iter().any(|value| value.is_at(vertex))
    }
}

/// Finds what stands for missing positions: a number far outside of the box around the other vertices that many vertices
/// have, exactly, in all coordinates or as their height. Others that are no positions, as `is_position` says, do not count.
/// Each vertex is there about `repeats` times.
pub(super) fn find_far_values(
    vertices: &Vertices,
    repeats: usize,
    is_position: impl Fn([f64; 3]) -> bool,
) -> FarValues {
    let count = vertices.len();
    if count < FEWEST_VERTICES * repeats {
        return FarValues::default();
    }
    // Even distances would meet the rows of a grid in stripes. Multiples of the golden ratio spread without a pattern.
    let place = |nth: usize| {
        let share = (nth as f64 * std::f64::consts::GOLDEN_RATIO).fract();
        ((share * count as f64) as usize).min(count - 1)
    };
    let sample = (0..SAMPLES.min(count)).map(|nth| vertices.at(place(nth)));
    let sample: Vec<[f64; 3]> = sample.filter(|vertex| is_position(*vertex)).collect();
    let mut found = outside(&sample);
    let fewest = (FEWEST_MISSING * repeats).max(count / LEAST_SHARE);
    found.retain(|value| {
        let equal = polled(vertices.iter()).filter(|vertex| value.is_at(*vertex));
        equal.take(fewest).count() == fewest
    });
    FarValues(found)
}

/// Returns the extreme positions and heights of a sample that are far outside of the box around its other vertices.
fn outside(sample: &[[f64; 3]]) -> Vec<FarValue> {
    if sample.is_empty() {
        return Vec::new();
    }
    let along = |axis: usize| sample.iter().map(move |vertex| vertex[axis]);
    let [x, y, z] = [0, 1, 2].map(|axis| InnerRange::of(along(axis)));
    let longest = [x, y, z].into_iter().map(InnerRange::length);
    let longest = longest.fold(0.0, f64::max);
    let mut found: Vec<FarValue> = z.far_ends(longest).map(FarValue::Height).collect();
    for (axis, range) in [x, y].into_iter().enumerate() {
        for end in range.far_ends(longest) {
            let vertex = sample.iter().find(|vertex| vertex[axis] == end);
            let vertex = vertex.filter(|vertex| found.iter().all(|value| !value.is_at(**vertex)));
            found.extend(vertex.map(|vertex| FarValue::Position(*vertex)));
        }
    }
    found
}

/// The ends of some numbers, and the range of those between them.
#[derive(Debug, Clone, Copy)]
struct InnerRange {
    ends: [f64; 2],
    inner: [f64; 2],
}

impl InnerRange {
    /// Returns the range of some numbers. Of two different ones, the more frequent one is between.
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let with = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
        let ends = values.clone().fold(none, with);
        let (mut inner, mut at_ends) = (none, [0, 0]);
        for value in values {
            if value == ends[0] {
                at_ends[0] += 1;
            } else if value == ends[1] {
                at_ends[1] += 1;
            } else {
                inner = with(inner, value);
            }
        }
        if inner == none {
            inner = [ends[usize::from(at_ends[1] > at_ends[0])]; 2];
        }
        Self { ends, inner }
    }

    fn length(self) -> f64 {
        self.inner[1] - self.inner[0]
    }

    /// Returns the ends that are far from the numbers between them. `longest` is the longest side of the box.
    fn far_ends(self, longest: f64) -> impl Iterator<Item = f64> {
        let [low, high] = self.inner;
        let room = FAR * longest;
        let is_far = move |end: &f64| longest > 0.0 && (*end < low - room || *end > high + room);
        self.ends.into_iter().filter(is_far)
    }
}

#[cfg(test)]
mod tests {
    use super::{CORNERS_OF_VERTEX, FarValue, find_far_values};
    use crate::mesh::missing::is_position;
    use crate::mesh::write::MeshFormat;
    use crate::mesh::{Mesh, MeshLimits, MeshRead, Vertices, read_from};

    /// Returns a relief of 30 by 20 by 2 with flat ground.
    fn relief() -> Vec<[f64; 3]> {
        let vertex = |k: usize| {
            let [x, y] = [k % 40, k / 40].map(|at| at as f64);
            [0.75 * x, 0.5 * y, (x * y).sin().max(0.0) * 2.0]
        };
        (0..1600).map(vertex).collect()
    }

    fn found(more: &[[f64; 3]]) -> Vec<FarValue> {
        let vertices: Vertices = [relief(), more.to_vec()].concat().into();
        find_far_values(&vertices, 1, is_position).0
    }

    #[test]
    fn repeated_numbers_far_outside_are_found_whatever_their_share() {
        for value in [-9999.0, -32768.0, 99999.0, 1e6] {
            for count in [16, 400, 3000] {
                let all = found(&vec![[value; 3]; count]);
                assert_eq!(all, [FarValue::Height(value)], "{value} {count}");
                let height = found(&vec![[0.0, 0.0, value]; count]);
                assert_eq!(height, [FarValue::Height(value)], "{value} {count}");
                let flat = found(&vec![[value, value, 0.0]; count]);
                let wanted = [FarValue::Position([value, value, 0.0])];
                assert_eq!(flat, wanted, "{value} {count}");
            }
        }
        let columns = |k: usize| [k as f64 * 0.01, 3.0, -9999.0];
        let columns: Vec<[f64; 3]> = (0..300).map(columns).collect();
        assert_eq!(found(&columns), [FarValue::Height(-9999.0)]);
    }

    #[test]
    fn flat_ground_specks_and_what_is_near_are_positions() {
        assert_eq!(found(&[]), []);
        let plane = |z: f64| vec![[3.0, 4.0, z]; 800];
        for z in [0.0, 2.0, -50.0, 250.0] {
            assert_eq!(found(&plane(z)), [], "{z}");
        }
        let specks: Vec<[f64; 3]> = (0..40).map(|k| [0.0, 0.0, -9999.0 - k as f64]).collect();
        assert_eq!(found(&specks), []);
        assert_eq!(found(&[[-9999.0; 3]; 5]), []);
        let few: Vertices = vec![[0.0, 1.0, 2.0]; 50].into();
        assert_eq!(find_far_values(&few, 1, is_position).0, []);
        let one: Vertices = vec![[0.0, 1.0, 2.0]; 500].into();
        assert_eq!(find_far_values(&one, 1, is_position).0, []);
    }

    /// Returns a relief of 3,042 triangles. Vertices are elsewhere where `moved` says so.
    fn surface(moved: impl Fn(usize, [f64; 3]) -> [f64; 3]) -> Mesh {
        let vertices = relief().into_iter().enumerate();
        let vertices: Vec<[f64; 3]> = vertices.map(|(k, vertex)| moved(k, vertex)).collect();
        let cells = (0..39 * 39).map(|k| k / 39 * 40 + k % 39);
        let faces = cells.flat_map(|k| [[k, k + 1, k + 40], [k + 1, k + 41, k + 40]]);
        let triangles = faces.map(|face| face.map(|corner| corner as u32));
        Mesh {
            vertices: vertices.into(),
            triangles: triangles.collect(),
        }
    }

    /// Writes a mesh as an STL and reads it.
    fn through_stl(mesh: &Mesh, format: MeshFormat) -> MeshRead {
        let bytes = format.encode(mesh);
        let len = bytes.len() as u64;
        let read = read_from(&mut bytes.as_slice(), len, "a.stl", &MeshLimits::SUGGESTED);
        read.expect("reads")
    }

    #[test]
    fn facets_with_a_corner_at_such_a_number_are_left_out_of_an_stl() {
        let height = |k: usize, [x, y, z]: [f64; 3]| [x, y, if k % 50 == 7 { -9999.0 } else { z }];
        let all = |k: usize, vertex| if k % 50 == 7 { [99999.0; 3] } else { vertex };
        for mesh in [surface(height), surface(all)] {
            let is_missing = |corner: &u32| corner % 50 == 7;
            let missing = mesh.triangles.iter().flatten().filter(|at| **at % 50 == 7);
            let missing = missing.count() as u64;
            let whole = mesh.triangles.iter();
            let whole = whole.filter(|face| !face.iter().any(is_missing)).count();
            for format in [MeshFormat::StlBinary, MeshFormat::StlAscii] {
                let read = through_stl(&mesh, format);
                assert_eq!(read.losses.missing_vertices, missing, "{format:?}");
                assert_eq!(read.mesh.triangles.len(), whole, "{format:?}");
                assert_eq!(read.mesh.vertices.len(), 3 * whole, "{format:?}");
            }
        }
    }

    #[test]
    fn one_far_vertex_of_an_stl_keeps_its_facets() {
        let spike = |k: usize, vertex| {
            if k == 700 {
                [9.0, 7.0, -9999.0]
            } else {
                vertex
            }
        };
        let mesh = surface(spike);
        let corners = mesh.triangles.as_flattened().iter();
        assert_eq!(
            corners.filter(|corner| **corner == 700).count(),
            CORNERS_OF_VERTEX
        );
        let read = through_stl(&mesh, MeshFormat::StlBinary);
        assert_eq!(read.losses.missing_vertices, 0);
        assert_eq!(read.mesh.triangles.len(), mesh.triangles.len());
    }

    #[test]
    fn vertices_at_such_a_number_are_left_out_of_points_and_of_faces() {
        let line = |[x, y, z]: [f64; 3]| format!("{x} {y} {z}\n");
        let rows: String = relief().into_iter().map(line).collect();
        let missing = "0 0 -9999\n".repeat(32);
        let open = |text: &str, name: &str| {
            let about = text.len() as u64;
            read_from(&mut text.as_bytes(), about, name, &MeshLimits::SUGGESTED)
        };
        let points = open(&format!("{rows}{missing}"), "a.xyz").expect("reads");
        assert_eq!(points.losses.missing_vertices, 32);
        assert_eq!(points.mesh.vertices, relief().into());
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 1632\nproperty float x\nproperty float y\nproperty float z\n\
             element face 2\nproperty list uchar int vertex_indices\nend_header\n{rows}{missing}3 0 1 40\n3 0 1 1600\n"
        );
        let mesh = open(&ply, "a.ply").expect("reads");
        assert_eq!(mesh.losses.missing_vertices, 32);
        assert_eq!(mesh.mesh.vertices.len(), 1600);
        assert_eq!(*mesh.mesh.triangles, [[0, 1, 40]]);
    }
}
