//! The scanned surface of a block: carved side or sides, walls and support, as points of a regular grid.

use std::ops::Range;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::pose::{BlockPose, FaceSide, SideFrame};
use super::relief::BlockRelief;
use super::seeding::hashed_normal;
use super::support::SupportMesh;
use crate::noise::{Noise, smoothstep};

/// Which surfaces of a block were scanned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ScannedPart {
    /// The front only.
    Face,
    /// Front and walls.
    FaceAndWalls,
    /// Front, walls and back.
    Everything,
}

/// A block as it was scanned.
#[derive(Debug, Clone)]
pub(super) struct BlockSolid {
    /// Number of grid points along x and along y.
    pub size: [usize; 2],
    /// Half the width and half the height, mm.
    pub half_mm: [f64; 2],
    pub thickness_mm: f64,
    pub part: ScannedPart,
    pub front: BlockRelief,
    /// The text on the back, if there is any.
    pub back: Option<BlockRelief>,
    /// Frames of front and back.
    pub frames: [SideFrame; 2],
    pub pose: BlockPose,
    pub scan: ScanNoise,
    pub support: SupportMesh,
}

/// Irregularities of a block's outline and errors of its scan.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScanNoise {
    /// Standard deviation of the heights, mm.
    sigma_mm: f64,
    seed: u64,
    outline: [Noise; 2],
    bottom: Noise,
    /// Fraction of the walls that the scan shows if it does not show the back.
    wall_share: f64,
}

impl ScanNoise {
    /// Draws the irregularities for a height noise of `sigma_mm`.
    pub(super) fn draw(sigma_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            sigma_mm,
            seed: rng.random(),
            outline: [Noise::draw(rng), Noise::draw(rng)],
            bottom: Noise::draw(rng),
            wall_share: rng.random_range(0.6..0.97),
        }
    }
}

impl BlockSolid {
    /// Returns the frame of a side.
    pub(super) fn frame(&self, side: FaceSide) -> SideFrame {
        self.frames[usize::from(side == FaceSide::Back)]
    }

    /// Returns the carved surface of a side.
    pub(super) fn relief(&self, side: FaceSide) -> Option<&BlockRelief> {
        match side {
            FaceSide::Front => Some(&self.front),
            FaceSide::Back => self.back.as_ref(),
        }
    }

