//! What the page sends, checked.

use serde::Deserialize;

use super::card::Card;
use super::desk::Desk;
use crate::catalog::{Look, NewVerdict};
use crate::domain::{Reason, Verdict};

/// Longest note in characters.
const NOTE_CHARS: usize = 2000;

/// An answer as the page sends it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnswerBody {
    /// The page's number of the act; sent again, it is stored once.
    pub(super) event: String,
    /// The card.
    pub(super) item: String,
    verdict: Verdict,
    reason: Option<Reason>,
    note: Option<String>,
    angle_read_deg: Option<f64>,
    shown_ms: Option<u64>,
}

/// Taking something back.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UndoBody {
    /// The number of what is taken back.
    pub(super) event: String,
}

/// Why what the page sent makes no sense.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum BadAnswer {
    /// A number of another form.
    #[error("an event is 1 to 64 letters, digits and hyphens")]
    Event,
    /// A reason without a fail.
    #[error("only a fail has a reason")]
    Reason,
    /// A note of a length that nobody types.
    #[error("a note has at most {NOTE_CHARS} characters")]
    Note,
    /// An angle past half a turn.
    #[error("an angle is from -180 to 180 degrees")]
    Angle,
    /// A time that no page is open for.
    #[error("a picture is not shown that long")]
    Shown,
    /// A map that flattens, or makes much larger or smaller.
    #[error("the relief cannot be laid like that")]
    Map,
}

impl AnswerBody {
    /// The verdict to store.
    ///
    /// # Errors
    /// When it makes no sense.
    pub(super) fn verdict(&self, card: &Card, desk: &Desk) -> Result<NewVerdict, BadAnswer> {
        check_event(&self.event)?;
        if self.reason.is_some() && self.verdict != Verdict::Fail {
            return Err(BadAnswer::Reason);
        }
        if self
            .angle_read_deg
            .is_some_and(|angle| angle.is_nan() || angle.abs() > 180.0)
        {
            return Err(BadAnswer::Angle);
        }
        if self.shown_ms.is_some_and(|ms| i64::try_from(ms).is_err()) {
            return Err(BadAnswer::Shown);
        }
        Ok(NewVerdict {
            pair: card.pair.clone(),
            metric: None,
            verdict: self.verdict,
            reviewer: desk.deck_options.reviewer.clone(),
            reason: self.reason,
            note: note(self.note.as_deref())?,
            look: Look {
                event: Some(self.event.clone()),
                seen: Some(card.view.seen()),
                shown_ms: self.shown_ms,
                angle_read_deg: self.angle_read_deg,
                review_order: Some(desk.deck_options.order),
            },
            at: None,
        })
    }
}

/// A note without what is around it; none where nothing is left.
pub(super) fn note(text: Option<&str>) -> Result<Option<String>, BadAnswer> {
    let text = text.map(str::trim).filter(|text| !text.is_empty());
    match text {
        Some(text) if text.chars().count() > NOTE_CHARS => Err(BadAnswer::Note),
        Some(text) => Ok(Some(text.to_owned())),
        None => Ok(None),
    }
}

/// Refuses numbers of acts that no page makes.
pub(super) fn check_event(event: &str) -> Result<(), BadAnswer> {
    let is_plain = event
        .bytes()
        .all(|byte| byte.is_ascii_alphanumeric() || byte == b'-');
    if is_plain && (1..=64).contains(&event.len()) {
        Ok(())
    } else {
        Err(BadAnswer::Event)
    }
}

#[cfg(test)]
mod tests {
    use super::{BadAnswer, NOTE_CHARS, check_event, note};

    #[test]
    fn numbers_of_acts_are_short_and_plain() {
        assert_eq!(check_event("3f2a-77"), Ok(()));
        for wrong in ["", "a b", "a'b", "é", &"x".repeat(65)] {
            assert_eq!(check_event(wrong), Err(BadAnswer::Event), "{wrong}");
        }
    }

    #[test]
    fn an_empty_note_is_none_and_a_book_is_refused() {
        assert_eq!(note(Some("  ")), Ok(None));
        assert_eq!(note(Some(" mờ ")), Ok(Some("mờ".to_owned())));
        let book = "ữ".repeat(NOTE_CHARS + 1);
        assert_eq!(note(Some(&book)), Err(BadAnswer::Note));
        assert!(note(Some(&book[..book.len() - 3])).is_ok());
    }
}
