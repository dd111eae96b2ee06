//! The settings as typed values, and the sections of a settings file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::Value;

use super::error::{ConfigError, Origin};
use super::sources::Preset;
use super::tree::{Change, Tree};
use crate::mesh;
use crate::raster;
use crate::stages::{PipelineParams, Settings, depth, fit, normalize, register};

/// Every setting, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Size limits of input files.
    pub limits: InputLimits,
    /// Resources of a run; they change no result.
    pub run: RunSettings,
    /// The stages.
    pub stages: Settings,
    /// The review page.
    pub review: ReviewSettings,
}

/// Size limits above which an input file is refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputLimits {
    /// Limits of mesh files.
    pub mesh: mesh::MeshLimits,
    /// Limits of print images.
    pub image: raster::ImageLimits,
}

/// Resources of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSettings {
    /// Pairs processed at the same time; 0 means one per core.
    pub workers: usize,
    /// Memory for the pairs processed at the same time, in MiB; 0 means most of the free memory.
    pub memory_mib: u64,
    /// Time limit for one stage of one pair, in seconds.
    pub stage_timeout_s: u64,
}

/// The review page.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReviewSettings {
    /// Keys by action, each named by its position on the keyboard (`KeyboardEvent.code`).
    pub keys: BTreeMap<String, String>,
}

/// The sections of a settings file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    limits: InputLimits,
    run: RunSettings,
    pipeline: PipelineParams,
    fit: fit::FitParams,
    depth: depth::DepthParams,
    normalize: normalize::NormalizeParams,
    register: register::RegisterParams,
    review: ReviewSettings,
}

impl From<Document> for Config {
    fn from(document: Document) -> Self {
        Self {
            limits: document.limits,
            run: document.run,
            stages: Settings {
                pipeline: document.pipeline,
                fit: document.fit,
                depth: document.depth,
                normalize: document.normalize,
                register: document.register,
            },
            review: document.review,
        }
    }
}

/// Converts the merged tree to typed settings.
///
/// # Errors
/// When a value has the wrong type or is unknown; the message names the first change to blame.
pub(super) fn typed(tree: &Tree, changes: &[Change]) -> Result<Config, ConfigError> {
    match read(tree) {
        Ok(document) => Ok(document.into()),
        Err(error) => Err(blame(changes, &error)),
    }
}

fn read(tree: &Tree) -> Result<Document, toml::de::Error> {
    Value::Table(tree.table().clone()).try_into()
}

/// Applies the changes to the defaults one by one and blames the first after which the settings are invalid.
fn blame(changes: &[Change], error: &toml::de::Error) -> ConfigError {
    let Ok(defaults) = Preset::Default.table() else {
        return ConfigError::BuiltIn(error.message().to_owned());
    };
    let mut tree = Tree::new(defaults);
    for change in changes {
        tree.apply(change);
        if let Err(error) = read(&tree) {
            return bad_value(change, &error);
        }
    }
    ConfigError::BuiltIn(error.message().to_owned())
}

fn bad_value(change: &Change, error: &toml::de::Error) -> ConfigError {
    match change.origin {
        Origin::Default => ConfigError::BuiltIn(error.message().to_owned()),
        Origin::Preset(_) | Origin::File(_) | Origin::Env(_) | Origin::Flag => ConfigError::Value {
            origin: change.origin.clone(),
            key: change.key.clone(),
            value: change.value.to_string(),
            reason: error.message().trim_end().to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use toml::{Table, Value};

    use super::{Document, Preset, Tree, read};

    fn keys(table: &Table, prefix: &str, into: &mut Vec<String>) {
        for (key, value) in table {
            let path = format!("{prefix}{key}");
            match value {
                Value::Table(inner) => keys(inner, &format!("{path}."), into),
                _ => into.push(path),
            }
        }
    }

    #[test]
    fn default_file_holds_exactly_the_existing_settings() {
        let file = Preset::Default.table().expect("valid TOML");
        let document: Document = read(&Tree::new(file.clone())).expect("every key and no other");
        let typed = Table::try_from(&document).expect("plain values");
        let (mut written, mut expected) = (Vec::new(), Vec::new());
        keys(&file, "", &mut written);
        keys(&typed, "", &mut expected);
        written.sort();
        expected.sort();
        assert_eq!(written, expected);
    }

    #[test]
    fn paper_preset_changes_only_settings_that_exist() {
        let mut tree = Tree::new(Preset::Default.table().expect("valid TOML"));
        let paper = Preset::Paper.table().expect("valid TOML");
        let changes = tree
            .changes(&paper, &super::Origin::Preset("paper"))
            .expect("known keys");
        for change in &changes {
            tree.apply(change);
        }
        read(&tree).expect("values of the right types");
    }
}
