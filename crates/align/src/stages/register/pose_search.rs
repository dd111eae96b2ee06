//! Coarse-to-fine search of the pose on soft strokes, without an exact threshold.

use super::confidence;
use super::larger_part::LargerPart;
use super::params::{ExpectedPose, RegisterError, RegisterParams};
use super::stretch::{best_score, stretch};
use crate::stages::normalize::{PrintMasks, soft_stroke};
use crate::stages::pose::{
    BeamWidth, ImagePyramid, Loss, PoseCandidate, RefinementPass, Refiner, SearchRange, SoftMask,
    search_coarse_to_fine,
};
use mocban_core::domain::Affine2;
use mocban_core::raster::PixelBox;

/// Refinement passes after the search.
const PASSES: [RefinementPass; 2] = [
    RefinementPass {
        size_px: 36,
        sigma_px: 0.8,
        max_steps: 7,
        beam_width: keep(4, 2),
    },
    LAST_PASS,
];
const LAST_PASS: RefinementPass = RefinementPass {
    size_px: 60,
    sigma_px: 1.0,
    max_steps: 6,
    beam_width: keep(3, 1),
};

const fn keep(upright: usize, mirrored: usize) -> BeamWidth {
    BeamWidth { upright, mirrored }
}
/// Largest working size of print and relief in pixels.
const BASE_PX: usize = 72;
/// Threshold of the soft strokes in the search, as a fraction of the relief's depth. With `SEARCH_SOFTNESS`, strokes
/// fall from 1 at the tops to 0 at half the depth. This tolerates a wrong threshold and a tilted plane.
const SEARCH_CUT: f64 = 0.25;
const SEARCH_SOFTNESS: f64 = 0.5;
/// If the best score is lower, the search is repeated without plateaus that are wider than `2 PLATEAU_PX + 1` pixels, if
/// these hold at least the fraction `LEAST_PLATEAU` of the strokes.
const WEAK: f64 = 0.42;
const PLATEAU_PX: usize = 5;
const LEAST_PLATEAU: f32 = 0.2;
/// Number of poses that are refined.
const KEEP: BeamWidth = keep(9, 3);
/// Smallest correlation of a match. If the best correlation is smaller, the pair is refused.
const LEAST_SCORE: f64 = 0.12;
/// The search refuses a pair as mirrored only if its best mirrored score is more than this many times its best upright
/// score. Closer cases are decided after the refinement. A symmetric character scores about the same both ways.
const MIRROR_WINS: f64 = 1.3;
/// A pose is the expected one if rotation, scale (natural logarithm) and position of the relief's middle differ by less
/// than this. The position is a fraction of the print's longest side.
const EXPECTED_DEG: f64 = 6.0;
const EXPECTED_RATIO: f64 = 0.08;
const EXPECTED_SHIFT: f64 = 0.06;
/// A pose other than the expected one is preferred only if its score is more than this many times the expected one's, and
/// high enough to convince: the best of all poses on a coarse scan or faint ink is a chance match.
const UNEXPECTED_WINS: f64 = 1.5;
const CONVINCING: f64 = 0.45;
/// The expected pose holds if its score is at least this part of the best one near it.
const HOLDS: f64 = 0.85;
/// A pose fits well if its score is at least this.
const FITS_WELL: f64 = 0.82;
/// `at_bound` is set if the scale is this close to either end of the searched band, in natural logarithms.
const BOUND: f64 = 0.02;

/// Poses of the relief on one interpretation of the print.
#[derive(Debug)]
pub(super) struct PoseSearch {
    /// The interpretation of the print that the relief agrees with best.
    pub(super) ink: usize,
    /// Upright poses, best first. There is at least one.
    pub(super) poses: Vec<PoseCandidate>,
    /// Best pose of the mirrored relief.
    pub(super) mirrored: Option<PoseCandidate>,
    /// Whether the best pose's scale lies at the end of the band.
    pub(super) at_bound: bool,
    /// Logarithm of the odds that the block gives the best pose; 0 if it expects none, or another one.
    pub(super) prior: f64,
    /// The expected pose, which maps to pixels of the masks, if it matches about as well as the best pose near it. It is
    /// more exact: the strokes of all characters around determine it.
    pub(super) expected: Option<Affine2>,
}

