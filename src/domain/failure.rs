//! Failures of stages, by class.

use serde::{Deserialize, Serialize};

/// Class of a failure. It decides between retry and quarantine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureClass {
    /// The input file is invalid: empty, truncated, NaN coordinates, no faces. Quarantined.
    BadInput,
    /// The input is valid, but the method finds no solution, as for a plate without relief. Quarantined.
    NoSolution,
    /// Reading or writing failed, or a file is missing. Retried with back-off.
    Io,
    /// The stage needs too much memory or time. Retried exclusively, then quarantined.
    Resource,
    /// A defect of this program, such as a caught panic. Quarantined.
    Bug,
}

impl FailureClass {
    /// All classes.
    pub const ALL: [Self; 5] = [
        Self::BadInput,
        Self::NoSolution,
        Self::Io,
        Self::Resource,
        Self::Bug,
    ];

    /// Returns the name in JSON, in the catalog and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::BadInput => "bad_input",
            Self::NoSolution => "no_solution",
            Self::Io => "io",
            Self::Resource => "resource",
            Self::Bug => "bug",
        }
    }
}

impl std::fmt::Display for FailureClass {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for FailureClass {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|class| class.name() == text)
            .ok_or_else(|| {
                format!(
                    "{text:?} is not a failure class (bad_input, no_solution, io, resource, bug)"
                )
            })
    }
}

/// A failure, stored and shown in this form: its class and a message with the file and the reason.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{message}")]
pub struct Failure {
    /// Decides between retry and quarantine.
    pub class: FailureClass,
    /// Lower-case fragment with the values.
    pub message: String,
}

impl Failure {
    /// Returns a failure of a class with its message.
    pub fn new(class: FailureClass, message: impl Into<String>) -> Self {
        Self {
            class,
            message: message.into(),
        }
    }
}
