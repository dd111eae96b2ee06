//! The alignment must not change with the mesh's unit, pose and vertex order or the print's position and rotation.
//!
//! Each test aligns a pair and a changed copy, and compares the landmarks in print pixels.

use std::f64::consts::PI;
use std::sync::LazyLock;

use mocban::config::{self, Sources};
use mocban::demo::{PairGenerator, Tier};
use mocban::domain::{Affine2, PrintFromMesh};
use mocban::mesh::Mesh;
use mocban::raster::{self, Grid, PrintImage};
use mocban::stages::{AlignedPair, Settings};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

static SETTINGS: LazyLock<Settings> = LazyLock::new(|| {
    let loaded = config::load(&Sources::default()).expect("the defaults are sound");
    loaded.config.stages
});

/// A pair with its alignment.
struct Case {
    name: String,
    mesh: Mesh,
    print: PrintImage,
    landmarks: Vec<[f64; 3]>,
    alignment: PrintFromMesh,
    /// Factor on the tolerance, relative to an undamaged and flat block.
    tolerance_factor: f64,
}

static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let all = [(Tier::Upright, 0), (Tier::Pose, 0), (Tier::Hard, 0)];
    all.into_par_iter()
        .map(|(tier, index)| {
            let pair = PairGenerator::new(tier, 57)
                .pair(index)
                .expect("the pair is made");
            let print =
                raster::decode(&pair.print, &raster::ImageLimits::SUGGESTED).expect("a picture");
            let alignment = align(&pair.mesh, &print);
            Case {
                alignment,
                tolerance_factor: if tier == Tier::Hard { HARD_FACTOR } else { 1.0 },
                name: pair.id,
                landmarks: pair.truth.landmarks,
                mesh: pair.mesh,
                print,
            }
        })
        .collect()
});

fn align(mesh: &Mesh, print: &PrintImage) -> PrintFromMesh {
    let print = print.clone().into();
    let aligned = AlignedPair::new(&mesh.clone().into(), &print, &SETTINGS).expect("an alignment");
    let best = aligned.metrics().first().expect("a metric");
    aligned.print_from_mesh(best)
}

/// A rigid motion and scaling of the mesh.
#[derive(Debug, Clone, Copy)]
struct Motion {
    rotation: Rotation3<f64>,
    scale: f64,
    shift: Vector3<f64>,
}

impl Motion {
    const NONE: Self = Self {
        rotation: Rotation3::from_matrix_unchecked(Matrix3::new(
            1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0,
        )),
        scale: 1.0,
        shift: Vector3::new(0.0, 0.0, 0.0),
    };

    fn point(&self, p: [f64; 3]) -> [f64; 3] {
        (self.rotation * Vector3::from(p) * self.scale + self.shift).into()
    }

    fn mesh(&self, mesh: &Mesh) -> Mesh {
        Mesh {
            vertices: mesh.vertices.iter().map(|v| self.point(v)).collect(),
            triangles: mesh.triangles.clone(),
        }
    }
}

impl Case {
    /// Returns the largest distance in pixels between the expected and found landmarks of the changed pair.
    fn max_error_px(
        &self,
        mesh: &Mesh,
        motion: &Motion,
        print: &PrintImage,
        print_motion: &Affine2,
    ) -> f64 {
        let changed = align(mesh, print);
        let distance = |landmark: &[f64; 3]| {
            let [x, y, _] = self.alignment.apply(*landmark);
            let [u, v] = print_motion.apply([x, y]);
            let [p, q, _] = changed.apply(motion.point(*landmark));
            (p - u).hypot(q - v)
        };
        self.landmarks.iter().map(distance).fold(0.0, f64::max)
    }

    fn error_of_moved_mesh(&self, motion: &Motion) -> f64 {
        self.max_error_px(
            &motion.mesh(&self.mesh),
            motion,
            &self.print,
            &Affine2::IDENTITY,
        )
    }

    fn error_of_changed_mesh(&self, mesh: &Mesh) -> f64 {
        self.max_error_px(mesh, &Motion::NONE, &self.print, &Affine2::IDENTITY)
    }

    fn error_of_changed_print(&self, print: &PrintImage, by: &Affine2) -> f64 {
        self.max_error_px(&self.mesh, &Motion::NONE, print, by)
    }

    fn extent(&self) -> f64 {
        let first = Vector3::from(self.mesh.vertices.at(0));
        let far = |v: [f64; 3]| (Vector3::from(v) - first).norm();
        self.mesh.vertices.iter().map(far).fold(0.0, f64::max)
    }
}

fn shuffled(mesh: &Mesh) -> Mesh {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut order: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    order.shuffle(&mut rng);
    let mut vertices = mesh.vertices.clone();
    for (old, new) in order.iter().enumerate() {
        vertices.set(*new as usize, mesh.vertices.at(old));
    }
    let mut triangles: Vec<[u32; 3]> = mesh
        .triangles
        .iter()
        .map(|t| {
            let mut t = t.map(|i| order[i as usize]);
            t.rotate_left(rng.random_range(0..3));
            t
        })
        .collect();
    triangles.shuffle(&mut rng);
    Mesh {
        vertices,
        triangles: triangles.into(),
    }
}

fn unshared_vertices(mesh: &Mesh) -> Mesh {
    let corners = mesh.triangles.iter().flatten();
    Mesh {
        vertices: corners.map(|i| mesh.vertices.at(*i as usize)).collect(),
        triangles: (0..mesh.triangles.len() as u32)
            .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
            .collect(),
    }
}

fn repeated(mesh: &Mesh) -> Mesh {
    Mesh {
        vertices: mesh.vertices.iter().flat_map(|v| [v; 3]).collect(),
        triangles: mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| 3 * i + 1))
            .collect(),
    }
}

