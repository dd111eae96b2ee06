//! Answers as the page sends them, validated.

use serde::Deserialize;

use super::item::ReviewItem;
use super::state::ServerState;
use mocban_catalog::{InvalidVerdict, NOTE_CHARS, NewVerdict, ReviewContext};
use mocban_core::domain::{Reason, Verdict};

/// An answer as the page sends it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnswerBody {
    /// Id that the page generates for this event. If the page sends the event twice, it is stored once.
    pub(super) event: String,
    /// Id of the item.
    pub(super) item: String,
    verdict: Verdict,
    reason: Option<Reason>,
    note: Option<String>,
    angle_read_deg: Option<f64>,
    shown_ms: Option<u64>,
}

/// A request to undo an event.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UndoBody {
    /// Id of the event to undo.
    pub(super) event: String,
}

/// Why a request from the page is not valid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum InvalidInput {
    #[error(transparent)]
    Verdict(#[from] InvalidVerdict),
    #[error("the map is singular, or its scale or shift is out of range")]
    Map,
}

impl AnswerBody {
    /// Returns the verdict to store.
    ///
    /// # Errors
    /// Returns an error if a field is not valid.
    pub(super) fn verdict(
        &self,
        item: &ReviewItem,
        state: &ServerState,
    ) -> Result<NewVerdict, InvalidInput> {
        let verdict = NewVerdict {
            pair: item.pair.clone(),
            metric: None,
            verdict: self.verdict,
            reviewer: state.options.queue.reviewer.clone(),
            reason: self.reason,
            note: check_note(self.note.as_deref())?,
            context: ReviewContext {
                event: Some(self.event.clone()),
                seen: Some(item.view.hash()),
                shown_ms: self.shown_ms,
                angle_read_deg: self.angle_read_deg,
                review_order: Some(state.options.queue.order),
            },
            at: None,
        };
        verdict.check((state.options.now)())?;
        Ok(verdict)
    }
}

/// Trims a note. Returns `None` if nothing is left.
///
/// # Errors
/// Returns an error if the note is too long.
pub(super) fn check_note(text: Option<&str>) -> Result<Option<String>, InvalidInput> {
    let text = text.map(str::trim).filter(|text| !text.is_empty());
    match text {
        Some(text) if text.contains('\0') || text.chars().count() > NOTE_CHARS => {
            Err(InvalidVerdict::Note.into())
        }
        Some(text) => Ok(Some(text.to_owned())),
        None => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::check_note;
    use mocban_catalog::NOTE_CHARS;

    #[test]
    fn an_empty_note_is_none_and_a_long_one_is_refused() {
        assert_eq!(check_note(Some("  ")), Ok(None));
        assert_eq!(check_note(Some(" mờ ")), Ok(Some("mờ".to_owned())));
        let long = "ữ".repeat(NOTE_CHARS + 1);
        assert!(check_note(Some(&long)).is_err());
        assert!(check_note(Some(&long[..long.len() - 3])).is_ok());
    }
}
