//! Key bindings. They refer to physical keys (`KeyboardEvent.code`), because Vietnamese input methods use letters and
//! digits as tone marks.

use std::collections::BTreeMap;

/// Groups of actions, in the order of the help: verdicts, display, navigation and dialogs, and manual alignment.
pub(super) const ACTIONS: [(&str, &str); 4] = [
    (
        "verdicts",
        "pass fail angle strokes_lost background_in shift_or_scale mirrored wrong_pair unsure note undo",
    ),
    (
        "modes",
        "two_up overlay edges onion checker difference reveal flicker auto_flicker angle_guides stroke_map zoom \
         scan_view rotate_left rotate_right less more reset",
    ),
    (
        "navigation",
        "next previous jump details guide help other_language",
    ),
    (
        "manual_alignment",
        "align mirror larger smaller save cancel",
    ),
];

/// Returns every action, in the order of the help.
pub(super) fn actions() -> impl Iterator<Item = &'static str> {
    let groups = ACTIONS.into_iter();
    groups.flat_map(|(_, actions)| actions.split_whitespace())
}

/// Why key bindings are not valid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// There is no action of this name.
    #[error("review.keys.{0}: there is no such action")]
    Unknown(String),
    /// Two actions have the same key.
    #[error("review.keys: {key} is given to both {first} and {second}")]
    Twice {
        /// The key.
        key: String,
        /// The first action.
        first: String,
        /// The other action.
        second: String,
    },
    /// The key is not a `KeyboardEvent.code`.
    #[error(
        "review.keys.{action} is {key:?}, not a physical key such as \"KeyP\", \"Digit1\" or \"\" for none"
    )]
    Form {
        /// The action.
        action: String,
        /// The invalid key.
        key: String,
    },
}

/// Converts a map of actions to keys into a map of keys to actions. An empty key disables the binding.
///
/// # Errors
/// Returns an error if an action is unknown, a key is not valid, or two actions have the same key.
pub fn key_map(keys: &BTreeMap<String, String>) -> Result<BTreeMap<String, String>, KeyError> {
    let mut bindings: BTreeMap<String, String> = BTreeMap::new();
    for (action, key) in keys {
        if actions().all(|known| known != action) {
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
        if let Some(first) = bindings.insert(key.clone(), action.clone()) {
            return Err(KeyError::Twice {
                key: key.clone(),
                first,
                second: action.clone(),
            });
        }
    }
    Ok(bindings)
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
    fn an_empty_key_disables_a_binding() {
        let keys = map(&[("pass", "KeyP"), ("fail", "")]).expect("valid");
        assert_eq!(
            keys.into_iter().collect::<Vec<_>>(),
            [("KeyP".into(), "pass".into())]
        );
    }

    #[test]
    fn invalid_bindings_are_refused() {
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
