//! Failures of stages, by class.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::enum_names;

/// Ends the message of an input file that does not exist, behind its path.
pub const NOT_THERE: &str = " is not there";

/// If a pair fails because of the unit of its scan, the message has one of these clauses. No other message has one.
pub const UNIT_CLAUSES: [&str; 3] = [
    "correct the unit",
    "check the unit",
    "the unit of the mesh is not known",
];

/// Class of a failure. It decides between retry and quarantine.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum FailureClass {
    /// The input file is invalid, for example empty or truncated. The pair is quarantined.
    BadInput,
    /// The input is valid, but the method finds no solution: for example, nothing is carved. The pair is quarantined.
    NoSolution,
    /// Reading or writing failed. If the failure may be temporary, the stage is retried a few times with back-off.
    /// Otherwise, or after the last attempt, the pair is quarantined.
    Io,
    /// The stage needs too much memory or time. It is retried once while no other pair runs. Then the pair is
    /// quarantined.
    Resource,
    /// A defect of this program, such as a caught panic. Quarantined.
    Bug,
}

enum_names! { pub FailureClass, "a failure class":
    BadInput = "bad_input", NoSolution = "no_solution", Io = "io", Resource = "resource", Bug = "bug",
}

/// A failure of a stage. The message names the file and the reason.
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

    /// Returns whether a pair failed because of the unit of its scan.
    pub fn names_unit(&self) -> bool {
        UNIT_CLAUSES
            .iter()
            .any(|clause| self.message.contains(clause))
    }
}
