//! Reads a face between the pixels of its height map.

use super::align::CarvedFace;
use super::height_map::{HEIGHT_STEP_MM, NO_HEIGHT};
use super::relief::surface_height;

/// The four pixels around a point, each with its weight.
type Neighbours = [([i64; 2], f32); 4];

impl CarvedFace {
    /// Returns the soft strokes at a point of the face (u, v in mm), from 0 on carved ground to 1 on tops; `None` beside the
    /// height map and where nothing was scanned.
    pub fn strokes_at(&self, point: [f64; 2]) -> Option<f32> {
        self.mean(point, |[x, y]| {
            self.map.heights.get(x, y).filter(|h| *h != NO_HEIGHT)?;
            let soft = self.relief.soft.get(x, y)?;
            Some(f32::from(soft) / 255.0)
        })
    }

    /// Returns the height at a point of the face (u, v in mm) over the surface under the tops of the strokes, in mm; `None`
    /// where nothing was scanned.
    pub fn height_at(&self, point: [f64; 2]) -> Option<f32> {
        let height = self.height_in_frame(point)?;
        Some(height - surface_height(&self.map, &self.relief.surface, point))
    }

    /// Returns the point of the mesh at a point of the face (u, v in mm), in the mesh's own frame and unit; `None` where
    /// nothing was scanned.
    pub fn mesh_point(&self, point: [f64; 2]) -> Option<[f64; 3]> {
        let height = self.height_in_frame(point)?;
        Some(
            self.map
                .frame
                .mesh_from_face([point[0], point[1], f64::from(height)]),
        )
    }

    /// Returns the point of the mesh's frame at a point of the face (u, v in mm), at the height of the tops of the strokes.
    pub fn top_point(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let height = surface_height(&self.map, &self.relief.surface, [u, v]);
        self.map.frame.mesh_from_face([u, v, f64::from(height)])
    }

    /// Returns the height along the axis n of the frame, mm.
    fn height_in_frame(&self, point: [f64; 2]) -> Option<f32> {
        self.mean(point, |[x, y]| {
            let height = self.map.heights.get(x, y);
            height.filter(|height| *height != NO_HEIGHT)
        })
    }

    /// Returns the mean of the values around a point that exist, weighted by their nearness.
    fn mean(&self, point: [f64; 2], value: impl Fn([i64; 2]) -> Option<f32>) -> Option<f32> {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (pixel, share) in self.neighbours(point) {
            if let Some(value) = value(pixel) {
                sum += share * value;
                weight += share;
            }
        }
        (weight > 0.0).then(|| sum / weight)
    }

    fn neighbours(&self, point: [f64; 2]) -> Neighbours {
        let [x, y] = [0, 1].map(|k: usize| (point[k] - self.map.origin_mm[k]) / HEIGHT_STEP_MM);
        let (left, top) = (x.floor(), y.floor());
        let (across, down) = ((x - left) as f32, (y - top) as f32);
        let (left, top) = (left as i64, top as i64);
        // The largest integer wraps around to the smallest one: both are outside of the map.
        let (right, bottom) = (left.wrapping_add(1), top.wrapping_add(1));
        [
            ([left, top], (1.0 - across) * (1.0 - down)),
            ([right, top], across * (1.0 - down)),
            ([left, bottom], (1.0 - across) * down),
            ([right, bottom], across * down),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_world::TestWorld;

    #[test]
    fn points_far_away_and_points_that_are_no_numbers_have_no_height() {
        let face = TestWorld::new(12).face();
        assert!(face.height_at([40.0, 50.0]).is_some());
        let far = i64::MAX as f64;
        for odd in [1e300, -1e300, far, -far, f64::INFINITY, f64::NAN] {
            for point in [[odd, 50.0], [40.0, odd], [odd, odd]] {
                assert_eq!(face.height_at(point), None, "{point:?}");
                assert_eq!(face.strokes_at(point), None, "{point:?}");
                assert_eq!(face.mesh_point(point), None, "{point:?}");
            }
        }
    }
}
