//! Settings of all four stages.

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::depth::{self, DepthParams};
use super::fit::{self, FitParams};
use super::normalize::{self, NormalizeParams};
use super::register::{self, RegisterParams};
use mocban_core::domain::{Stage, ThresholdMetric};

/// Which of the two pipelines runs; see `stages::pipeline`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlignmentMethod {
    /// The recommended method: finds the pose first, then chooses thresholds in the aligned frame.
    Default,
    /// The paper's method (arXiv 2411.05524): chooses thresholds first, then searches all rotations.
    Paper,
}

impl AlignmentMethod {
    /// Returns the metrics that the method computes, in the order of [`ThresholdMetric::ALL`].
    ///
    /// # Examples
    /// ```
    /// use mocban_align::stages::AlignmentMethod;
    ///
    /// assert_eq!(AlignmentMethod::Default.metrics().len(), 4);
    /// assert_eq!(AlignmentMethod::Paper.metrics().len(), 3);
    /// ```
    pub const fn metrics(self) -> &'static [ThresholdMetric] {
        match self {
            Self::Default => &ThresholdMetric::ALL,
            Self::Paper => &ThresholdMetric::PAPER,
        }
    }
}

/// Settings of the pipeline as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PipelineParams {
    /// Which of the two pipelines runs.
    pub method: AlignmentMethod,
}

/// Settings of all four stages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The pipeline as a whole.
    pub pipeline: PipelineParams,
    /// Mesh to plane.
    pub fit: FitParams,
    /// Mesh and plane to depth map.
    pub depth: DepthParams,
    /// Depth map and print to ink and relief heights.
    pub normalize: NormalizeParams,
    /// Ink and relief to alignment.
    pub register: RegisterParams,
}

impl Settings {
    /// Returns what a stage's result depends on besides its inputs: the revision of the stage, the settings of the
    /// stage, and the method if the stage differs between methods. A fit may register its candidates, so it depends on the
    /// revisions of the other stages too, but not on their settings.
    ///
    /// # Examples
    /// ```
    /// use mocban_core::domain::Stage;
    ///
    /// let before = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/default_settings.in"))?;
    /// let mut after = before.clone();
    /// after.register.smoothing_px = 2.0;
    /// assert_eq!(before.fingerprint_fields(Stage::Fit), after.fingerprint_fields(Stage::Fit));
    /// assert_ne!(before.fingerprint_fields(Stage::Register), after.fingerprint_fields(Stage::Register));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn fingerprint_fields(&self, stage: Stage) -> serde_json::Value {
        let (revision, settings) = match stage {
            Stage::Fit => {
                return json!({
                    "revision": fit::REVISION,
                    "trials": [depth::REVISION, normalize::REVISION, register::REVISION],
                    "method": self.pipeline.method,
                    "settings": self.fit,
                });
            }
            Stage::Depth => return json!({"revision": depth::REVISION, "settings": self.depth}),
            Stage::Normalize => (normalize::REVISION, json!(self.normalize)),
            Stage::Register => (register::REVISION, json!(self.register)),
        };
        json!({"revision": revision, "method": self.pipeline.method, "settings": settings})
    }
}

#[cfg(test)]
mod tests {
    use crate::stages::testing::settings;
    use crate::stages::{depth, normalize, register};
    use mocban_core::domain::Stage;
    use serde_json::json;

    #[test]
    fn a_fit_depends_on_the_revisions_of_the_stages_that_its_trials_run() {
        let fields = settings().fingerprint_fields(Stage::Fit);
        let revisions = [depth::REVISION, normalize::REVISION, register::REVISION];
        assert_eq!(fields["trials"], json!(revisions));
    }
}
