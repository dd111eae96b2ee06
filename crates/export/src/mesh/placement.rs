//! The frame of exported meshes: the block in front of the viewer, upright like the print.
//!
//! x points to the right, y up, and z out of the block; lengths are millimetres, or mesh units if the unit is unknown.
//! The origin is the point of the fitted plane below the centre of the print image. A block is carved in mirror
//! writing, and no rigid motion of a block makes it readable. The frame therefore shows the block as it is: y runs
//! against the rows of the print, and x against its columns. Only texture coordinates contain the reflection.

use mocban_core::domain::{
    Affine2, DepthScale, FitOutcome, HeightFromMesh, LengthUnit, Levelling, MetricOutcome,
    PrintFromMesh, Rigid3,
};

/// Places the points of a scan in the frame of exported meshes.
#[derive(Debug, Clone)]
pub(crate) struct MeshPlacement {
    fit: FitOutcome,
    scale: DepthScale,
    threshold: f64,
    print_from_mesh: PrintFromMesh,
    height_from_mesh: HeightFromMesh,
    frame_from_plane: Rigid3,
    writing_is_mirrored: bool,
    /// Levelling of the depth map, if any, with the width and the height of the map.
    levelling: Option<(Levelling, [usize; 2])>,
}

/// A placed point of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlacedPoint {
    /// Position in the frame, in millimetres, or mesh units if the unit is unknown.
    pub(super) position: [f64; 3],
    /// Print pixel.
    pub(super) pixel: [f64; 2],
    /// Height over the fitted surface, or over its levelling, in the unit of `position`.
    pub(super) height: f64,
    /// Whether the point belongs to a stroke at the metric's threshold.
    pub(super) is_stroke: bool,
}

impl MeshPlacement {
    /// Returns the placement of a metric's result over a print of `size` (width and height in pixels). Returns `None`
    /// if the alignment is singular.
    pub(crate) fn new(
        fit: FitOutcome,
        scale: DepthScale,
        outcome: &MetricOutcome,
        size: [usize; 2],
    ) -> Option<Self> {
        let print_from_plane = outcome.print_from_depth.after(&scale.depth_from_plane);
        let centre = size.map(|side| (side as f64 - 1.0) / 2.0);
        let origin = print_from_plane.inverse()?.apply(centre);
        let [x_axis, y_axis] = upright_axes(&print_from_plane);
        let axes = [
            [x_axis[0], x_axis[1], 0.0],
            [y_axis[0], y_axis[1], 0.0],
            [0.0, 0.0, 1.0],
        ];
        Some(Self {
            print_from_mesh: PrintFromMesh::new(
                &outcome.print_from_depth,
                &scale.depth_from_plane,
                &fit.plane_from_mesh,
            ),
            height_from_mesh: HeightFromMesh::new(&fit.plane_from_mesh, scale.curvature.as_ref()),
            threshold: outcome.threshold_depth,
            frame_from_plane: Rigid3::to_frame(axes, [origin[0], origin[1], 0.0]),
            writing_is_mirrored: print_from_plane.determinant() >= 0.0,
            fit,
            scale,
            levelling: None,
        })
    }

    /// Measures heights over the levelling of the depth map, if there is one. `size` is the map's width and height.
    #[must_use]
    pub(crate) fn levelled(mut self, levelling: Option<&Levelling>, size: [u32; 2]) -> Self {
        let size = size.map(|side| side as usize);
        self.levelling = levelling.map(|levelling| (*levelling, size));
        self
    }

    /// Returns the unit of the mesh, if it is known.
    pub(crate) const fn unit(&self) -> Option<LengthUnit> {
        self.scale.unit
    }

    /// Returns whether the block is carved in mirror writing, so that x runs against the columns of the print.
    pub(crate) const fn writing_is_mirrored(&self) -> bool {
        self.writing_is_mirrored
    }

    /// Returns the map from mesh points to print pixels.
    pub(super) const fn print_from_mesh(&self) -> &PrintFromMesh {
        &self.print_from_mesh
    }

    /// Returns the similarity that maps mesh points to the frame, as a 4 x 4 matrix. It has no reflection; its scale
    /// is 1 if the mesh is in millimetres or its unit is unknown.
    pub(super) fn frame_from_mesh(&self) -> [[f64; 4]; 4] {
        let scale = self.frame_unit_per_mesh_unit();
        let mut rows = self.frame_from_plane.after(&self.fit.plane_from_mesh).0;
        for value in rows[..3].as_flattened_mut() {
            *value *= scale;
        }
        rows
    }

