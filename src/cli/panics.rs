//! Panics are defects of ours: logged for us, told to the user in a sentence.

use std::backtrace::Backtrace;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::exit::ExitCode;

/// Lets a panic's own words and the way to it go to the log (`-v`, `--log-file`) instead of the screen; who catches it
/// says the rest.
pub(super) fn log_only() {
    std::panic::set_hook(Box::new(|panic| {
        if tracing::enabled!(tracing::Level::INFO) {
            let way = Backtrace::force_capture();
            tracing::info!("{panic}\n{way}");
        }
    }));
}

/// Does some work; a panic in it becomes `told` and an exit code.
pub(super) fn caught(work: impl FnOnce() -> ExitCode, told: impl FnOnce(&str)) -> ExitCode {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        told("a defect of this program stopped it; the same with -v tells where");
        ExitCode::Error
    })
}

#[cfg(test)]
mod tests {
    use super::{ExitCode, caught};

    #[test]
    fn a_panic_becomes_a_sentence_and_code_1() {
        let mut said = String::new();
        let code = caught(
            || unreachable!("made up"),
            |text| text.clone_into(&mut said),
        );
        assert_eq!(code, ExitCode::Error);
        assert!(
            said.contains("a defect") && !said.contains("made up"),
            "{said}"
        );
        assert_eq!(caught(|| ExitCode::Done, |_| {}), ExitCode::Done);
    }
}
