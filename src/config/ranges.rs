//! Ranges of the settings that are numbers.

use toml::Value;

use super::{ConfigError, Tree};

/// Key, smallest and largest value. The reasons stand beside the settings in `config/default.toml`.
const RANGES: &[(&str, f64, f64)] = &[
    ("run.workers", 0.0, 1024.0),
    ("run.stage_limit_s", 1.0, 86_400.0),
];

/// Holds every number to its range.
///
/// # Errors
/// For the first number outside.
pub(super) fn check(tree: &Tree) -> Result<(), ConfigError> {
    for setting in tree.settings() {
        let Some((_, min, max)) = RANGES.iter().find(|(key, ..)| *key == setting.key) else {
            continue;
        };
        let inside = number(&setting.value).is_none_or(|value| (*min..=*max).contains(&value));
        if !inside {
            return Err(ConfigError::Range {
                origin: setting.origin,
                key: setting.key,
                value: setting.value.to_string(),
                min: *min,
                max: *max,
            });
        }
    }
    Ok(())
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(integer) => Some(*integer as f64),
        Value::Float(float) => Some(*float),
        Value::String(_)
        | Value::Boolean(_)
        | Value::Datetime(_)
        | Value::Array(_)
        | Value::Table(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{RANGES, Tree};
    use crate::config::Preset;

    #[test]
    fn every_range_is_of_a_setting_that_exists() {
        let tree = Tree::new(Preset::Default.table().expect("valid TOML"));
        let settings = tree.settings();
        for (key, min, max) in RANGES {
            assert!(min < max, "{key}");
            assert!(settings.iter().any(|setting| setting.key == *key), "{key}");
        }
    }
}