    /// Places a point of the mesh.
    pub(super) fn place(&self, point: [f64; 3]) -> PlacedPoint {
        let scale = self.frame_unit_per_mesh_unit();
        let on_plane = self.fit.plane_from_mesh.apply(point);
        let height = self.height_from_mesh.apply(point)
            - self.levelling.map_or(0.0, |(levelling, size)| {
                let px = [on_plane[0], on_plane[1]];
                levelling.height_at(self.scale.depth_from_plane.apply(px), size)
            });
        let [u, v, _] = self.print_from_mesh.apply(point);
        let region = self.fit.region.as_ref();
        PlacedPoint {
            position: self.frame_from_plane.apply(on_plane).map(|c| c * scale),
            pixel: [u, v],
            height: height * scale,
            is_stroke: height >= self.threshold && region.is_none_or(|r| r.contains(point)),
        }
    }

    /// Returns millimetres per mesh unit, or 1 if the unit is unknown.
    pub(crate) fn frame_unit_per_mesh_unit(&self) -> f64 {
        self.scale.unit.map_or(1.0, LengthUnit::mm)
    }
}

/// Returns orthonormal axes of the plane, in plane coordinates: the second is closest to the upward direction of the
/// print, and the first points to the right of it, seen from outside the block.
fn upright_axes(print_from_plane: &Affine2) -> [[f64; 2]; 2] {
    let [mut u, v] = print_from_plane.0;
    if print_from_plane.determinant() < 0.0 {
        // The print is not mirrored against the block, so its columns run in the direction of x.
        u = u.map(|value| -value);
    }
    // The rotation closest to the linear part, which maps plane axes to directions in the print.
    let (cos, sin) = (u[0] + v[1], v[0] - u[1]);
    let length = cos.hypot(sin);
    let (cos, sin) = (cos / length, sin / length);
    [[-cos, sin], [-sin, -cos]]
}

#[cfg(test)]
pub(super) mod tests {
    use super::{Levelling, MeshPlacement};
    use mocban_core::domain::{
        Affine2, Curvature, DepthScale, Disagreement, FitOutcome, LengthUnit, MetricOutcome,
        Rigid3, ScanRegion, Scores, ThresholdMetric, test_values::flat_fit,
    };

    const SIZE: [usize; 2] = [200, 100];

    fn plane_from_mesh() -> Rigid3 {
        let (sin, cos) = 0.3_f64.sin_cos();
        let axes = [[0.0, cos, sin], [0.0, -sin, cos], [1.0, 0.0, 0.0]];
        Rigid3::to_frame(axes, [500.0, 2.0, -7.0])
    }

    fn fit() -> FitOutcome {
        flat_fit(plane_from_mesh())
    }

    fn scale(unit: Option<LengthUnit>) -> DepthScale {
        DepthScale {
            height_min: -1.0,
            height_per_level: 2e-5,
            mesh_unit_per_px: 0.025,
            depth_from_plane: Affine2([[-40.0, 0.0, 100.0], [0.0, -40.0, 90.0]]),
            curvature: Some(Curvature([0.01, 0.0, 0.02, 0.0, 0.0, 0.003])),
            unit,
        }
    }

    fn outcome(print_from_depth: Affine2) -> MetricOutcome {
        let scores = [0.0; 7];
        MetricOutcome {
            metric: ThresholdMetric::NlSsim,
            threshold_level: 30_000,
            threshold_depth: -0.4,
            print_from_depth,
            angle_deg: 0.0,
            scale: 1.0,
            shift_px: [0.0; 2],
            scores: Scores {
                ssim: scores[0],
                nl_ssim: scores[1],
                iou: scores[2],
                iou_box: scores[3],
                dice: scores[4],
                density_print: scores[5],
                density_depth: scores[6],
            },
            disagreement: Disagreement::default(),
            margin: 0.0,
            confidence: None,
            at_bound: false,
        }
    }

    /// Returns the placement of a turned and shifted block of the given unit.
    pub(crate) fn placement(unit: Option<LengthUnit>) -> MeshPlacement {
        let alignment = Affine2::similarity(0.5, 0.7, [40.0, -20.0]);
        MeshPlacement::new(fit(), scale(unit), &outcome(alignment), SIZE).expect("invertible")
    }

    /// Returns the mesh point at a point of the plane frame.
    pub(crate) fn mesh_point(on_plane: [f64; 3]) -> [f64; 3] {
        plane_from_mesh().inverse().apply(on_plane)
    }

