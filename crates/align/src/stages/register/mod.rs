//! Finds the pose, chooses each metric's depth threshold in the aligned frame, and scores the masks.
//!
//! The pose is found from soft strokes, whose values fall gradually from 1 to 0, so no exact threshold is needed.
//! `pose_search` searches all rotations and a band of scales, from coarse to fine. `refine` compares the best poses and
//! refines the winner at full size. `paper_method::register` is the method of the published paper, which chooses the
//! thresholds before the pose.

mod anisotropic_scale;
mod confidence;
mod doubts;
mod half_canvas;
mod ink_edge;
mod larger_part;
mod levelling;
mod lone_stroke;
mod metric_thresholds;
mod misfit;
mod observation;
mod params;
mod pose_search;
mod posed;
mod print_side;
mod refine;
mod scoring;
mod soft_thresholds;
mod stretch;
mod stroke_map;
mod tops_edge;
mod unmatched;

pub use confidence::ConfidenceInputs;
pub use doubts::Doubts;
pub use observation::Observation;
pub use params::{ExpectedPose, RegisterError, RegisterParams};
pub use scoring::Registered;
pub(super) use scoring::{Alignment, canvas_print, score_alignments};
pub use stroke_map::StrokeMap;

use super::normalize::{Normalized, relative_depths};
use crate::stages::binarize::rim_share;
use crate::stages::pose::SoftMask;
use doubts::unexplained_misfit;
use half_canvas::HalfCanvas;
use larger_part::OtherPart;
use metric_thresholds::ChosenThreshold;
use mocban_core::domain::{InkHypothesis, PoseFeatures};
use mocban_core::raster::{DepthMap, Mask};
use pose_search::PoseSearch;
use posed::{Levelled, Posed, TornParts};

/// Revision of this stage. It is raised whenever the same inputs and settings may give a different result than before.
pub const REVISION: u32 = 32;

/// A pair of low confidence is refused as mirrored above this factor already. Damage can favour the mirrored relief of a
/// symmetric character by a few percent.
const MIRROR_LIKELY: f64 = 1.04;

/// A pair is refused if the probability of the pose, multiplied by the probability of the same character, is below this
/// fraction of `min_confidence`. The fraction is small because damaged blocks and dry prints of the right character
/// have strokes without a partner too.
const UNLIKELY: f64 = 0.05;

/// A torn print is sought if the probability of the pose, multiplied by the probability of the same character, is below
/// this.
const DOUBTFUL: f64 = 0.75;

/// A pair is refused if the probability of the pose, of the same character and of all doubts together is below this. Right
/// pairs of bold prints reach 0.003.
const IMPOSSIBLE: f64 = 0.001;

/// A light print is refused if the tops cover more than this fraction of the rim of the depth map. Strokes do not
/// surround a character, so these tops are the carved ground, seen from the back of the scanned surface.
const TOPS_AT_RIM: f64 = 0.6;

