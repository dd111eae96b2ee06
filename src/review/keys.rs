//! Which key does what: by its place on the keyboard (`event.code`), because Vietnamese typing uses letters and digits
//! as tone marks.

use std::collections::BTreeMap;

/// Everything a key can do, in the order of the help.
pub(super) const ACTIONS: [&str; 40] = [
    "pass",
    "fail",
    "angle",
    "strokes_lost",
    "background_in",
    "shift_or_scale",
    "mirrored",
    "wrong_pair",
    "unsure",
    "note",
    "undo",
    "two_up",
    "overlay",
    "edges",
    "onion",
    "checker",
    "difference",
    "reveal",
    "flicker",
    "rock",
    "protractor",
    "strokes",
    "zoom",
    "turn_left",
    "turn_right",
    "less",
    "more",
    "reset",
    "next",
    "previous",
    "jump",
    "info",
    "help",
    "correct",
    "mirror",
    "larger",
    "smaller",
    "save",
    "leave",
    "other_language",
];

/// Why keys cannot be laid like that.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// A name that is no action.
    #[error("review.keys.{0}: there is no such action")]
    Unknown(String),
    /// Two actions on one key.
    #[error("review.keys: {key} is given to both {first} and {second}")]
    Twice {
        /// The key.
        key: String,
        /// One action.
        first: String,
        /// The other.
        second: String,
    },
    /// A key that is no `KeyboardEvent.code`.
    #[error(
        "review.keys.{action} is {key:?}, not the place of a key such as \"KeyP\", \"Digit1\" or \"\" for none"
    )]
    Form {
        /// The action.
        action: String,
        /// What it was given.
        key: String,
    },
}

/// Turns actions with their keys into keys with their actions. An empty key switches the action's key off.
///
/// # Errors
/// When an action is not known, or a key is given twice.
pub fn key_map(keys: &BTreeMap<String, String>) -> Result<BTreeMap<String, String>, KeyError> {
    let mut actions: BTreeMap<String, String> = BTreeMap::new();
    for (action, key) in keys {
        if !ACTIONS.contains(&action.as_str()) {
            return Err(KeyError::Unknown(action.clone()));
        }
        if !key.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
            return Err(KeyError::Form {
                action: action.clone(),
                key: key.clone(),
            });
        }
        if key.is_empty() {
            continue;
        }
        if let Some(first) = actions.insert(key.clone(), action.clone()) {
            return Err(KeyError::Twice {
                key: key.clone(),
                first,
                second: action.clone(),
            });
        }
    }
    Ok(actions)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{KeyError, key_map};

    fn map(pairs: &[(&str, &str)]) -> Result<BTreeMap<String, String>, KeyError> {
        let pairs = pairs
            .iter()
            .map(|(a, k)| ((*a).to_owned(), (*k).to_owned()));
        key_map(&pairs.collect())
    }

    #[test]
    fn an_empty_key_switches_an_action_off() {
        let keys = map(&[("pass", "KeyP"), ("fail", "")]).expect("valid");
        assert_eq!(
            keys.into_iter().collect::<Vec<_>>(),
            [("KeyP".into(), "pass".into())]
        );
    }

    #[test]
    fn keys_that_cannot_be_are_refused() {
        assert!(matches!(map(&[("pas", "KeyP")]), Err(KeyError::Unknown(_))));
        assert!(matches!(
            map(&[("pass", "<p>")]),
            Err(KeyError::Form { .. })
        ));
        let twice = map(&[("pass", "KeyP"), ("fail", "KeyP")]).expect_err("refused");
        assert_eq!(
            twice.to_string(),
            "review.keys: KeyP is given to both fail and pass"
        );
    }
}
