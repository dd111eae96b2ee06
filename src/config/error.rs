//! What can be wrong with settings; each message names where the value stands and its key.

use std::path::PathBuf;

use super::Origin;
use crate::domain::plain;

/// Characters shown of what somebody wrote.
const LONGEST: usize = 160;

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
    #[error("{origin}: line {line}: {}", plain(reason, LONGEST))]
    Syntax {
        /// Whose text.
        origin: Origin,
        /// Line, from 1.
        line: usize,
        /// The parser's reason.
        reason: String,
    },
    /// A section or key that does not exist.
    #[error("{origin}: there is no setting {}{hint}", plain(key, LONGEST))]
    Unknown {
        /// Where it stands.
        origin: Origin,
        /// Dotted key.
        key: String,
        /// A guess at what was meant, or empty.
        hint: String,
    },
    /// A section where a value stands, or the other way round.
    #[error(
        "{origin}: {} is a section; give its keys one by one",
        plain(key, LONGEST)
    )]
    NotASection {
        /// Where it stands.
        origin: Origin,
        /// Dotted key.
        key: String,
    },
    /// A value of the wrong type, or one that the setting does not know.
    #[error(
        "{origin}: {} = {}: {}",
        plain(key, LONGEST),
        plain(value, LONGEST),
        plain(reason, LONGEST)
    )]
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
    #[error(
        "{origin}: {} = {} is outside {min} to {max}",
        plain(key, LONGEST),
        plain(value, LONGEST)
    )]
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
    #[error(
        "{origin}: there is no preset \"{}\", only default and paper{hint}",
        plain(name, LONGEST)
    )]
    UnknownPreset {
        /// Where it stands.
        origin: Origin,
        /// As written.
        name: String,
        /// A guess at what was meant, or empty.
        hint: String,
    },
    /// `--set` without `=`, or without a section.
    #[error(
        "--set \"{}\" is not of the form section.key=value",
        plain(text, LONGEST)
    )]
    SetForm {
        /// As typed.
        text: String,
    },
    /// The embedded texts and the structs disagree: a defect of the program.
    #[error("the built-in settings do not fit together: {0}")]
    BuiltIn(String),
}
