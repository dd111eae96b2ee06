//! Heights in an export of bent blocks agree with the mesh and with the masks.

use std::path::Path;

use mocban::domain::{Affine2, HeightFromMesh, Rigid3};
use mocban::mesh::{self, Mesh, MeshLimits};
use mocban::raster::{Grid, decode_grey8, decode_grey16};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::cli::mocban;

/// Distance within which a mask and its levels must be uniform around a compared vertex, in depth-map pixels.
const MARGIN_PX: i64 = 2;

/// A line of an export of one bent block, and its files.
struct BentBlock {
    line: Value,
    mesh: Mesh,
    levels: Grid<u16>,
    mask: Grid<u8>,
    depth_from_plane: Affine2,
    height_from_mesh: HeightFromMesh,
}

impl BentBlock {
    fn read(project: &Path, export: &Path, line: Value) -> Self {
        let file = |name: &str| {
            let path = export.join(line["files"][name].as_str().expect(name));
            std::fs::read(path).expect(name)
        };
        let path = line["mesh"].as_str().expect("a path");
        let bytes = std::fs::read(project.join(path)).expect("the mesh");
        Self {
            mesh: mesh::read(&bytes, path, &MeshLimits::SUGGESTED).expect("a mesh"),
            levels: decode_grey16(&file("depth")).expect("a depth map"),
            mask: decode_grey8(&file("depth_mask")).expect("a mask"),
            depth_from_plane: field(&line, "depth_from_plane"),
            height_from_mesh: field(&line, "height_from_mesh"),
            line,
        }
    }

    fn number(&self, name: &str) -> f64 {
        self.line[name].as_f64().expect(name)
    }

    fn height(&self, level: u16) -> f64 {
        self.number("height_min") + f64::from(level - 1) * self.number("height_per_level")
    }

    /// Returns the pixels around a position, or `None` near the border.
    fn around(&self, [x, y]: [f64; 2]) -> Option<Vec<(usize, usize)>> {
        let (x, y) = (x.round() as i64, y.round() as i64);
        let offsets = || -MARGIN_PX..=MARGIN_PX;
        let places = offsets().flat_map(|dy| offsets().map(move |dx| (x + dx, y + dy)));
        let inside = places.map(|(x, y)| {
            self.mask.get(x, y)?;
            Some((x as usize, y as usize))
        });
        inside.collect()
    }

    /// Returns the share of the visible vertices away from edges that the rule classifies as the mask does, with heights
    /// over the fitted surface and over the plane, and their number.
    fn agreement(&self) -> ([f64; 2], usize) {
        let threshold = self.number("threshold_depth");
        let plane = &self.height_from_mesh.plane_from_mesh;
        let (mut right, mut count) = ([0_usize; 2], 0_usize);
        for i in 0..self.mesh.vertices.len() {
            let point = self.mesh.vertices.at(i);
            let at = [0, 1, 2].map(|k| {
                let row: [f64; 4] = plane[k];
                row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3]
            });
            let Some(pixels) = self.around(self.depth_from_plane.apply([at[0], at[1]])) else {
                continue;
            };
            let levels = || pixels.iter().map(|(x, y)| self.levels.at(*x, *y));
            let is_set = self.mask.at(pixels[0].0, pixels[0].1) == 255;
            let is_uniform = pixels
                .iter()
                .all(|(x, y)| (self.mask.at(*x, *y) == 255) == is_set);
            let lowest = levels().min().unwrap_or(0);
            let height = self.height_from_mesh.apply(point);
            // Vertices below all pixels around them are hidden: at the back of the block or below an overhang.
            let is_hidden =
                lowest == 0 || height < self.height(lowest) - self.number("mesh_unit_per_px");
            if is_hidden || !is_uniform {
                continue;
            }
            count += 1;
            for (right, height) in right.iter_mut().zip([height, at[2]]) {
                *right += usize::from((height >= threshold) == is_set);
            }
        }
        (right.map(|right| right as f64 / count as f64), count)
    }

    /// Returns the largest distance, in mm, between the mesh and points of the depth map that were mapped back to it.
    fn largest_distance_mm(&self) -> f64 {
        let mesh_from_plane = field::<Rigid3>(&self.line, "plane_from_mesh").inverse();
        let plane_from_depth = self.depth_from_plane.inverse().expect("an invertible map");
        let [c0, cx, cy, cxx, cxy, cyy] = self.height_from_mesh.curvature;
        let mut largest = 0.0_f64;
        for y in (20..self.levels.height()).step_by(97) {
            for x in (20..self.levels.width()).step_by(89) {
                let level = self.levels.at(x, y);
                if level == 0 {
                    continue;
                }
                let [u, v] = plane_from_depth.apply([x as f64, y as f64]);
                let surface = c0 + cx * u + cy * v + cxx * u * u + cxy * u * v + cyy * v * v;
                let point = mesh_from_plane.apply([u, v, self.height(level) + surface]);
                largest = largest.max(self.distance(point));
            }
        }
        largest * self.number("mm_per_mesh_unit")
    }

    /// Returns the distance of a point from the nearest triangle with a corner near the point, mesh units.
    fn distance(&self, point: [f64; 3]) -> f64 {
        let near = 8.0 * self.number("mesh_unit_per_px");
        let is_near = |corner: &[f64; 3]| (0..3).all(|k| (corner[k] - point[k]).abs() < near);
        let mut nearest = f64::INFINITY;
        for corners in &self.mesh.triangles {
            if !is_near(&self.mesh.vertices.at(corners[0] as usize)) {
                continue;
            }
            let corners = corners.map(|i| self.mesh.vertices.at(i as usize));
            nearest = nearest.min(triangle_distance(point, corners));
        }
        nearest
    }
}

