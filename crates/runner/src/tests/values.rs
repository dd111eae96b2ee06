//! Small values for tests of the runner.

use serde_json::Map;

use mocban_catalog::{BlockAttributes, ImportRow, PairAttributes};
use mocban_core::domain::{BlockName, MetricOutcome, PairName, ThresholdMetric, test_values};

/// Returns a pair without optional attributes.
pub(crate) fn pair_attributes(mesh_path: &str, print_path: &str) -> PairAttributes {
    PairAttributes {
        name: PairName::new("1").expect("a pair's name"),
        mesh_path: mesh_path.to_owned(),
        print_path: print_path.to_owned(),
        unit: None,
        scanned_face_down: None,
        character: None,
        block: None,
        meta: Map::new(),
        prior: None,
    }
}

/// Returns a pair whose files do not exist.
pub(super) fn pair_row(pair: &str) -> ImportRow {
    ImportRow {
        name: PairName::new(pair).expect("a pair's name"),
        mesh_path: format!("{pair}.stl"),
        print_path: format!("{pair}.png"),
        unit: None,
        scanned_face_down: None,
        character: None,
        block: None,
        meta: Map::new(),
        prior: None,
    }
}

/// Returns a block without optional attributes.
pub(crate) fn block_attributes(mesh_path: &str, page_path: &str) -> BlockAttributes {
    BlockAttributes {
        name: BlockName::new("1").expect("a block's name"),
        mesh_path: mesh_path.to_owned(),
        page_path: page_path.to_owned(),
        labels_path: None,
        unit: None,
        side: None,
        meta: None,
    }
}

/// Returns a metric with plausible numbers.
pub(crate) fn metric_outcome(metric: ThresholdMetric) -> MetricOutcome {
    test_values::metric_outcome(metric, 0.5)
}