    fn close(one: &[f64], other: &[f64]) -> bool {
        one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn x_and_y_run_against_columns_and_rows_of_the_print() {
        let placed = placement(Some(LengthUnit::Cm));
        // 40 depth pixels per cm and 0.5 print pixels per depth pixel.
        let mm_per_px = 10.0 / 20.0;
        for point in [[0.3, -0.2, 0.1], [5.0, 4.0, -0.7], [-2.0, 1.0, 0.0]] {
            let found = placed.place(mesh_point(point));
            let [u, v, z] = placed.print_from_mesh().apply(mesh_point(point));
            assert!(close(&found.pixel, &[u, v]) && placed.writing_is_mirrored());
            let expected = [(99.5 - u) * mm_per_px, (49.5 - v) * mm_per_px, 10.0 * z];
            assert!(close(&found.position, &expected), "{found:?} {expected:?}");
        }
    }

    #[test]
    fn the_matrix_is_a_similarity_without_reflection_and_places_points() {
        let placed = placement(Some(LengthUnit::In));
        let m = placed.frame_from_mesh();
        let dot = |i: usize, j: usize| (0..3).map(|k| m[i][k] * m[j][k]).sum::<f64>();
        for (i, j) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
            let expected = if i == j { 25.4 * 25.4 } else { 0.0 };
            assert!((dot(i, j) - expected).abs() < 1e-9);
        }
        let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
        let determinant = m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1);
        assert!((determinant - 25.4_f64.powi(3)).abs() < 1e-6);
        let [x, y, z] = mesh_point([1.0, 2.0, 3.0]);
        let moved = [0, 1, 2].map(|i| m[i][0] * x + m[i][1] * y + m[i][2] * z + m[i][3]);
        assert!(close(&moved, &placed.place([x, y, z]).position));
    }

    #[test]
    fn a_stretched_print_leaves_the_mesh_undistorted() {
        let stretched = Affine2([[0.52, -0.1, 3.0], [0.1, 0.5, 8.0]]);
        let placed = MeshPlacement::new(fit(), scale(None), &outcome(stretched), SIZE);
        let placed = placed.expect("invertible");
        let [a, b] = [[0.0; 3], [3.0, 4.0, 0.0]].map(|p| placed.place(mesh_point(p)));
        let apart = [0, 1].map(|k| a.position[k] - b.position[k]);
        assert!((apart[0].hypot(apart[1]) - 5.0).abs() < 1e-9);
        // The directions of the axes are still those of the print, within the stretch.
        let pixels = [0, 1].map(|k| b.pixel[k] - a.pixel[k]);
        assert!(apart[0] * pixels[0] > 0.0 && apart[1] * pixels[1] > 0.0);
    }

    #[test]
    fn a_print_that_is_not_mirrored_keeps_the_direction_of_its_columns() {
        let mirrored = Affine2::similarity(0.5, 0.7, [40.0, -20.0]).after(&Affine2::mirror(180));
        let placed = MeshPlacement::new(fit(), scale(None), &outcome(mirrored), SIZE);
        let placed = placed.expect("invertible");
        assert!(!placed.writing_is_mirrored());
        let found = placed.place(mesh_point([1.0, 2.0, 0.5]));
        let expected = [
            (found.pixel[0] - 99.5) / 20.0,
            (49.5 - found.pixel[1]) / 20.0,
            0.5,
        ];
        assert!(close(&found.position, &expected), "{found:?} {expected:?}");
    }

    #[test]
    fn strokes_are_measured_from_the_curved_surface_within_the_region() {
        let [x, y] = [1.5, -2.0];
        let curvature = scale(None).curvature.expect("a curved block").height(x, y);
        let placed = placement(Some(LengthUnit::Mm));
        for (height, is_stroke) in [(-0.399, true), (-0.401, false)] {
            let found = placed.place(mesh_point([x, y, curvature + height]));
            assert!((found.height - height).abs() < 1e-9);
            assert_eq!(found.is_stroke, is_stroke, "{height}");
        }
        let elsewhere = ScanRegion {
            box_from_mesh: plane_from_mesh(),
            bounds: [[2.0, -9.0, -9.0], [9.0, 9.0, 9.0]],
        };
        let fit = FitOutcome {
            region: Some(elsewhere),
            ..fit()
        };
        let outcome = outcome(Affine2::IDENTITY);
        let placed = MeshPlacement::new(fit, scale(None), &outcome, SIZE).expect("invertible");
        let [left, right] = [1.5, 2.5].map(|x| placed.place(mesh_point([x, 0.0, 0.2])).is_stroke);
        assert_eq!((left, right), (false, true));
    }

    #[test]
    fn a_singular_alignment_has_no_placement() {
        let flat = outcome(Affine2([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]]));
        assert!(MeshPlacement::new(fit(), scale(None), &flat, SIZE).is_none());
    }

    #[test]
    fn heights_are_measured_over_the_levelling() {
        let levelling = Levelling {
            heights: [[0.25; Levelling::NODES]; Levelling::NODES],
        };
        let levelled = placement(None).levelled(Some(&levelling), [100, 80]);
        let point = [1.0, 2.0, 3.0];
        let [plain, levelled] =
            [placement(None), levelled].map(|placed| placed.place(point).height);
        assert!((plain - levelled - 0.25).abs() < 1e-12);
    }
}
