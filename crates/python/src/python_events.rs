//! What a function of the project library reports, on its way to Python.

use serde_json::json;

use crate::compute::EventSender;
use mocban_project::events::{Listener, ProjectEvent};

/// An event in JSON: of a run, or a warning.
pub(crate) enum PythonEvent {
    Run(String),
    Warning(String),
}

/// Sends the events of a function to Python.
pub(crate) struct PythonEvents(pub(crate) EventSender<PythonEvent>);

impl Listener for PythonEvents {
    fn event(&self, event: ProjectEvent<'_>) {
        match event {
            ProjectEvent::Run(event) => self.0.send(PythonEvent::Run(json!(event).to_string())),
            ProjectEvent::Warning(text) => self.0.send(PythonEvent::Warning(text)),
            ProjectEvent::Begun(_) | ProjectEvent::Ended => {}
        }
    }
}
