//! A synthetic pair with known alignment: a carved character without symmetry, and its print.

use std::sync::LazyLock;

use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::depth::{DepthParams, ResolutionBy};
use super::fit::FitParams;
use super::normalize::NormalizeParams;
use super::register::RegisterParams;
use super::score::SsimWindow;
use super::{AlignedPair, AlignmentMethod, PipelineParams, Print, Settings, StageError};
use mocban_core::domain::{Affine2, MetricOutcome, PrintFromMesh};
use mocban_core::mesh::Mesh;
use mocban_core::raster::{Grid, PrintImage};

/// Vertices along a side of the carved sheet.
const SIDE: usize = 110;
/// Side of the sheet, millimetres.
const SHEET_MM: f64 = 12.0;
/// Depth of the carving, millimetres.
const RELIEF_MM: f64 = 1.2;

/// Parameters of a synthetic sheet.
#[derive(Debug, Clone, Copy)]
pub(super) struct SyntheticSheet {
    /// Rotation of the sheet: axis times angle in radians.
    pub(super) turn: [f64; 3],
    /// Mesh units per millimetre.
    pub(super) scale: f64,
    pub(super) origin: [f64; 3],
    /// Whether faces are wound inwards.
    pub(super) inward: bool,
    /// Height of the bow at the rim, millimetres.
    pub(super) bow_mm: f64,
    pub(super) noise_mm: f64,
    /// Whether the geometry is mirrored: a pair that must not pass.
    pub(super) mirrored: bool,
}

impl Default for SyntheticSheet {
    fn default() -> Self {
        Self {
            turn: [0.0; 3],
            scale: 1.0,
            origin: [0.0; 3],
            inward: false,
            bow_mm: 0.0,
            noise_mm: 0.006,
            mirrored: false,
        }
    }
}

/// Returns whether a point is on a stroke, as read in print. x points right and y down, in millimetres from the middle.
fn stroke(x: f64, y: f64) -> bool {
    let bar = |x0: f64, x1: f64, y0: f64, y1: f64| (x0..x1).contains(&x) && (y0..y1).contains(&y);
    bar(-4.0, 4.2, -4.2, -3.2)
        || bar(-3.2, -2.2, -4.2, 4.2)
        || bar(-3.2, 1.6, -0.6, 0.3)
        || bar(2.2, 3.1, -1.8, 3.4)
        || bar(0.4, 3.1, 2.6, 3.4)
        || (x - 0.2).hypot(y + 1.9) < 0.75
}

impl SyntheticSheet {
    fn rotation(&self) -> Rotation3<f64> {
        Rotation3::new(Vector3::from(self.turn))
    }

    /// Maps a point on the sheet to the mesh. `x` and `y` are as read in print, `z` points out of the block, all in mm.
    pub(super) fn place(&self, x: f64, y: f64, z: f64) -> [f64; 3] {
        // The block is carved in mirror writing, so its x axis is reversed. Its y axis points up.
        let side = if self.mirrored { 1.0 } else { -1.0 };
        let p = self.rotation() * Vector3::new(side * x, -y, z) * self.scale;
        (p + Vector3::from(self.origin)).into()
    }

    /// Returns the outward normal of the sheet in the mesh frame.
    pub(super) fn normal(&self) -> Vector3<f64> {
        self.rotation() * Vector3::z()
    }

    pub(super) fn mesh(&self) -> Mesh {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut mesh = Mesh::default();
        for j in 0..SIDE {
            for i in 0..SIDE {
                let (x, y) = (at(i), at(j));
                let bow = self.bow_mm * (x * x + 0.4 * x * y) / (SHEET_MM * SHEET_MM / 4.0);
                let noise = (rng.random::<f64>() - 0.5) * 3.4 * self.noise_mm;
                mesh.vertices
                    .push(self.place(x, y, CARVED.at(i, j) + bow + noise));
            }
        }
        for j in 1..SIDE as u32 {
            for i in 1..SIDE as u32 {
                let k = j * SIDE as u32 + i;
                let (a, b, c, d) = (k - 1 - SIDE as u32, k - SIDE as u32, k, k - 1);
                for t in [[a, b, c], [a, c, d]] {
                    let [p, q, r] = t;
                    mesh.triangles.push(if self.inward == self.mirrored {
                        t
                    } else {
                        [p, r, q]
                    });
                }
            }
        }
        mesh
    }
}

/// Returns the position of a vertex along a side, in millimetres from the middle.
fn at(i: usize) -> f64 {
    (i as f64 / (SIDE - 1) as f64 - 0.5) * SHEET_MM
}

/// Heights of every synthetic sheet in millimetres: 0 on strokes, falling along walls to an uneven ground.
static CARVED: LazyLock<Grid<f64>> = LazyLock::new(|| {
    const FINE: usize = 3 * SIDE;
    let fine = |k: usize| (k as f64 / (FINE - 1) as f64 - 0.5) * SHEET_MM;
    let strokes: Vec<(f64, f64)> = (0..FINE * FINE)
        .map(|k| (fine(k % FINE), fine(k / FINE)))
        .filter(|(x, y)| stroke(*x, *y))
        .collect();
    Grid::from_fn(SIDE, SIDE, |i, j| {
        let (x, y) = (at(i), at(j));
        let near = |(p, q): &(f64, f64)| (p - x).powi(2) + (q - y).powi(2);
        let far = strokes
            .iter()
            .map(near)
            .fold(f64::INFINITY, f64::min)
            .sqrt();
        let gouged = 0.12 * ((x * 2.3).sin() * (y * 3.1 + x).cos());
        if stroke(x, y) {
            0.0
        } else {
            -(far * 1.6).min(RELIEF_MM + gouged)
        }
    })
});

