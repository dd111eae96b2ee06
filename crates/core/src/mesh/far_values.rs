//! Numbers below 1e15 that stand for a missing position, such as -9999 in all coordinates or in one of them.

use super::extreme_vertices::ExtremeVertices;
use super::inner_range::InnerRange;
use super::triangle_mesh::Vertices;
use crate::domain::cancel::polled;

/// Vertices that are compared with the extreme ones.
const SAMPLES: usize = 1024;
/// Fewest vertices of a mesh in which some may stand for missing ones.
const FEWEST_VERTICES: usize = 100;
/// Fewest vertices that share a number that stands for a missing one.
const FEWEST_MISSING: usize = 8;
/// About how many corners lie at a vertex if each triangle has corners of its own.
const CORNERS_OF_VERTEX: usize = 6;
/// Distance of such a number from the box around the other vertices, as a multiple of its longest side.
const FAR: f64 = 10.0;
/// Far numbers such as -9999 are farther from the origin than a box whose numbers are at most this large, as a multiple of its
/// longest side or in the unit of the mesh.
const NEAR: f64 = 2.0;
const NEAR_UNITS: f64 = 8000.0;
/// Absolute heights that stand for missing ones even if they are nearer.
const KNOWN_HEIGHTS: [f64; 8] = [
    99.0, 999.0, 9999.0, 99_999.0, 999_999.0, 32_767.0, 32_768.0, 65_535.0,
];
/// Least gap between such a height and others, and between height 0 and others of points, as a share of the longest side.
const KNOWN_GAP: f64 = 0.02;
const ZERO_GAP: f64 = 0.5;
/// At least one in this number of vertices is at such a height if it stands for missing ones.
const VERTICES_PER_KNOWN: usize = 1000;

/// What the vertices of a mesh are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VertexKind {
    /// Corners of triangles, each of which has corners of its own.
    Corners,
    /// Corners that triangles may share.
    Shared,
    /// Points without triangles.
    Points,
}

/// A number that vertices without a position have along an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FarValue {
    axis: usize,
    value: f64,
}

