//! The depth stage (paper III-B): renders the mesh along the plane's normal. Each pixel gets the highest hit.

use serde::{Deserialize, Serialize};

use super::Scan;
use super::zbuffer::{IndexedSurface, LARGEST_OVERLAP, NO_HIT, Viewport};
use mocban_core::domain::cancel::poll;
use mocban_core::domain::{DepthScale, FailureClass, FitOutcome, LengthUnit};
use mocban_core::raster::{DepthMap, Grid};
use mocban_core::simd::{dispatch, max_f32, min_f32};

/// Raised by every change of the code that may change results.
pub const REVISION: u32 = 5;

/// Limit for the longest side of a depth map, in pixels. A square map of this size has 268 million pixels.
const LONGEST_PX_LIMIT: f64 = 16_384.0;
/// Pixels of a side that are not covered by the scan.
const BORDER_PX: f64 = 3.0;

/// What sets the size of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResolutionBy {
    /// The map's longest side has `longest_px` pixels.
    LongestSide,
    /// A millimetre has `px_per_mm` pixels; the mesh's unit must be known.
    PxPerMm,
}

/// Settings of the depth stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthParams {
    /// What sets the size of a pixel.
    pub resolution_by: ResolutionBy,
    /// Longest side of the map in pixels, 32..=16384.
    pub longest_px: u32,
    /// Pixels per millimetre, above 0.
    pub px_per_mm: f64,
}

impl DepthParams {
    /// Returns the largest number of pixels of a map of a scan that is at most `longest_mm` long.
    ///
    /// ```
    /// use mocban_align::stages::depth::{DepthParams, ResolutionBy};
    ///
    /// let by_side = DepthParams { resolution_by: ResolutionBy::LongestSide, longest_px: 512, px_per_mm: 10.0 };
    /// assert_eq!(by_side.max_pixels(40.0), 512 * 512);
    /// let by_mm = DepthParams { resolution_by: ResolutionBy::PxPerMm, ..by_side };
    /// assert_eq!(by_mm.max_pixels(40.0), 403 * 403);
    /// assert_eq!(by_mm.max_pixels(1e9), 16_384 * 16_384);
    /// ```
    pub fn max_pixels(&self, longest_mm: f64) -> u64 {
        let longest_px = match self.resolution_by {
            ResolutionBy::LongestSide => f64::from(self.longest_px),
            ResolutionBy::PxPerMm => longest_mm * self.px_per_mm + BORDER_PX,
        };
        (longest_px.min(LONGEST_PX_LIMIT).ceil() as u64).pow(2)
    }
}

/// Doubles of this magnitude (2^52) have no fraction bits, and their lowest bits are the bits of an integer.
const INTEGER_BIAS: f64 = 4_503_599_627_370_496.0;

/// Why the depth stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DepthError {
    /// Pixels per millimetre were requested for a mesh of unknown unit.
    #[error(
        "depth.resolution_by is px_per_mm but the unit of the mesh is not known; give it in the manifest"
    )]
    UnitUnknown,
    /// The map would be too large.
    #[error(
        "depth map would be {longest_px:.0} px long, more than {LONGEST_PX_LIMIT}; lower depth.px_per_mm or check the unit"
    )]
    TooLarge {
        /// Requested longest side in pixels.
        longest_px: f64,
    },
    /// Large triangles overlap too often to be drawn.
    #[error(
        "its {0} triangles overlap more than {LARGEST_OVERLAP} times, or most are slivers across the scan; remove repeated \
         faces or remesh the scan"
    )]
    Overlap(usize),
    /// No ray meets the surface.
    #[error("no ray along the plane's normal meets the mesh")]
    NothingSeen,
}

impl DepthError {
    /// Returns what the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::UnitUnknown | Self::TooLarge { .. } | Self::Overlap(_) => FailureClass::BadInput,
            Self::NothingSeen => FailureClass::NoSolution,
        }
    }
}