/// Renders the print at `px_per_mm` pixels per millimetre, rotated clockwise by `turn_deg`. Also returns the true map
/// from the sheet to the print.
pub(super) fn print(px_per_mm: f64, turn_deg: f64) -> (Print, Affine2) {
    shrunk_print(px_per_mm, turn_deg, 1.0)
}

/// Like [`print`], for paper whose height is multiplied by `shrunk_by` after printing.
pub(super) fn shrunk_print(px_per_mm: f64, turn_deg: f64, shrunk_by: f64) -> (Print, Affine2) {
    let size = (SHEET_MM * px_per_mm) as usize;
    let middle = (size - 1) as f64 / 2.0;
    let as_printed = Affine2::similarity(
        px_per_mm,
        turn_deg.to_radians(),
        [middle + 1.3, middle - 2.1],
    );
    let shrinkage = Affine2([
        [1.0, 0.0, 0.0],
        [0.0, shrunk_by, (1.0 - shrunk_by) * middle],
    ]);
    let print_from_sheet = shrinkage.after(&as_printed);
    let back = print_from_sheet.inverse().expect("a similarity");
    let rgb = Grid::from_fn(size, size, |x, y| {
        let looks = 4;
        let mut ink = 0.0;
        for j in 0..looks {
            for i in 0..looks {
                let offset = |k: i32| (f64::from(k) + 0.5) / f64::from(looks) - 0.5;
                let [u, v] = back.apply([x as f64 + offset(i), y as f64 + offset(j)]);
                ink += f64::from(u8::from(stroke(u, v))) / f64::from(looks * looks);
            }
        }
        let paper = 52_000.0 - 40.0 * x as f64;
        [(paper - ink * 42_000.0) as u16; 3]
    });
    (PrintImage::from(rgb).into(), print_from_sheet)
}

/// Renders the print among eight neighbours in mirror writing. The edges of the image cut off a
/// quarter of the neighbours.
pub(super) fn grid_print(px_per_mm: f64, turn_deg: f64) -> (Print, Affine2) {
    let (one, print_from_sheet) = print(px_per_mm, turn_deg);
    let one = &one.image().rgb;
    let side = one.width();
    let cut = side / 4;
    let rgb = Grid::from_fn(3 * side - 2 * cut, 3 * side - 2 * cut, |x, y| {
        let [x, y] = [x + cut, y + cut];
        let is_middle = [x / side, y / side] == [1, 1];
        let column = if is_middle {
            x % side
        } else {
            side - 1 - x % side
        };
        one.at(column, y % side)
    });
    let shift = (side - cut) as f64;
    let moved = Affine2::scale_shift(1.0, [shift; 2]);
    (PrintImage::from(rgb).into(), moved.after(&print_from_sheet))
}

/// The default settings of all stages, at a smaller depth map.
pub(super) fn settings() -> Settings {
    Settings {
        pipeline: PipelineParams {
            method: AlignmentMethod::Default,
        },
        fit: FitParams {
            curved_blocks: true,
            seed: 1,
            spaced_points: 1000,
            spacing: 0.02,
            ransac_draws: 500,
            ransac_distance: 0.005,
            min_relief: 0.005,
        },
        depth: DepthParams {
            resolution_by: ResolutionBy::LongestSide,
            longest_px: 400,
            px_per_mm: 40.0,
        },
        normalize: NormalizeParams {
            canvas_px: 256,
            character_px: 192,
            print_grey: 127,
            density_greys: [50, 139],
            structure_greys: [90, 149],
            window: SsimWindow::Gaussian,
        },
        register: RegisterParams {
            scale_band: 1.6,
            working_px: 192,
            smoothing_px: 1.2,
            anisotropic_scale: true,
            threshold_min: 0.01,
            threshold_max: 0.6,
            min_confidence: 0.3,
            window: SsimWindow::Gaussian,
            coarse_angles: 60,
            fine_angles: 60,
        },
    }
}

/// The paper's settings of all stages.
pub(super) fn paper_settings() -> Settings {
    let mut settings = settings();
    settings.pipeline.method = AlignmentMethod::Paper;
    settings
}

/// Runs the four stages. Returns `print_from_mesh` and the outcome of each metric.
pub(super) fn run(
    mesh: &Mesh,
    print: &Print,
    settings: &Settings,
) -> Result<Vec<(PrintFromMesh, MetricOutcome)>, StageError> {
    let aligned = AlignedPair::new(&mesh.clone().into(), print, settings)?;
    let of = |metric: &MetricOutcome| (aligned.print_from_mesh(metric), *metric);
    Ok(aligned.metrics().iter().map(of).collect())
}

/// Returns the mean distance in pixels between the true and the found positions of points on the strokes.
pub(super) fn landmark_error_px(
    world: &SyntheticSheet,
    truth: &Affine2,
    found: &PrintFromMesh,
) -> f64 {
    let places = [
        [-3.5, -3.7],
        [3.9, -3.7],
        [-2.7, 4.0],
        [2.6, 3.0],
        [0.2, -1.9],
        [1.0, 0.0],
    ];
    let error = |[x, y]: [f64; 2]| {
        let [u, v] = truth.apply([x, y]);
        let [p, q, _] = found.apply(world.place(x, y, 0.0));
        (p - u).hypot(q - v)
    };
    places.into_iter().map(error).sum::<f64>() / places.len() as f64
}

/// Returns an arbitrary fixed rotation as axis times angle.
pub(super) fn some_turn(k: u64) -> [f64; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(k);
    let mut random = || rng.random::<f64>() * 2.0 - 1.0;
    let raw = Matrix3::from_fn(|_, _| random());
    let turned = Rotation3::from_matrix(&raw);
    turned.scaled_axis().into()
}