impl FarValue {
    /// Returns whether a vertex has no position.
    pub(super) fn is_at(self, vertex: [f64; 3]) -> bool {
        vertex[self.axis] == self.value
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
/// have, exactly, along an axis. If there is none, a height that usually stands for a missing one may be nearer: -99, -999 and
/// so on, and 0 in points without faces. Vertices that are no positions, as `is_position` says, do not count. `extremes` are
/// vertices that may be far outside.
pub(super) fn find_far_values(
    vertices: &Vertices,
    kind: VertexKind,
    extremes: &ExtremeVertices,
    is_position: impl Fn([f64; 3]) -> bool,
) -> FarValues {
    let count = vertices.len();
    let repeats = match kind {
        VertexKind::Corners => CORNERS_OF_VERTEX,
        VertexKind::Shared | VertexKind::Points => 1,
    };
    if count < FEWEST_VERTICES * repeats {
        return FarValues::default();
    }
    // Even distances would meet the rows of a grid in stripes. Multiples of the golden ratio spread without a pattern.
    let place = |nth: usize| {
        let share = (nth as f64 * std::f64::consts::GOLDEN_RATIO).fract();
        ((share * count as f64) as usize).min(count - 1)
    };
    let sample = (0..SAMPLES.min(count)).map(|nth| vertices.at(place(nth)));
    let sample = sample.chain(extremes.all());
    let mut sample: Vec<[f64; 3]> = sample.filter(|vertex| is_position(*vertex)).collect();
    let mut ranges = AxisRanges::of(&sample);
    if !ranges.is_near_origin() {
        // Extreme vertices need not be those farthest from the origin.
        sample.extend(ExtremeVertices::of(vertices, &is_position).all());
        ranges = AxisRanges::of(&sample);
    }
    let has = |value: &FarValue, fewest: usize| {
        let equal = polled(vertices.iter()).filter(|vertex| value.is_at(*vertex));
        equal.take(fewest).count() == fewest
    };
    let fewest = FEWEST_MISSING * repeats;
    let mut found = outside(&sample, &ranges);
    found.retain(|value| has(value, fewest));
    if found.is_empty() {
        let heights = ranges.known_heights(kind == VertexKind::Points);
        found.extend(heights.map(|value| FarValue { axis: 2, value }));
        found.retain(|value| has(value, fewest.max(count / VERTICES_PER_KNOWN)));
    }
    FarValues(found)
}

/// Returns the numbers at the ends of a sample that are far outside of the box around its other vertices. Along x and y, those
/// of vertices that are far along an earlier axis are left out, and those of vertices at several positions count only if they
/// usually stand for missing ones: the straight edge of a plate may be far from a fine relief.
fn outside(sample: &[[f64; 3]], ranges: &AxisRanges) -> Vec<FarValue> {
    let mut found: Vec<FarValue> = Vec::new();
    for axis in [2, 0, 1] {
        for value in ranges.far_ends(axis) {
            let far = FarValue { axis, value };
            let vertices: Vec<_> = sample.iter().filter(|vertex| far.is_at(**vertex)).collect();
            let is_alone = vertices.windows(2).all(|two| two[0] == two[1]);
            let is_new = |vertex: &&[f64; 3]| found.iter().all(|other| !other.is_at(**vertex));
            let is_placeholder = axis == 2 || is_alone || is_usual(value);
            if is_placeholder && vertices.iter().any(is_new) {
                found.push(far);
            }
        }
    }
    found
}

/// Returns whether a number usually stands for a missing one: a height of [`KNOWN_HEIGHTS`], a power of ten, or one less.
fn is_usual(number: f64) -> bool {
    let size = number.abs();
    let is_power = |size: f64| size >= 1e4 && size.log10().fract() == 0.0;
    KNOWN_HEIGHTS.contains(&size) || is_power(size) || is_power(size + 1.0)
}

/// The inner ranges along the axes.
#[derive(Debug, Clone)]
struct AxisRanges {
    axes: [InnerRange; 3],
    /// The range of heights without any of its ends.
    heights: [f64; 2],
    /// The longest side of the box.
    longest: f64,
}

impl AxisRanges {
    fn of(sample: &[[f64; 3]]) -> Self {
        let along = |axis: usize| sample.iter().map(move |vertex| vertex[axis]);
        let mut axes = [0, 1, 2].map(|axis| InnerRange::of(&along(axis)));
        let longest = |axes: &[InnerRange; 3]| {
            let lengths = axes.iter().map(InnerRange::length);
            lengths.fold(0.0, f64::max)
        };
        let heights = axes[2].inner();
        let first = longest(&axes);
        for axis in &mut axes {
            axis.extend_by(first);
        }
        Self {
            longest: longest(&axes),
            heights,
            axes,
        }
    }

    /// Returns the numbers along an axis that are far outside of the box.
    fn far_ends(&self, axis: usize) -> impl Iterator<Item = f64> {
        let room = if self.longest > 0.0 {
            FAR * self.longest
        } else {
            f64::INFINITY
        };
        self.axes[axis].ends_beyond(room)
    }

    /// Returns heights that usually stand for missing ones, if there is a gap between them and the others that is longer than
    /// the range of these.
    fn known_heights(&self, are_points: bool) -> impl Iterator<Item = f64> {
        let [low, high] = self.heights;
        let longest = self.axes[0].length().max(self.axes[1].length());
        self.axes[2].ends().filter(move |end| {
            let gap = (low - end).max(end - high);
            let share = if KNOWN_HEIGHTS.contains(&end.abs()) {
                KNOWN_GAP
            } else if are_points && *end == 0.0 {
                ZERO_GAP
            } else {
                f64::INFINITY
            };
            gap > high - low && gap > share * longest
        })
    }

    /// Returns whether numbers far outside of the box are also farther from the origin than the box.
    fn is_near_origin(&self) -> bool {
        let most = NEAR_UNITS.max(NEAR * self.longest);
        self.axes.iter().all(|range| range.largest() <= most)
    }
}

#[cfg(test)]
mod tests {
    use super::{CORNERS_OF_VERTEX, FarValue, VertexKind, find_far_values};
    use crate::mesh::missing::{PositionCheck, is_position};
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

    fn of_height(value: f64) -> FarValue {
        FarValue { axis: 2, value }
    }

    fn found(more: &[[f64; 3]]) -> Vec<FarValue> {
        let vertices: Vertices = [relief(), more.to_vec()].concat().into();
        find(&vertices)
    }

    fn find(vertices: &Vertices) -> Vec<FarValue> {
        let check = PositionCheck::of(vertices);
        find_far_values(vertices, VertexKind::Shared, &check.extremes, is_position).0
    }

    #[test]
    fn repeated_numbers_far_outside_are_found_whatever_their_share() {
        for value in [-9999.0, -32768.0, 99999.0, 1e6] {
            for count in [16, 400, 3000] {
                let all = found(&vec![[value; 3]; count]);
                assert_eq!(all, [of_height(value)], "{value} {count}");
                let height = found(&vec![[0.0, 0.0, value]; count]);
                assert_eq!(height, [of_height(value)], "{value} {count}");
                let flat = found(&vec![[value, value, 0.0]; count]);
                let wanted = [FarValue { axis: 0, value }];
                assert_eq!(flat, wanted, "{value} {count}");
            }
        }
        for axis in 0..3 {
            let place = |k: usize| {
                let mut place = [k as f64 * 0.01, 3.0, 1.0];
                place.rotate_right(axis);
                place[axis] = -9999.0;
                place
            };
            let places: Vec<[f64; 3]> = (0..300).map(place).collect();
            let value = -9999.0;
            assert_eq!(found(&places), [FarValue { axis, value }]);
        }
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
        assert_eq!(find(&few), []);
        let one: Vertices = vec![[0.0, 1.0, 2.0]; 500].into();
        assert_eq!(find(&one), []);
    }

    #[test]
    fn few_of_many_and_two_numbers_are_found() {
        let all = |more: &[[f64; 3]], shift: f64| -> Vertices {
            let relief = relief().repeat(40).into_iter();
            let shifted = relief.map(|[x, y, z]| [x + shift, y + shift, z]);
            shifted.chain(more.iter().copied()).collect()
        };
        for shift in [0.0, 5e5] {
            let few = [[shift, shift, -9999.0]; 8];
            assert_eq!(find(&all(&few, shift)), [of_height(-9999.0)]);
            assert_eq!(find(&all(&few[1..], shift)), []);
        }
        let two = [vec![[-9999.0; 3]; 3000], vec![[-32768.0; 3]; 9]].concat();
        let found = find(&all(&two, 0.0));
        let wanted = [-32768.0, -9999.0].map(of_height);
        assert_eq!(found, wanted);
    }

    #[test]
    fn usual_numbers_for_missing_heights_are_found_behind_a_gap() {
        let with = |value: f64, scale: f64, lift: f64| -> Vertices {
            let relief = relief().into_iter();
            let lifted = relief.map(|[x, y, z]| [x, y, z + lift].map(|value| value * scale));
            let missing = (0..40).map(|k| [f64::from(k) * scale, 9.0 * scale, value]);
            lifted.chain(missing).collect()
        };
        for (value, scale) in [
            (-99.0, 1.0),
            (-999.0, 10.0),
            (-9999.0, 1000.0),
            (-32768.0, 1000.0),
        ] {
            let found = find(&with(value, scale, 0.0));
            assert_eq!(found, [of_height(value)], "{value}");
            assert_eq!(find(&with(value + 0.5, scale, 0.0)), [], "{value}");
        }
        let zeros = with(0.0, 1.0, 30.0);
        let found = |kind| {
            let check = PositionCheck::of(&zeros);
            find_far_values(&zeros, kind, &check.extremes, is_position).0
        };
        assert_eq!(found(VertexKind::Points), [of_height(0.0)]);
        assert_eq!(found(VertexKind::Shared), []);
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
    fn the_edges_of_a_plate_around_a_fine_relief_stay() {
        let edges = [-600.0, 600.0].map(|x| (0..40).map(move |k| [x, 0.5 * f64::from(k), 0.0]));
        let edges: Vec<[f64; 3]> = edges.into_iter().flatten().collect();
        assert_eq!(found(&edges), []);
        let missing: Vec<[f64; 3]> = edges.iter().map(|[_, y, z]| [-9999.0, *y, *z]).collect();
        let wanted = [FarValue {
            axis: 0,
            value: -9999.0,
        }];
        assert_eq!(found(&missing), wanted);
    }

    #[test]
    fn facets_with_a_corner_at_such_a_number_are_left_out_of_an_stl() {
        let along = |axis: usize| {
            surface(move |k, mut vertex| {
                if k % 50 == 7 {
                    vertex[axis] = -9999.0;
                }
                vertex
            })
        };
        let all = |k: usize, vertex| if k % 50 == 7 { [99999.0; 3] } else { vertex };
        for mesh in [along(0), along(1), along(2), surface(all)] {
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
