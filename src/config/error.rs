//! What can be wrong with settings; each message names where the value stands and its key.

use std::path::PathBuf;

use super::Origin;
use crate::domain::sanitize;

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
    #[error("{origin}: line {line}: {}", sanitize(reason, LONGEST))]
    Syntax {
        /// Whose text.
        origin: Origin,
        /// Line, from 1.
        line: usize,
        /// The parser's reason.
        reason: String,
    },
    /// A section or key that does not exist.
    #[error("{origin}: there is no setting {}{hint}", sanitize(key, LONGEST))]
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
        sanitize(key, LONGEST)
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
        sanitize(key, LONGEST),
        sanitize(value, LONGEST),
        sanitize(reason, LONGEST)
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
        sanitize(key, LONGEST),
        sanitize(value, LONGEST)
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
        sanitize(name, LONGEST)
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
        sanitize(text, LONGEST)
    )]
    SetForm {
        /// As typed.
        text: String,
    },
    /// The embedded texts and the structs disagree: a defect of the program.
    #[error("the built-in settings do not fit together: {0}")]
    BuiltIn(String),
}

#[cfg(test)]
mod tests {
    use super::{ConfigError, LONGEST, Origin};

    /// Every word of a message that comes from outside is shown without commands to the screen, and short.
    #[test]
    fn words_of_others_come_plain_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(LONGEST + 1)] {
            for error in errors(&rude) {
                let said = error.to_string();
                assert!(!said.contains(&rude), "{error:?}: {said:?}");
            }
        }
    }

    /// Each with one word from outside.
    fn errors(rude: &str) -> Vec<ConfigError> {
        let (origin, word) = (|| Origin::Flag, || rude.to_owned());
        let value = |key: &str, value: &str, reason: &str| ConfigError::Value {
            origin: origin(),
            key: key.to_owned(),
            value: value.to_owned(),
            reason: reason.to_owned(),
        };
        let range = |key: &str, value: &str| ConfigError::Range {
            origin: origin(),
            key: key.to_owned(),
            value: value.to_owned(),
            min: 0.0,
            max: 1.0,
        };
        vec![
            ConfigError::Syntax {
                origin: origin(),
                line: 1,
                reason: word(),
            },
            ConfigError::Unknown {
                origin: origin(),
                key: word(),
                hint: String::new(),
            },
            ConfigError::NotASection {
                origin: origin(),
                key: word(),
            },
            value(rude, "1", "no"),
            value("key", rude, "no"),
            value("key", "1", rude),
            range(rude, "1"),
            range("key", rude),
            ConfigError::UnknownPreset {
                origin: origin(),
                name: word(),
                hint: String::new(),
            },
            ConfigError::SetForm { text: word() },
            ConfigError::NotASection {
                origin: Origin::Env(word()),
                key: String::new(),
            },
        ]
    }
}
