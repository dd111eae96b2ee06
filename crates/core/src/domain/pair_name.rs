//! The user's id of a pair.

use std::borrow::Cow;
use std::fmt::Write as _;

use percent_encoding::percent_decode_str;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::spelling::{composed, fold_case};
use super::{ErrorCode, Explained, is_hidden, sanitize};

/// Characters of an id that a file name on Windows may not have, and the escape character itself. All are ASCII.
const ESCAPED: &str = "%\"*:<>?|";
/// Names that are devices on Windows, with and without an extension.
const DEVICES: [&str; 6] = ["con", "prn", "aux", "nul", "conin$", "conout$"];
/// Devices with a number from 0 to 9, which may be a superscript.
const NUMBERED_DEVICES: [&str; 2] = ["com", "lpt"];

/// Spaces that text programs write and nobody sees.
pub const NO_BREAK_SPACES: [char; 3] = ['\u{a0}', '\u{2007}', '\u{202f}'];

/// The user's id of a pair: any text of 1 to 200 bytes without control characters, invisible characters, slashes, a
/// leading dot, and spaces at its ends. It is stored in Unicode's composed form (NFC) and with plain spaces, so the same
/// id typed on macOS and on Windows is equal.
///
/// ```
/// use mocban_core::domain::PairName;
///
/// assert_eq!(PairName::new("chữ số 1").map(|name| name.to_string()), Ok("chữ số 1".to_owned()));
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
    /// The id has a character that is not allowed.
    #[error("id \"{shown}\" holds {1:?}; an id has no slashes, control or invisible characters", shown = sanitize(.0, 48))]
    Character(String, char),
    /// The id has several lines.
    #[error("id \"{shown}\" has a line break; write it on one line", shown = sanitize(.0, 48))]
    LineBreak(String),
    /// The id has a tab between other characters.
    #[error("id \"{shown}\" has a tab; remove it", shown = sanitize(.0, 48))]
    Tab(String),
    /// The id begins with a dot.
    #[error("id \"{shown}\" begins with a dot", shown = sanitize(.0, 48))]
    LeadingDot(String),
    /// The id begins or ends with a space.
    #[error("id \"{shown}\" begins or ends with a space", shown = sanitize(.0, 48))]
    OuterSpace(String),
    /// The id is too long for file names derived from it.
    #[error("an id of {0} bytes is too long; the limit is {limit}", limit = PairName::MAX_BYTES)]
    TooLong(usize),
}

impl Explained for PairNameError {
    fn code(&self) -> ErrorCode {
        ErrorCode::Usage
    }
}

impl PairName {
    /// Maximum length of an id, and of the file name derived from it, in bytes.
    pub const MAX_BYTES: usize = 200;

    /// Validates an id and converts it to NFC.
    ///
    /// # Errors
    /// Returns an error if the id is empty, too long, or has a character that is not allowed.
    pub fn new(text: &str) -> Result<Self, PairNameError> {
        if text.is_empty() {
            return Err(PairNameError::Empty);
        }
        let is_bad = |c: &char| matches!(c, '/' | '\\') || is_hidden(*c);
        if let Some(bad) = text.chars().find(is_bad) {
            let text = text.to_owned();
            return Err(match bad {
                '\n' | '\r' => PairNameError::LineBreak(text),
                '\t' => PairNameError::Tab(text),
                bad => PairNameError::Character(text, bad),
            });
        }
        if text.starts_with('.') {
            return Err(PairNameError::LeadingDot(text.to_owned()));
        }
        if text.trim() != text {
            return Err(PairNameError::OuterSpace(text.to_owned()));
        }
        let name = Self(composed(text).replace(NO_BREAK_SPACES, " "));
        let longest = name.0.len().max(name.file_name().len());
        if longest > Self::MAX_BYTES {
            return Err(PairNameError::TooLong(longest));
        }
        Ok(name)
    }

    /// Returns the id.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns the id as a file name that is valid on every system: characters that Windows does not allow are
    /// percent-encoded, and so are a final dot and the first letter of a device name. Different ids have different
    /// file names.
    ///
    /// ```
    /// use mocban_core::domain::PairName;
    ///
    /// let file_name = |id| PairName::new(id).map(|name| name.file_name().into_owned());
    /// assert_eq!(file_name("chữ số 1"), Ok("chữ số 1".to_owned()));
    /// assert_eq!(file_name("tờ 3: 天?"), Ok("tờ 3%3A 天%3F".to_owned()));
    /// assert_eq!(file_name("con"), Ok("%63on".to_owned()));
    /// ```
    pub fn file_name(&self) -> Cow<'_, str> {
        let (device, last) = (is_device(&self.0), self.0.len() - 1);
        let is_escaped = |(at, c): (usize, char)| {
            ESCAPED.contains(c) || (at == 0 && device) || (at == last && c == '.')
        };
        if !self.0.char_indices().any(is_escaped) {
            return Cow::Borrowed(&self.0);
        }
        let mut name = String::with_capacity(self.0.len() + 8);
        for (at, c) in self.0.char_indices() {
            if is_escaped((at, c)) {
                let _ = write!(name, "%{:02X}", u32::from(c));
            } else {
                name.push(c);
            }
        }
        Cow::Owned(name)
    }

    /// Returns the id as file systems compare names that ignore case, such as those of Windows and macOS. Files of two
    /// pairs fall together there if these forms are equal.
    ///
    /// ```
    /// use mocban_core::domain::PairName;
    ///
    /// let folded = |id| PairName::new(id).map(|name| name.folded());
    /// assert_eq!(folded("Đĩa A1"), folded("đĩa a1"));
    /// assert_ne!(folded("đĩa"), folded("dia"));
    /// ```
    pub fn folded(&self) -> String {
        fold_case(&self.0)
    }

    /// Returns the id with this file name. `None` if no id has it.
    pub fn of_file_name(file_name: &str) -> Option<Self> {
        let text = percent_decode_str(file_name).decode_utf8().ok()?;
        let name = Self::new(&text).ok()?;
        (name.file_name() == file_name).then_some(name)
    }
}

