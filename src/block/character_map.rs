//! The map from the scan to the page at one character.

use super::align::Face;
use super::characters::PlacedCharacter;
use super::page_map::PageMap;
use super::relief::surface_height;
use crate::domain::Affine2;

/// The affine map at the middle of a character.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharacterMap {
    /// Row 1 and 2 give the pixel of the page of a point `[x, y, z, 1]` of the mesh, row 3 its height over the tops of the
    /// strokes in mesh units.
    pub page_from_mesh: [[f64; 4]; 3],
}

impl CharacterMap {
    /// Linearizes the map of a face to its page at the middle of a character.
    pub fn of(face: &Face, map: &PageMap, character: &PlacedCharacter) -> Self {
        let [u0, v0, u1, v1] = character.face_box;
        let middle = [f64::midpoint(u0, u1), f64::midpoint(v0, v1)];
        let page = map.page_from_face(middle);
        let derivative = map.derivative(middle);
        let frame = &face.map.frame;
        let mut rows = [[0.0; 4]; 3];
        // face = axes (point - centre) mm; page = page(middle) + derivative (face - middle).
        for (row, (slope, at)) in rows.iter_mut().zip(derivative.iter().zip(page)) {
            row[3] = at;
            for k in 0..2 {
                row[3] -= slope[k] * middle[k];
                for axis in 0..3 {
                    let step = slope[k] * frame.axes[k][axis] * frame.mm;
                    row[axis] += step;
                    row[3] -= step * frame.centre[axis];
                }
            }
        }
        let tops = f64::from(surface_height(&face.map, &face.relief.surface, middle));
        rows[2][3] = -tops / frame.mm;
        for axis in 0..3 {
            rows[2][axis] = frame.axes[2][axis];
            rows[2][3] -= frame.axes[2][axis] * frame.centre[axis];
        }
        Self {
            page_from_mesh: rows,
        }
    }

    /// Returns the same map to the pixels of a crop of the page; `None` if the crop has no inverse.
    pub fn print_from_mesh(&self, page_from_crop: &Affine2) -> Option<[[f64; 4]; 3]> {
        let crop_from_page = page_from_crop.inverse()?.0;
        let mut rows = self.page_from_mesh;
        for (row, [a, b, c]) in rows.iter_mut().zip(crop_from_page) {
            for axis in 0..4 {
                row[axis] = a * self.page_from_mesh[0][axis] + b * self.page_from_mesh[1][axis];
            }
            row[3] += c;
        }
        Some(rows)
    }
}
