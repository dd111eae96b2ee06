//! Which pairs must run again because their settings or inputs changed, and why.

use serde::Serialize;
use serde_json::Value;

use super::recipes::Recipes;
use super::{Catalog, Result};
use crate::domain::{PairName, Stage};

/// Why a pair has work before it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "reason")]
pub enum WorkReason {
    /// It has never run.
    New,
    /// An earlier run ended before it was done.
    Unfinished,
    /// It waits to be tried again after a failure that may pass.
    BackingOff,
    /// It failed for good, but with other settings or inputs than the current ones.
    FailedBefore,
    /// The settings of `stage` or the program's revision of it changed.
    Settings {
        /// First stage with other settings.
        stage: Stage,
        /// What changed.
        changes: Vec<FieldChange>,
    },
    /// The mesh file's bytes changed.
    Mesh,
    /// The print file's bytes changed.
    Print,
    /// The unit or the side it was scanned from was told otherwise at an import.
    Manifest,
    /// It was asked for (`--rerun`).
    Asked,
}

/// A setting that is not what it was.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldChange {
    /// Name such as `register.max_scale`.
    pub field: String,
    /// Value then; `None` when it was not there.
    pub old: Option<Value>,
    /// Value now; `None` when it is gone.
    pub new: Option<Value>,
}

/// Pairs with the same work before them for the same reason.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanEntry {
    /// First stage to run.
    pub from: Stage,
    /// Why.
    #[serde(flatten)]
    pub why: WorkReason,
    /// How many pairs.
    pub pairs: u64,
}

/// What a run would do.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Plan {
    /// Work by first stage and reason.
    pub entries: Vec<PlanEntry>,
    /// Pairs with nothing left to do.
    pub done: u64,
    /// Pairs that failed for good and stay so.
    pub quarantined: u64,
    /// Pairs set aside.
    pub held: u64,
}

impl Plan {
    /// Pairs that would run.
    pub fn pairs(&self) -> u64 {
        self.entries.iter().map(|entry| entry.pairs).sum()
    }
}

impl std::fmt::Display for FieldChange {
    /// `register.max_scale: 1.2 -> 1.3`
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let show = |value: &Option<Value>| match value {
            Some(value) => value.to_string(),
            None => "none".to_owned(),
        };
        write!(
            f,
            "{}: {} -> {}",
            self.field,
            show(&self.old),
            show(&self.new)
        )
    }
}

impl Catalog {
    /// What a run with these settings would do with the pairs named, or with all.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn plan(&self, recipes: &Recipes, pairs: Option<&[PairName]>) -> Result<Plan> {
        let _ = (recipes, pairs);
        todo!()
    }

    /// Why a pair would run, and from which stage; `None` when nothing is left to do.
    ///
    /// # Errors
    /// When there is no such pair.
    pub async fn why(&self, pair: &PairName, recipes: &Recipes) -> Result<Option<PlanEntry>> {
        let _ = (pair, recipes);
        todo!()
    }
}