/// Rotates the print by 90 degrees clockwise.
fn rotated_90(print: &PrintImage) -> (PrintImage, Affine2) {
    let (width, height) = (print.rgb.width(), print.rgb.height());
    let rgb = Grid::from_fn(height, width, |x, y| print.rgb.at(y, height - 1 - x));
    let motion = Affine2([[0.0, -1.0, (height - 1) as f64], [1.0, 0.0, 0.0]]);
    (PrintImage::from(rgb), motion)
}

/// Rotates the print by a multiple of 90 degrees.
fn rotated_by_quarters(print: &PrintImage, quarters: usize) -> (PrintImage, Affine2) {
    let start = (print.clone(), Affine2::IDENTITY);
    (0..quarters).fold(start, |(print, so_far), _| {
        let (print, motion) = rotated_90(&print);
        (print, motion.after(&so_far))
    })
}

/// Adds white pixels at the left, top, right and bottom. A negative number crops that side.
fn padded(print: &PrintImage, [left, top, right, bottom]: [i64; 4]) -> (PrintImage, Affine2) {
    let side = |length: usize, added: i64| (length as i64 + added) as usize;
    let width = side(print.rgb.width(), left + right);
    let height = side(print.rgb.height(), top + bottom);
    let colours = print.rgb.to_rgb16();
    let rgb = Grid::from_fn(width, height, |x, y| {
        let from = colours.get(x as i64 - left, y as i64 - top);
        from.unwrap_or([u16::MAX; 3])
    });
    let motion = Affine2::scale_shift(1.0, [left as f64, top as f64]);
    (PrintImage::from(rgb), motion)
}

/// Tolerance of changes that leave the data of the stages equal, pixels.
const EXACT_PX: f64 = 0.02;
/// Tolerance in pixels for a rotated mesh. Its depth map samples other points of the mesh.
const ROTATED_PX: f64 = 0.15;
/// Tolerance of cropped prints, pixels.
const CROPPED_PX: f64 = 0.1;
/// Tolerance factor of bent and damaged blocks.
const HARD_FACTOR: f64 = 5.0;

/// Asserts that the error of every pair stays within the limit.
fn assert_within(what: &str, limit_px: f64, error_px: impl Fn(&Case) -> f64 + Sync) {
    let far = |case: &Case| {
        let error = error_px(case);
        (error > limit_px).then(|| format!("{}: {error:.4} px", case.name))
    };
    let wrong: Vec<String> = CASES.par_iter().filter_map(far).collect();
    assert!(wrong.is_empty(), "{what}: {}", wrong.join(", "));
}

#[test]
fn unit_and_position_change_nothing() {
    for (scale, extents) in [(0.001, 1.0), (25.4, 1e3), (1.0, 1e3)] {
        assert_within(
            &format!("scaled by {scale}, {extents} extents away"),
            EXACT_PX,
            |case| {
                let shift = Vector3::new(0.6, -0.7, 0.4) * scale * extents * case.extent();
                case.error_of_moved_mesh(&Motion {
                    scale,
                    shift,
                    ..Motion::NONE
                })
            },
        );
    }
}

#[test]
fn order_and_repetition_of_vertices_change_nothing() {
    type Change = fn(&Mesh) -> Mesh;
    let changes: [(&str, Change); 3] = [
        ("shuffled", shuffled),
        ("unshared vertices", unshared_vertices),
        ("repeated", repeated),
    ];
    for (what, change) in changes {
        assert_within(what, EXACT_PX, |case| {
            case.error_of_changed_mesh(&change(&case.mesh))
        });
    }
}

#[test]
fn scan_rotated_by_half_a_turn_changes_nothing() {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let rotation = Rotation3::new(axis * PI);
        assert_within(&format!("rotated about {axis:?}"), EXACT_PX, |case| {
            case.error_of_moved_mesh(&Motion {
                rotation,
                ..Motion::NONE
            })
        });
    }
}

#[test]
fn any_pose_of_the_scan_gives_the_same_alignment() {
    for axis in [
        [0.087, 0.02, 0.0],
        [0.0, 0.0, 0.52],
        [1.1, -0.4, 0.8],
        [-0.3, 2.1, -1.8],
    ] {
        let rotation = Rotation3::new(Vector3::from(axis));
        assert_within(&format!("rotated by {axis:?}"), ROTATED_PX, |case| {
            case.error_of_moved_mesh(&Motion {
                rotation,
                ..Motion::NONE
            }) / case.tolerance_factor
        });
    }
}

#[test]
fn rotated_print_rotates_the_alignment() {
    for quarters in 1..4 {
        assert_within(
            &format!("print rotated by {quarters} quarters"),
            EXACT_PX,
            |case| {
                let (print, motion) = rotated_by_quarters(&case.print, quarters);
                case.error_of_changed_print(&print, &motion)
            },
        );
    }
}

#[test]
fn white_border_shifts_the_alignment() {
    for by in [[7, 0, 0, 0], [13, 9, 5, 21]] {
        assert_within(&format!("white added {by:?}"), EXACT_PX, |case| {
            let (print, motion) = padded(&case.print, by);
            case.error_of_changed_print(&print, &motion)
        });
    }
}

#[test]
fn cropped_print_shifts_the_alignment() {
    for by in [[-3, 0, 0, 0], [-1, -2, -3, -4]] {
        assert_within(&format!("cropped {by:?}"), CROPPED_PX, |case| {
            let (print, motion) = padded(&case.print, by);
            case.error_of_changed_print(&print, &motion) / case.tolerance_factor
        });
    }
}
