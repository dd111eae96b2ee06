//! What can be wrong with settings; each message names where the value stands and its key.

use std::path::PathBuf;

use super::Origin;

/// A setting that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read settings from {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The text is not TOML.
    #[error("{origin}: line {line}: {reason}")]
    Syntax {
        /// Whose text.
        origin: Origin,
        /// Line, from 1.
        line: usize,
        /// The parser's reason.
        reason: String,
    },
    /// A section or key that does not exist.
    #[error("{origin}: there is no setting {key}{hint}")]
    Unknown {
        /// Where it stands.
        origin: Origin,
        /// Dotted key.
        key: String,
        /// A guess at what was meant, or empty.
        hint: String,
    },
    /// A section where a value stands, or the other way round.
    #[error("{origin}: {key} is a section; give its keys one by one")]
    NotASection {
        /// Where it stands.
        origin: Origin,
        /// Dotted key.
        key: String,
    },
    /// A value of the wrong type, or one that the setting does not know.
    #[error("{origin}: {key} = {value}: {reason}")]
    Value {
        /// Where it stands.
        origin: Origin,
        /// Dotted key.
        key: String,
        /// The value as TOML.
        value: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A number outside its range.
    #[error("{origin}: {key} = {value} is outside {min} to {max}")]
    Range {
        /// Where it stands.
        origin: Origin,
        /// Dotted key.
        key: String,
        /// The value as TOML.
        value: String,
        /// Smallest allowed.
        min: f64,
        /// Largest allowed.
        max: f64,
    },
    /// A preset that does not exist.
    #[error("{origin}: there is no preset {name:?}, only default and paper{hint}")]
    UnknownPreset {
        /// Where it stands.
        origin: Origin,
        /// As written.
        name: String,
        /// A guess at what was meant, or empty.
        hint: String,
    },
    /// `--set` without `=`, or without a section.
    #[error("--set {text:?} is not of the form section.key=value")]
    SetForm {
        /// As typed.
        text: String,
    },
    /// The embedded texts and the structs disagree: a defect of the program.
    #[error("the built-in settings do not fit together: {0}")]
    BuiltIn(String),
}