/// Renders the heights over the fitted surface, mirrored so that the map reads like the print.
///
/// If the fit found a region, the rest of the scan is not rendered.
///
/// A pixel gets level 0 ("no data") if the ray through its centre misses the mesh. Other levels, 1..=65535, are linear
/// in the height of the highest hit, see [`DepthScale`]. `unit` is the unit of the mesh, if known.
///
/// # Errors
/// Returns an error if pixels per millimetre are set but `unit` is `None`, the map is too large, or no ray hits.
pub fn depth(
    scan: &Scan,
    fit: &FitOutcome,
    unit: Option<LengthUnit>,
    params: &DepthParams,
) -> Result<DepthMap, DepthError> {
    let part;
    let indexed = if let Some(region) = &fit.region {
        part = scan.mesh_in(region);
        if part.vertices.is_empty() {
            return Err(DepthError::NothingSeen);
        }
        &IndexedSurface::new(&part)
    } else {
        scan.indexed()
    };
    let bounds = indexed.bounds(&fit.plane_from_mesh);
    let view = Viewport::around(bounds, longest_px(bounds, unit, params)?, true);
    let plane_from_px = view
        .px_from_plane
        .inverse()
        .ok_or(DepthError::NothingSeen)?;
    let mut heights = indexed.render(&fit.plane_from_mesh, &view);
    if indexed.overlaps_too_often() {
        return Err(DepthError::Overlap(scan.mesh().triangles.len()));
    }
    if let Some(curvature) = &fit.curvature {
        let rows = heights.data_mut().chunks_exact_mut(view.width);
        dispatch!({
            for (y, row) in rows.enumerate() {
                poll();
                // Conversions from 32-bit integers to floats are vectorized.
                for (x, height) in (0_i32..).zip(row) {
                    let [u, v] = plane_from_px.apply([f64::from(x), y as f64]);
                    *height -= curvature.height(u, v) as f32;
                }
            }
        });
    }
    let (levels, height_min, height_per_level) =
        quantize(&heights).ok_or(DepthError::NothingSeen)?;
    Ok(DepthMap {
        levels,
        scale: DepthScale {
            height_min,
            height_per_level,
            mesh_unit_per_px: view.unit_per_px,
            depth_from_plane: view.px_from_plane,
            curvature: fit.curvature,
            unit,
        },
    })
}

/// Returns the longest side of the map in pixels. The bounds are in mesh units.
fn longest_px(
    [low, high]: [[f64; 2]; 2],
    unit: Option<LengthUnit>,
    params: &DepthParams,
) -> Result<usize, DepthError> {
    let longest_px = match params.resolution_by {
        ResolutionBy::LongestSide => f64::from(params.longest_px),
        ResolutionBy::PxPerMm => {
            let mm = unit.ok_or(DepthError::UnitUnknown)?.mm();
            (high[0] - low[0]).max(high[1] - low[1]) * mm * params.px_per_mm + BORDER_PX
        }
    };
    if longest_px > LONGEST_PX_LIMIT {
        return Err(DepthError::TooLarge { longest_px });
    }
    Ok((longest_px.round() as usize).max(8))
}

/// Quantizes heights to levels 1..=65535. Returns the levels, the height of level 1 and the height per level. Returns
/// `None` if no pixel holds data.
fn quantize(heights: &Grid<f32>) -> Option<(Grid<u16>, f64, f64)> {
    let [low, high] = range(heights)?.map(f64::from);
    let step = ((high - low) / 65_534.0).max(f64::from(f32::MIN_POSITIVE));
    let width = heights.width();
    let mut levels = Grid::new(width, heights.height(), 0);
    let rows = levels.data_mut().chunks_exact_mut(width);
    dispatch!({
        for (levels, heights) in rows.zip(heights.data().chunks_exact(width)) {
            poll();
            for (level, z) in levels.iter_mut().zip(heights) {
                let steps = ((f64::from(*z) - low) / step).clamp(0.0, 65_534.0);
                // Rounds half up, with additions alone.
                let near = (steps + INTEGER_BIAS) - INTEGER_BIAS;
                let up = if steps - near >= 0.5 { 1.0 } else { 0.0 };
                let nearest = (near + up + 1.0 + INTEGER_BIAS).to_bits() as u16;
                *level = if *z == NO_HIT { 0 } else { nearest };
            }
        }
    });
    Some((levels, low, step))
}

