//! How the grid of a block is divided into triangles.

use super::pose::FaceSide;
use super::solid::BlockSolid;

/// Rows of the grid that are computed at a time.
pub(super) const BAND: usize = 32;

/// Returns the number of triangles of a block's mesh.
pub(super) fn triangle_count(solid: &BlockSolid) -> usize {
    let [nx, ny] = solid.size;
    let side = 2 * (nx - 1) * (ny - 1);
    let walls = 2 * solid.border().len() * solid.wall_rows();
    side * solid.scanned_sides().len() + walls + solid.support.triangles.len()
}

/// Returns the two triangles of a quad with corners in counterclockwise order. Diagonals alternate like a chessboard.
pub(super) fn split<T: Copy>([a, b, c, d]: [T; 4], is_odd: bool) -> [[T; 3]; 2] {
    if is_odd {
        [[a, b, d], [b, c, d]]
    } else {
        [[a, b, c], [a, c, d]]
    }
}

/// Returns the corners of a quad of the grid on a side, counterclockwise as seen from outside. The corners are given in
/// the order of the front.
pub(super) fn facing<T: Copy>([a, b, c, d]: [T; 4], side: FaceSide) -> [T; 4] {
    match side {
        FaceSide::Front => [a, b, c, d],
        FaceSide::Back => [a, d, c, b],
    }
}
