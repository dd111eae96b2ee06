//! The ranges of numeric settings, and pairs of settings that must be in ascending order.

use std::ops::RangeInclusive;

use toml::Value;

use super::error::{ConfigError, Origin};
use super::tree::{Setting, Tree};

/// The range of every numeric setting. A test checks that the comments in `config/default.toml` state the same ranges.
const RANGES: &[(&str, RangeInclusive<f64>)] = &[
    ("limits.mesh.max_bytes", 1.0..=1e15),
    ("limits.mesh.max_vertices", 3.0..=4_294_967_295.0),
    ("limits.mesh.max_triangles", 1.0..=4_294_967_295.0),
    ("limits.image.max_bytes", 1.0..=1e15),
    ("limits.image.max_pixels", 1.0..=1e9),
    ("run.workers", 0.0..=1024.0),
    ("run.memory_mib", 0.0..=1e9),
    ("run.stage_timeout_s", 1.0..=86_400.0),
    ("storage.cache_gb", 1.0..=1e6),
    ("fit.seed", 0.0..=f64::INFINITY),
    ("fit.spaced_points", 3.0..=100_000.0),
    ("fit.spacing", 1e-6..=1.0),
    ("fit.ransac_draws", 1.0..=100_000.0),
    ("fit.ransac_distance", 1e-6..=1.0),
    ("fit.min_relief", 0.0..=1.0),
    ("depth.longest_px", 32.0..=16_384.0),
    ("depth.px_per_mm", 1e-3..=1e4),
    ("normalize.print_grey", 0.0..=255.0),
    ("normalize.canvas_px", 64.0..=2048.0),
    ("normalize.character_px", 32.0..=2048.0),
    ("register.scale_band", 1.0..=2.0),
    ("register.threshold_min", 0.0..=1.0),
    ("register.threshold_max", 0.0..=1.0),
    ("normalize.density_greys", 0.0..=255.0),
    ("normalize.structure_greys", 0.0..=255.0),
    ("register.working_px", 32.0..=1024.0),
    ("register.smoothing_px", 0.0..=10.0),
    ("register.min_confidence", 0.0..=1.0),
    ("register.coarse_angles", 4.0..=3600.0),
    ("register.fine_angles", 2.0..=3600.0),
];

/// Pairs of settings of which the first must be below the second.
const ASCENDING: &[(&str, &str)] = &[
    ("normalize.character_px", "normalize.canvas_px"),
    ("register.threshold_min", "register.threshold_max"),
];

/// Checks every number against its range, and the order of each pair of settings in `ASCENDING`.
///
/// # Errors
/// Returns an error for the first invalid value.
pub(super) fn check(tree: &Tree) -> Result<(), ConfigError> {
    let settings = tree.settings();
    settings.iter().try_for_each(check_range)?;
    let find = |key: &str| settings.iter().find(|setting| setting.key == key);
    for (low, high) in ASCENDING {
        if let (Some(low), Some(high)) = (find(low), find(high)) {
            check_ascending(low, high)?;
        }
    }
    Ok(())
}

/// Checks that all numbers of a setting are in its range. If the setting has two numbers, the first must not exceed the
/// second.
fn check_range(setting: &Setting) -> Result<(), ConfigError> {
    let Some((_, range)) = RANGES.iter().find(|(key, _)| *key == setting.key) else {
        return Ok(());
    };
    let numbers = numbers(&setting.value);
    if !numbers.iter().all(|number| range.contains(number)) {
        return Err(setting.refused(&format!(" is outside the range {}", range_text(range))));
    }
    match numbers[..] {
        [first, last] if first > last => Err(setting.invalid("the first is above the last")),
        _ => Ok(()),
    }
}

/// Formats a range for error messages and for the comments of the default settings file.
fn range_text(range: &RangeInclusive<f64>) -> String {
    if range.end().is_infinite() {
        format!("{} or more", range.start())
    } else {
        format!("{} to {}", range.start(), range.end())
    }
}

