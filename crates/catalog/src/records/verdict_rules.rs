//! Which values a new verdict may have, wherever it comes from: the review page, a command or a file.

use crate::records::reviewer_names::person_name;
use crate::records::verdicts::NewVerdict;
use mocban_core::domain::{UnixMillis, Verdict, is_hidden};

/// Maximum length of a reviewer's name in characters.
const REVIEWER_CHARS: usize = 100;
/// Maximum length of a note in characters.
pub const NOTE_CHARS: usize = 2000;
/// Maximum length of an event id in characters.
const EVENT_CHARS: usize = 64;
/// How far the clock of the computer where a verdict was given may be ahead.
pub const CLOCK_SKEW_MS: UnixMillis = 5 * 60 * 1000;
/// How far a time may lie ahead of the clock: one without a time zone is read as UTC, and clocks are up to 14 hours ahead of
/// UTC.
const MAX_AHEAD_MS: UnixMillis = 14 * 60 * 60 * 1000 + CLOCK_SKEW_MS;

/// Why a verdict is not stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidVerdict {
    /// The name is empty, too long, or not one visible line.
    #[error("the reviewer's name must be one line of 1 to {REVIEWER_CHARS} visible characters")]
    Reviewer,
    /// The name is a word of an example.
    #[error("NAME and TÊN stand for a name; give the name of the reviewer")]
    Placeholder,
    /// A reason without a fail.
    #[error("only a fail has a reason")]
    Reason,
    /// The note is too long, or no text.
    #[error("a note is text of at most {NOTE_CHARS} characters")]
    Note,
    /// The id has another form.
    #[error("an event is 1 to {EVENT_CHARS} letters, digits and hyphens")]
    Event,
    /// The angle is out of range.
    #[error("an angle is from -180 to 180 degrees")]
    Angle,
    /// The time does not fit the catalog.
    #[error("the display time is too long")]
    ShownMs,
    /// The time cannot be that of a verdict.
    #[error("the time of a verdict is from 1970 to now")]
    At,
}

impl NewVerdict {
    /// Checks all values. `now` is the time of storing.
    ///
    /// # Errors
    /// Returns the first rule that a value breaks.
    pub fn check(&self, now: UnixMillis) -> Result<(), InvalidVerdict> {
        check_reviewer(&self.reviewer)?;
        if self.reason.is_some() && self.verdict != Verdict::Fail {
            return Err(InvalidVerdict::Reason);
        }
        let note = self.note.as_deref().unwrap_or_default();
        // PostgreSQL stores no zero character.
        if note.contains('\0') || note.chars().nth(NOTE_CHARS).is_some() {
            return Err(InvalidVerdict::Note);
        }
        let context = &self.context;
        context.event.as_deref().map_or(Ok(()), check_event)?;
        if !context
            .angle_read_deg
            .is_none_or(|angle| angle.abs() <= 180.0)
        {
            return Err(InvalidVerdict::Angle);
        }
        if context
            .shown_ms
            .is_some_and(|ms| i64::try_from(ms).is_err())
        {
            return Err(InvalidVerdict::ShownMs);
        }
        if !self
            .at
            .is_none_or(|at| (0..=now + MAX_AHEAD_MS).contains(&at))
        {
            return Err(InvalidVerdict::At);
        }
        Ok(())
    }
}

/// Returns a reviewer's name in its one spelling: see [`person_name`].
///
/// # Errors
/// Returns an error if the name is empty or too long, or has characters that are not shown.
pub fn reviewer_name(text: &str) -> Result<String, InvalidVerdict> {
    let name = person_name(text);
    check_reviewer(&name)?;
    Ok(name)
}

/// Checks the name of a reviewer.
///
/// # Errors
/// Returns an error if the name is empty or too long, has characters that are not shown, or is a word of an example.
fn check_reviewer(name: &str) -> Result<(), InvalidVerdict> {
    if matches!(
        name,
        "NAME" | "TÊN" | "<NAME>" | "<TÊN>" | "<name>" | "<tên>"
    ) {
        return Err(InvalidVerdict::Placeholder);
    }
    let is_valid = name.trim() == name && !name.contains(is_hidden);
    if is_valid && (1..=REVIEWER_CHARS).contains(&name.chars().count()) {
        Ok(())
    } else {
        Err(InvalidVerdict::Reviewer)
    }
}

