//! Says what may be wrong with the scan of a pair, by what its stages have stored.

use mocban_align::scan_size;
use mocban_align::stages::ScanHints;
use mocban_catalog::{PairAttributes, PairResults};
use mocban_core::domain::{DepthOutcome, FitOutcome, Stage};

/// Returns the warnings of all stages about a scan, one sentence each. Results of other versions of the program have none.
pub fn of_pair(results: &PairResults) -> Vec<String> {
    let attributes = &results.attributes;
    let fit = results.stage(Stage::Fit);
    let fit = fit.and_then(|record| record.parse::<FitOutcome>().ok());
    let depth = results.stage(Stage::Depth);
    let depth = depth.and_then(|record| record.parse::<DepthOutcome>().ok());
    let mut found = fit.map_or_else(Vec::new, |fit| of_fit(&fit, attributes));
    found.extend(depth.and_then(|depth| of_depth(&depth, attributes)));
    found
}

/// Returns what was left out of a scan, and how the result of `fit` contradicts its attributes.
pub fn of_fit(fit: &FitOutcome, attributes: &PairAttributes) -> Vec<String> {
    let hints = ScanHints {
        unit: attributes.unit,
        scanned_face_down: attributes.scanned_face_down,
    };
    let mut found = fit.losses().sentences();
    found.extend(scan_size::contradictions(fit, hints));
    found
}

/// Returns a warning if the carved surface does not have the size of a character. The unit of a pair that was cut from a block
/// is that of the block, which has its own warning.
pub fn of_depth(depth: &DepthOutcome, attributes: &PairAttributes) -> Option<String> {
    if attributes.prior.is_some() {
        return None;
    }
    scan_size::doubtful_surface(scan_size::length_of_outcome(depth), attributes.unit)
}
