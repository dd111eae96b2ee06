//! How likely an alignment is right, from what speaks for and against it.
//!
//! A logistic model. Its weights were fitted to 1,010 made pairs of two independent generators: right pairs of every
//! kind, meshes with another character's print, mirrored meshes and uncarved plates, when walls and frame lines still
//! counted. When they first did not, the least of 896 right pairs had 0.75 and the highest of 505 wrong ones 0.43. The
//! weights of the spread and of the rim were chosen by hand, so that poses a few percent off and cuts through worn
//! or tilted tops come among the least sure.

use crate::domain::PoseFeatures;

/// Weights of the logarithms of correlation, tops met, ink met, other angle and mirrored; the first stands alone.
const POSE: [f64; 6] = [2.54, 6.17, 2.67, 1.56, -2.43, -2.41];
/// Weights of one; logarithm of the mask's area over that of the mask by relief alone, and its square; that of the
/// ink's area over it, and its square; logarithm of the correlation; spread of the answers, by [`spread_out`]; square of
/// the rim, which is 0.03 in the median of made pairs of `hard`, and above 0.05 in three of a hundred.
const MASK: [f64; 8] = [5.13, -3.54, -3.51, 1.12, -1.79, 3.29, -1.5, -500.0];
/// A spread that nobody would see, as share of the depth map's longest side.
const UNSEEN: f64 = 0.002;
/// Shares below this are as bad as none.
const FLOOR: f64 = 0.02;
/// Ratios to the other poses' scores are cut to this range.
const RATIO: [f64; 2] = [0.2, 1.5];

/// Chance, 0..=1, that the pose is right: turned within 5 degrees, landmarks within 5 % of the character's height.
pub(super) fn of_pose(evidence: &PoseFeatures) -> f64 {
    let share = |value: f64| value.max(FLOOR).ln();
    let ratio = |value: f64| value.clamp(RATIO[0], RATIO[1]).ln();
    let features = [
        1.0,
        share(evidence.correlation),
        share(evidence.tops_met),
        share(evidence.ink_met),
        ratio(evidence.other_angle),
        ratio(evidence.mirrored),
    ];
    logistic(POSE.iter().zip(features).map(|(w, f)| w * f).sum())
}

/// What bears on a depth mask; areas are shares of the canvas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Areas {
    /// The mask's own.
    pub(super) mask: f64,
    /// That of the mask whose threshold was chosen from the relief alone.
    pub(super) relief: f64,
    /// The print's ink.
    pub(super) ink: f64,
    /// What a slightly lower cut adds to the mask's, as a logarithm, times the mask's root: how wide the rim is that it
    /// adds; the narrower of the mask's own and that of the mask by relief alone.
    pub(super) rim: f64,
}

/// Chance, 0..=1, that a depth mask is true to the tops (intersection over union of 0.7 or more) when the pose is.
pub(super) fn of_mask(evidence: &PoseFeatures, areas: Areas) -> f64 {
    let over_relief = |area: f64| (area.max(1e-6) / areas.relief.max(1e-6)).ln();
    let (mask, ink) = (over_relief(areas.mask), over_relief(areas.ink));
    let features = [
        1.0,
        mask,
        mask * mask,
        ink,
        ink * ink,
        evidence.correlation.max(FLOOR).ln(),
        spread_out(evidence.spread),
        areas.rim * areas.rim,
    ];
    logistic(MASK.iter().zip(features).map(|(w, f)| w * f).sum())
}

/// 0 for answers that lie on each other, growing slowly with how far they lie apart.
fn spread_out(spread: f64) -> f64 {
    (spread / UNSEEN).ln_1p()
}

fn logistic(value: f64) -> f64 {
    1.0 / (1.0 + (-value).exp())
}

#[cfg(test)]
mod tests {
    use super::{Areas, of_mask, of_pose};
    use crate::domain::PoseFeatures;

    const PLAIN: PoseFeatures = PoseFeatures {
        correlation: 0.88,
        tops_met: 0.94,
        ink_met: 0.91,
        other_angle: 0.3,
        mirrored: 0.4,
        spread: 0.0,
    };

    #[test]
    fn each_witness_moves_the_chance_its_way() {
        let plain = of_pose(&PLAIN);
        assert!(plain > 0.99);
        let worse = [
            PoseFeatures {
                correlation: 0.4,
                ..PLAIN
            },
            PoseFeatures {
                tops_met: 0.5,
                ..PLAIN
            },
            PoseFeatures {
                ink_met: 0.4,
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
        for evidence in worse {
            assert!(of_pose(&evidence) < plain, "{evidence:?}");
        }
    }

    const LIKE: Areas = Areas {
        mask: 0.2,
        relief: 0.2,
        ink: 0.25,
        rim: 0.03,
    };

    #[test]
    fn a_mask_far_from_the_reliefs_own_is_trusted_less() {
        let chance = |mask, ink| of_mask(&PLAIN, Areas { mask, ink, ..LIKE });
        assert!(chance(0.2, 0.25) > 0.95);
        assert!(chance(0.5, 0.25) < chance(0.25, 0.25));
        assert!(chance(0.2, 0.08) < chance(0.2, 0.25));
    }

    #[test]
    fn a_pose_that_hangs_on_its_start_is_trusted_less() {
        let chance = |spread| of_mask(&PoseFeatures { spread, ..PLAIN }, LIKE);
        assert!(chance(0.0005) > 0.95);
        assert!(chance(0.02) < 0.7);
    }

    #[test]
    fn a_cut_through_tops_is_trusted_less() {
        let chance = |rim| of_mask(&PLAIN, Areas { rim, ..LIKE });
        assert!(chance(0.04) > 0.95);
        assert!(chance(0.1) < 0.6);
    }

    #[test]
    fn another_characters_print_is_not_believed() {
        let wrong = PoseFeatures {
            correlation: 0.34,
            tops_met: 0.65,
            ink_met: 0.68,
            other_angle: 0.88,
            mirrored: 0.94,
            spread: 0.0,
        };
        assert!(of_pose(&wrong) < 0.05);
    }
}