    /// Returns the sides that the scan shows.
    pub(super) fn scanned_sides(&self) -> &'static [FaceSide] {
        match self.part {
            ScannedPart::Everything => &[FaceSide::Front, FaceSide::Back],
            ScannedPart::Face | ScannedPart::FaceAndWalls => &[FaceSide::Front],
        }
    }

    /// Returns the number of rows of faces on the walls.
    pub(super) fn wall_rows(&self) -> usize {
        if self.part == ScannedPart::Face {
            return 0;
        }
        let spacing = 2.0 * self.half_mm[0] / (self.size[0] - 1) as f64;
        ((self.thickness_mm / (3.0 * spacing)).ceil() as usize).max(2)
    }

    /// Returns the grid points of the border, counterclockwise as seen from the front.
    pub(super) fn border(&self) -> Vec<[usize; 2]> {
        let [last_x, last_y] = self.size.map(|n| n - 1);
        let bottom = (0..last_x).map(|i| [i, 0]);
        let right = (0..last_y).map(|j| [last_x, j]);
        let top = (0..last_x).map(|i| [last_x - i, last_y]);
        let left = (0..last_y).map(|j| [0, last_y - j]);
        bottom.chain(right).chain(top).chain(left).collect()
    }

    /// Returns the points of some rows of the grid on a side, in mesh coordinates.
    pub(super) fn rows(&self, side: FaceSide, rows: Range<usize>) -> Vec<Vec<[f32; 3]>> {
        rows.into_par_iter()
            .map(|j| {
                (0..self.size[0])
                    .map(|i| self.mesh_point(self.surface_point(side, i, j)))
                    .collect()
            })
            .collect()
    }

    /// Returns the rings of the walls from the front downwards, each with the points of the border, in mesh
    /// coordinates. The first ring is the border of the front. The last one is that of the back if the scan shows it.
    pub(super) fn rings(&self) -> Vec<Vec<[f32; 3]>> {
        let rows = self.wall_rows();
        let border = self.border();
        let ends: Vec<[[f64; 3]; 2]> = border
            .par_iter()
            .map(|[i, j]| {
                [FaceSide::Front, FaceSide::Back].map(|side| self.surface_point(side, *i, *j))
            })
            .collect();
        let share = if self.part == ScannedPart::Everything {
            1.0
        } else {
            self.scan.wall_share
        };
        (0..=rows)
            .into_par_iter()
            .map(|row| {
                let t = share * row as f64 / rows.max(1) as f64;
                let ring = ends.iter().enumerate();
                ring.map(|(k, ends)| self.mesh_point(self.wall_point(*ends, t, row, k)))
                    .collect()
            })
            .collect()
    }

    /// Returns a point of a wall at a fraction `t` of the way from front to back, in the block frame.
    fn wall_point(&self, [top, bottom]: [[f64; 3]; 2], t: f64, row: usize, k: usize) -> [f64; 3] {
        if t == 0.0 {
            return top;
        }
        if t == 1.0 {
            return bottom;
        }
        let point = [0, 1, 2].map(|i| top[i] + (bottom[i] - top[i]) * t);
        let [x, y, z] = point;
        let noise = self.scan.sigma_mm * hashed_normal(self.scan.seed ^ 7, k as u64, row as u64);
        let rough = 0.25 * self.scan.outline[0].two_octaves((x + y) / 9.0, (x - y + z) / 5.0);
        let outward = (rough + noise) * (4.0 * t * (1.0 - t)).min(1.0);
        let [nx, ny] = [0, 1].map(|i| {
            let share = point[i] / self.half_mm[i];
            if share.abs() > 0.97 {
                share.signum()
            } else {
                0.0
            }
        });
        [x + nx * outward, y + ny * outward, z]
    }

    /// Returns a point of the grid on a side with the noise of the scan, in the block frame.
    fn surface_point(&self, side: FaceSide, i: usize, j: usize) -> [f64; 3] {
        let [x, y] = self.grid_position(i, j);
        let frame = self.frame(side);
        let uv = frame.uv(x, y);
        let height = self.relief(side).map_or_else(
            || 0.3 * self.scan.bottom.two_octaves(x / 7.0, y / 4.0),
            |relief| relief.height_mm(uv),
        );
        let seed = self.scan.seed ^ u64::from(side == FaceSide::Back);
        let noise = self.scan.sigma_mm * hashed_normal(seed, i as u64, j as u64);
        frame.block_from_face(uv, height + noise)
    }

    /// Returns x and y of a grid point, mm. The border is a little irregular.
    fn grid_position(&self, i: usize, j: usize) -> [f64; 2] {
        let regular = [(i, 0), (j, 1)].map(|(index, axis)| {
            let share = index as f64 / (self.size[axis] - 1) as f64;
            (2.0 * share - 1.0) * self.half_mm[axis]
        });
        [0, 1].map(|axis| {
            let from_edge = self.half_mm[axis] - regular[axis].abs();
            let near = 1.0 - smoothstep(0.0, 5.0, from_edge);
            if near <= 0.0 {
                return regular[axis];
            }
            let along = regular[1 - axis] / 11.0;
            let noise = self.scan.outline[axis].two_octaves(along, regular[axis].signum() * 9.0);
            regular[axis] + 0.5 * near * noise
        })
    }

    /// Converts a point of the block frame to mesh coordinates as they are written.
    fn mesh_point(&self, point: [f64; 3]) -> [f32; 3] {
        self.pose.mesh_from_block(point).map(|c| c as f32)
    }

    /// Returns the points of the support in mesh coordinates.
    pub(super) fn support_points(&self) -> Vec<[f32; 3]> {
        let points = self.support.vertices.iter();
        points.map(|point| self.mesh_point(*point)).collect()
    }
}
