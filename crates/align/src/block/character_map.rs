//! The map from the scan to the page at one character.

use super::align::CarvedFace;
use super::characters::PlacedCharacter;
use super::page_map::PageMap;
use super::relief::surface_height;
use mocban_core::domain::{Affine2, PrintFromMesh};

/// Step of the rounded pixels, as a part of the longer edge of the character's box in whole pixels: a box that another
/// program wrote with fewer digits gets the same step.
const ROUNDED_PART: f64 = 0.002;
/// Step of the point at which a rounded map is linearized, mm.
const ROUNDED_MM: f64 = 1.0;

/// The affine map at the middle of a character.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharacterMap {
    /// Row 1 and 2 give the pixel of the page of a point `[x, y, z, 1]` of the mesh, row 3 its height over the tops of the
    /// strokes in mesh units.
    pub page_from_mesh: PrintFromMesh,
}

impl CharacterMap {
    /// Linearizes the map of a face to its page at the middle of a character.
    pub fn of(face: &CarvedFace, map: &PageMap, character: &PlacedCharacter) -> Self {
        let middle = middle_mm(character);
        let page = map.page_from_face(middle);
        Self::linear(face, middle, page, map.derivative(middle))
    }

    /// Like [`Self::of`], but rounded, so that the map changes an edge of the box by at most 0.3 % of its length. When other
    /// boxes of the page change, the map of the face changes everywhere by a small part of a pixel, and the rounded map of
    /// a character usually stays equal. `px_per_mm` is the resolution of the page.
    pub fn rounded(
        face: &CarvedFace,
        map: &PageMap,
        character: &PlacedCharacter,
        px_per_mm: f64,
    ) -> Self {
        let [left, top, right, bottom] = character.label.page_box;
        let longer = (right - left).max(bottom - top).round();
        let round = |value: f64, step: f64| (value / step).round() * step;
        let middle = middle_mm(character).map(|at| round(at, ROUNDED_MM));
        let page = map.page_from_face(middle);
        let page = page.map(|at| round(at, ROUNDED_PART * longer));
        // Over half an edge, such a step of the slope moves a pixel by a step of the position.
        let slope_step = 2.0 * ROUNDED_PART * px_per_mm;
        let derivative = map.derivative(middle);
        let derivative = derivative.map(|row| row.map(|slope| round(slope, slope_step)));
        Self::linear(face, middle, page, derivative)
    }

    /// Returns the map with these page pixels at a point of the face in mm, and with these slopes in pixels per mm.
    fn linear(
        face: &CarvedFace,
        middle: [f64; 2],
        page: [f64; 2],
        derivative: [[f64; 2]; 2],
    ) -> Self {
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
            page_from_mesh: PrintFromMesh(rows),
        }
    }

    /// Returns the same map to the pixels of a crop of the page; `None` if the crop has no inverse.
    pub fn print_from_mesh(&self, page_from_crop: &Affine2) -> Option<PrintFromMesh> {
        let crop_from_page = page_from_crop.inverse()?;
        Some(self.page_from_mesh.in_image(&crop_from_page))
    }
}

/// Returns the middle of a character on the face, mm.
fn middle_mm(character: &PlacedCharacter) -> [f64; 2] {
    let [u0, v0, u1, v1] = character.face_box;
    [f64::midpoint(u0, u1), f64::midpoint(v0, v1)]
}

#[cfg(test)]
mod tests {
    use super::super::test_world::{SIDES_MM, TestWorld};
    use super::CharacterMap;
    use crate::block::{CharacterBox, PageMap, Support, place_characters};
    use mocban_core::domain::Affine2;

    #[test]
    fn mesh_points_near_the_character_get_the_page_pixels_of_the_map() {
        let world = TestWorld::new(21);
        let face = world.face();
        let affine = Affine2::similarity(8.0, 0.03, [60.0, 30.0]);
        let page = world.affine_page([1300, 900], &affine);
        let map = PageMap::affine(&affine, [0.0; 2], SIDES_MM);
        let [x, y] = affine.apply([68.75, 43.75]);
        let label = CharacterBox {
            name: "a".to_owned(),
            text: None,
            page_box: [x - 45.0, y - 45.0, x + 45.0, y + 45.0],
        };
        let support = Support {
            origin_mm: [0.0; 2],
            columns: 16,
            percent: vec![100; 16 * 11],
        };
        let placed = place_characters(&face, &page, (&map, &support), &[label]);
        let character = &placed.characters[0];
        assert!(character.confidence > 0.9, "{character:?}");
        let local = CharacterMap::of(&face, &map, character);
        // The frame of the mesh is that of the face.
        let tops = super::surface_height(&face.map, &face.relief.surface, [68.75, 43.75]);
        let [px, py, height] = local
            .page_from_mesh
            .apply([70.0, 42.0, f64::from(tops) - 1.5]);
        let expected = affine.apply([70.0, 42.0]);
        assert!((px - expected[0]).abs() < 0.01 && (py - expected[1]).abs() < 0.01);
        assert!((height + 1.5).abs() < 0.02, "{height}");
        let crop = Affine2([[0.0, -1.0, 900.0], [1.0, 0.0, 40.0]]);
        let in_crop = local.print_from_mesh(&crop).unwrap();
        let [cx, cy, _] = in_crop.apply([70.0, 42.0, 0.0]);
        let [bx, by] = crop.apply([cx, cy]);
        assert!((bx - px).abs() < 1e-6 && (by - py).abs() < 1e-6);
    }

    #[test]
    fn a_rounded_map_is_near_and_hardly_ever_changes_with_the_map_of_the_face() {
        let world = TestWorld::new(21);
        let face = world.face();
        let px_per_mm = 8.0;
        let support = Support {
            origin_mm: [0.0; 2],
            columns: 16,
            percent: vec![100; 16 * 11],
        };
        let label = CharacterBox {
            name: "a".to_owned(),
            text: None,
            page_box: [550.0, 350.0, 640.0, 450.0],
        };
        let [mut changed, mut unlike] = [0, 0];
        for k in 0..40 {
            let maps = [0.0, 0.003].map(|shift| {
                let turn = 0.03 + 0.002 * f64::from(k);
                let affine = Affine2::similarity(px_per_mm, turn, [60.0 + shift, 30.0 - shift]);
                PageMap::affine(&affine, [0.0; 2], SIDES_MM)
            });
            let page =
                world.affine_page([1300, 900], &Affine2::similarity(8.0, 0.03, [60.0, 30.0]));
            let placed = place_characters(
                &face,
                &page,
                (&maps[0], &support),
                std::slice::from_ref(&label),
            );
            let character = &placed.characters[0];
            let [here, there] = [&maps[0], &maps[1]]
                .map(|map| CharacterMap::rounded(&face, map, character, px_per_mm));
            changed += u32::from(here != there);
            let exact = CharacterMap::of(&face, &maps[0], character);
            unlike += u32::from(here != exact);
            let [u0, v0, u1, v1] = character.face_box;
            for point in [[u0, v0], [u0, v1], [u1, v0], [u1, v1]] {
                let [x, y, _] = exact.page_from_mesh.apply([point[0], point[1], 0.0]);
                let [near_x, near_y, _] = here.page_from_mesh.apply([point[0], point[1], 0.0]);
                let error = (near_x - x).abs().max((near_y - y).abs());
                // 0.3 % of 100 px, and the rotation of the box.
                assert!(error <= 0.33, "{error}");
            }
        }
        assert!(changed <= 8 && unlike == 40, "{changed} {unlike}");
    }
}