impl PoseSearch {
    /// Returns the poses of a search without plateaus if the best of them scores higher. Those of this search on the same
    /// interpretation of the print remain as competitors: the poses of both searches alternate.
    fn or_surer(self, narrow: Self) -> Self {
        if narrow.score() <= self.score() {
            return self;
        }
        let mut poses = Vec::new();
        let mut others = self.poses.into_iter();
        if narrow.ink != self.ink {
            others = Vec::new().into_iter();
        }
        for pose in narrow.poses {
            poses.push(pose);
            poses.extend(others.next());
        }
        poses.extend(others);
        let mirrored = narrow.mirrored.into_iter().chain(self.mirrored);
        Self {
            poses,
            mirrored: mirrored.max_by(|a, b| a.score.total_cmp(&b.score)),
            ..narrow
        }
    }

    /// Replaces the poses by better ones with unequal scales, see [`stretch`].
    fn stretch(
        &mut self,
        print: &PrintMasks,
        wood: &ImagePyramid,
        wood_px: WoodPx,
        params: &RegisterParams,
    ) {
        let Some(print_base) = ImagePyramid::new(&print.soft_ink(), BASE_PX) else {
            return;
        };
        let mut found: Vec<PoseCandidate> =
            self.poses.iter().copied().chain(self.mirrored).collect();
        stretch(&mut found, &print_base, wood, wood_px.middle, LAST_PASS);
        (self.mirrored, self.poses) = (
            found.iter().copied().find(|pose| pose.mirrored),
            found.into_iter().filter(|pose| !pose.mirrored).collect(),
        );
        let print_px = longest(print.known.bounding_box());
        self.at_bound = is_at_bound(self.poses.first(), wood_px.longest / print_px, params);
    }

    fn score(&self) -> f64 {
        self.poses.first().map_or(0.0, |pose| pose.score)
    }
}

/// Searches for poses of the relief on every interpretation of the print. Returns the poses on the best interpretation.
///
/// `depths` holds, for each depth-map pixel, the depth below the tops as a fraction of the relief's depth. Poses,
/// `expected` too, map depth-map pixels to pixels of the print's masks. If a pose is expected, it has no competitors
/// unless one matches much better.
///
/// # Errors
/// Returns an error if the relief has no data. If no interpretation matches, returns the error for the likeliest one.
pub(super) fn search(
    depths: &SoftMask,
    prints: &[PrintMasks],
    expected: Option<&ExpectedPose>,
    params: &RegisterParams,
) -> Result<PoseSearch, RegisterError> {
    let wood = ImagePyramid::new(depths, BASE_PX).ok_or(RegisterError::NoPose)?;
    let wood = wood.map(|d| soft_stroke(d, SEARCH_CUT, SEARCH_SOFTNESS));
    let wood_px = WoodPx {
        longest: longest(depths.known.bounding_box()),
        middle: [depths.known.width(), depths.known.height()].map(|side| side as f64 / 2.0),
    };
    let on_inks = |wood: &ImagePyramid| {
        let inks = prints.iter().enumerate();
        let searches =
            inks.map(|(ink, print)| find_poses(wood, wood_px, ink, print, expected, params));
        let best = searches.reduce(|best, other| match (&best, &other) {
            (Ok(a), Ok(b)) if b.score() > a.score() => other,
            (Err(_), Ok(_)) => other,
            _ => best,
        });
        let mut found = best.unwrap_or(Err(RegisterError::NoPose))?;
        // A block shows how a picture was scaled.
        if params.anisotropic_scale && expected.is_none() && found.score() < FITS_WELL {
            found.stretch(&prints[found.ink], wood, wood_px, params);
        }
        Ok(found)
    };
    let found = on_inks(&wood);
    let is_weak = match &found {
        Ok(found) => found.score() < WEAK && found.prior == 0.0,
        Err(error) => matches!(error, RegisterError::NoCorrelation { .. }),
    };
    if !is_weak {
        return found;
    }
    // A rim, walls or ground that count as tops hide the strokes.
    let Some(narrow) = wood.without_plateaus(PLATEAU_PX, LEAST_PLATEAU) else {
        return found;
    };
    combined(found, on_inks(&narrow))
}

/// Combines a search with one without plateaus. A pair that only the latter matches needs a score of [`WEAK`].
///
/// # Errors
/// Returns the error of the first search, or that of the second one if this finds the pair mirrored.
fn combined(
    found: Result<PoseSearch, RegisterError>,
    narrow: Result<PoseSearch, RegisterError>,
) -> Result<PoseSearch, RegisterError> {
    match (found, narrow) {
        (Ok(found), Ok(narrow)) => Ok(found.or_surer(narrow)),
        (Err(_), Ok(narrow)) if narrow.score() >= WEAK => Ok(narrow),
        (_, Err(error @ RegisterError::Mirrored { .. })) => Err(error),
        (found, _) => found,
    }
}

