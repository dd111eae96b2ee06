//! What must not matter: unit, pose, order and repetition of vertices, place and turn of the print.
//!
//! Each test aligns pairs twice, as they are and changed, and compares where the landmarks fall in print pixels.

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

/// A pair with its answer.
struct Case {
    name: String,
    mesh: Mesh,
    print: PrintImage,
    landmarks: Vec<[f64; 3]>,
    answer: PrintFromMesh,
    /// How much farther a change may move the answer than that of a whole and flat block.
    looseness: f64,
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
            let answer = align(&pair.mesh, &print);
            Case {
                answer,
                looseness: if tier == Tier::Hard { HARD } else { 1.0 },
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

/// A motion and scaling of the mesh.
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
    /// Largest distance at the landmarks between where they should fall and where the changed pair puts them, pixels.
    fn off_px(
        &self,
        mesh: &Mesh,
        motion: &Motion,
        print: &PrintImage,
        print_motion: &Affine2,
    ) -> f64 {
        let changed = align(mesh, print);
        let distance = |landmark: &[f64; 3]| {
            let [x, y, _] = self.answer.apply(*landmark);
            let [u, v] = print_motion.apply([x, y]);
            let [p, q, _] = changed.apply(motion.point(*landmark));
            (p - u).hypot(q - v)
        };
        self.landmarks.iter().map(distance).fold(0.0, f64::max)
    }

    fn mesh_moved(&self, motion: &Motion) -> f64 {
        self.off_px(
            &motion.mesh(&self.mesh),
            motion,
            &self.print,
            &Affine2::IDENTITY,
        )
    }

    fn mesh_changed(&self, mesh: &Mesh) -> f64 {
        self.off_px(mesh, &Motion::NONE, &self.print, &Affine2::IDENTITY)
    }

    fn print_moved(&self, print: &PrintImage, by: &Affine2) -> f64 {
        self.off_px(&self.mesh, &Motion::NONE, print, by)
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

fn soup(mesh: &Mesh) -> Mesh {
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

/// The print turned by a quarter, clockwise.
fn turned(print: &PrintImage) -> (PrintImage, Affine2) {
    let (width, height) = (print.rgb.width(), print.rgb.height());
    let rgb = Grid::from_fn(height, width, |x, y| print.rgb.at(y, height - 1 - x));
    let motion = Affine2([[0.0, -1.0, (height - 1) as f64], [1.0, 0.0, 0.0]]);
    (PrintImage { rgb }, motion)
}

/// The print turned by so many quarters.
fn turned_by(print: &PrintImage, quarters: usize) -> (PrintImage, Affine2) {
    let start = (print.clone(), Affine2::IDENTITY);
    (0..quarters).fold(start, |(print, so_far), _| {
        let (print, motion) = turned(&print);
        (print, motion.after(&so_far))
    })
}

/// The print with pixels of white added at left, top, right and bottom, or cut off where the number is negative.
fn framed(print: &PrintImage, [left, top, right, bottom]: [i64; 4]) -> (PrintImage, Affine2) {
    let side = |length: usize, added: i64| (length as i64 + added) as usize;
    let width = side(print.rgb.width(), left + right);
    let height = side(print.rgb.height(), top + bottom);
    let rgb = Grid::from_fn(width, height, |x, y| {
        let from = print.rgb.get(x as i64 - left, y as i64 - top);
        from.unwrap_or([u16::MAX; 3])
    });
    let motion = Affine2::scale_shift(1.0, [left as f64, top as f64]);
    (PrintImage { rgb }, motion)
}

/// A change that the stages do not see at all moves no landmark by more than this, pixels.
const EXACT_PX: f64 = 0.02;
/// The same for a turn of the mesh that is not by a right angle in the plane: the depth map stays upright, so its
/// pixels see other places.
const TURNED_PX: f64 = 0.15;
/// The same where less of the print is known.
const CROPPED_PX: f64 = 0.1;
/// A bent and broken block holds its answer this much less tightly.
const HARD: f64 = 5.0;

/// Holds every pair under a change to the limit.
fn hold(what: &str, limit_px: f64, off_px: impl Fn(&Case) -> f64 + Sync) {
    let far = |case: &Case| {
        let off = off_px(case);
        (off > limit_px).then(|| format!("{}: {off:.4} px", case.name))
    };
    let wrong: Vec<String> = CASES.par_iter().filter_map(far).collect();
    assert!(wrong.is_empty(), "{what}: {}", wrong.join(", "));
}

#[test]
fn unit_and_place_change_nothing() {
    for (scale, extents) in [(0.001, 1.0), (25.4, 1e3), (1.0, 1e3)] {
        hold(
            &format!("scaled by {scale}, {extents} extents away"),
            EXACT_PX,
            |case| {
                let shift = Vector3::new(0.6, -0.7, 0.4) * scale * extents * case.extent();
                case.mesh_moved(&Motion {
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
        ("soup", soup),
        ("repeated", repeated),
    ];
    for (what, change) in changes {
        hold(what, EXACT_PX, |case| {
            case.mesh_changed(&change(&case.mesh))
        });
    }
}

#[test]
fn scan_upside_down_changes_nothing() {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let rotation = Rotation3::new(axis * PI);
        hold(&format!("turned about {axis:?}"), EXACT_PX, |case| {
            case.mesh_moved(&Motion {
                rotation,
                ..Motion::NONE
            })
        });
    }
}

#[test]
fn any_pose_of_the_scan_changes_hardly_anything() {
    for axis in [
        [0.087, 0.02, 0.0],
        [0.0, 0.0, 0.52],
        [1.1, -0.4, 0.8],
        [-0.3, 2.1, -1.8],
    ] {
        let rotation = Rotation3::new(Vector3::from(axis));
        hold(&format!("turned by {axis:?}"), TURNED_PX, |case| {
            case.mesh_moved(&Motion {
                rotation,
                ..Motion::NONE
            }) / case.looseness
        });
    }
}

#[test]
fn turned_print_turns_the_answer() {
    for quarters in 1..4 {
        hold(
            &format!("print turned by {quarters} quarters"),
            EXACT_PX,
            |case| {
                let (print, motion) = turned_by(&case.print, quarters);
                case.print_moved(&print, &motion)
            },
        );
    }
}

#[test]
fn white_around_the_print_moves_the_answer() {
    for by in [[7, 0, 0, 0], [13, 9, 5, 21]] {
        hold(&format!("white added {by:?}"), EXACT_PX, |case| {
            let (print, motion) = framed(&case.print, by);
            case.print_moved(&print, &motion)
        });
    }
}

#[test]
fn cropped_print_moves_the_answer() {
    for by in [[-3, 0, 0, 0], [-1, -2, -3, -4]] {
        hold(&format!("cropped {by:?}"), CROPPED_PX, |case| {
            let (print, motion) = framed(&case.print, by);
            case.print_moved(&print, &motion) / case.looseness
        });
    }
}
