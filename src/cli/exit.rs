//! Exit codes, and the known ways in which a command ends without a result.

/// The exit status of the process; the numbers are fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum ExitCode {
    /// Done, or nothing was left to do.
    Done = 0,
    /// An unexpected error.
    Error = 1,
    /// The command line, a setting or a manifest is wrong; nothing was changed.
    Usage = 2,
    /// The run ended and some pairs failed.
    SomeFailed = 3,
    /// The selection matched no pair.
    NothingSelected = 4,
    /// There is no project in the directory.
    NoProject = 10,
    /// Another process runs the project.
    InUse = 11,
    /// `check` found damage.
    Damaged = 12,
    /// `report --fail-under` was not met.
    BelowFailUnder = 20,
    /// `report --require-complete` was not met.
    Incomplete = 21,
    /// Stopped by Ctrl-C or SIGTERM; the state is safe.
    Stopped = 130,
}

impl ExitCode {
    /// Every code.
    pub const ALL: [Self; 11] = [
        Self::Done,
        Self::Error,
        Self::Usage,
        Self::SomeFailed,
        Self::NothingSelected,
        Self::NoProject,
        Self::InUse,
        Self::Damaged,
        Self::BelowFailUnder,
        Self::Incomplete,
        Self::Stopped,
    ];

    /// Returns the explanation that `--help` prints.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Done => "done, or nothing left to do",
            Self::Error => "unexpected error",
            Self::Usage => "wrong command line, setting or manifest",
            Self::SomeFailed => "finished, some pairs failed",
            Self::NothingSelected => "the selection matched no pair",
            Self::NoProject => "no project here",
            Self::InUse => "project in use by another process",
            Self::Damaged => "check found damage",
            Self::BelowFailUnder => "--fail-under not met",
            Self::Incomplete => "--require-complete not met",
            Self::Stopped => "stopped by Ctrl-C, state safe",
        }
    }

    /// Returns the table of codes for `--help`.
    pub fn table() -> String {
        let lines: Vec<String> = Self::ALL
            .iter()
            .map(|code| format!("  {:>3}  {}", *code as u8, code.meaning()))
            .collect();
        format!("Exit codes:\n{}", lines.join("\n"))
    }
}

impl From<ExitCode> for std::process::ExitCode {
    fn from(code: ExitCode) -> Self {
        Self::from(code as u8)
    }
}

/// A command that cannot be carried out as given, with its own exit code.
#[derive(Debug, thiserror::Error)]
pub(super) enum Refusal {
    /// An unknown pair, or a selection without pairs.
    #[error("{0}")]
    NothingSelected(String),
    /// A wrong command line that clap alone cannot detect.
    #[error("{0}")]
    Usage(String),
}

impl Refusal {
    /// Returns the exit code.
    pub(super) const fn code(&self) -> ExitCode {
        match self {
            Self::NothingSelected(_) => ExitCode::NothingSelected,
            Self::Usage(_) => ExitCode::Usage,
        }
    }
}
