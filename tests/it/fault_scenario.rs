//! A command that is run while system calls on the disk fail, and its expected outcome.

use std::path::Path;
use std::process::Command;

use crate::cli::{Call, call};
use crate::fault::{Fault, spread};
use crate::test_size::size_from_env;
use crate::uninterrupted::Comparison;

/// The expected outcome of a command under a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// The command fails.
    Fails,
    /// The command succeeds.
    Succeeds,
    /// Either, depending on the failing call.
    Either,
}

/// A command that runs while the disk fails.
pub(crate) struct FaultScenario {
    /// Prepares a directory for the command.
    pub(crate) before: fn(&Comparison, &Path),
    /// Returns the command for that directory.
    pub(crate) command: fn(&Path) -> Command,
    /// Checks the state after the command and completes the work. The `bool` says whether the command succeeded.
    pub(crate) after: fn(&Comparison, &Path, bool),
}

impl FaultScenario {
    /// Counts the calls of the fault's kind in a run without faults.
    fn calls(&self, comparison: &Comparison, fault: &Fault) -> usize {
        let (root, notes) = (comparison.folder("counted"), comparison.folder("notes"));
        (self.before)(comparison, &root);
        call(fault.inject(0, &root, &notes, &mut (self.command)(&root))).expect(0);
        let calls = Fault::calls(&notes);
        assert!(calls > 0, "{fault}: the command makes no such call");
        calls
    }

    /// Runs the command with a fault at the n-th call, then checks the outcome and completes the work without faults.
    /// Returns the exit code, or `None` if the command made fewer than `nth` calls.
    #[expect(clippy::print_stderr, reason = "names the fault if an assertion fails")]
    fn check(&self, comparison: &Comparison, fault: &Fault, nth: usize, end: End) -> Option<i32> {
        let (root, notes) = (comparison.folder("injected"), comparison.folder("notes"));
        (self.before)(comparison, &root);
        let result = call(fault.inject(nth, &root, &notes, &mut (self.command)(&root)));
        if Fault::injected(&notes) == 0 {
            return None;
        }
        let at = format!("{fault}, call {nth}: code {}, {}", result.code, result.err);
        assert_outcome(&result, end, &root, &at);
        eprintln!("the state after {at}");
        (self.after)(comparison, &root, result.code == 0);
        Some(result.code)
    }

    /// Injects each fault at up to `points` of the calls that the fault applies to. These calls are evenly spaced.
    #[expect(clippy::print_stderr, reason = "figures of the long test")]
    pub(crate) fn check_all(&self, faults: &[(Fault, End)], points: usize) {
        let comparison = Comparison::new("1");
        for (fault, end) in faults {
            let calls = self.calls(&comparison, fault);
            let chosen = spread(calls, points);
            let mut codes: Vec<_> = (chosen.iter())
                .map(|nth| self.check(&comparison, fault, *nth, *end))
                .collect();
            let mut nth = calls;
            while codes.iter().all(Option::is_none) && nth > 1 {
                // The command that was counted was slower than the others, and wrote what they wrote in more calls.
                nth /= 2;
                codes.push(self.check(&comparison, fault, nth, *end));
            }
            let injected = codes.iter().flatten().count();
            assert!(injected > 0, "{fault}: no fault was injected");
            let refused = codes.iter().flatten().filter(|code| **code != 0).count();
            eprintln!("{fault}: {injected} of {calls} calls failed, {refused} commands failed");
        }
    }
}

/// Asserts the outcome. If the command failed, its error must be one line that names the file and the reason.
fn assert_outcome(result: &Call, end: End, root: &Path, at: &str) {
    match end {
        End::Fails => assert_ne!(result.code, 0, "{at}"),
        End::Succeeds => assert_eq!(result.code, 0, "{at}"),
        End::Either => {}
    }
    assert!(!result.err.contains("panicked"), "{at}");
    if result.code == 0 {
        return;
    }
    if result.code == 3 {
        // The output was written, but lacks data that could not be read. A warning names the file and the reason.
        let is_warned = |line: &str| line.starts_with("warning: ") && has_reason(line, root);
        assert!(result.err.lines().any(is_warned), "{at}");
        return;
    }
    if result.code == 12 {
        // A check names the file among its findings.
        assert!(has_reason(&result.out, root), "{at}: {}", result.out);
        return;
    }
    // Warnings and log lines are not errors.
    let lines = result.err.lines();
    let mut lines = lines.filter(|line| !line.starts_with("warning: ") && !line.contains(" WARN "));
    let error = lines.next().unwrap_or_default();
    // Settings and lists that cannot be read are an error of usage.
    let is_usage = result.code == 2 && error.starts_with("error: cannot read ");
    assert!(result.code == 1 || is_usage, "{at}");
    assert_eq!(lines.next(), None, "{at}");
    assert!(error.starts_with("error: "), "{at}");
    assert!(has_reason(error, root), "{at}");
}

/// Returns whether a message names a file below a directory, and the reason of a disk fault.
fn has_reason(message: &str, root: &Path) -> bool {
    let reasons = [
        "disk is full",
        "disk refused",
        "disk reported an error",
        "disk refuses",
        "disk cannot read",
        "cannot be written to",
        "No space left",
        "Input/output error",
    ];
    message.contains(&format!("{}/", root.display()))
        && reasons.iter().any(|reason| message.contains(reason))
}

/// Returns the number of calls at which each fault is injected.
pub(crate) fn fault_points() -> usize {
    size_from_env("MOCBAN_FAULT_MOMENTS", 1)
}