fn field<T: DeserializeOwned>(line: &Value, name: &str) -> T {
    T::deserialize(&line[name]).expect(name)
}

/// Returns the distance of a point from a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
fn triangle_distance(point: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let minus = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let along =
        |p: [f64; 3], t: f64, q: [f64; 3]| [p[0] + t * q[0], p[1] + t * q[1], p[2] + t * q[2]];
    let segment = |from: [f64; 3], to: [f64; 3]| {
        let side = minus(to, from);
        let length = dot(side, side);
        let t = if length > 0.0 {
            (dot(minus(point, from), side) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let gap = minus(point, along(from, t, side));
        dot(gap, gap).sqrt()
    };
    let (ab, ac, ap) = (minus(b, a), minus(c, a), minus(point, a));
    let (d00, d01, d11) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
    let (d20, d21) = (dot(ap, ab), dot(ap, ac));
    let area = d00 * d11 - d01 * d01;
    let (v, w) = (
        (d11 * d20 - d01 * d21) / area,
        (d00 * d21 - d01 * d20) / area,
    );
    if area > 0.0 && v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
        let gap = minus(point, along(along(a, v, ab), w, ac));
        return dot(gap, gap).sqrt();
    }
    segment(a, b).min(segment(b, c)).min(segment(c, a))
}

#[test]
fn heights_over_a_bent_block_follow_mesh_and_mask() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let demo = ["demo", "p", "--tier", "hard", "--pairs", "5", "--seed", "1"];
    mocban(dir.path(), &demo).expect(0);
    let export = ["-C", "p", "export", "--metric", "ensemble", "-o", "out"];
    mocban(dir.path(), &export).expect(0);
    let text = std::fs::read_to_string(dir.path().join("out/pairs.jsonl")).expect("the lines");
    let mut compared = 0;
    for line in text.lines() {
        let line: Value = serde_json::from_str(line).expect("JSON");
        if line["mm_per_mesh_unit"].is_null() {
            continue;
        }
        let block = BentBlock::read(&dir.path().join("p"), &dir.path().join("out"), line);
        let ([over_surface, over_plane], count) = block.agreement();
        let id = &block.line["id"];
        assert!(count > 5_000, "{id}: {count} vertices");
        assert!(over_surface > 0.995, "{id}: {over_surface}");
        assert!(over_plane < 0.98, "{id} is not bent: {over_plane}");
        let distance = block.largest_distance_mm();
        assert!(distance < 0.01, "{id}: {distance} mm");
        compared += 1;
    }
    assert!(compared >= 3, "{compared} pairs with a unit");
}

#[test]
fn the_scale_beside_the_depth_map_holds_the_curved_surface() {
    #[derive(Deserialize)]
    struct Scale {
        no_data: u16,
        height_min: f64,
        curvature: [f64; 6],
        depth_from_plane: Affine2,
    }
    let dir = tempfile::tempdir().expect("a temporary directory");
    let demo = ["demo", "p", "--tier", "hard", "--pairs", "1", "--seed", "1"];
    mocban(dir.path(), &demo).expect(0);
    mocban(dir.path(), &["-C", "p", "export", "-o", "out"]).expect(0);
    let out = dir.path().join("out");
    let text = std::fs::read_to_string(out.join("pairs/hard-0000/depth.json")).expect("a file");
    let scale: Scale = serde_json::from_str(&text).expect("a scale");
    let lines = std::fs::read_to_string(out.join("pairs.jsonl")).expect("the lines");
    let line = lines.lines().next().expect("a line");
    let line: Value = serde_json::from_str(line).expect("JSON");
    assert_eq!(scale.no_data, 0);
    assert_eq!(scale.height_min, line["height_min"]);
    assert_eq!(scale.depth_from_plane, field(&line, "depth_from_plane"));
    let height_from_mesh: HeightFromMesh = field(&line, "height_from_mesh");
    assert_eq!(scale.curvature, height_from_mesh.curvature);
    assert_ne!(scale.curvature, [0.0; 6]);
}
