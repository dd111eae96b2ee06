//! Handles panics, which are defects of this program. Details go to the log, and the user sees one sentence.

use std::backtrace::Backtrace;
use std::panic::{AssertUnwindSafe, catch_unwind};

use mocban_project::ExitCode;

/// Sends the message and backtrace of a panic to the log (`-v`, `--log-file`) instead of the terminal.
pub(crate) fn log_only() {
    std::panic::set_hook(Box::new(|panic| {
        if tracing::enabled!(tracing::Level::INFO) {
            let backtrace = Backtrace::force_capture();
            tracing::info!("{panic}\n{backtrace}");
        }
    }));
}

/// Calls `work` and returns its exit code. If it panics, shows one sentence and returns `ExitCode::Error`.
pub(crate) fn catch(work: impl FnOnce() -> ExitCode, show_error: impl FnOnce(&str)) -> ExitCode {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        show_error(
            "a defect of this program stopped it; run the same command with -v to see where",
        );
        ExitCode::Error
    })
}

#[cfg(test)]
mod tests {
    use super::{ExitCode, catch};

    #[test]
    fn panic_becomes_a_sentence_and_code_1() {
        let mut message = String::new();
        let code = catch(
            || unreachable!("made up"),
            |text| text.clone_into(&mut message),
        );
        assert_eq!(code, ExitCode::Error);
        assert!(
            message.contains("a defect") && !message.contains("made up"),
            "{message}"
        );
        assert_eq!(catch(|| ExitCode::Done, |_| {}), ExitCode::Done);
    }
}
