//! Runs work on a thread of its own, without the GIL, until it ends or Python gets a signal such as Ctrl-C.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::failure::raise;
use crate::log;
use mocban_core::domain::cancel::{CancelToken, Cancelled};
use mocban_core::locked;

/// Time between two looks for a signal.
const SIGNAL_POLL: Duration = Duration::from_millis(50);

/// Bytes of the stack of a thread, as in the program.
const STACK_BYTES: usize = 8 << 20;

/// Nothing was computed yet.
const UNUSED: u8 = 0;
/// This process has computed something.
const USED: u8 = 1;
/// A parent of this process has computed something, and locks that its threads held may never be released.
const FORKED: u8 = 2;

static STATE: AtomicU8 = AtomicU8::new(UNUSED);

/// Notes that this process is the child of a fork.
#[pyfunction]
pub(crate) fn forked() {
    // A child of a parent that computed nothing is as good as new.
    let _ = STATE.compare_exchange(USED, FORKED, Ordering::SeqCst, Ordering::SeqCst);
}

/// Refuses work in the child of a fork of a process that had computed something.
fn refuse_after_fork(py: Python<'_>) -> PyResult<()> {
    let before = STATE.compare_exchange(UNUSED, USED, Ordering::SeqCst, Ordering::SeqCst);
    if before != Err(FORKED) {
        return Ok(());
    }
    let text = "mocban was used before this process was forked, and locks of the parent may never be released; start \
                processes with multiprocessing.get_context(\"spawn\"), or use threads";
    Err(raise(py, "Error", "forked", text, None))
}

/// Cancels computations from another thread.
#[pyclass(frozen, module = "mocban._native")]
pub(crate) struct NativeCancel(CancelToken);

#[pymethods]
impl NativeCancel {
    #[new]
    fn new() -> Self {
        Self(CancelToken::default())
    }

    /// Requests that all computations with this object end.
    fn cancel(&self) {
        self.0.cancel();
    }
}

/// What a thread sends.
enum Sent<T, E> {
    Event(E),
    Ended(Result<T, Cancelled>),
    Panicked(String),
}

/// Sends events of work to the thread that waits for its result.
pub(crate) struct EventSender<E>(Box<dyn Fn(E) + Send + Sync>);

impl<E> EventSender<E> {
    pub(crate) fn send(&self, event: E) {
        (self.0)(event);
    }
}

/// Returns the result of work, or the exception of a signal handler, which cancels the work. `cancel` cancels it, too.
pub(crate) fn compute<T: Send + 'static>(
    py: Python<'_>,
    cancel: Option<&NativeCancel>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let token = cancel.map_or_else(CancelToken::default, |NativeCancel(token)| token.clone());
    let receiver = start(py, &token, |_: EventSender<()>| work())?;
    loop {
        let received = receive(py, &receiver);
        if let Err(error) = attend(py) {
            token.cancel();
            return Err(error);
        }
        match received {
            Some(Sent::Ended(result)) => return ended(py, result),
            Some(Sent::Panicked(text)) => return Err(bug(py, &text)),
            Some(Sent::Event(())) | None => {}
        }
    }
}

/// Like [`compute`], with events, which `on_event` handles with the GIL. After a signal or an exception of `on_event`, calls
/// `stop` with the token of the work and waits for the end of the work, before it returns the exception.
pub(crate) fn compute_with_events<T: Send + 'static, E: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(EventSender<E>) -> T + Send + 'static,
    mut on_event: impl FnMut(E) -> PyResult<()>,
    stop: impl Fn(&CancelToken),
) -> PyResult<T> {
    let token = CancelToken::default();
    let receiver = start(py, &token, work)?;
    let mut exception = None;
    loop {
        let received = receive(py, &receiver);
        let mut happened = attend(py);
        match received {
            Some(Sent::Ended(result)) => {
                let exception = exception.or(happened.err());
                return exception.map_or_else(|| ended(py, result), Err);
            }
            Some(Sent::Panicked(text)) => {
                let exception = exception.or(happened.err());
                return Err(exception.unwrap_or_else(|| bug(py, &text)));
            }
            Some(Sent::Event(event)) if exception.is_none() && happened.is_ok() => {
                happened = on_event(event);
            }
            Some(Sent::Event(_)) | None => {}
        }
        if let Err(error) = happened {
            stop(&token);
            exception.get_or_insert(error);
        }
    }
}

type SentBy<T, E> = Mutex<Receiver<Sent<T, E>>>;

fn start<T: Send + 'static, E: Send + 'static>(
    py: Python<'_>,
    token: &CancelToken,
    work: impl FnOnce(EventSender<E>) -> T + Send + 'static,
) -> PyResult<SentBy<T, E>> {
    refuse_after_fork(py)?;
    let (sender, receiver) = mpsc::channel();
    let inner = token.clone();
    let body = move || {
        let events: Sender<Sent<T, E>> = sender.clone();
        // Nobody may be waiting any more.
        let events = EventSender(Box::new(move |event| drop(events.send(Sent::Event(event)))));
        let result = catch_unwind(AssertUnwindSafe(|| inner.run(|| work(events))));
        let _ = sender.send(match result {
            Ok(result) => Sent::Ended(result),
            Err(payload) => Sent::Panicked(panic_text(&*payload)),
        });
    };
    let builder = thread::Builder::new()
        .name("mocban".to_owned())
        .stack_size(STACK_BYTES);
    builder.spawn(body).map_err(|error| {
        let text = format!("no thread can be started: {error}");
        raise(py, "Error", "unexpected", &text, None)
    })?;
    Ok(Mutex::new(receiver))
}

/// Waits for a message; `None` if it is time to look for a signal.
fn receive<T: Send, E: Send>(py: Python<'_>, receiver: &SentBy<T, E>) -> Option<Sent<T, E>> {
    let received = py.detach(|| {
        let receiver = locked(receiver);
        receiver.recv_timeout(SIGNAL_POLL)
    });
    match received {
        Ok(sent) => Some(sent),
        Err(RecvTimeoutError::Timeout) => None,
        // The thread sends its result before it ends.
        Err(RecvTimeoutError::Disconnected) => Some(Sent::Panicked(BUG.to_owned())),
    }
}

/// Passes log messages on, and runs the handlers of signals. Looks for signals after each event, because there may be no pause
/// between events.
fn attend(py: Python<'_>) -> PyResult<()> {
    log::forward(py)?;
    py.check_signals()
}

const BUG: &str = "the computation panicked, which is a defect of mocban; please report it";

fn bug(py: Python<'_>, text: &str) -> PyErr {
    raise(py, "Error", "bug", text, None)
}

/// Returns the text of the exception of a panic.
fn panic_text(payload: &(dyn Any + Send)) -> String {
    let message = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    message.map_or_else(|| BUG.to_owned(), |message| format!("{BUG}: {message}"))
}

fn ended<T>(py: Python<'_>, result: Result<T, Cancelled>) -> PyResult<T> {
    result.map_err(|Cancelled| raise(py, "Cancelled", "cancelled", "the work was cancelled", None))
}
