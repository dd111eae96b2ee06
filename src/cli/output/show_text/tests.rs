//! Tests of the text that `show` prints about one pair.

use super::{
    Adjustment, DepthOutcome, FitOutcome, ManualCorrection, adjustment_text, depth_numbers,
    fit_numbers, metric_head,
};
use mocban_core::domain::{
    Affine2, Curvature, DepthScale, LengthUnit, Rigid3, ThresholdMetric, test_values::flat_fit,
};

/// Returns what `show` prints about a plate of 50 mm with a relief of 2 mm, in a scan with this unit.
fn stage_texts(unit: LengthUnit, known: bool) -> [String; 2] {
    let unit_mm = unit.mm();
    let unit = known.then_some(unit);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let fit = FitOutcome {
        curvature: Some(Curvature([0.0; 6])),
        curvature_height: 0.4 / unit_mm,
        inlier_ratio: 0.75,
        rms: 0.0125 / unit_mm,
        relief: 2.0 / unit_mm,
        ..flat_fit(Rigid3::to_frame(axes, [0.0; 3]))
    };
    let depth = DepthOutcome {
        width: 200,
        height: 100,
        scale: DepthScale {
            height_min: 0.0,
            height_per_level: 0.0,
            mesh_unit_per_px: 0.25 / unit_mm,
            depth_from_plane: Affine2::IDENTITY,
            curvature: None,
            unit,
        },
        coverage: 1.0,
    };
    [fit_numbers(&fit, &[], unit), depth_numbers(&depth, unit)]
}

#[test]
fn lengths_have_their_unit_and_keep_their_digits() {
    for (unit, known, [fit, depth]) in [
        (
            LengthUnit::M,
            true,
            [
                "relief 0.00200 m, rms 0.0000125 m, inliers 0.75",
                "200 x 100 px, 0.000250 m a pixel",
            ],
        ),
        (
            LengthUnit::In,
            true,
            [
                "relief 0.0787 in, rms 0.000492 in, inliers 0.75",
                "200 x 100 px, 0.00984 in a pixel",
            ],
        ),
        (
            LengthUnit::M,
            false,
            [
                "relief 0.00200 mesh units, rms 0.0000125 mesh units, inliers 0.75",
                "200 x 100 px, 0.000250 mesh units a pixel",
            ],
        ),
    ] {
        let texts = stage_texts(unit, known);
        assert!(texts[0].starts_with(fit), "{}", texts[0]);
        assert!(texts[1].starts_with(depth), "{}", texts[1]);
    }
    let [metres, _] = stage_texts(LengthUnit::M, true);
    assert!(metres.contains(", curvature 0.000400 m;"), "{metres}");
    for (unit, expected) in [
        (Some(LengthUnit::In), "threshold in"),
        (None, "threshold mesh units"),
    ] {
        assert!(metric_head(unit).contains(&expected.to_owned()));
    }
}

#[test]
fn adjustment_is_one_line() {
    let adjustment = Adjustment {
        from: ThresholdMetric::Ensemble,
        by: ManualCorrection {
            rotation_deg: -5.04,
            shift_px: [3.0, 4.0],
            scale: 1.0,
            mirrored: true,
        },
        from_iou: 0.7021,
    };
    insta::assert_snapshot!(adjustment_text(&adjustment, 0.616));
}
