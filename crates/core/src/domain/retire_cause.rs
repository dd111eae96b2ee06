//! Why a pair is out of all counts.

use serde::Serialize;

use super::enum_names;

/// Who retired a pair. Its results and verdicts stay.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RetireCause {
    /// A person. Only a person brings it back.
    Person,
    /// An import of a list without it. A list with it brings it back.
    List,
    /// The labels of its block, from which its box is gone. It comes back with its box.
    Labels,
}

enum_names! { pub RetireCause, "a cause":
    Person = "person", List = "list", Labels = "labels",
}