/// Checks the form of an event id.
///
/// # Errors
/// Returns an error if the id is empty or too long, or has characters other than letters, digits and hyphens.
pub fn check_event(event: &str) -> Result<(), InvalidVerdict> {
    let mut bytes = event.bytes();
    let is_valid = bytes.all(|byte| byte.is_ascii_alphanumeric() || byte == b'-');
    if is_valid && (1..=EVENT_CHARS).contains(&event.len()) {
        Ok(())
    } else {
        Err(InvalidVerdict::Event)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        InvalidVerdict, MAX_AHEAD_MS, NOTE_CHARS, check_event, check_reviewer, reviewer_name,
    };
    use crate::{NewVerdict, ReviewContext};
    use mocban_core::domain::{Reason, Verdict};

    const NOW: i64 = 1_800_000_000_000;

    fn valid() -> NewVerdict {
        NewVerdict {
            pair: "0001".parse().expect("a name"),
            metric: None,
            verdict: Verdict::Fail,
            reviewer: "Lê Thị Lan".to_owned(),
            reason: Some(Reason::Angle),
            note: Some("ữ".repeat(NOTE_CHARS)),
            context: ReviewContext {
                event: Some("3f2a-77".to_owned()),
                angle_read_deg: Some(-180.0),
                shown_ms: Some(i64::MAX as u64),
                ..ReviewContext::default()
            },
            at: Some(NOW + MAX_AHEAD_MS),
        }
    }

    #[test]
    fn a_value_out_of_its_range_is_named() {
        assert_eq!(valid().check(NOW), Ok(()));
        let with = |change: fn(&mut NewVerdict)| {
            let mut changed = valid();
            change(&mut changed);
            changed.check(NOW)
        };
        let cases: [(fn(&mut NewVerdict), _); 10] = [
            (|one| one.verdict = Verdict::Pass, InvalidVerdict::Reason),
            (
                |one| one.note = Some("a\0".to_owned()),
                InvalidVerdict::Note,
            ),
            (
                |one| one.note = Some("a".repeat(NOTE_CHARS + 1)),
                InvalidVerdict::Note,
            ),
            (
                |one| one.context.event = Some("a b".to_owned()),
                InvalidVerdict::Event,
            ),
            (
                |one| one.context.angle_read_deg = Some(180.1),
                InvalidVerdict::Angle,
            ),
            (
                |one| one.context.angle_read_deg = Some(f64::NAN),
                InvalidVerdict::Angle,
            ),
            (
                |one| one.context.shown_ms = Some(u64::MAX),
                InvalidVerdict::ShownMs,
            ),
            (|one| one.at = Some(-1), InvalidVerdict::At),
            (
                |one| one.at = Some(NOW + MAX_AHEAD_MS + 1),
                InvalidVerdict::At,
            ),
            (
                |one| one.reviewer = " lan".to_owned(),
                InvalidVerdict::Reviewer,
            ),
        ];
        for (change, rule) in cases {
            assert_eq!(with(change), Err(rule));
        }
    }

    #[test]
    fn names_of_reviewers_are_one_visible_line() {
        assert_eq!(check_reviewer(&"ê".repeat(100)), Ok(()));
        let typed = reviewer_name(" Le\u{302} \u{a0} Lan\n");
        assert_eq!(typed.as_deref(), Ok("Lê Lan"));
        for wrong in [
            "",
            " ",
            "a\nb",
            "a\u{1b}[2J",
            "lan\u{200b}",
            "a\0",
            &"x".repeat(101),
        ] {
            assert_eq!(
                check_reviewer(wrong),
                Err(InvalidVerdict::Reviewer),
                "{wrong:?}"
            );
        }
    }

    #[test]
    fn placeholders_are_no_names() {
        for wrong in ["NAME", "TÊN", "<NAME>"] {
            assert_eq!(reviewer_name(wrong), Err(InvalidVerdict::Placeholder));
        }
        assert_eq!(check_reviewer("Name"), Ok(()));
    }

    #[test]
    fn event_ids_are_short_and_alphanumeric() {
        for wrong in ["", "a b", "a'b", "é", &"x".repeat(65)] {
            assert_eq!(check_event(wrong), Err(InvalidVerdict::Event), "{wrong}");
        }
    }
}
