//! Identifiers: the user's id of a pair, and row ids of the catalog.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sanitize;

/// Row id of a pair in the catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PairId(pub i64);

/// Row id of one start of a worker process; never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct WorkerId(pub i64);

/// The user's id of a pair: 1 to 128 characters of `[A-Za-z0-9_-]`, so that it is a valid file name on every system.
///
/// ```
/// use mocban::domain::PairName;
///
/// assert_eq!(PairName::new("b01_0002").map(|name| name.to_string()), Ok("b01_0002".to_owned()));
/// assert!(PairName::new("b01/0002").is_err());
/// ```
#[derive(
    Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(try_from = "String", into = "String")]
pub struct PairName(String);

/// Why an id is not valid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PairNameError {
    /// The id is empty.
    #[error("the id is empty")]
    Empty,
    /// The id has a character outside `[A-Za-z0-9_-]`.
    #[error("id \"{shown}\" holds {1:?}; an id is made of letters A-Z, digits, _ and -", shown = sanitize(.0, 48))]
    Character(String, char),
    /// The id is too long for file names derived from it.
    #[error("id of {0} characters is longer than 128")]
    TooLong(usize),
}

impl PairName {
    /// Maximum length in characters.
    pub const MAX_LEN: usize = 128;

    /// Validates an id.
    ///
    /// # Errors
    /// Returns an error if the id is empty, too long, or contains a character that is not allowed.
    pub fn new(text: &str) -> Result<Self, PairNameError> {
        if text.is_empty() {
            return Err(PairNameError::Empty);
        }
        if let Some(bad) = text
            .chars()
            .find(|c| !(c.is_ascii_alphanumeric() || *c == '_' || *c == '-'))
        {
            return Err(PairNameError::Character(text.to_owned(), bad));
        }
        if text.len() > Self::MAX_LEN {
            return Err(PairNameError::TooLong(text.len()));
        }
        Ok(Self(text.to_owned()))
    }

    /// Returns the id.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl std::str::FromStr for PairName {
    type Err = PairNameError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::new(text)
    }
}

impl TryFrom<String> for PairName {
    type Error = PairNameError;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        Self::new(&text)
    }
}

impl From<PairName> for String {
    fn from(name: PairName) -> Self {
        name.0
    }
}

impl std::fmt::Display for PairName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{PairName, PairNameError};

    #[test]
    fn an_invalid_id_is_shown_sanitized_and_short() {
        for text in ["a\u{1b}[2J".to_owned(), "\u{e9}".repeat(60)] {
            let refused = PairName::new(&text).expect_err("an error").to_string();
            assert!(!refused.contains(&text), "{refused:?}");
        }
    }

    #[test]
    fn slash_dot_and_empty_are_refused() {
        assert_eq!(PairName::new(""), Err(PairNameError::Empty));
        assert_eq!(
            PairName::new("a/b"),
            Err(PairNameError::Character("a/b".into(), '/'))
        );
        assert!(PairName::new("b01.0002").is_err());
        assert!(PairName::new(&"x".repeat(129)).is_err());
        assert!(PairName::new("123456789012_A-z").is_ok());
    }
}