/// Returns the lowest and the highest height. Returns `None` if no pixel holds data.
fn range(heights: &Grid<f32>) -> Option<[f32; 2]> {
    // Computes the extremes of each column first. This loop is vectorized; one minimum over all pixels would not be.
    let width = heights.width();
    let (mut lows, mut highs) = (vec![f32::INFINITY; width], vec![NO_HIT; width]);
    for row in heights.data().chunks_exact(width) {
        poll();
        for ((low, high), z) in lows.iter_mut().zip(&mut highs).zip(row) {
            *low = min_f32(if *z == NO_HIT { f32::INFINITY } else { *z }, *low);
            *high = max_f32(*z, *high);
        }
    }
    let low = lows.into_iter().fold(f32::INFINITY, f32::min);
    let high = highs.into_iter().fold(NO_HIT, f32::max);
    (high != NO_HIT).then_some([low, high])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{DepthError, DepthParams, NO_HIT, ResolutionBy, depth, quantize};
    use crate::stages::Scan;
    use mocban_core::domain::{Curvature, FitOutcome, LengthUnit, Rigid3, ScanRegion, test_values};
    use mocban_core::mesh::Mesh;
    use mocban_core::raster::Grid;

    fn params() -> DepthParams {
        DepthParams {
            resolution_by: ResolutionBy::LongestSide,
            longest_px: 64,
            px_per_mm: 10.0,
        }
    }

    /// A 10 x 6 sheet whose height is `0.1 x`, in a grid of 21 x 13 vertices.
    fn ramp() -> Scan {
        let mut mesh = Mesh::default();
        for j in 0..13_u32 {
            for i in 0..21_u32 {
                let (x, y) = (f64::from(i) * 0.5, f64::from(j) * 0.5);
                mesh.vertices.push([x, y, 0.1 * x]);
                if i > 0 && j > 0 {
                    let k = j * 21 + i;
                    mesh.triangles.push([k - 22, k - 21, k]);
                    mesh.triangles.push([k - 22, k, k - 1]);
                }
            }
        }
        mesh.into()
    }

    fn flat_fit(curvature: Option<Curvature>) -> FitOutcome {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        FitOutcome {
            curvature,
            ..test_values::flat_fit(Rigid3::to_frame(axes, [0.0; 3]))
        }
    }

    proptest! {
        #[test]
        fn levels_equal_rounded_shares_of_the_range(
            heights in proptest::collection::vec(prop_oneof![4 => -3.0..5.0_f32, 1 => Just(NO_HIT)], 1..90),
        ) {
            let seen: Vec<f64> = heights.iter().filter(|z| **z != NO_HIT).map(|z| f64::from(*z)).collect();
            let grid = Grid::from_vec(heights.len(), 1, heights.clone()).expect("a row");
            let Some((levels, low, step)) = quantize(&grid) else {
                prop_assert!(seen.is_empty());
                return Ok(());
            };
            prop_assert_eq!(low, seen.iter().copied().fold(f64::INFINITY, f64::min));
            let high = seen.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            prop_assert_eq!(step, ((high - low) / 65_534.0).max(f64::from(f32::MIN_POSITIVE)));
            for (z, level) in heights.iter().zip(levels.data()) {
                let rounded = ((f64::from(*z) - low) / step).round().clamp(0.0, 65_534.0) as u16;
                prop_assert_eq!(*level, if *z == NO_HIT { 0 } else { 1 + rounded });
            }
        }
    }

    #[test]
    fn heights_are_right_and_the_map_is_mirrored() {
        let map = depth(&ramp(), &flat_fit(None), None, &params()).expect("the ramp is seen");
        let to_px = map.scale.depth_from_plane;
        for (x, y) in [(1.0, 1.0), (5.0, 3.0), (9.0, 5.0)] {
            let [u, v] = to_px.apply([x, y]);
            let (column, row) = (u.round() as usize, v.round() as usize);
            let [px, _] = to_px
                .inverse()
                .expect("a view")
                .apply([column as f64, row as f64]);
            let height = map.height(column, row).expect("inside the sheet");
            assert!((height - 0.1 * px).abs() < 1e-4);
        }
        assert!(to_px.apply([9.0, 1.0])[0] < to_px.apply([1.0, 1.0])[0]);
    }

    #[test]
    fn heights_are_measured_from_the_bow() {
        let curvature = Curvature([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]);
        let map =
            depth(&ramp(), &flat_fit(Some(curvature)), None, &params()).expect("the ramp is seen");
        for y in 0..map.levels.height() {
            for x in 0..map.levels.width() {
                assert!(map.height(x, y).is_none_or(|h| h.abs() < 1e-5));
            }
        }
    }

    #[test]
    fn faces_outside_the_region_are_not_rendered() {
        let fit = FitOutcome {
            region: Some(ScanRegion {
                box_from_mesh: flat_fit(None).plane_from_mesh,
                bounds: [[1.9, -1.0, -1.0], [6.1, 7.0, 0.61]],
            }),
            ..flat_fit(None)
        };
        let map = depth(&ramp(), &fit, None, &params()).expect("a part is seen");
        let seen: Vec<f64> = (0..map.levels.width())
            .filter_map(|x| map.height(x, map.levels.height() / 2))
            .collect();
        let (low, high) = seen
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(low, high), h| {
                (low.min(*h), high.max(*h))
            });
        assert!(
            (low - 0.2).abs() < 0.02 && (high - 0.6).abs() < 0.02,
            "{low} {high}"
        );
    }

    #[test]
    fn pixels_per_mm_need_a_unit() {
        let per_mm = DepthParams {
            resolution_by: ResolutionBy::PxPerMm,
            ..params()
        };
        let refused = depth(&ramp(), &flat_fit(None), None, &per_mm);
        assert_eq!(refused, Err(DepthError::UnitUnknown));
        let map = depth(&ramp(), &flat_fit(None), Some(LengthUnit::Cm), &per_mm).expect("a map");
        assert!((map.scale.mesh_unit_per_px - 0.01).abs() < 1e-9);
    }
}
