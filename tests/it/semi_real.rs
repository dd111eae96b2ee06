//! Aligns photographed prints with reliefs generated from their own ink, through all four stages.

use mocban::config::{self, Sources};
use mocban::demo::{DemoPair, PairGenerator, Tier};
use mocban::domain::MetricOutcome;
use mocban::raster;
use mocban::results::{
    ground_truth::{TruthErrors, TruthRecord},
    tops_iou,
};
use mocban::stages::{AlignedPair, Settings, StageError};
use rayon::prelude::*;

/// Largest landmark error in percent of the character height. The ground truth is accurate to about a pixel.
const MAX_LANDMARKS_PCT: f64 = 3.0;

pub(crate) fn settings() -> Settings {
    let loaded = config::load(&Sources::default()).expect("the defaults are sound");
    loaded.config.stages
}

/// Aligns a pair without its unit and carved side. Returns the errors of all metrics.
fn aligned(pair: &DemoPair, settings: &Settings) -> Result<Vec<TruthErrors>, StageError> {
    let print = raster::decode(&pair.print, &raster::ImageLimits::SUGGESTED).expect("a picture");
    let aligned = AlignedPair::new(&pair.mesh.clone().into(), &print.into(), settings)?;
    let truth = serde_json::to_value(&pair.truth).expect("a truth is JSON");
    let truth = TruthRecord::read(&truth).expect("the truth is sound");
    let errors = |outcome: &MetricOutcome| {
        let found = aligned.print_from_mesh(outcome);
        let tops = tops_iou(&aligned.depth, outcome, &pair.tops);
        truth
            .measure(&found, Some(tops))
            .expect("the truth is sound")
    };
    Ok(aligned.metrics().iter().map(errors).collect())
}

#[test]
fn every_photographed_print_is_aligned_with_its_relief() {
    let (pairs, settings) = (PairGenerator::new(Tier::Real, 31), settings());
    let count = Tier::Real.max_pairs().expect("the real tier is finite");
    assert_eq!(count, 20);
    let wrong: Vec<String> = (0..count)
        .into_par_iter()
        .flat_map_iter(|index| {
            let pair = pairs.pair(index).expect("the pair is made");
            match aligned(&pair, &settings) {
                Ok(found) => found
                    .iter()
                    .filter_map(|errors| error_message(&pair, errors))
                    .collect(),
                Err(error) => vec![format!("{}: {error}", pair.id)],
            }
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn error_message(pair: &DemoPair, errors: &TruthErrors) -> Option<String> {
    let is_right = errors.angle_deg <= 5.0 && errors.tre_pct <= MAX_LANDMARKS_PCT;
    (!is_right).then(|| format!("{}: {errors:?}", pair.id))
}
