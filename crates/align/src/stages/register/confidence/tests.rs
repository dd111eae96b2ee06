//! What the inputs of the confidence do to it.

use super::{
    ConfidenceInputs, MASK, character_inputs, less_likely, logistic, mask_inputs, of_character,
    of_pair_alone, of_pose, pose_inputs, prior_of,
};
use crate::stages::register::Doubts;
use mocban_core::domain::PoseFeatures;

fn of_mask(features: &PoseFeatures, probability_right: f64) -> f64 {
    logistic(&MASK, &mask_inputs(features, probability_right))
}

const NO_DOUBTS: Doubts = Doubts {
    share: 1.0,
    smooth_misfit: 0.0,
    seen_ink: 1.0,
    lone_stroke: 0.0,
    parts_overlap: 1.0,
};

const PLAIN: PoseFeatures = PoseFeatures {
    correlation: 0.88,
    tops_covered: 0.94,
    ink_covered: 0.91,
    other_angle: 0.3,
    mirrored: 0.4,
    spread: 0.0,
    unmatched_tops: 0.0,
    unmatched_ink: 0.0,
    edge_scatter: 0.03,
    ink_area: 40.0,
};

#[test]
fn each_feature_moves_the_probability_its_way() {
    let plain = of_pose(&PLAIN, 0.0);
    assert!(plain > 0.99);
    let worse = [
        PoseFeatures {
            correlation: 0.4,
            ..PLAIN
        },
        PoseFeatures {
            tops_covered: 0.5,
            ..PLAIN
        },
        PoseFeatures {
            ink_covered: 0.4,
            ..PLAIN
        },
        PoseFeatures {
            other_angle: 0.95,
            ..PLAIN
        },
        PoseFeatures {
            mirrored: 1.1,
            ..PLAIN
        },
    ];
    for features in worse {
        assert!(of_pose(&features, 0.0) < plain, "{features:?}");
    }
}

#[test]
fn a_block_that_is_sure_outweighs_doubts_about_the_pose() {
    let doubtful = PoseFeatures {
        other_angle: 0.95,
        mirrored: 0.95,
        ..PLAIN
    };
    assert!(of_pose(&doubtful, prior_of(1.0)) > of_pose(&doubtful, 0.0));
    assert_eq!(prior_of(0.3), 0.0);
}

#[test]
fn doubts_lower_the_confidence_of_the_inputs() {
    let inputs = |doubts| ConfidenceInputs {
        pose: pose_inputs(&PLAIN),
        mask: mask_inputs(&PLAIN, 0.9),
        character: character_inputs(&PLAIN),
        prior: 0.0,
        doubts,
        pixel_width: 0.0,
    };
    let without = inputs(NO_DOUBTS).confidence();
    let with = |doubts| inputs(doubts).confidence() / without;
    let of_part = with(Doubts {
        share: 0.6,
        ..NO_DOUBTS
    });
    assert!((of_part - 0.8).abs() < 1e-9, "{of_part}");
    let smooth_misfit = 0.14;
    assert!(
        with(Doubts {
            smooth_misfit,
            ..NO_DOUBTS
        }) < 0.05
    );
    assert!(
        with(Doubts {
            seen_ink: 0.25,
            ..NO_DOUBTS
        }) < 0.51
    );
}

#[test]
fn a_block_says_nothing_about_the_character() {
    let other_character = PoseFeatures {
        unmatched_tops: 1.5,
        unmatched_ink: 1.5,
        edge_scatter: 0.08,
        other_angle: 0.7,
        mirrored: 0.85,
        ..PLAIN
    };
    let inputs = |prior| ConfidenceInputs {
        pose: pose_inputs(&other_character),
        mask: mask_inputs(&other_character, 0.9),
        character: character_inputs(&other_character),
        prior,
        doubts: NO_DOUBTS,
        pixel_width: 0.0,
    };
    assert!(inputs(prior_of(1.0)).confidence() < of_character(&other_character));
    assert!(of_character(&other_character) < 0.3);
}

#[test]
fn a_mask_of_an_improbable_threshold_is_trusted_less() {
    let probability = |p| of_mask(&PLAIN, p);
    assert!(probability(0.99) > 0.95);
    assert!(probability(0.5) < probability(0.99) - 0.05);
    assert!(probability(0.05) < 0.4);
}

#[test]
fn a_levelled_map_that_agrees_better_is_no_evidence_for_pose_and_character() {
    let levelled = PoseFeatures {
        correlation: 0.95,
        edge_scatter: 0.02,
        ..PLAIN
    };
    for probability in [of_pair_alone, of_character] {
        assert!(probability(&levelled) > probability(&PLAIN));
        assert_eq!(less_likely(probability, [&PLAIN, &levelled]), &PLAIN);
        assert_eq!(less_likely(probability, [&levelled, &PLAIN]), &PLAIN);
    }
}

#[test]
fn a_pose_that_depends_on_its_start_is_trusted_less() {
    let probability = |spread| of_mask(&PoseFeatures { spread, ..PLAIN }, 0.9);
    assert!(probability(0.0005) > 0.95);
    assert!(probability(0.02) < probability(0.0005) - 0.02);
}

#[test]
fn strokes_without_a_partner_are_evidence_against_the_character() {
    let probability = |unmatched_tops, unmatched_ink, edge_scatter, ink_area| {
        of_character(&PoseFeatures {
            unmatched_tops,
            unmatched_ink,
            edge_scatter,
            ink_area,
            other_angle: 0.7,
            mirrored: 0.85,
            ..PLAIN
        })
    };
    assert!(probability(0.0, 0.0, 0.03, 50.0) > 0.98);
    // Lost wood.
    assert!(probability(0.0, 6.0, 0.05, 50.0) > 0.9);
    // Strokes in other places.
    assert!(probability(1.5, 1.5, 0.08, 50.0) < 0.1);
    // A stroke without ink, in a character of few and of many strokes.
    assert!(probability(3.0, 0.0, 0.06, 20.0) < 0.3);
    assert!(probability(3.0, 0.0, 0.06, 80.0) > 0.9);
}

#[test]
fn a_close_competitor_is_evidence_against_the_character() {
    let strokes = PoseFeatures {
        unmatched_tops: 0.8,
        unmatched_ink: 0.8,
        edge_scatter: 0.08,
        ..PLAIN
    };
    let close = PoseFeatures {
        mirrored: 0.95,
        ..strokes
    };
    assert!(of_character(&close) < 0.3 * of_character(&strokes));
}

#[test]
fn another_characters_print_has_a_low_confidence() {
    let wrong = PoseFeatures {
        correlation: 0.34,
        tops_covered: 0.65,
        ink_covered: 0.68,
        other_angle: 0.88,
        mirrored: 0.94,
        spread: 0.0,
        ..PLAIN
    };
    assert!(of_pose(&wrong, 0.0) < 0.05);
}