/// Aligns a depth map with a print, chooses one threshold for each metric and scores the masks on the canvas.
///
/// `depth` and `normalized` are the results of earlier stages. The pose maps depth-map pixels to print-image pixels.
/// All metrics share this pose. `expected` is the pose that the registration of the whole block gave, if the pair was cut
/// from one: other poses need much better evidence.
///
/// # Errors
/// Returns an error if print, relief or the mask of a metric is empty. Also returns an error if print and relief do not
/// match: no pose correlates, the mirrored relief matches better, the confidence in the pose is below `min_confidence`,
/// or print and relief very probably show different characters.
///
/// # Examples
/// ```
/// # use mocban_core::raster;
/// # use mocban_demo as demo;
/// # let settings = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/default_settings.in"))?;
/// # let pair = demo::PairGenerator::new(demo::Tier::Pose, 7).with_vertices(Some(20_000)).pair(0)?;
/// # let image = raster::decode(&pair.print, &raster::ImageLimits::SUGGESTED)?;
/// use mocban_align::stages::{Print, Scan, depth, fit, normalize, register};
///
/// let (scan, print) = (Scan::from(pair.mesh), Print::from(image));
/// let plane = fit::fit(&scan, Some(&print), None, &settings.fit)?;
/// let map = depth::depth(&scan, &plane, None, &settings.depth)?;
/// assert_eq!(map.levels.width().max(map.levels.height()), 512);
/// let normalized = normalize::normalize(&map, &print, &settings.normalize)?;
/// // One mask for each interpretation of the print, the likeliest first.
/// assert_eq!(normalized.prints.len(), normalized.outcome.inks.len());
/// let registered = register::register(&map, &normalized, None, &settings.register)?;
/// for metric in &registered.outcome.metrics {
///     assert!(metric.confidence.is_some_and(|confidence| confidence > 0.5));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn register(
    depth: &DepthMap,
    normalized: &Normalized,
    expected: Option<&ExpectedPose>,
    params: &RegisterParams,
) -> Result<Registered, RegisterError> {
    let relief = normalized.outcome.relief.ok_or(RegisterError::NoStrokes)?;
    let depths = relative_depths(depth, &relief);
    let expected = expected.map(|expected| ExpectedPose {
        print_from_depth: normalized.prints[0]
            .masks_from_print()
            .after(&expected.print_from_depth),
        ..*expected
    });
    let mut search = pose_search::search(&depths, &normalized.prints, expected.as_ref(), params)?;
    let mut single = Posed::new(depth, &depths, &relief, normalized, &search, false, params);
    // A block shows where a character is, whether or not its print is torn.
    let mut of_part = None;
    if expected.is_none()
        && let Some(found) = on_larger_part(depth, &depths, normalized, &search, &single, params)
    {
        (search, single) = (found.search, Ok(found.posed));
        of_part = Some(found.part);
    }
    let single = single?;
    let (masks, share) = match &of_part {
        Some(part) => (&part.masks, part.share),
        None => (normalized, 1.0),
    };
    let levelled = Levelled::try_new(depth, &relief, &single, masks, &search, params);
    let (depth, levelling, posed) = match &levelled {
        Some(found) => (&found.map, Some(found.levelling), &found.posed),
        None => (depth, None, &single),
    };
    let (refined, thresholds, features) = (&posed.refined, &posed.thresholds, &posed.features);
    require_tops(
        depth,
        &normalized.outcome.inks,
        search.ink,
        thresholds,
        params,
    )?;
    for features in [features, &single.features] {
        require_character(features, search.prior, params)
            .map_err(|error| error.with(|| posed.observe(depth)))?;
    }
    let alignments: Vec<Alignment> = thresholds
        .iter()
        .map(|ChosenThreshold { choice, .. }| Alignment {
            metric: choice.metric,
            level: choice.level,
            print_from_depth: refined.print_from_depth,
            margin: refined.margin,
            at_bound: search.at_bound || choice.at_bound,
        })
        .collect();
    let whole_print = canvas_print(normalized, search.ink);
    let stroke_map = |alignment: &Alignment| {
        StrokeMap::of(&posed.canvas, alignment.level, normalized.outcome.canvas_px)
    };
    let mut registered = score_alignments(
        depth,
        normalized,
        search.ink,
        whole_print,
        &alignments,
        stroke_map,
        params.window,
    )?;
    // The other part of a torn print is no evidence.
    let part_print = of_part
        .as_ref()
        .map(|part| canvas_print(&part.masks, search.ink));
    let print = part_print.as_ref().unwrap_or(&registered.canvas_print);
    let misfits = [posed, &single].map(|posed| misfit_of(posed, search.prior));
    let doubts = Doubts {
        share,
        // A levelling chooses the heights from the ink, which hides displaced strokes: the larger misfit counts.
        smooth_misfit: misfits[0].max(misfits[1]),
        seen_ink: seen_ink(print, &posed.canvas.ink),
        lone_stroke: (of_part.as_ref())
            .map_or(0.0, |part| part.both.lone_stroke)
            .max(posed.lone_stroke),
        parts_overlap: of_part.as_ref().map_or(1.0, |part| part.both.overlap),
    };
    require_belief(features, search.prior, doubts, params)
        .map_err(|error| error.with(|| posed.observe(depth)))?;
    let probabilities = thresholds.iter().map(|chosen| chosen.probability_right);
    registered.confidence_inputs = confidence::set_confidence(
        &mut registered.outcome.metrics,
        [features, &single.features],
        search.prior,
        doubts,
        posed.canvas.print_px / posed.canvas.stroke_width,
        probabilities,
    );
    registered.outcome.features = Some(*features);
    registered.outcome.levelling = levelling;
    registered.outcome.displaced = of_part.as_ref().map(|part| {
        let print = &normalized.prints[search.ink];
        part.other
            .in_print(print, &refined.print_from_depth, part.share)
    });
    Ok(registered)
}

/// Returns the displacement of whole strokes that rough edges do not explain, as a fraction of the stroke width.
fn misfit_of(posed: &Posed, prior: f64) -> f64 {
    unexplained_misfit(posed.smooth_misfit, posed.features.edge_scatter, prior)
}

/// What was found on the larger part of a torn print.
struct PartFit {
    search: PoseSearch,
    posed: Posed,
    part: TornPrint,
}

/// A torn print without its smaller part.
struct TornPrint {
    masks: Normalized,
    /// Fraction of the ink that is on the larger part.
    share: f64,
    /// The smaller part.
    other: OtherPart,
    /// How well both parts agree with the relief.
    both: TornParts,
}

