//! Something that is done while the disk refuses, and how it must end.

use std::path::Path;
use std::process::Command;

use crate::cli::{Call, call};
use crate::fault::{Fault, spread};
use crate::sizes::asked;
use crate::unbroken::World;

/// How a command under a fault must end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// With an error.
    Refused,
    /// As if nothing had been.
    Unmoved,
    /// Either, by the moment at which it strikes.
    Either,
}

/// Something that is done while the disk refuses.
pub(crate) struct Deed {
    /// Puts what it needs in a folder.
    pub(crate) before: fn(&World, &Path),
    /// The command, to be called in that folder.
    pub(crate) command: fn(&Path) -> Command,
    /// Looks whether all is as it must be after it, and goes on to the end; told whether it said that it was done.
    pub(crate) after: fn(&World, &Path, bool),
}

impl Deed {
    /// How many calls of the kind it makes when nothing fails.
    fn calls(&self, world: &World, fault: &Fault) -> usize {
        let (root, notes) = (world.folder("counted"), world.folder("notes"));
        (self.before)(world, &root);
        call(fault.strike(0, &root, &notes, &mut (self.command)(&root))).expect(0);
        let calls = Fault::calls(&notes);
        assert!(calls > 0, "{fault}: there is no such call");
        calls
    }

    /// Does it under a fault at the n-th call, and then again without. Gives the exit code; `None` when there were
    /// not so many calls this time.
    fn survives(&self, world: &World, fault: &Fault, nth: usize, end: End) -> Option<i32> {
        let (root, notes) = (world.folder("struck"), world.folder("notes"));
        (self.before)(world, &root);
        let told = call(fault.strike(nth, &root, &notes, &mut (self.command)(&root)));
        if Fault::struck(&notes) == 0 {
            return None;
        }
        let at = format!("{fault}, call {nth}: code {}, {}", told.code, told.err);
        is_said(&told, end, &root, &at);
        (self.after)(world, &root, told.code == 0);
        Some(told.code)
    }

    /// Strikes with each fault at so many of the calls it could strike.
    #[expect(clippy::print_stderr, reason = "the figures of the long test")]
    pub(crate) fn survives_all(&self, faults: &[(Fault, End)], moments: usize) {
        let world = World::new("1");
        for (fault, end) in faults {
            let calls = self.calls(&world, fault);
            let chosen = spread(calls, moments);
            let codes: Vec<_> = (chosen.iter())
                .map(|nth| self.survives(&world, fault, *nth, *end))
                .collect();
            let struck = codes.iter().flatten().count();
            assert!(struck > 0, "{fault}: nothing was struck");
            let refused = codes.iter().flatten().filter(|code| **code != 0).count();
            eprintln!("{fault}: {struck} of {calls} calls struck, {refused} refused");
        }
    }
}

/// It ended as it must, and an error is one sentence with its file and its reason.
fn is_said(told: &Call, end: End, root: &Path, at: &str) {
    match end {
        End::Refused => assert_ne!(told.code, 0, "{at}"),
        End::Unmoved => assert_eq!(told.code, 0, "{at}"),
        End::Either => {}
    }
    assert!(!told.err.contains("panicked"), "{at}");
    if told.code == 0 {
        return;
    }
    assert_eq!(told.code, 1, "{at}");
    // A warning, or a line of the log, is no error.
    let told = told.err.lines();
    let mut lines = told.filter(|line| !line.starts_with("warning: ") && !line.contains(" WARN "));
    let error = lines.next().unwrap_or_default();
    assert_eq!(lines.next(), None, "{at}");
    assert!(error.starts_with("error: "), "{at}");
    assert!(error.contains(&format!("{}/", root.display())), "{at}");
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
    assert!(reasons.iter().any(|reason| error.contains(reason)), "{at}");
}

/// Moments at which each fault strikes, evenly over all there are.
pub(crate) fn moments() -> usize {
    asked("MOCBAN_FAULT_MOMENTS", 1)
}
