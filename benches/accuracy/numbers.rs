//! Lists every number in a result with its path, such as `normalize.inks.0.threshold_print`.

use std::collections::BTreeMap;

use mocban::stages::AlignedPair;
use serde::Serialize;
use serde_json::Value;

/// Values as text by path.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Numbers(BTreeMap<String, String>);

impl Numbers {
    /// Returns the numbers of the four stages that all metrics share.
    pub(super) fn of_stages(aligned: &AlignedPair) -> anyhow::Result<Self> {
        let mut numbers = Self::default();
        numbers.add("fit", &aligned.fit)?;
        numbers.add("depth", &aligned.depth.scale)?;
        numbers.add("normalize", &aligned.normalized.outcome)?;
        numbers.add("features", &aligned.registered.outcome.features)?;
        Ok(numbers)
    }

    /// Adds everything a value holds below `path`.
    pub(super) fn add(&mut self, path: &str, value: &impl Serialize) -> anyhow::Result<()> {
        self.flatten(path.to_owned(), &serde_json::to_value(value)?);
        Ok(())
    }

    /// Adds the inputs of the confidence of the metric with an index, if the method has any.
    pub(super) fn add_inputs(
        &mut self,
        aligned: &AlignedPair,
        metric: usize,
    ) -> anyhow::Result<()> {
        let Some(inputs) = aligned.registered.confidence_inputs.get(metric) else {
            return Ok(());
        };
        self.add("inputs.pose", &inputs.pose)?;
        self.add("inputs.mask", &inputs.mask)?;
        self.add("inputs.character", &inputs.character)?;
        self.add("inputs.share", &inputs.doubts.share)?;
        self.add("inputs.smooth_misfit", &inputs.doubts.smooth_misfit)?;
        self.add("inputs.seen_ink", &inputs.doubts.seen_ink)?;
        self.add("inputs.lone_stroke", &inputs.doubts.lone_stroke)?;
        self.add("inputs.parts_overlap", &inputs.doubts.parts_overlap)?;
        self.add("inputs.pixel_width", &inputs.pixel_width)
    }

    /// Returns a value as text.
    pub(super) fn text(&self, path: &str) -> Option<&str> {
        self.0.get(path).map(String::as_str)
    }

    /// Returns a value as a number.
    pub(super) fn number(&self, path: &str) -> Option<f64> {
        self.text(path)?.parse().ok()
    }

    /// Returns every path.
    pub(super) fn paths(&self) -> impl Iterator<Item = &String> {
        self.0.keys()
    }

    fn flatten(&mut self, path: String, value: &Value) {
        match value {
            Value::Null => {}
            Value::String(text) => {
                self.0.insert(path, text.clone());
            }
            Value::Bool(_) | Value::Number(_) => {
                self.0.insert(path, value.to_string());
            }
            Value::Array(items) => {
                for (i, item) in items.iter().enumerate() {
                    self.flatten(format!("{path}.{i}"), item);
                }
            }
            Value::Object(fields) => {
                for (name, field) in fields {
                    self.flatten(format!("{path}.{name}"), field);
                }
            }
        }
    }
}
