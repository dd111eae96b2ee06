//! The heights of a face as they are stored: cropped, and rounded to half a micrometre.

use serde::{Deserialize, Serialize};

use super::face_layer::{FACE_CELL, find_face};
use super::height_map::{HEIGHT_STEP_MM, HeightMap, NO_HEIGHT};
use super::orientation::Orientation;
use mocban_core::raster::Grid;

/// Step of stored heights, mm.
const STORED_STEP_MM: f32 = 0.0005;
/// Stored value of [`NO_HEIGHT`].
const NOT_STORED: u16 = 0;

/// The stored form of the height map of a face.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredHeights {
    /// Position of the map, and what its values mean.
    pub header: HeightHeader,
    /// 0 where there is no face; others are multiples of 0.5 um over `low_mm`.
    pub values: Grid<u16>,
}

/// The numbers of [`StoredHeights`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeightHeader {
    /// The frame of the side.
    pub frame: Orientation,
    /// Coordinates u and v of the centre of the top-left pixel, mm.
    pub origin_mm: [f64; 2],
    /// Height of the value 0, mm, which itself means that there is no height.
    pub low_mm: f32,
}

impl HeightMap {
    /// Returns the face in this map for storage: cropped to it, without other heights, and rounded to 0.5 um. Returns `None`
    /// if no face is found.
    pub fn face(&self) -> Option<StoredHeights> {
        let face = find_face(self)?;
        let bounds = face.bounding_box()?;
        let (x0, y0) = (bounds.x0 * FACE_CELL, bounds.y0 * FACE_CELL);
        let size = [bounds.width() * FACE_CELL, bounds.height() * FACE_CELL];
        let is_face = |x: usize, y: usize| face.at(x / FACE_CELL, y / FACE_CELL);
        let middle = {
            let on_face = |(x, y): (usize, usize)| is_face(x, y).then(|| self.heights.at(x, y));
            let places = (0..size[1]).step_by(FACE_CELL).flat_map(|y| {
                (0..size[0])
                    .step_by(FACE_CELL)
                    .map(move |x| (x0 + x, y0 + y))
            });
            let mut heights: Vec<f32> = places.filter_map(on_face).collect();
            heights.retain(|height| *height != NO_HEIGHT);
            let middle = heights.len() / 2;
            (!heights.is_empty())
                .then(|| *heights.select_nth_unstable_by(middle, f32::total_cmp).1)?
        };
        let low_mm = middle - STORED_STEP_MM * 32_768.0;
        let value = |x: usize, y: usize| {
            let height = self.heights.at(x0 + x, y0 + y);
            if height == NO_HEIGHT || !is_face(x0 + x, y0 + y) {
                return NOT_STORED;
            }
            let steps = ((height - low_mm) / STORED_STEP_MM).round();
            if (1.0..=65_535.0).contains(&steps) {
                steps as u16
            } else {
                NOT_STORED
            }
        };
        Some(StoredHeights {
            header: HeightHeader {
                frame: self.frame,
                origin_mm: [
                    self.origin_mm[0] + x0 as f64 * HEIGHT_STEP_MM,
                    self.origin_mm[1] + y0 as f64 * HEIGHT_STEP_MM,
                ],
                low_mm,
            },
            values: Grid::from_fn(size[0], size[1], value),
        })
    }
}

impl From<&StoredHeights> for HeightMap {
    fn from(stored: &StoredHeights) -> Self {
        let HeightHeader {
            frame,
            origin_mm,
            low_mm,
        } = stored.header;
        let height = |value: &u16| match *value {
            NOT_STORED => NO_HEIGHT,
            value => low_mm + f32::from(value) * STORED_STEP_MM,
        };
        Self {
            frame,
            origin_mm,
            heights: stored.values.map(height),
        }
    }
}