/// Returns an error if `low` is not below `high`. Blames `low`, or `high` if `low` has its default value.
fn check_ascending(low: &Setting, high: &Setting) -> Result<(), ConfigError> {
    match (&numbers(&low.value)[..], &numbers(&high.value)[..]) {
        ([a], [b]) if a >= b => {
            let (blamed, reason) = match low.origin {
                Origin::Default => (high, format!("must be above {} = {}", low.key, low.value)),
                Origin::Preset(_) | Origin::File(_) | Origin::Env(_) | Origin::Flag => {
                    (low, format!("must be below {} = {}", high.key, high.value))
                }
            };
            Err(blamed.invalid(&reason))
        }
        _ => Ok(()),
    }
}

/// Returns the numbers in a setting's value. Returns an empty list if the value contains no numbers.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Integer(integer) => vec![*integer as f64],
        Value::Float(float) => vec![*float],
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        Value::String(_) | Value::Boolean(_) | Value::Datetime(_) | Value::Table(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::{ASCENDING, Origin, RANGES, RangeInclusive, Tree, check, numbers, range_text};
    use crate::{Preset, explanation};

    fn tree() -> Tree {
        Tree::new(Preset::Default.table().expect("valid TOML"))
    }

    fn complaint(key: &str, value: toml::Value) -> String {
        let mut tree = tree();
        for change in tree.change(key, value, &Origin::Flag).expect("a known key") {
            tree.apply(&change);
        }
        check(&tree).expect_err("refused").to_string()
    }

    #[test]
    fn values_that_contradict_each_other_are_refused() {
        assert_eq!(
            complaint("normalize.canvas_px", 128.into()),
            "--set: normalize.canvas_px = 128: must be above normalize.character_px = 192"
        );
        assert_eq!(
            complaint("register.threshold_min", 0.9.into()),
            "--set: register.threshold_min = 0.9: must be below register.threshold_max = 0.6"
        );
        let greys = toml::Value::from(vec![9, 5]);
        assert!(complaint("normalize.density_greys", greys).ends_with("above the last"));
        assert!(complaint("fit.spacing", f64::NAN.into()).contains("outside"));
        assert!(complaint("fit.seed", (-1).into()).ends_with("outside the range 0 or more"));
    }

    #[test]
    fn every_number_has_a_range_and_every_range_a_number() {
        let settings = tree().settings();
        let numeric = settings
            .iter()
            .filter(|setting| !numbers(&setting.value).is_empty());
        let mut expected: Vec<&str> = numeric.map(|setting| setting.key.as_str()).collect();
        let mut keys: Vec<&str> = RANGES.iter().map(|(key, _)| *key).collect();
        expected.sort_unstable();
        keys.sort_unstable();
        assert_eq!(keys, expected);
        let ascending = ASCENDING.iter().flat_map(|(low, high)| [low, high]);
        for key in ascending {
            assert!(keys.contains(key), "{key}");
        }
        assert!(RANGES.iter().all(|(_, range)| range.start() < range.end()));
    }

    /// Returns each range that a comment states as `A to B` or `A or more`.
    fn stated_ranges(comment: &str) -> Vec<RangeInclusive<f64>> {
        let clauses = comment.split([' ', '\n']).collect::<Vec<_>>();
        let number = |text: &str| text.trim_end_matches(['.', ';', ',']).parse::<f64>().ok();
        let stated = clauses.windows(3).filter_map(|words| match words {
            [min, "to", max] => Some(number(min)?..=number(max)?),
            [min, "or", more] if more.starts_with("more") => Some(number(min)?..=f64::INFINITY),
            _ => None,
        });
        stated.collect()
    }

    #[test]
    fn comments_in_the_default_file_state_the_ranges() {
        for (key, range) in RANGES {
            let comment = explanation(key).join(" ");
            assert!(
                stated_ranges(&comment).contains(range),
                "{key}: the comment must state \"{}\": {comment}",
                range_text(range)
            );
        }
    }
}
