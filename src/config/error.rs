//! Errors of settings: the layer that set the value, the key, what is wrong, and what was probably meant.

use std::path::PathBuf;

use crate::domain::sanitize;

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
            Self::Env(name) => f.write_str(&sanitize(name, MAX_QUOTE)),
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
    /// The text is not TOML.
    #[error("{origin}: line {line}: {}", sanitize(reason, MAX_QUOTE))]
    Syntax {
        /// The layer.
        origin: Origin,
        /// Line, from 1.
        line: usize,
        /// The parser's message.
        reason: String,
    },
    /// A section or key that does not exist.
    #[error("{origin}: there is no setting {}{hint}", sanitize(key, MAX_QUOTE))]
    Unknown {
        /// The layer.
        origin: Origin,
        /// Dotted key.
        key: String,
        /// A suggestion, or empty.
        hint: String,
    },
    /// A value in place of a section.
    #[error(
        "{origin}: {} is a section; set its keys one by one",
        sanitize(key, MAX_QUOTE)
    )]
    NotASection {
        /// The layer.
        origin: Origin,
        /// Dotted key.
        key: String,
    },
    /// A value of the wrong type, or one that the setting does not accept.
    #[error(
        "{origin}: {} = {}: {}",
        sanitize(key, MAX_QUOTE),
        sanitize(value, MAX_QUOTE),
        sanitize(reason, MAX_QUOTE)
    )]
    Value {
        /// The layer.
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
        "{origin}: {} = {} is outside the range {range}",
        sanitize(key, MAX_QUOTE),
        sanitize(value, MAX_QUOTE)
    )]
    Range {
        /// The layer.
        origin: Origin,
        /// Dotted key.
        key: String,
        /// The value as TOML.
        value: String,
        /// The allowed values.
        range: String,
    },
    /// A preset that does not exist.
    #[error(
        "{origin}: there is no preset \"{}\", only default and paper{hint}",
        sanitize(name, MAX_QUOTE)
    )]
    UnknownPreset {
        /// The layer.
        origin: Origin,
        /// As written.
        name: String,
        /// A suggestion, or empty.
        hint: String,
    },
    /// `--set` without `=`, or without a section.
    #[error(
        "--set \"{}\" is not of the form section.key=value",
        sanitize(text, MAX_QUOTE)
    )]
    SetForm {
        /// As typed.
        text: String,
    },
    /// The embedded texts and the structs disagree: a defect of this program.
    #[error("the built-in settings are inconsistent: {0}")]
    BuiltIn(String),
}

/// Returns up to `limit` of the known names that are similar to a mistyped one, most similar first.
///
/// A name is similar if at most a third of the longer name must be edited, or one name starts with the other.
pub fn nearest<'a>(
    typed: &str,
    known: impl IntoIterator<Item = &'a str>,
    limit: usize,
) -> Vec<&'a str> {
    let mut ranked: Vec<(usize, &str)> = known
        .into_iter()
        .filter_map(|name| distance_if_similar(typed, name).map(|edits| (edits, name)))
        .collect();
    ranked.sort_unstable();
    ranked.dedup();
    ranked.truncate(limit);
    ranked.into_iter().map(|(_, name)| name).collect()
}

/// Returns a suggestion such as `; did you mean "workers"?`, or nothing if no name is similar.
pub fn hint<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest(typed, known, 1).first() {
        Some(name) => format!("; did you mean {name:?}?"),
        None => String::new(),
    }
}

fn distance_if_similar(typed: &str, name: &str) -> Option<usize> {
    let longer = typed.chars().count().max(name.chars().count());
    let allowed = (longer / 3).max(1);
    let edits = strsim::osa_distance(typed, name);
    let is_prefix = !typed.is_empty() && (name.starts_with(typed) || typed.starts_with(name));
    (edits <= allowed || is_prefix).then_some(edits)
}

#[cfg(test)]
mod tests {
    use super::{ConfigError, MAX_QUOTE, Origin, hint, nearest};

    #[test]
    fn similar_names_come_in_order_and_others_not_at_all() {
        let known = ["0001", "0011", "9999"];
        assert_eq!(nearest("001", known, 5), ["0001", "0011"]);
        assert!(nearest("zebra", known, 5).is_empty());
        assert_eq!(hint("zebra", known), "");
        assert_eq!(hint("0001x", ["0001"]), "; did you mean \"0001\"?");
        assert_eq!(
            hint("wrokers", ["workers"]),
            "; did you mean \"workers\"?",
            "a swap of neighbours is one edit"
        );
    }

    /// Text from outside is shown without control characters, and shortened.
    #[test]
    fn quoted_text_is_sanitized_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(MAX_QUOTE + 1)] {
            for error in errors(&rude) {
                let text = error.to_string();
                assert!(!text.contains(&rude), "{error:?}: {text:?}");
            }
        }
    }

    /// Returns errors that each quote one text from outside.
    fn errors(rude: &str) -> Vec<ConfigError> {
        let (origin, quote) = (|| Origin::Flag, || rude.to_owned());
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
            range: "0 to 1".to_owned(),
        };
        vec![
            ConfigError::Syntax {
                origin: origin(),
                line: 1,
                reason: quote(),
            },
            ConfigError::Unknown {
                origin: origin(),
                key: quote(),
                hint: String::new(),
            },
            ConfigError::NotASection {
                origin: origin(),
                key: quote(),
            },
            value(rude, "1", "no"),
            value("key", rude, "no"),
            value("key", "1", rude),
            range(rude, "1"),
            range("key", rude),
            ConfigError::UnknownPreset {
                origin: origin(),
                name: quote(),
                hint: String::new(),
            },
            ConfigError::SetForm { text: quote() },
            ConfigError::NotASection {
                origin: Origin::Env(quote()),
                key: String::new(),
            },
        ]
    }
}
