//! Events that a function reports while it works, such as for the progress bar of a terminal or of a page.

use std::fmt;

use mocban_catalog::SetApart;
use mocban_runner::RunEvent;

/// Something that happens while a function works.
#[derive(Debug)]
pub enum ProjectEvent<'a> {
    /// Work begins that may take long, such as `exporting`.
    Begun(&'static str),
    /// That work has ended.
    Ended,
    /// Something that the caller should know, although the function goes on.
    Warning(String),
    /// Something in a run.
    Run(&'a RunEvent),
}

/// Receives the events of a function.
pub trait Listener: Sync {
    /// Receives an event.
    fn event(&self, event: ProjectEvent<'_>);
}

/// Ignores all events.
impl Listener for () {
    fn event(&self, _: ProjectEvent<'_>) {}
}

/// Work that may take long. It ends when this is dropped.
pub(crate) struct LongWork<'a>(&'a dyn Listener);

impl<'a> LongWork<'a> {
    /// Tells the listener what begins.
    pub(crate) fn begin(listener: &'a dyn Listener, what: &'static str) -> Self {
        listener.event(ProjectEvent::Begun(what));
        Self(listener)
    }
}

impl Drop for LongWork<'_> {
    fn drop(&mut self) {
        self.0.event(ProjectEvent::Ended);
    }
}

/// Warns a listener.
pub(crate) fn warn(listener: &dyn Listener, text: impl fmt::Display) {
    listener.event(ProjectEvent::Warning(text.to_string()));
}

/// Warns a listener about damaged rows that an output does not include.
pub(crate) fn warn_about_set_apart(listener: &dyn Listener, found: &SetApart) {
    if let Some(sentence) = found.sentence() {
        warn(listener, sentence);
    }
}
