//! Writes the mesh of a block as binary PLY with indexed vertices.

use std::io::{self, Write};

use super::facets::{BAND, facing, split, triangle_count};
use super::pose::FaceSide;
use super::solid::{BlockSolid, ScannedPart};

/// Numbers of the vertices of a PLY file: the front, the rings of the walls without those of front and back, the back,
/// the support.
struct VertexNumbers {
    size: [usize; 2],
    border: Vec<[usize; 2]>,
    /// Number of rings with vertices of their own.
    own_rings: usize,
    has_back: bool,
}

impl VertexNumbers {
    fn of(solid: &BlockSolid) -> Self {
        let has_back = solid.part == ScannedPart::Everything;
        Self {
            size: solid.size,
            border: solid.border(),
            own_rings: solid.wall_rows() - usize::from(has_back),
            has_back,
        }
    }

    const fn side_count(&self) -> usize {
        self.size[0] * self.size[1]
    }

    fn back_start(&self) -> usize {
        self.side_count() + self.own_rings * self.border.len()
    }

    fn support_start(&self) -> usize {
        self.back_start() + usize::from(self.has_back) * self.side_count()
    }

    fn on_side(&self, side: FaceSide, i: usize, j: usize) -> u32 {
        let start = match side {
            FaceSide::Front => 0,
            FaceSide::Back => self.back_start(),
        };
        (start + j * self.size[0] + i) as u32
    }

    /// Returns the number of a vertex of a ring; ring 0 is the border of the front.
    fn on_ring(&self, ring: usize, k: usize) -> u32 {
        let [i, j] = self.border[k];
        if ring == 0 {
            self.on_side(FaceSide::Front, i, j)
        } else if ring > self.own_rings {
            self.on_side(FaceSide::Back, i, j)
        } else {
            (self.side_count() + (ring - 1) * self.border.len() + k) as u32
        }
    }
}

/// Writes the mesh of a block: vertices row by row, then faces row by row.
pub(super) fn write_ply(solid: &BlockSolid, out: &mut impl Write) -> io::Result<()> {
    let numbers = VertexNumbers::of(solid);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
        property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        numbers.support_start() + solid.support.vertices.len(),
        triangle_count(solid),
    )?;
    write_side(solid, FaceSide::Front, out)?;
    if numbers.own_rings > 0 {
        let rings = solid.rings();
        for ring in &rings[1..=numbers.own_rings] {
            write_points(ring, out)?;
        }
    }
    if numbers.has_back {
        write_side(solid, FaceSide::Back, out)?;
    }
    write_points(&solid.support_points(), out)?;
    write_faces(solid, &numbers, out)
}

fn write_side(solid: &BlockSolid, side: FaceSide, out: &mut impl Write) -> io::Result<()> {
    let rows = solid.size[1];
    for first in (0..rows).step_by(BAND) {
        for row in solid.rows(side, first..(first + BAND).min(rows)) {
            write_points(&row, out)?;
        }
    }
    Ok(())
}

fn write_points(points: &[[f32; 3]], out: &mut impl Write) -> io::Result<()> {
    let bytes: Vec<u8> = points
        .iter()
        .flatten()
        .flat_map(|c| c.to_le_bytes())
        .collect();
    out.write_all(&bytes)
}

fn write_faces(
    solid: &BlockSolid,
    numbers: &VertexNumbers,
    out: &mut impl Write,
) -> io::Result<()> {
    let [nx, ny] = solid.size;
    for side in solid.scanned_sides() {
        for j in 0..ny - 1 {
            let mut bytes = Vec::with_capacity(26 * nx);
            for i in 0..nx - 1 {
                let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
                let quad = facing(corners, *side).map(|[i, j]| numbers.on_side(*side, i, j));
                push_faces(&mut bytes, &split(quad, (i + j) % 2 == 1));
            }
            out.write_all(&bytes)?;
        }
    }
    let count = numbers.border.len();
    for ring in 0..solid.wall_rows() {
        let mut bytes = Vec::with_capacity(26 * count);
        for k in 0..count {
            let next = (k + 1) % count;
            let [low, high] = [ring + 1, ring];
            let quad = [(low, k), (low, next), (high, next), (high, k)]
                .map(|(ring, k)| numbers.on_ring(ring, k));
            push_faces(&mut bytes, &split(quad, false));
        }
        out.write_all(&bytes)?;
    }
    let start = numbers.support_start() as u32;
    let mut bytes = Vec::new();
    for triangle in &solid.support.triangles {
        push_faces(&mut bytes, &[triangle.map(|corner| corner + start)]);
    }
    out.write_all(&bytes)
}

fn push_faces(bytes: &mut Vec<u8>, faces: &[[u32; 3]]) {
    for face in faces {
        bytes.push(3);
        bytes.extend(face.iter().flat_map(|corner| corner.to_le_bytes()));
    }
}
