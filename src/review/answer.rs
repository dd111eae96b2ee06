//! Answers as the page sends them, validated.

use serde::Deserialize;

use super::item::ReviewItem;
use super::state::ServerState;
use crate::catalog::{NewVerdict, ReviewContext};
use crate::domain::{Reason, Verdict};

/// Maximum length of a note in characters.
const NOTE_CHARS: usize = 2000;

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
    #[error("an event is 1 to 64 letters, digits and hyphens")]
    Event,
    #[error("only a fail has a reason")]
    Reason,
    #[error("a note has at most {NOTE_CHARS} characters")]
    Note,
    #[error("an angle is from -180 to 180 degrees")]
    Angle,
    #[error("the display time is too long")]
    ShownMs,
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
        check_event(&self.event)?;
        if self.reason.is_some() && self.verdict != Verdict::Fail {
            return Err(InvalidInput::Reason);
        }
        let is_angle = |angle: f64| angle.abs() <= 180.0;
        if !self.angle_read_deg.is_none_or(is_angle) {
            return Err(InvalidInput::Angle);
        }
        if self.shown_ms.is_some_and(|ms| i64::try_from(ms).is_err()) {
            return Err(InvalidInput::ShownMs);
        }
        Ok(NewVerdict {
            pair: item.pair.clone(),
            metric: None,
            verdict: self.verdict,
            reviewer: state.options.queue.reviewer.clone(),
            reason: self.reason,
            note: check_note(self.note.as_deref())?,
            look: ReviewContext {
                event: Some(self.event.clone()),
                seen: Some(item.view.hash()),
                shown_ms: self.shown_ms,
                angle_read_deg: self.angle_read_deg,
                review_order: Some(state.options.queue.order),
            },
            at: None,
        })
    }
}

/// Trims a note. Returns `None` if nothing is left.
///
/// # Errors
/// Returns an error if the note is too long.
pub(super) fn check_note(text: Option<&str>) -> Result<Option<String>, InvalidInput> {
    let text = text.map(str::trim).filter(|text| !text.is_empty());
    match text {
        Some(text) if text.chars().count() > NOTE_CHARS => Err(InvalidInput::Note),
        Some(text) => Ok(Some(text.to_owned())),
        None => Ok(None),
    }
}

/// Checks the form of an event id.
///
/// # Errors
/// Returns an error if the id is empty or too long, or has characters other than letters, digits and hyphens.
pub(super) fn check_event(event: &str) -> Result<(), InvalidInput> {
    let is_valid = event
        .bytes()
        .all(|byte| byte.is_ascii_alphanumeric() || byte == b'-');
    if is_valid && (1..=64).contains(&event.len()) {
        Ok(())
    } else {
        Err(InvalidInput::Event)
    }
}

#[cfg(test)]
mod tests {
    use super::{InvalidInput, NOTE_CHARS, check_event, check_note};

    #[test]
    fn event_ids_are_short_and_alphanumeric() {
        assert_eq!(check_event("3f2a-77"), Ok(()));
        for wrong in ["", "a b", "a'b", "é", &"x".repeat(65)] {
            assert_eq!(check_event(wrong), Err(InvalidInput::Event), "{wrong}");
        }
    }

    #[test]
    fn an_empty_note_is_none_and_a_long_one_is_refused() {
        assert_eq!(check_note(Some("  ")), Ok(None));
        assert_eq!(check_note(Some(" mờ ")), Ok(Some("mờ".to_owned())));
        let long = "ữ".repeat(NOTE_CHARS + 1);
        assert_eq!(check_note(Some(&long)), Err(InvalidInput::Note));
        assert!(check_note(Some(&long[..long.len() - 3])).is_ok());
    }
}
