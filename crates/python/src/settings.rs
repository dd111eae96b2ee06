//! The settings of the stages and the limits of input files.

use std::sync::Arc;

use pyo3::prelude::*;

use crate::failure::raise;
use mocban_align::stages::Settings;
use mocban_config::{BaseLayer, Sources, load};
use mocban_core::InputLimits;

/// A preset with changes.
#[pyclass(frozen, module = "mocban._native")]
pub(crate) struct NativeSettings {
    pub(crate) stages: Arc<Settings>,
    pub(crate) limits: InputLimits,
    /// Most pixels of a print.
    #[pyo3(get)]
    max_pixels: u64,
    /// All settings in JSON.
    #[pyo3(get)]
    json: String,
}

#[pymethods]
impl NativeSettings {
    /// Loads a preset, with changes in the form `section.key=value`. The environment is not read.
    #[new]
    fn new(py: Python<'_>, preset: &str, sets: Vec<String>) -> PyResult<Self> {
        let refuse = |text: &str| {
            let text = text.strip_prefix("--set: ").unwrap_or(text);
            raise(py, "SettingsError", "settings", text, None)
        };
        let preset = preset.parse().map_err(|text: String| refuse(&text))?;
        let sources = Sources {
            base: BaseLayer::Preset(preset),
            env: Vec::new(),
            sets,
        };
        let loaded = load(&sources).map_err(|error| refuse(&error.to_string()))?;
        let config = loaded.config;
        let json = config
            .that_change_results()
            .map_err(|error| refuse(&error.to_string()))?;
        Ok(Self {
            stages: Arc::new(config.stages),
            limits: config.limits,
            max_pixels: config.limits.image.max_pixels,
            json: json.to_string(),
        })
    }
}
