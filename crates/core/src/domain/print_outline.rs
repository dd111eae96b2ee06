//! Outline of the part of a print that shows the character of a pair.

use serde::{Deserialize, Serialize};

use super::Affine2;

/// A convex polygon in pixels of the print image. The print shows the character of the pair inside it and other
/// characters outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PrintOutline {
    /// Corners in order, at least three.
    pub corners: Vec<[f64; 2]>,
}

impl PrintOutline {
    /// Returns the convex hull of points in pixels, or `None` if all points lie on one line.
    ///
    /// # Examples
    /// ```
    /// use mocban_core::domain::PrintOutline;
    ///
    /// let points = [[0.0, 0.0], [4.0, 0.0], [2.0, 1.0], [4.0, 4.0], [0.0, 4.0]];
    /// let square = PrintOutline::around(&points).ok_or("a line")?;
    /// assert_eq!(square.corners.len(), 4);
    /// assert_eq!(square.columns_in_row(1.0), Some([0.0, 4.0]));
    /// assert_eq!(square.columns_in_row(5.0), None);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn around(points: &[[f64; 2]]) -> Option<Self> {
        let mut sorted = points.to_vec();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let mut corners = half_hull(sorted.iter().copied());
        corners.extend(half_hull(sorted.into_iter().rev()));
        (corners.len() >= 3).then_some(Self { corners })
    }

    /// Returns the first and the last column inside the outline in a row, or `None` if the row lies outside.
    pub fn columns_in_row(&self, y: f64) -> Option<[f64; 2]> {
        let next = self.corners.iter().cycle().skip(1);
        let mut columns: Option<[f64; 2]> = None;
        for ([x0, y0], [x1, y1]) in self.corners.iter().zip(next) {
            if y < y0.min(*y1) || y > y0.max(*y1) {
                continue;
            }
            let ends = if y0 == y1 {
                [*x0, *x1]
            } else {
                [x0 + (x1 - x0) * (y - y0) / (y1 - y0); 2]
            };
            let [low, high] = columns.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
            columns = Some([
                low.min(ends[0]).min(ends[1]),
                high.max(ends[0]).max(ends[1]),
            ]);
        }
        columns
    }

    /// Returns the outline in another frame. The map must not mirror.
    #[must_use]
    pub fn mapped(&self, map: &Affine2) -> Self {
        Self {
            corners: self
                .corners
                .iter()
                .map(|corner| map.apply(*corner))
                .collect(),
        }
    }

    /// Returns the lowest and the highest coordinates of the corners.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for corner in &self.corners {
            for k in 0..2 {
                bounds[0][k] = bounds[0][k].min(corner[k]);
                bounds[1][k] = bounds[1][k].max(corner[k]);
            }
        }
        bounds
    }
}

/// Returns one half of the convex hull of points sorted along x, without its last corner (Andrew's monotone chain).
fn half_hull(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for point in points {
        while let [.., a, b] = hull[..]
            && (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) <= 0.0
        {
            hull.pop();
        }
        hull.push(point);
    }
    hull.pop();
    hull
}

#[cfg(test)]
mod tests {
    use super::PrintOutline;

    #[test]
    fn points_on_a_line_have_no_outline() {
        let line: Vec<[f64; 2]> = (0..5).map(|k| [f64::from(k), f64::from(2 * k)]).collect();
        assert_eq!(PrintOutline::around(&line), None);
        assert_eq!(PrintOutline::around(&[]), None);
    }

    #[test]
    fn hull_contains_all_points_and_only_the_outer_ones_are_corners() {
        let points: Vec<[f64; 2]> = (0..400)
            .map(|k| {
                [f64::from(k * 37 % 101), f64::from(k * 53 % 97)]
                    .map(|v| v - 0.3 * f64::from(k % 7))
            })
            .collect();
        let outline = PrintOutline::around(&points).expect("an area");
        for [x, y] in &points {
            let [low, high] = outline.columns_in_row(*y).expect("a row of the hull");
            assert!(low - 1e-9 <= *x && *x <= high + 1e-9, "{x}, {y}");
        }
        assert!(outline.corners.iter().all(|corner| points.contains(corner)));
        assert!(outline.corners.len() < 40);
        let [low, high] = outline.bounds();
        for k in 0..2 {
            let least = points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
            let most = points
                .iter()
                .map(|p| p[k])
                .fold(f64::NEG_INFINITY, f64::max);
            assert_eq!([low[k], high[k]], [least, most]);
        }
    }
}
