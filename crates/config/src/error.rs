//! Errors of settings. A message names the layer, the key and the problem, and may suggest a similar name.

use std::path::PathBuf;

use mocban_core::domain::{ErrorCode, Explained, sanitize};

/// Longest quotation in a message, in characters.
const MAX_QUOTE: usize = 160;

/// A layer of settings; later variants override earlier ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// The embedded `config/default.toml`.
    Default,
    /// A named preset, such as `paper`.
    Preset(&'static str),
    /// The project's `mocban.toml` or the file given by `--config`.
    File(PathBuf),
    /// An environment variable, by its name.
    Env(String),
    /// `--set` on the command line.
    Flag,
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Default => f.write_str("default"),
            Self::Preset(name) => write!(f, "preset {name}"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Env(name) => f.write_str(&quote(name)),
            Self::Flag => f.write_str("--set"),
        }
    }
}

/// A setting that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read settings from {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A layer is not TOML, or has an unknown key or an invalid value.
    #[error("{origin}: {problem}")]
    Layer {
        /// The layer.
        origin: Origin,
        /// The key, the value and the problem, sanitized.
        problem: String,
    },
    /// `--set` without `=`, or without a section.
    #[error("--set \"{}\" is not of the form section.key=value", quote(.0))]
    SetForm(String),
    /// The embedded texts and the structs disagree: a defect of this program.
    #[error("the built-in settings are inconsistent: {0}")]
    BuiltIn(String),
}

impl Explained for ConfigError {
    fn code(&self) -> ErrorCode {
        ErrorCode::Settings
    }
}

/// Sanitizes and shortens text from outside, so that messages can quote it.
pub(super) fn quote(text: &str) -> String {
    sanitize(text, MAX_QUOTE)
}
