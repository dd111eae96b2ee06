//! The settings as plain values for the rooms that use them, and the sections they are written in.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::Value;

use super::{Change, ConfigError, Origin, Tree};
use crate::mesh;
use crate::raster;
use crate::stages::{Settings, depth, fit, normalize, register};

/// Every setting, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// What an input file may ask of the machine.
    pub limits: Limits,
    /// How a run uses the machine; changes no result.
    pub run: RunSettings,
    /// The method.
    pub stages: Settings,
    /// The review page.
    pub review: ReviewSettings,
}

/// What an input file may ask of the machine before it is refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Of mesh files.
    pub mesh: mesh::MeshLimits,
    /// Of print images.
    pub image: raster::ImageLimits,
}

/// How a run uses the machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSettings {
    /// Pairs worked on at the same time; 0 is one a core.
    pub workers: usize,
    /// Memory for the pairs worked on at the same time, in MiB; 0 is most of what is free.
    pub memory_mib: u64,
    /// Longest time for one stage of one pair, in seconds.
    pub stage_timeout_s: u64,
}

/// The review page.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReviewSettings {
    /// Keys by what they do, each named by its place on the keyboard.
    pub keys: BTreeMap<String, String>,
}

/// The sections of a settings file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    limits: Limits,
    run: RunSettings,
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
                fit: document.fit,
                depth: document.depth,
                normalize: document.normalize,
                register: document.register,
            },
            review: document.review,
        }
    }
}

/// The merged tree as typed settings.
///
/// # Errors
/// When a value is of the wrong type or is not known; the first change that brought it in is named.
pub(super) fn typed(tree: &Tree, changes: &[Change]) -> Result<Config, ConfigError> {
    match read(tree) {
        Ok(document) => Ok(document.into()),
        Err(error) => Err(blame(changes, &error)),
    }
}

fn read(tree: &Tree) -> Result<Document, toml::de::Error> {
    Value::Table(tree.table().clone()).try_into()
}

/// Lays the changes over the defaults one by one until the settings can no longer be read.
fn blame(changes: &[Change], error: &toml::de::Error) -> ConfigError {
    let Ok(defaults) = super::Preset::Default.table() else {
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

    use super::super::{Preset, Tree};
    use super::{Document, read};

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
    fn default_file_holds_exactly_the_settings_there_are() {
        let file = Preset::Default.table().expect("valid TOML");
        let document: Document = read(&Tree::new(file.clone())).expect("every key and no other");
        let again = Table::try_from(&document).expect("plain values");
        let (mut written, mut wanted) = (Vec::new(), Vec::new());
        keys(&file, "", &mut written);
        keys(&again, "", &mut wanted);
        written.sort();
        wanted.sort();
        assert_eq!(written, wanted);
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
