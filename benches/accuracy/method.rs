//! A preset with overridden settings.

use mocban::config::{self, BaseLayer, Preset, Sources};
use mocban::stages::Settings;

/// How pairs are aligned.
#[derive(Debug, Clone)]
pub(super) struct Method {
    /// Name of the preset.
    pub(super) name: &'static str,
    /// Settings of the stages.
    pub(super) settings: Settings,
}

impl Method {
    /// Loads a preset with changed settings, each given as `SECTION.KEY=VALUE`. Ignores environment variables.
    pub(super) fn load(preset: Preset, sets: &[String]) -> anyhow::Result<Self> {
        let loaded = config::load(&Sources {
            base: BaseLayer::Preset(preset),
            env: Vec::new(),
            sets: sets.to_vec(),
        })?;
        Ok(Self {
            name: preset.name(),
            settings: loaded.config.stages,
        })
    }
}
