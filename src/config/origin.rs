//! Where the value of a setting came from.

use std::path::PathBuf;

use crate::domain::sanitize;

/// A layer of settings; later variants win over earlier ones.
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
            Self::Env(name) => f.write_str(&sanitize(name, 160)),
            Self::Flag => f.write_str("--set"),
        }
    }
}