/// Returns whether a file of this name is a device on Windows.
pub fn is_device(text: &str) -> bool {
    let stem = text.split('.').next().unwrap_or(text).trim_end();
    let is_in = |devices: &[&str], name: &str| {
        let mut devices = devices.iter();
        devices.any(|device| name.eq_ignore_ascii_case(device))
    };
    let is_number = |c: char| c.is_ascii_digit() || "\u{b9}\u{b2}\u{b3}".contains(c);
    let unnumbered = stem.strip_suffix(is_number);
    is_in(&DEVICES, stem) || unnumbered.is_some_and(|name| is_in(&NUMBERED_DEVICES, name))
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
    use proptest::prelude::*;

    use super::{PairName, PairNameError};

    #[test]
    fn an_invalid_id_is_shown_sanitized_and_short() {
        for text in ["a\u{1b}[2J".to_owned(), format!("/{}", "\u{e9}".repeat(60))] {
            let refused = PairName::new(&text).expect_err("an error").to_string();
            assert!(!refused.contains(&text), "{refused:?}");
        }
    }

    #[test]
    fn ids_of_any_script_are_accepted() {
        for text in [
            "chữ số 1",
            "天",
            "b01.0002",
            "số 3 (bản sao)",
            "-a",
            "𠖾",
            "123456789012_A-z",
        ] {
            assert_eq!(PairName::new(text).map(String::from), Ok(text.to_owned()));
        }
    }

    #[test]
    fn composed_and_decomposed_ids_are_equal() {
        let [composed, decomposed] = ["chữ", "chu\u{31b}\u{303}"];
        assert_ne!(composed, decomposed);
        assert_eq!(PairName::new(composed), PairName::new(decomposed));
        assert_eq!(PairName::new("tờ\u{a0}3"), PairName::new("tờ 3"));
    }

    #[test]
    fn texts_that_cannot_name_a_file_are_refused() {
        let character = |text: &str, c| Err(PairNameError::Character(text.into(), c));
        assert_eq!(PairName::new(""), Err(PairNameError::Empty));
        assert_eq!(PairName::new("a/b"), character("a/b", '/'));
        assert_eq!(PairName::new("a\\b"), character("a\\b", '\\'));
        let tab = PairName::new("a\tb").expect_err("a tab");
        assert_eq!(tab.to_string(), "id \"a b\" has a tab; remove it");
        for text in ["a\nb", "a\r\nb"] {
            let refused = PairName::new(text).expect_err("two lines");
            assert_eq!(refused, PairNameError::LineBreak(text.into()));
            let sentence = refused.to_string();
            assert!(sentence.ends_with("\" has a line break; write it on one line"));
        }
        assert_eq!(
            PairName::new("a\u{202e}b"),
            character("a\u{202e}b", '\u{202e}')
        );
        assert_eq!(
            PairName::new(".a"),
            Err(PairNameError::LeadingDot(".a".into()))
        );
        assert_eq!(
            PairName::new("a "),
            Err(PairNameError::OuterSpace("a ".into()))
        );
        assert!(PairName::new(&"x".repeat(200)).is_ok());
        assert_eq!(
            PairName::new(&"x".repeat(201)),
            Err(PairNameError::TooLong(201))
        );
        assert_eq!(
            PairName::new(&"?".repeat(70)),
            Err(PairNameError::TooLong(210))
        );
    }

    #[test]
    fn file_names_are_valid_on_windows() {
        let of = |text| PairName::new(text).expect(text).file_name().into_owned();
        assert_eq!(of("a:b*c|d<e>f\"g?h%"), "a%3Ab%2Ac%7Cd%3Ce%3Ef%22g%3Fh%25");
        assert_eq!(of("tờ 1."), "tờ 1%2E");
        assert_eq!(of("nul.1"), "%6Eul.1");
        assert_eq!(of("COM7"), "%43OM7");
        assert_eq!(of("lpt\u{b2}.a"), "%6Cpt\u{b2}.a");
        assert_eq!(of("CONIN$"), "%43ONIN$");
        assert_eq!(of("COM10"), "COM10");
        assert_eq!(of("aux."), "%61ux%2E");
    }

    proptest! {
        #[test]
        fn an_id_is_found_again_by_its_file_name(text in "[a-cé%:.?* ]{1,12}|con|nul\\.") {
            if let Ok(name) = PairName::new(&text) {
                let file_name = name.file_name().into_owned();
                prop_assert!(!file_name.contains([':', '?', '*', '/']) && !file_name.ends_with('.'));
                prop_assert_eq!(PairName::of_file_name(&file_name), Some(name));
            }
        }
    }
}
