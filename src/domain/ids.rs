//! Identities: the user's name of a pair, and the catalog's numbers.

use serde::{Deserialize, Serialize};

use super::sanitize;

/// A pair's number in the catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PairId(pub i64);

/// One start of a worker process; never used again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct WorkerId(pub i64);

/// The user's id of a pair: 1 to 128 characters of `[A-Za-z0-9_-]`, so that it can be a file name everywhere.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct PairName(String);

/// An id that cannot be a file name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PairNameError {
    /// No characters at all.
    #[error("the id is empty")]
    Empty,
    /// A character outside `[A-Za-z0-9_-]`.
    #[error("id \"{shown}\" holds {1:?}; an id is made of letters A-Z, digits, _ and -", shown = sanitize(.0, 48))]
    Character(String, char),
    /// Longer than a file name may be with our endings.
    #[error("id of {0} characters is longer than 128")]
    TooLong(usize),
}

impl PairName {
    /// Longest id in characters.
    pub const MAX_LEN: usize = 128;

    /// Checks an id.
    ///
    /// # Errors
    /// When it is empty, too long, or holds a character that is not allowed.
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

    /// The id as typed.
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
    fn a_refused_id_is_shown_plain_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "\u{e9}".repeat(60)] {
            let refused = PairName::new(&rude).expect_err("a refusal").to_string();
            assert!(!refused.contains(&rude), "{refused:?}");
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
