//! Log messages of the Rust libraries and messages of panics, which go to Python's `logging`.

use std::collections::VecDeque;
use std::fmt::{Debug, Write as _};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, Once};

use pyo3::prelude::*;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber};

use mocban_core::locked;

/// Messages that wait for a thread with the GIL; older ones are dropped.
const MAX_WAITING: usize = 1000;

/// Level as a number of Python, and text.
static WAITING: Mutex<VecDeque<(u32, String)>> = Mutex::new(VecDeque::new());

static INSTALL: Once = Once::new();

fn waiting() -> MutexGuard<'static, VecDeque<(u32, String)>> {
    locked(&WAITING)
}

/// Receives the messages of this process from now on. Panics print nothing any more.
pub(crate) fn install() {
    INSTALL.call_once(|| {
        // Only this library is in the extension module.
        let _ = tracing::subscriber::set_global_default(MessageQueue(AtomicU64::new(1)));
        std::panic::set_hook(Box::new(|panic| {
            push(ERROR, panic.to_string().replace(":\n", ": "));
        }));
    });
}

/// Adds a message; drops the oldest one if too many wait.
fn push(level: u32, text: String) {
    let mut waiting = waiting();
    if waiting.len() == MAX_WAITING {
        waiting.pop_front();
    }
    waiting.push_back((level, text));
}

/// Passes all messages that wait to the logger `mocban`.
pub(crate) fn forward(py: Python<'_>) -> PyResult<()> {
    let messages = std::mem::take(&mut *waiting());
    if messages.is_empty() {
        return Ok(());
    }
    write(py, messages)
}

/// Level of a warning in Python's `logging`.
pub(crate) const WARNING: u32 = 30;
/// Level of an error in Python's `logging`.
const ERROR: u32 = 40;

/// Passes messages with their levels to the logger `mocban`.
pub(crate) fn write(
    py: Python<'_>,
    messages: impl IntoIterator<Item = (u32, String)>,
) -> PyResult<()> {
    let logger = py
        .import("logging")?
        .call_method1("getLogger", ("mocban",))?;
    for (level, text) in messages {
        logger.call_method1("log", (level, "%s", text))?;
    }
    Ok(())
}

/// Stores messages. Spans are ignored.
struct MessageQueue(AtomicU64);

impl Subscriber for MessageQueue {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() <= Level::INFO && metadata.target().starts_with("mocban")
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(self.0.fetch_add(1, Ordering::Relaxed).max(1))
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let level = match *event.metadata().level() {
            Level::ERROR => ERROR,
            Level::WARN => WARNING,
            _ => 20,
        };
        let mut text = EventText(String::new());
        event.record(&mut text);
        push(level, text.0);
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// The message of an event, and its fields.
struct EventText(String);

impl Visit for EventText {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        let separator = if self.0.is_empty() { "" } else { " " };
        // Writing to a string does not fail.
        let _ = match field.name() {
            "message" => write!(self.0, "{separator}{value:?}"),
            name => write!(self.0, "{separator}{name}={value:?}"),
        };
    }
}
