//! A scan and its indexed surface, which fit and depth share.

use std::sync::OnceLock;

use super::zbuffer::IndexedSurface;
use mocban_core::domain::cancel::{poll, polled};
use mocban_core::domain::{MeshLosses, ScanRegion};
use mocban_core::mesh::{Mesh, MeshRead, Vertices};
use mocban_core::simd::{dispatch, min_f64};

/// Vertices between two polls for a cancellation.
const VERTICES_PER_POLL: usize = 4096;
/// Heights whose minima are computed together.
const LANES: usize = 8;

/// A mesh as read, and its surface, which is indexed on first use.
#[derive(Debug)]
pub struct Scan {
    mesh: Mesh,
    losses: MeshLosses,
    indexed: OnceLock<IndexedSurface>,
}

impl Scan {
    /// Returns the mesh as read.
    pub const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns what was left out of the file's mesh.
    pub const fn losses(&self) -> MeshLosses {
        self.losses
    }

    /// Returns the faces with all corners in a region. For a mesh without faces, returns the points in the region.
    pub(super) fn mesh_in(&self, region: &ScanRegion) -> Mesh {
        part_in(&self.mesh, region)
    }

    /// Returns the surface, ready to be rendered along any direction.
    pub(super) fn indexed(&self) -> &IndexedSurface {
        self.indexed.get_or_init(|| IndexedSurface::new(&self.mesh))
    }
}

impl From<MeshRead> for Scan {
    fn from(MeshRead { mesh, losses }: MeshRead) -> Self {
        Self {
            mesh,
            losses,
            indexed: OnceLock::new(),
        }
    }
}

impl From<Mesh> for Scan {
    fn from(mesh: Mesh) -> Self {
        let losses = MeshLosses::default();
        MeshRead { mesh, losses }.into()
    }
}

/// Returns the faces with all corners in a region. For a mesh without faces, returns the points in the region.
pub(super) fn part_in(mesh: &Mesh, region: &ScanRegion) -> Mesh {
    let kept = match &mesh.vertices {
        Vertices::Single(all) => contained(region, all),
        Vertices::Double(all) => contained(region, all),
    };
    part_of_kept(mesh, &kept)
}

/// Returns whether each vertex lies in a region, as [`ScanRegion::contains`] does.
fn contained<T: Copy + Into<f64>>(region: &ScanRegion, vertices: &[[T; 3]]) -> Vec<bool> {
    let ([low, high], [rows @ .., _]) = (region.bounds, region.box_from_mesh.0);
    let mut kept = vec![false; vertices.len()];
    let runs = kept.chunks_mut(VERTICES_PER_POLL);
    for (kept, vertices) in runs.zip(vertices.chunks(VERTICES_PER_POLL)) {
        poll();
        dispatch!({
            for (kept, [x, y, z]) in kept.iter_mut().zip(vertices) {
                let (x, y, z): (f64, f64, f64) = ((*x).into(), (*y).into(), (*z).into());
                let mut is_inside = true;
                for k in 0..3 {
                    let at = rows[k][0] * x + rows[k][1] * y + rows[k][2] * z + rows[k][3];
                    is_inside &= (low[k] <= at) & (at <= high[k]);
                }
                *kept = is_inside;
            }
        });
    }
    kept
}

/// Returns the lowest value of an affine form over the vertices, infinity if there are none. `row` holds the coefficients of
/// x, y and z and the constant.
pub(super) fn lowest_along(vertices: &Vertices, row: [f64; 4]) -> f64 {
    match vertices {
        Vertices::Single(all) => lowest_of(all, row),
        Vertices::Double(all) => lowest_of(all, row),
    }
}

fn lowest_of<T: Copy + Into<f64>>(vertices: &[[T; 3]], [a, b, c, d]: [f64; 4]) -> f64 {
    let mut lowest = [f64::INFINITY; LANES];
    for vertices in vertices.chunks(VERTICES_PER_POLL) {
        poll();
        lowest = dispatch!({
            let mut lowest = lowest;
            for vertices in vertices.chunks(LANES) {
                for (lowest, [x, y, z]) in lowest.iter_mut().zip(vertices) {
                    let (x, y, z): (f64, f64, f64) = ((*x).into(), (*y).into(), (*z).into());
                    *lowest = min_f64(a * x + b * y + c * z + d, *lowest);
                }
            }
            lowest
        });
    }
    lowest.into_iter().fold(f64::INFINITY, f64::min)
}

/// Returns the faces with only corners that `keeps` accepts. For a mesh without faces, returns the accepted points.
pub(super) fn part_of(mesh: &Mesh, keeps: impl Fn([f64; 3]) -> bool) -> Mesh {
    let kept: Vec<bool> = polled(mesh.vertices.iter()).map(keeps).collect();
    part_of_kept(mesh, &kept)
}

/// Returns the faces with only corners that are kept. For a mesh without faces, returns the points that are kept.
fn part_of_kept(mesh: &Mesh, kept: &[bool]) -> Mesh {
    if mesh.triangles.is_empty() {
        let points = polled(mesh.vertices.iter()).zip(kept);
        let points = points.filter_map(|(point, kept)| (*kept).then_some(point));
        return Mesh {
            vertices: points.collect::<Vec<_>>().into(),
            triangles: Vec::new().into(),
        };
    }
    let is_kept = |face: &&[u32; 3]| face.iter().all(|corner| kept[*corner as usize]);
    of_faces(mesh, polled(&mesh.triangles).filter(is_kept))
}

/// Returns the mesh of some faces, without the vertices that no face uses.
pub(super) fn of_faces<'a>(mesh: &Mesh, faces: impl IntoIterator<Item = &'a [u32; 3]>) -> Mesh {
    let mut places = vec![u32::MAX; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let mut renumbered = Vec::new();
    for face in polled(faces) {
        renumbered.push(face.map(|corner| {
            let place = &mut places[corner as usize];
            if *place == u32::MAX {
                *place = vertices.len() as u32;
                vertices.push(mesh.vertices.at(corner as usize));
            }
            *place
        }));
    }
    Mesh {
        vertices: vertices.into(),
        triangles: renumbered.into(),
    }
}
