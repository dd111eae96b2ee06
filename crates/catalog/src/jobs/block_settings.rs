//! The settings of the stages of blocks, which workers of the same run share.

use serde_json::Value;

use crate::jobs::fingerprint::differences;
use crate::jobs::plan::FieldChange;
use mocban_core::domain::BlockStage;

/// The settings of the stages of a block, by stage: each stage's revision and settings.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockSettings([Value; BlockStage::COUNT]);

impl BlockSettings {
    /// Collects the settings of each stage.
    pub fn new(fields: impl Fn(BlockStage) -> Value) -> Self {
        Self(BlockStage::ALL.map(fields))
    }

    /// Returns the settings as a JSON array by stage. Another process can pass the text to
    /// [`BlockSettings::changes_from`].
    pub fn json(&self) -> String {
        Value::from(self.0.to_vec()).to_string()
    }

    /// Returns the settings that differ from those of another process, which are given as [`BlockSettings::json`].
    /// Returns nothing if the text cannot be read.
    pub fn changes_from(&self, other: &str) -> Vec<FieldChange> {
        let other: Vec<Value> = serde_json::from_str(other).unwrap_or_default();
        let stages = BlockStage::ALL.into_iter().zip(other);
        let changes =
            stages.flat_map(|(stage, old)| differences(stage.name(), &old, self.of(stage)));
        changes.collect()
    }

    /// Returns the settings of a stage.
    pub const fn of(&self, stage: BlockStage) -> &Value {
        &self.0[stage.index()]
    }
}
