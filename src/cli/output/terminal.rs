//! Shows the events of a command on stderr.

use std::sync::Mutex;

use super::busy::Busy;
use super::context::Context;
use super::progress::ProgressReporter;
use crate::cli::input::global::ProgressMode;
use mocban_core::locked;
use mocban_project::events::{Listener, ProjectEvent};
use mocban_runner::RunEvent;

/// Shows work that takes long, warnings, and the progress of a run.
pub(crate) struct Terminal<'a> {
    context: &'a Context,
    busy: Mutex<Option<Busy>>,
    progress: Mutex<Option<ProgressReporter>>,
}

impl<'a> Terminal<'a> {
    /// Shows nothing yet.
    pub(crate) fn new(context: &'a Context) -> Self {
        Self {
            context,
            busy: Mutex::default(),
            progress: Mutex::default(),
        }
    }

    /// Shows the progress of a run until it ends.
    pub(crate) fn of_run(context: &'a Context) -> Self {
        let global = &context.global;
        let (screen, palette) = (&context.screen, context.stderr);
        let progress = ProgressReporter::new(global, screen, palette);
        Self {
            progress: Mutex::new(Some(progress)),
            ..Self::new(context)
        }
    }
}

impl Listener for Terminal<'_> {
    fn event(&self, event: ProjectEvent<'_>) {
        match event {
            ProjectEvent::Begun(what) => {
                *locked(&self.busy) = Some(Busy::start(self.context, what));
            }
            ProjectEvent::Ended => {
                locked(&self.busy).take();
                if let Some(progress) = locked(&self.progress).take() {
                    progress.end();
                }
            }
            ProjectEvent::Warning(text) => self.context.warn(&text),
            ProjectEvent::Run(event) => {
                if let RunEvent::BlockWarned { block, warning, .. } = event
                    && self.context.global.progress != ProgressMode::Json
                {
                    self.context.warn(&format!("block {block}: {warning}"));
                }
                if let Some(progress) = locked(&self.progress).as_mut() {
                    progress.event(event);
                }
            }
        }
    }
}
