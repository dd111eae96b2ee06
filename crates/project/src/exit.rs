//! Exit codes, and errors of commands that cannot be carried out as given.

use mocban_core::domain::{ErrorCode, Explained};

/// The exit status of the process; the numbers are fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum ExitCode {
    /// Done, or nothing was left to do.
    Done = 0,
    /// An unexpected error.
    Error = 1,
    /// The command line, a setting or a manifest is wrong. Nothing was changed.
    Usage = 2,
    /// The run ended and some pairs failed.
    SomeFailed = 3,
    /// The selection matched no pair.
    NothingSelected = 4,
    /// There is no project in the directory.
    NoProject = 10,
    /// Another process runs the project, or writes the same output.
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

/// Every code with its explanation in `--help`.
const MEANINGS: [(ExitCode, &str); 11] = [
    (ExitCode::Done, "done, or nothing left to do"),
    (ExitCode::Error, "unexpected error"),
    (ExitCode::Usage, "wrong command line, setting or manifest"),
    (ExitCode::SomeFailed, "finished, some pairs failed"),
    (ExitCode::NothingSelected, "the selection matched no pair"),
    (ExitCode::NoProject, "no project here"),
    (
        ExitCode::InUse,
        "project or output in use by another process",
    ),
    (ExitCode::Damaged, "check found damage"),
    (ExitCode::BelowFailUnder, "--fail-under not met"),
    (ExitCode::Incomplete, "--require-complete not met"),
    (ExitCode::Stopped, "stopped by Ctrl-C, state safe"),
];

impl ExitCode {
    /// Returns the table of codes for `--help`.
    pub fn table() -> String {
        let line = |(code, meaning): (Self, &str)| format!("\n  {:>3}  {meaning}", code as u8);
        format!("Exit codes:{}", MEANINGS.map(line).concat())
    }
}

impl From<ExitCode> for std::process::ExitCode {
    fn from(code: ExitCode) -> Self {
        Self::from(code as u8)
    }
}

impl From<ErrorCode> for ExitCode {
    fn from(code: ErrorCode) -> Self {
        match code {
            ErrorCode::Usage | ErrorCode::Settings | ErrorCode::NotPermitted => Self::Usage,
            ErrorCode::Incomplete => Self::SomeFailed,
            ErrorCode::NothingSelected => Self::NothingSelected,
            ErrorCode::NoProject => Self::NoProject,
            ErrorCode::ProjectInUse | ErrorCode::OutputInUse => Self::InUse,
            ErrorCode::Damaged | ErrorCode::LogLost => Self::Damaged,
            ErrorCode::ClosedPipe => Self::Done,
            _ => Self::Error,
        }
    }
}

/// A command that cannot be carried out as given.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// An unknown pair, or a selection without pairs.
    #[error("{0}")]
    NothingSelected(String),
    /// A wrong command line that clap alone cannot detect.
    #[error("{0}")]
    Usage(String),
    /// An output that is not complete, and would replace an earlier file.
    #[error("{0}")]
    Incomplete(String),
    /// A catalog that is damaged, empty or not a catalog.
    #[error("{0}")]
    Damaged(String),
    /// A failure of the system, or of another process.
    #[error("{0}")]
    Unexpected(String),
}

impl Explained for Refusal {
    fn code(&self) -> ErrorCode {
        match self {
            Self::NothingSelected(_) => ErrorCode::NothingSelected,
            Self::Usage(_) => ErrorCode::Usage,
            Self::Incomplete(_) => ErrorCode::Incomplete,
            Self::Damaged(_) => ErrorCode::Damaged,
            Self::Unexpected(_) => ErrorCode::Unexpected,
        }
    }
}
