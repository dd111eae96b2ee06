//! Writes the mesh of a block as binary STL.

use std::io::{self, Write};

use rayon::prelude::*;

use super::facets::{BAND, facing, split, triangle_count};
use super::solid::BlockSolid;

/// Writes the mesh of a block: the sides row by row, then walls and support.
pub(super) fn write_stl(solid: &BlockSolid, out: &mut impl Write) -> io::Result<()> {
    let mut header = [0; 80];
    let title = b"carved block";
    header[..title.len()].copy_from_slice(title);
    out.write_all(&header)?;
    out.write_all(&(triangle_count(solid) as u32).to_le_bytes())?;
    let [nx, ny] = solid.size;
    for side in solid.scanned_sides() {
        for first in (0..ny - 1).step_by(BAND) {
            let end = (first + BAND).min(ny - 1);
            let rows = solid.rows(*side, first..end + 1);
            let facets: Vec<Vec<u8>> = (first..end)
                .into_par_iter()
                .map(|j| {
                    let (low, high) = (&rows[j - first], &rows[j - first + 1]);
                    let mut bytes = Vec::with_capacity(100 * nx);
                    for i in 0..nx - 1 {
                        let quad = facing([low[i], low[i + 1], high[i + 1], high[i]], *side);
                        push_facets(&mut bytes, split(quad, (i + j) % 2 == 1));
                    }
                    bytes
                })
                .collect();
            facets.iter().try_for_each(|bytes| out.write_all(bytes))?;
        }
    }
    if solid.wall_rows() > 0 {
        for pair in solid.rings().windows(2) {
            let [high, low] = [&pair[0], &pair[1]];
            let mut bytes = Vec::with_capacity(100 * high.len());
            for k in 0..high.len() {
                let next = (k + 1) % high.len();
                let quad = [low[k], low[next], high[next], high[k]];
                push_facets(&mut bytes, split(quad, false));
            }
            out.write_all(&bytes)?;
        }
    }
    let points = solid.support_points();
    let mut bytes = Vec::new();
    for triangle in &solid.support.triangles {
        push_facet(&mut bytes, triangle.map(|corner| points[corner as usize]));
    }
    out.write_all(&bytes)
}

fn push_facets(bytes: &mut Vec<u8>, facets: [[[f32; 3]; 3]; 2]) {
    for facet in facets {
        push_facet(bytes, facet);
    }
}

fn push_facet(bytes: &mut Vec<u8>, facet: [[f32; 3]; 3]) {
    let [a, b, c] = facet;
    let edge = |p: [f32; 3], q: [f32; 3]| [0, 1, 2].map(|i| f64::from(q[i]) - f64::from(p[i]));
    let (one, two) = (edge(a, b), edge(a, c));
    let cross = [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        one[j] * two[k] - one[k] * two[j]
    });
    let length = cross.iter().map(|c| c * c).sum::<f64>().sqrt().max(1e-30);
    let mut record = [0_u8; 50];
    let numbers = cross.map(|c| (c / length) as f32);
    let numbers = numbers.into_iter().chain(facet.into_iter().flatten());
    for (target, number) in record.as_chunks_mut::<4>().0.iter_mut().zip(numbers) {
        *target = number.to_le_bytes();
    }
    bytes.extend_from_slice(&record);
}
