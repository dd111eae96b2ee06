//! The settings as typed values, and their conversion from the merged settings tree.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::Value;

use super::error::ConfigError;
use super::sources::Preset;
use super::tree::{Setting, Tree};
use mocban_align::stages::Settings;
use mocban_core::InputLimits;
use mocban_core::domain::value_error_text;

/// Every setting as a typed value. [`Tree`] has already refused unknown sections and keys.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Size limits of input files.
    pub limits: InputLimits,
    /// Resources of a run; they change no result.
    pub run: RunSettings,
    /// Where the project's data is.
    pub storage: StorageSettings,
    /// The stages.
    #[serde(flatten)]
    pub stages: Settings,
    /// The review page.
    pub review: ReviewSettings,
}

impl Config {
    /// Returns the settings without those of a computer: its resources, and where the data is.
    ///
    /// # Errors
    /// Returns an error if a value has no JSON form.
    pub fn that_change_results(&self) -> Result<serde_json::Value, serde_json::Error> {
        let mut settings = serde_json::to_value(self)?;
        if let Some(sections) = settings.as_object_mut() {
            for section in ["run", "storage"] {
                sections.remove(section);
            }
        }
        Ok(settings)
    }
}

/// Resources of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSettings {
    /// Pairs processed at the same time; 0 means one per core.
    pub workers: usize,
    /// Memory limit in MiB for all pairs processed at the same time. 0 means most of the free memory.
    pub memory_mib: u64,
    /// Time limit for one stage of one pair, in seconds.
    pub stage_timeout_s: u64,
}

/// Where the project's data is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StorageSettings {
    /// URL of the catalog in PostgreSQL. Empty for a file in the project.
    pub catalog: String,
    /// Address of the artifacts in an object store. Empty for the project's folder.
    pub artifacts: String,
    /// Folders or addresses of inputs by the name that stored paths begin with.
    pub roots: BTreeMap<String, String>,
    /// Folder for local copies of inputs. Empty for the user's cache folder.
    pub cache: String,
    /// Space for local copies in GB (1e9 bytes).
    pub cache_gb: u64,
}

/// The review page.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReviewSettings {
    /// The key for each action. Keys are named by position on the keyboard (`KeyboardEvent.code`).
    pub keys: BTreeMap<String, String>,
}

/// Converts the merged tree to typed settings.
///
/// # Errors
/// Returns an error if a value has the wrong type or is not one of the allowed values. The message names the first
/// change that causes the error.
pub(super) fn typed(tree: &Tree, changes: &[Setting]) -> Result<Config, ConfigError> {
    read(tree).map_err(|error| blame(changes, &error))
}

fn read(tree: &Tree) -> Result<Config, toml::de::Error> {
    Value::Table(tree.table().clone()).try_into()
}

/// Applies the changes to the defaults one by one. Returns an error for the first change that makes the settings
/// invalid.
fn blame(changes: &[Setting], error: &toml::de::Error) -> ConfigError {
    let Ok(defaults) = Preset::Default.table() else {
        return ConfigError::BuiltIn(error.message().to_owned());
    };
    let mut tree = Tree::new(defaults);
    for change in changes {
        tree.apply(change);
        if let Err(error) = read(&tree) {
            let why = value_error_text(error.message().trim_end());
            return match why.strip_prefix(&change.value.to_string()) {
                Some(rest) => change.refused(rest),
                None => change.invalid(&why),
            };
        }
    }
    ConfigError::BuiltIn(error.message().to_owned())
}

#[cfg(test)]
mod tests {
    use toml::{Table, Value};

    use super::{Config, Preset, Tree, read};
    use crate::Origin;

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
        let document: Config = read(&Tree::new(file.clone())).expect("every key and no other");
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
            .changes(&paper, &Origin::Preset("paper"))
            .expect("known keys");
        for change in &changes {
            tree.apply(change);
        }
        read(&tree).expect("values of the right types");
    }
}
