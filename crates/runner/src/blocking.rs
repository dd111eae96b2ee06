//! Blocking calls and tasks whose panics go on in their callers, the end of cancelled ones, and the text of a panic.

use std::any::Any;
use std::time::Duration;

use tokio::task::JoinError;

use mocban_core::domain::sanitize;

/// Longest excerpt of a panic's message, in characters.
const MAX_PANIC_CHARS: usize = 160;

/// Describes a panic and what to do about it.
pub(super) fn panic_text(payload: &(dyn Any + Send)) -> String {
    let message = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    let message = message.map_or_else(String::new, |text| {
        format!(" ({})", sanitize(text, MAX_PANIC_CHARS))
    });
    format!(
        "the stage panicked{message}: this is a bug, please report it with the output of `run --rerun failed -v`"
    )
}

/// Longest time to wait for the end of cancelled work. Only work that waits for a file takes longer. Unit tests wait longer,
/// because they also run on busy machines.
const LONGEST_END: Duration = Duration::from_millis(if cfg!(test) { 3_000 } else { 500 });

/// Waits until the cancelled work of a pair or block has returned its memory, but not longer than [`LONGEST_END`].
pub(super) async fn wait_for_end<T>(ended: impl Future<Output = T>) {
    if tokio::time::timeout(LONGEST_END, ended).await.is_err() {
        tracing::warn!("a thread still waits for a file; its memory no longer counts for --memory");
    }
}

/// Runs a blocking call on a thread for such calls; resumes its panic.
pub(super) async fn run_blocking<T: Send + 'static>(
    call: impl FnOnce() -> T + Send + 'static,
) -> T {
    task_result(tokio::task::spawn_blocking(call).await)
}

/// Returns what a task returned; resumes its panic.
pub(super) fn task_result<T>(ended: Result<T, JoinError>) -> T {
    match ended {
        Ok(result) => result,
        Err(error) => std::panic::resume_unwind(error.into_panic()),
    }
}

#[cfg(test)]
mod tests {
    use super::{MAX_PANIC_CHARS, panic_text};

    #[test]
    fn the_message_of_a_panic_is_sanitized_and_shortened() {
        for message in ["a\u{1b}[2J".to_owned(), "a".repeat(MAX_PANIC_CHARS + 1)] {
            let text = panic_text(&message);
            assert!(!text.contains(&message), "{text:?}");
        }
    }
}
