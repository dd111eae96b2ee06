//! Errors of settings. A message names the layer, the key and the problem, and may suggest a similar name.

use std::path::PathBuf;

use mocban_core::domain::sanitize;

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

/// Sanitizes and shortens text from outside, so that messages can quote it.
pub(super) fn quote(text: &str) -> String {
    sanitize(text, MAX_QUOTE)
}

/// Returns up to `limit` of the known names that are similar to a mistyped name, most similar first.
///
/// Two names are similar if one starts with the other, or if their edit distance is 1 or at most a third of the longer
/// name's length.
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
    use super::{hint, nearest};

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
}