/// Returns the pose on the larger part of a torn print, if that is more probable than `single`, the pose on the whole
/// print. What misfits is left out, so a part agrees better than a whole by chance too: its probability counts by its share
/// of the ink. A mirrored relief may match a part that is symmetric, so a print that matches the mirrored relief is whole.
fn on_larger_part(
    depth: &DepthMap,
    depths: &SoftMask,
    normalized: &Normalized,
    search: &PoseSearch,
    single: &Result<Posed, RegisterError>,
    params: &RegisterParams,
) -> Option<PartFit> {
    let relief = normalized.outcome.relief?;
    let of_whole = single.as_ref().map_or(0.0, probability);
    let is_mirrored = |posed: &Posed| posed.features.mirrored > MIRROR_LIKELY;
    if of_whole >= DOUBTFUL || single.as_ref().is_ok_and(is_mirrored) {
        return None;
    }
    let print = &normalized.prints[search.ink];
    let part = larger_part::find(depths, print, &search.poses)?;
    let found = pose_search::search_part(depths, print, search, &part, params).ok()?;
    let masks = normalized.with_masks(search.ink, part.masks.clone());
    let posed = Posed::new(depth, depths, &relief, &masks, &found, false, params).ok()?;
    if part.share * probability(&posed) <= of_whole {
        return None;
    }
    let (rest, print_from_depth) = part.other.masks(print);
    let canvas = HalfCanvas::new(
        depth,
        &rest,
        &normalized.outcome.inks[search.ink].canvas_from_print,
        &print_from_depth,
        normalized.outcome.canvas_px,
    );
    Some(PartFit {
        part: TornPrint {
            masks,
            share: part.share,
            other: part.other,
            both: posed.with_smaller(&canvas, depth),
        },
        search: found,
        posed,
    })
}

/// Returns the fraction of the print's ink that lies where the depth map has data. `seen` is the ink with data on a canvas
/// of half the side length.
fn seen_ink(canvas_print: &Mask, seen: &Mask) -> f64 {
    let scale = (canvas_print.width() as f64 / seen.width() as f64).powi(2);
    scale * seen.count() as f64 / canvas_print.count().max(1) as f64
}

/// Returns the probability that the pose is right and that print and relief show the same character, by the pair alone.
fn probability(posed: &Posed) -> f64 {
    confidence::of_pose(&posed.features, 0.0) * confidence::of_character(&posed.features)
}

/// Refuses pairs whose strokes without a partner almost rule out that print and relief show the same character. Also
/// refuses less unlikely pairs whose mirrored relief matches better. `prior` is what the block knows.
fn require_character(
    features: &PoseFeatures,
    prior: f64,
    params: &RegisterParams,
) -> Result<(), RegisterError> {
    let [pose, character] = [
        confidence::of_pose(features, prior),
        confidence::of_character(features),
    ];
    if features.mirrored > MIRROR_LIKELY && pose * character < params.min_confidence {
        return Err(RegisterError::Mirrored {
            times: features.mirrored,
        });
    }
    if pose * character < UNLIKELY * params.min_confidence {
        return Err(RegisterError::OtherCharacter {
            pose,
            character,
            seen: Observation::Nothing,
        });
    }
    Ok(())
}

/// Refuses pairs whose doubts rule out that print and relief show the same character.
fn require_belief(
    features: &PoseFeatures,
    prior: f64,
    doubts: Doubts,
    params: &RegisterParams,
) -> Result<(), RegisterError> {
    let pose = confidence::of_pose(features, prior);
    let character = confidence::of_character(features) * doubts.factor();
    if params.min_confidence > 0.0 && pose * character < IMPOSSIBLE {
        return Err(RegisterError::OtherCharacter {
            pose,
            character,
            seen: Observation::Nothing,
        });
    }
    Ok(())
}

/// Refuses pairs whose print was read as light strokes on dark, if dark strokes are likelier or the tops surround the
/// character. A mirrored relief that is seen from the back matches the light background of a dark print, and no score of
/// the alignment shows it.
fn require_tops(
    depth: &DepthMap,
    inks: &[InkHypothesis],
    ink: usize,
    thresholds: &[ChosenThreshold],
    params: &RegisterParams,
) -> Result<(), RegisterError> {
    if !inks[ink].light_on_dark || params.min_confidence == 0.0 {
        return Ok(());
    }
    // The last threshold is that of the metric `relief`.
    let surround = |chosen: &ChosenThreshold| {
        let tops = depth.stroke_mask(chosen.choice.level);
        let known = depth.levels.map(|level| *level != 0);
        rim_share(&tops, &known) > TOPS_AT_RIM
    };
    if !inks[0].light_on_dark || thresholds.last().is_some_and(surround) {
        return Err(RegisterError::Inverted);
    }
    Ok(())
}

#[cfg(test)]
mod print_tests;
#[cfg(test)]
mod tests;
