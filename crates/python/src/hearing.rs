//! What a function of the project library reports, on its way to Python.

use serde_json::json;

use crate::compute::EventSender;
use mocban_project::events::{Listener, ProjectEvent};

/// An event in JSON: of a run, or a warning.
pub(crate) enum Heard {
    Run(String),
    Warning(String),
}

/// Sends the events of a function to Python.
pub(crate) struct Hearing(pub(crate) EventSender<Heard>);

impl Listener for Hearing {
    fn event(&self, event: ProjectEvent<'_>) {
        match event {
            ProjectEvent::Run(event) => self.0.send(Heard::Run(json!(event).to_string())),
            ProjectEvent::Warning(text) => self.0.send(Heard::Warning(text)),
            ProjectEvent::Begun(_) | ProjectEvent::Ended => {}
        }
    }
}