/// Searches for poses on the larger part of a torn print, the pose that was found with it first. `whole` are the poses on
/// the whole print, `print`.
///
/// # Errors
/// Returns an error like [`search`].
pub(super) fn search_part(
    depths: &SoftMask,
    print: &PrintMasks,
    whole: &PoseSearch,
    part: &LargerPart,
    params: &RegisterParams,
) -> Result<PoseSearch, RegisterError> {
    let mut found = search(depths, std::slice::from_ref(&part.masks), None, params)?;
    found.poses.insert(0, part.pose);
    let [of_wood, of_print] =
        [&depths.known, &print.known].map(|known| longest(known.bounding_box()));
    Ok(PoseSearch {
        ink: whole.ink,
        at_bound: is_at_bound(Some(&part.pose), of_wood / of_print, params),
        ..found
    })
}

/// Returns whether a pose's scale lies at the end of the band. `ratio` is the longest side of the area with data of the depth
/// map, divided by that of the print.
fn is_at_bound(pose: Option<&PoseCandidate>, ratio: f64, params: &RegisterParams) -> bool {
    pose.is_some_and(|pose| {
        let ratio = pose.fixed_from_moving.scale() * ratio;
        params.scale_band > 1.0 && ratio.ln().abs() > params.scale_band.ln() - BOUND
    })
}

/// Measures of a depth map in pixels.
#[derive(Debug, Clone, Copy)]
struct WoodPx {
    /// Longest side of the area with data.
    longest: f64,
    /// Middle of the map.
    middle: [f64; 2],
}

/// Searches for poses on one interpretation of the print.
fn find_poses(
    wood: &ImagePyramid,
    wood_px: WoodPx,
    ink: usize,
    print: &PrintMasks,
    expected: Option<&ExpectedPose>,
    params: &RegisterParams,
) -> Result<PoseSearch, RegisterError> {
    let print_base = ImagePyramid::new(&print.soft_ink(), BASE_PX).ok_or(RegisterError::NoPose)?;
    let limits = SearchRange {
        max_scale: params.scale_band,
        beam_width: KEEP,
    };
    let passes = PASSES.map(|pass| pass.smoothed(print.pixel_sigma()));
    let mut found = search_coarse_to_fine(&print_base, wood, limits, &passes);
    let print_bounds = print.known.bounding_box();
    let print_px = longest(print_bounds);
    let (mut prior, mut kept) = (0.0, None);
    if let (Some(expected), Some(bounds)) = (expected, print_bounds) {
        let pose = &expected.print_from_depth;
        let near = near_expected(&print_base, wood, &found, pose, bounds);
        let rival = best_score(&found);
        if prefer_expected(&mut found, near.map(|near| near.best)) {
            let odds = confidence::prior_of(expected.confidence);
            // The block is no evidence for a pose that the pair itself contradicts.
            let agrees = |near: &NearPose| rival <= UNEXPECTED_WINS * near.best.score;
            prior = near.filter(agrees).map_or(0.0, |_| odds);
            let holds = |near: &NearPose| near.expected_score >= HOLDS * near.best.score;
            kept = near.filter(|near| odds > 0.0 && holds(near)).map(|_| *pose);
        }
    }
    require_upright(&found)?;
    let (mirrored, poses): (Vec<PoseCandidate>, Vec<PoseCandidate>) =
        found.into_iter().partition(|pose| pose.mirrored);
    Ok(PoseSearch {
        ink,
        at_bound: is_at_bound(poses.first(), wood_px.longest / print_px, params),
        poses,
        mirrored: mirrored.first().copied(),
        prior,
        expected: kept,
    })
}

/// The best pose near the expected one, and the score of the expected pose itself.
#[derive(Clone, Copy)]
struct NearPose {
    best: PoseCandidate,
    expected_score: f64,
}

