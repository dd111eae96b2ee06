//! True alignments of pairs whose box on the page of their block was changed: the print is another crop of the page.

use super::ground_truth::{TruthError, TruthRecord};
use mocban_catalog::PrintPlace;
use mocban_core::domain::Affine2;

/// Least share of the landmarks in a box that still shows the character.
const MIN_SHARE_INSIDE: f64 = 0.5;

impl TruthRecord {
    /// Returns the true alignment for the current crop of the page. Pixels of a crop are pixels of the page, so a change of the
    /// crop changes the map exactly.
    ///
    /// # Errors
    /// Returns an error if the crop of the record is not known, if its mask is of another crop, or if less than half of the
    /// landmarks lie in the box.
    pub fn in_crop(mut self, place: &PrintPlace) -> Result<Self, TruthError> {
        let known = self.page_from_crop.ok_or(TruthError::UnknownCrop)?;
        if known == place.page_from_crop {
            return Ok(self);
        }
        if self.tops_mask.is_some() {
            return Err(TruthError::OtherCrop);
        }
        let [known, current] =
            [known, place.page_from_crop].map(|[first, second, _]| Affine2([first, second]));
        if self.share_inside(&known, place.bounds) < MIN_SHARE_INSIDE {
            return Err(TruthError::OtherCharacter);
        }
        let moved = current.inverse().ok_or(TruthError::Flat)?.after(&known);
        self.print_from_mesh = self.print_from_mesh.in_image(&moved);
        self.char_height_px *= moved.scale();
        self.page_from_crop = Some(place.page_from_crop);
        Ok(self)
    }

    /// Returns the share of the landmarks whose true place on the page lies in a box: left, top, right, bottom.
    fn share_inside(&self, page_from_crop: &Affine2, [left, top, right, bottom]: [f64; 4]) -> f64 {
        let is_inside = |point: &&[f64; 3]| {
            let [x, y, _] = self.print_from_mesh.apply(**point);
            let [x, y] = page_from_crop.apply([x, y]);
            (left..=right).contains(&x) && (top..=bottom).contains(&y)
        };
        let inside = self.landmarks.iter().filter(is_inside).count();
        inside as f64 / self.landmarks.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::{TruthError, TruthRecord};
    use mocban_catalog::PrintPlace;
    use mocban_core::domain::{Affine2, PrintFromMesh};

    const fn shifted([x, y]: [f64; 2]) -> [[f64; 3]; 3] {
        [[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]]
    }

    /// A character of 40 pixels at (120, 220) to (160, 260) on the page, in a crop that begins at (100, 200).
    fn record() -> TruthRecord {
        TruthRecord::read(&serde_json::json!({
            "id": "b_a",
            "print_from_mesh": [[10.0, 0.0, 0.0, 20.0], [0.0, 10.0, 0.0, 20.0], [0.0, 0.0, 1.0, 0.0]],
            "plane": { "n": [0.0, 0.0, 1.0], "d": 0.0 },
            "landmarks": [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [4.0, 4.0, 0.0]],
            "char_height_px": 40.0,
            "page_from_crop": shifted([100.0, 200.0]),
        }))
        .expect("the record is whole")
    }

    fn place(page_from_crop: [[f64; 3]; 3], bounds: [f64; 4]) -> PrintPlace {
        PrintPlace {
            page_from_crop,
            bounds,
        }
    }

    #[test]
    fn a_record_follows_its_box() {
        let record = record();
        let same = place(shifted([100.0, 200.0]), [0.0; 4]);
        assert_eq!(record.clone().in_crop(&same), Ok(record.clone()));
        let wider = place(shifted([70.0, 190.0]), [90.0, 210.0, 170.0, 270.0]);
        let found = record.print_from_mesh;
        let before = record.clone().measure(&found, None).expect("usable");
        assert_eq!(before.tre_pct, 0.0);
        // The result of the wider crop is right by the moved record, and was wrong by the record of the old crop.
        let found = found.in_image(&Affine2::scale_shift(1.0, [30.0, 10.0]));
        let wrong = record.measure(&found, None).expect("usable");
        assert!(wrong.tre_pct > 50.0 && !wrong.pass(), "{wrong:?}");
        let moved = record.in_crop(&wider).expect("the same character");
        let right = moved.measure(&found, None).expect("usable");
        assert!(right.tre_pct < 1e-9 && right.pass(), "{right:?}");
    }

    #[test]
    fn a_record_follows_a_crop_that_is_turned() {
        let turned = [[0.0, -1.0, 180.0], [1.0, 0.0, 200.0], [0.0, 0.0, 1.0]];
        let box_px = [110.0, 210.0, 170.0, 270.0];
        let moved = record().in_crop(&place(turned, box_px));
        let moved = moved.expect("the same character");
        // The pixel (120, 220) of the page.
        let [x, y, _] = moved.print_from_mesh.apply([0.0; 3]);
        assert_eq!([180.0 - y, 200.0 + x], [120.0, 220.0]);
        assert_eq!(moved.char_height_px, 40.0);
    }

    #[test]
    fn a_record_of_another_or_an_unknown_crop_is_refused() {
        let other = place(shifted([300.0, 200.0]), [320.0, 220.0, 360.0, 260.0]);
        let refused = record().in_crop(&other);
        assert_eq!(refused, Err(TruthError::OtherCharacter));
        let wider = place(shifted([70.0, 190.0]), [90.0, 210.0, 170.0, 270.0]);
        let unknown = TruthRecord {
            page_from_crop: None,
            ..record()
        };
        assert_eq!(unknown.in_crop(&wider), Err(TruthError::UnknownCrop));
        let with_mask = TruthRecord {
            tops_mask: Some("tops.png".to_owned()),
            ..record()
        };
        assert_eq!(with_mask.in_crop(&wider), Err(TruthError::OtherCrop));
        let flat = TruthRecord {
            print_from_mesh: PrintFromMesh([[0.0; 4]; 3]),
            ..record()
        };
        assert_eq!(flat.in_crop(&wider), Err(TruthError::OtherCharacter));
    }
}
