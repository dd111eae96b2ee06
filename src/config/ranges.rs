//! Ranges of the settings that are numbers, and settings that must fit together.

use toml::Value;

use super::{ConfigError, Origin, Setting, Tree};

/// Key, smallest and largest value. The reasons stand beside the settings in `config/default.toml`.
const RANGES: &[(&str, f64, f64)] = &[
    ("limits.mesh.max_bytes", 1.0, 1e15),
    ("limits.mesh.max_vertices", 3.0, 4_294_967_295.0),
    ("limits.mesh.max_triangles", 1.0, 4_294_967_295.0),
    ("limits.image.max_bytes", 1.0, 1e15),
    ("limits.image.max_pixels", 1.0, 1e10),
    ("run.workers", 0.0, 1024.0),
    ("run.memory_mib", 0.0, 1e9),
    ("run.stage_timeout_s", 1.0, 86_400.0),
    ("fit.spaced_points", 3.0, 100_000.0),
    ("fit.spacing", 1e-6, 1.0),
    ("fit.ransac_draws", 1.0, 100_000.0),
    ("fit.ransac_distance", 1e-6, 1.0),
    ("fit.min_relief", 0.0, 1.0),
    ("depth.longest_px", 32.0, 16_384.0),
    ("depth.px_per_mm", 1e-3, 1e4),
    ("normalize.canvas_px", 64.0, 2048.0),
    ("normalize.character_px", 32.0, 2048.0),
    ("normalize.scale_band", 1.0, 2.0),
    ("normalize.threshold_min", 0.0, 1.0),
    ("normalize.threshold_max", 0.0, 1.0),
    ("normalize.ink_spread", 1.0, 3.0),
    ("register.working_px", 32.0, 1024.0),
    ("register.smoothing_px", 0.0, 10.0),
    ("register.min_confidence", 0.0, 1.0),
    ("register.coarse_angles", 4.0, 3600.0),
    ("register.fine_angles", 2.0, 3600.0),
];

/// The first of each two is below the second.
const RISING: &[(&str, &str)] = &[
    ("normalize.character_px", "normalize.canvas_px"),
    ("normalize.threshold_min", "normalize.threshold_max"),
];

/// Settings of two numbers of which the first is not above the second.
const SPANS: &[&str] = &["normalize.density_greys", "normalize.structure_greys"];

/// Holds every number to its range and to its neighbour.
///
/// # Errors
/// For the first number that is out of place.
pub(super) fn check(tree: &Tree) -> Result<(), ConfigError> {
    let settings = tree.settings();
    check_ranges(&settings)?;
    let find = |key: &str| settings.iter().find(|setting| setting.key == key);
    for (low, high) in RISING {
        if let (Some(low), Some(high)) = (find(low), find(high)) {
            check_rising(low, high)?;
        }
    }
    if let (Some(normalize), Some(register)) = (find("normalize.method"), find("register.method")) {
        check_methods(normalize, register)?;
    }
    for span in SPANS.iter().filter_map(|key| find(key)) {
        check_span(span)?;
    }
    Ok(())
}

/// `refine` starts from the pose that `bounding_box` does not look for: without this every pair would fail.
fn check_methods(normalize: &Setting, register: &Setting) -> Result<(), ConfigError> {
    let is = |setting: &Setting, name: &str| setting.value.as_str() == Some(name);
    if !(is(normalize, "bounding_box") && is(register, "refine")) {
        return Ok(());
    }
    Err(match register.origin {
        Origin::Default => bad(
            normalize,
            "needs register.method = \"exhaustive\"".to_owned(),
        ),
        Origin::Preset(_) | Origin::File(_) | Origin::Env(_) | Origin::Flag => bad(
            register,
            "needs normalize.method = \"pose_first\"".to_owned(),
        ),
    })
}

/// The one of the two that somebody set is to blame, the lower one where both or neither are.
fn check_rising(low: &Setting, high: &Setting) -> Result<(), ConfigError> {
    match (number(&low.value), number(&high.value)) {
        (Some(a), Some(b)) if a >= b => {
            let (blamed, reason) = match low.origin {
                Origin::Default => (high, format!("must be above {} = {}", low.key, low.value)),
                Origin::Preset(_) | Origin::File(_) | Origin::Env(_) | Origin::Flag => {
                    (low, format!("must be below {} = {}", high.key, high.value))
                }
            };
            Err(bad(blamed, reason))
        }
        _ => Ok(()),
    }
}

fn check_span(setting: &Setting) -> Result<(), ConfigError> {
    let ends: Option<Vec<f64>> = setting
        .value
        .as_array()
        .and_then(|values| values.iter().map(number).collect());
    match ends.as_deref() {
        Some([first, last]) if first > last => {
            Err(bad(setting, "the first is above the last".to_owned()))
        }
        _ => Ok(()),
    }
}

fn bad(setting: &Setting, reason: String) -> ConfigError {
    ConfigError::Value {
        origin: setting.origin.clone(),
        key: setting.key.clone(),
        value: setting.value.to_string(),
        reason,
    }
}

fn check_ranges(settings: &[Setting]) -> Result<(), ConfigError> {
    for setting in settings {
        let Some((_, min, max)) = RANGES.iter().find(|(key, ..)| *key == setting.key) else {
            continue;
        };
        let inside = number(&setting.value).is_none_or(|value| (*min..=*max).contains(&value));
        if !inside {
            return Err(ConfigError::Range {
                origin: setting.origin.clone(),
                key: setting.key.clone(),
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
    use super::{RANGES, RISING, SPANS, Tree, check};
    use crate::config::{Origin, Preset};

    fn complaint(key: &str, value: toml::Value) -> String {
        let mut tree = Tree::new(Preset::Default.table().expect("valid TOML"));
        for change in tree.change(key, value, &Origin::Flag).expect("a known key") {
            tree.apply(&change);
        }
        check(&tree).expect_err("out of place").to_string()
    }

    #[test]
    fn neighbours_out_of_order_are_refused() {
        assert_eq!(
            complaint("normalize.canvas_px", 128.into()),
            "--set: normalize.canvas_px = 128: must be above normalize.character_px = 192"
        );
        assert_eq!(
            complaint("normalize.method", "bounding_box".into()),
            "--set: normalize.method = \"bounding_box\": needs register.method = \"exhaustive\""
        );
        let greys = toml::Value::from(vec![9, 5]);
        assert!(complaint("normalize.density_greys", greys).ends_with("above the last"));
        assert!(complaint("fit.spacing", f64::NAN.into()).contains("outside"));
    }

    #[test]
    fn every_range_is_of_a_setting_that_exists() {
        let tree = Tree::new(Preset::Default.table().expect("valid TOML"));
        let settings = tree.settings();
        let rising = RISING.iter().flat_map(|(low, high)| [low, high]);
        for key in RANGES
            .iter()
            .map(|(key, ..)| key)
            .chain(rising)
            .chain(SPANS)
        {
            assert!(settings.iter().any(|setting| setting.key == *key), "{key}");
        }
        assert!(RANGES.iter().all(|(_, min, max)| min < max));
    }
}
