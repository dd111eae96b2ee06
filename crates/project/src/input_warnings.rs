//! Says what may be wrong with the files of a pair or block, by what its stages have stored.

use mocban_align::scan_size;
use mocban_align::stages::ScanHints;
use mocban_catalog::{BlockDetail, PairAttributes, PairResults};
use mocban_core::domain::{DepthOutcome, FitOutcome, MeshLosses, NormalizeOutcome, Stage};
use mocban_core::raster::profile_warning;
use serde_json::Value;

/// Returns the warnings of all stages about scan and print, one sentence each. Results of other versions of the program have
/// none.
pub fn of_pair(results: &PairResults) -> Vec<String> {
    let attributes = &results.attributes;
    let fit = results.stage(Stage::Fit);
    let fit = fit.and_then(|record| record.parse::<FitOutcome>().ok());
    let depth = results.stage(Stage::Depth);
    let depth = depth.and_then(|record| record.parse::<DepthOutcome>().ok());
    let mut found = fit.map_or_else(Vec::new, |fit| of_fit(&fit, attributes));
    found.extend(depth.and_then(|depth| of_depth(&depth, attributes)));
    let normalize = results.stage(Stage::Normalize);
    let normalize = normalize.and_then(|record| record.parse::<NormalizeOutcome>().ok());
    found.extend(normalize.as_ref().and_then(of_normalize));
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

/// Returns a warning if the colours of the print may differ from what its file means.
pub fn of_normalize(normalize: &NormalizeOutcome) -> Option<String> {
    normalize.ignored_profile.as_deref().map(profile_warning)
}

/// Returns what the stages of a block assumed about its files, left out of them or could not apply, one sentence each.
pub fn of_block(detail: &BlockDetail) -> Vec<String> {
    let mut found = Vec::new();
    for stage in &detail.stages {
        let number = |name: &str| stage.outcome.get(name).and_then(Value::as_u64).unwrap_or(0);
        let losses = MeshLosses {
            missing_vertices: number("missing_vertices"),
            incomplete_faces: number("incomplete_faces"),
        };
        found.extend(losses.sentences());
        let warnings = stage.outcome.get("warnings").and_then(Value::as_array);
        let warnings = warnings.into_iter().flatten();
        found.extend(warnings.filter_map(Value::as_str).map(str::to_owned));
    }
    found
}
