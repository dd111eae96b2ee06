//! The three pictures of one result that people look at.

use super::pair_files::SourcePrint;
use super::pictures::{PrintView, Rgb};
use crate::catalog::PairResults;
use crate::domain::ThresholdMetric;
use crate::raster;
use crate::report::pair_artifacts::PairArtifacts;
use crate::store::Project;

/// Print, relief laid on it and overlay of a metric's result, each at most `side` pixels wide and high, as far as they
/// can be drawn; and why one that should be there is not.
pub(super) fn tiles(
    project: &Project,
    pair: &PairResults,
    metric: ThresholdMetric,
    side: usize,
    limits: &raster::ImageLimits,
) -> ([Option<Rgb>; 3], Option<String>) {
    let Ok(print) = SourcePrint::read(project, pair, limits) else {
        return ([None, None, None], None);
    };
    let view = PrintView::of_side(&print.picture, side);
    let plain = Some(view.print(&print.picture));
    let Some(record) = pair.metric(metric) else {
        return ([plain, None, None], None);
    };
    match PairArtifacts::new(project, pair).depth() {
        Ok(depth) => {
            let relief = view.relief(&depth, &record.outcome.print_from_depth);
            let overlay = view.overlay(&print.picture, &depth, &record.outcome);
            ([plain, Some(relief), Some(overlay)], None)
        }
        Err(error) => ([plain, None, None], Some(error.to_string())),
    }
}