/// Refines the expected pose and the poses found near it; returns the best of them that stays near. `None` if the expected
/// pose is mirrored. `bounds` are those of the print.
fn near_expected(
    print: &ImagePyramid,
    wood: &ImagePyramid,
    found: &[PoseCandidate],
    expected: &Affine2,
    bounds: PixelBox,
) -> Option<NearPose> {
    let print_middle = [bounds.x0 + bounds.x1, bounds.y0 + bounds.y1].map(|sum| sum as f64 / 2.0);
    if expected.determinant() <= 0.0 {
        return None;
    }
    let (size, sigma) = (LAST_PASS.size_px, LAST_PASS.sigma_px);
    let (fixed, moving) = (print.level(size, sigma), wood.level(size, sigma));
    let refiner = Refiner::new(&fixed, &moving);
    let start = PoseCandidate {
        fixed_from_moving: *expected,
        score: 0.0,
        mirrored: false,
    };
    // The point of the depth map that is expected at the middle of the print.
    let middle = expected.inverse()?.apply(print_middle);
    let is_near = |pose: &PoseCandidate| {
        let ratio = pose.fixed_from_moving.scale() / start.fixed_from_moving.scale();
        let [a, b] = [pose, &start].map(|pose| pose.fixed_from_moving.apply(middle));
        let distance = (a[0] - b[0]).hypot(a[1] - b[1]);
        pose.rotation_to(&start) < EXPECTED_DEG
            && ratio.ln().abs() < EXPECTED_RATIO
            && distance < EXPECTED_SHIFT * bounds.longest_side() as f64
    };
    let refined = refiner.refine(&start, LAST_PASS.max_steps, Loss::Huber);
    let upright = found.iter().filter(|pose| !pose.mirrored).copied();
    let evaluated = refiner.evaluate(&start);
    let best = upright
        .chain([refined, evaluated])
        .filter(is_near)
        .max_by(|a, b| a.score.total_cmp(&b.score))?;
    Some(NearPose {
        best,
        expected_score: evaluated.score,
    })
}

/// Keeps only the pose near the expected one, unless another one matches much better. Returns whether it was kept.
fn prefer_expected(found: &mut Vec<PoseCandidate>, near: Option<PoseCandidate>) -> bool {
    let upright = best_score(found.iter().filter(|pose| !pose.mirrored));
    let mirrored = best_score(found.iter().filter(|pose| pose.mirrored));
    let near = near.filter(|near| {
        upright <= CONVINCING.max(UNEXPECTED_WINS * near.score)
            && mirrored <= UNEXPECTED_WINS * near.score
    });
    if let Some(near) = near {
        *found = vec![near];
    }
    near.is_some()
}

/// Returns the longest side of the box around the known pixels, or 1 if there are none.
fn longest(bounds: Option<PixelBox>) -> f64 {
    bounds.map_or(1.0, |bounds| bounds.longest_side() as f64)
}

/// Refuses mirrored pairs and pairs without a correlating pose.
fn require_upright(found: &[PoseCandidate]) -> Result<(), RegisterError> {
    let best = |mirrored: bool| {
        let of_kind = found.iter().filter(|pose| pose.mirrored == mirrored);
        of_kind.map(|pose| pose.score).fold(0.0, f64::max)
    };
    let (upright, mirrored) = (best(false), best(true));
    if mirrored > upright * MIRROR_WINS && mirrored > LEAST_SCORE {
        return Err(RegisterError::Mirrored {
            times: mirrored / upright.max(LEAST_SCORE * LEAST_SCORE),
        });
    }
    if upright < LEAST_SCORE {
        return Err(RegisterError::NoCorrelation {
            best: upright,
            needs: LEAST_SCORE,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{PoseSearch, combined};
    use crate::stages::pose::PoseCandidate;
    use crate::stages::register::RegisterError;
    use mocban_core::domain::Affine2;

    fn with_scores(scores: &[f64]) -> PoseSearch {
        let pose = |score: &f64| PoseCandidate {
            fixed_from_moving: Affine2([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            score: *score,
            mirrored: false,
        };
        PoseSearch {
            ink: 0,
            poses: scores.iter().map(pose).collect(),
            mirrored: None,
            at_bound: false,
            prior: 0.0,
            expected: None,
        }
    }

    const NOTHING: RegisterError = RegisterError::NoCorrelation {
        best: 0.1,
        needs: 0.12,
    };
    const MIRRORED: RegisterError = RegisterError::Mirrored { times: 2.0 };

    #[test]
    fn the_competitors_of_both_searches_remain() {
        let both = combined(
            Ok(with_scores(&[0.4, 0.2])),
            Ok(with_scores(&[0.6, 0.5, 0.1])),
        );
        let scores: Vec<f64> = both
            .iter()
            .flat_map(|both| &both.poses)
            .map(|pose| pose.score)
            .collect();
        assert_eq!(scores, [0.6, 0.4, 0.5, 0.2, 0.1]);
    }

    #[test]
    fn a_pose_without_plateaus_alone_must_match_well_and_not_mirrored() {
        let [weak, good] = [0.3, 0.6].map(|score| with_scores(&[score, 0.1]));
        assert_eq!(combined(Err(NOTHING), Ok(weak)).err(), Some(NOTHING));
        assert!(combined(Err(NOTHING), Ok(good)).is_ok());
        let found = with_scores(&[0.3]);
        assert_eq!(combined(Ok(found), Err(MIRRORED)).err(), Some(MIRRORED));
        assert!(combined(Ok(with_scores(&[0.3])), Err(NOTHING)).is_ok());
    }
}
