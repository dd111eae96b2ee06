//! The true alignment of the pairs that are cut from a block: one line of `truth.jsonl` each.

use nalgebra::{DMatrix, DVector};

use super::block_truth::{BlockCharacterTruth, BlockTruth};
use crate::scan_pose::TopsPlane;
use crate::truth_line::TruthLine;
use mocban_core::domain::{Affine2, PrintFromMesh, Rigid3, box_iou};

/// Least intersection over union of a box with the ink of a character that it belongs to.
const MIN_OVERLAP: f64 = 0.3;

impl BlockTruth {
    /// Returns the character whose ink best overlaps a box on the page (left, top, right, bottom, in pixels), or `None`
    /// if none does.
    pub fn character_at(&self, found: [f64; 4]) -> Option<&BlockCharacterTruth> {
        let overlaps = self.characters.iter().filter_map(|character| {
            let share = box_iou(character.box_px?, found);
            (share >= MIN_OVERLAP).then_some((character, share))
        });
        let best = overlaps.max_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(character, _)| character)
    }

    /// Returns the true alignment of the pair `id` of a character. `page_from_print` maps the pixels of its print to the
    /// page. It has no mask of the stroke tops, and the height of a flat character is half its width. Returns `None` if the
    /// page does not belong to the block or the landmarks lie on a line.
    pub fn pair(
        &self,
        id: &str,
        character: &BlockCharacterTruth,
        page_from_print: &Affine2,
    ) -> Option<TruthLine> {
        let print_from_page = page_from_print.inverse()?;
        let [left, top, right, bottom] = character.box_px?;
        let mut points = Vec::new();
        let mut values = [const { Vec::new() }; 3];
        for landmark in &character.landmarks {
            let [u, v, height] = Rigid3(self.face_from_mesh).apply(landmark.mesh);
            let [x, y] = print_from_page.apply(landmark.page?);
            points.push([u, v]);
            for (values, value) in values.iter_mut().zip([x, y, height]) {
                values.push(value);
            }
        }
        let [x, y, top_height] = values.map(|values| fitted(&points, &values));
        let (x, y, top_height) = (x?, y?, top_height?);
        let unit_mm = self.unit.mm();
        let [u, v, height, _] = self.face_from_mesh;
        let row = |[a, b, c]: [f64; 3]| {
            let mut row = [0, 1, 2, 3].map(|i| a * u[i] + b * v[i]);
            row[3] += c;
            row
        };
        // The height over the plane, divided by the length of its gradient, is the distance from it.
        let slope = row(top_height);
        let steepness = (1.0 + top_height[0].powi(2) + top_height[1].powi(2)).sqrt();
        let over = [0, 1, 2, 3].map(|i| (height[i] - slope[i]) / steepness / unit_mm);
        Some(TruthLine {
            id: id.to_owned(),
            print_from_mesh: PrintFromMesh([row(x), row(y), over]),
            plane: TopsPlane {
                n: [over[0], over[1], over[2]],
                d: over[3],
            },
            landmarks: character
                .landmarks
                .iter()
                .map(|landmark| landmark.mesh)
                .collect(),
            char_height_px: (bottom - top).max((right - left) / 2.0) * print_from_page.scale(),
            tops_mask: None,
        })
    }
}

/// Fits a + b u + c v to values at points by least squares; returns the factors of u and v and the constant.
fn fitted(points: &[[f64; 2]], values: &[f64]) -> Option<[f64; 3]> {
    let count = points.len() as f64;
    let middle = [0, 1].map(|i| points.iter().map(|point| point[i]).sum::<f64>() / count);
    let rows = DMatrix::from_fn(points.len(), 3, |row, column| match column {
        2 => 1.0,
        _ => points[row][column] - middle[column],
    });
    let normal = rows.transpose() * &rows;
    let right = rows.transpose() * DVector::from_column_slice(values);
    let solved = normal.cholesky()?.solve(&right);
    let (a, b) = (solved[0], solved[1]);
    Some([a, b, solved[2] - a * middle[0] - b * middle[1]])
}

#[cfg(test)]
mod tests {
    use crate::block::{BlockKind, BlockOptions, BlockWorld};
    use mocban_core::domain::Affine2;

    #[test]
    fn map_of_a_pair_leads_from_its_landmarks_to_the_print() {
        let truth = BlockWorld::new(BlockOptions {
            seed: 11,
            kind: BlockKind::Warp,
            spacing_mm: 3.0,
        })
        .truth();
        let page_from_print = Affine2([[1.0, 0.0, 700.0], [0.0, 1.0, 300.0]]);
        let shown = truth
            .characters
            .iter()
            .filter(|character| character.on_page);
        let mut checked = 0;
        for character in shown {
            let [x0, y0, x1, y1] = character.box_px.expect("ink on the page");
            let rough = [x0 - 3.0, y0 + 2.0, x1 + 1.0, y1 - 3.0];
            let found = truth.character_at(rough).expect("the character");
            assert_eq!(found.name, character.name);
            let pair = truth.pair("a", character, &page_from_print).expect("a map");
            for landmark in &character.landmarks {
                let [x, y, height] = pair.print_from_mesh.apply(landmark.mesh);
                let page = landmark.page.expect("on the page");
                assert!((x + 700.0 - page[0]).hypot(y + 300.0 - page[1]) < 0.3);
                assert!((height * truth.unit.mm()).abs() < 0.1, "{height}");
            }
            let normal: f64 = (0..3).map(|i| pair.plane.n[i] * truth.normal[i]).sum();
            let length: f64 = pair.plane.n.iter().map(|c| c * c).sum();
            assert!(normal > 0.99 && (length - 1.0).abs() < 1e-9);
            checked += 1;
        }
        assert!(checked > 80);
        assert!(truth.character_at([-50.0, -50.0, -10.0, -10.0]).is_none());
    }
}
