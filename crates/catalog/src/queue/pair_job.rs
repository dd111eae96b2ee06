//! The jobs of pairs.

use std::borrow::Cow;

use serde::Serialize;
use serde_json::{Value, json};

use crate::Result;
use crate::db::conn::Conn;
use crate::db::query::query;
use crate::db::script::Script;
use crate::queue::checkpoint::UPDATE_INPUTS;
use crate::queue::kind::{JobKind, StoredKind};
use crate::queue::lease::{FingerprintId, InputVersions, PairProvenance};
use crate::queue::selection::PairSelection;
use mocban_core::domain::{ContentHash, PairId, PairName, Stage, WorkerId};

/// The kind of the jobs of pairs. Besides what all jobs have, these have a priority, may have to run exclusively, and are
/// counted by the fingerprint of their last result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairJob;

impl JobKind for PairJob {
    type Unit = PairId;
    type Name = PairName;
    type Selection = PairSelection;
    type Stage = Stage;
    type Provenance = PairProvenance;
    type Inputs = InputVersions;

    fn unit(id: i64) -> PairId {
        PairId(id)
    }

    fn id(unit: PairId) -> i64 {
        unit.0
    }

    fn ids(selection: &PairSelection) -> Cow<'_, str> {
        Cow::Borrowed(&selection.json)
    }

    fn stage(index: usize) -> Option<Stage> {
        Stage::from_index(index)
    }

    fn index(stage: Stage) -> usize {
        stage.index()
    }
}

impl StoredKind for PairJob {
    const NUMBER: usize = 0;
    const NAMES: &'static [(&'static str, &'static str)] = &[
        ("job", "job"),
        ("unit", "pair"),
        ("result", "stage_result"),
        ("attempt", "attempt"),
        ("failure", "failure"),
        ("settings", "fingerprints"),
        ("prio", "prio, "),
        ("turn", "turn"),
        ("exclusive", "exclusive"),
        ("fingerprint", "fingerprint"),
        (
            "and_advance",
            ", exclusive = 0, low_confidence = item.value ->> 'low_confidence', fingerprint = item.value ->> 'fingerprint',
    dirty = dirty OR item.value ->> 'mixed' OR ((item.value ->> 'first') IS NOT NULL
        AND job.fingerprint IS NOT (SELECT upstream FROM fingerprint WHERE id = item.value ->> 'first'))",
        ),
        ("and_go_back", FINGERPRINT_BEFORE),
        ("and_reset", ", prio = 0, exclusive = 0"),
        ("and_exclusive_if", ", exclusive = max(exclusive, "),
        ("end_exclusive_if", ")"),
        ("and_counted", COUNT_CLAIMED),
    ];
    const PROVENANCE: &'static [(&'static str, &'static str)] = &[
        ("fingerprint", "[fingerprint]"),
        ("mesh_hash", "unhex(item.value ->> 'mesh_hash')"),
        ("print_hash", "unhex(item.value ->> 'print_hash')"),
        ("attributes", "item.value ->> 'attributes'"),
    ];

    fn provenance(made_with: &PairProvenance) -> Result<impl Serialize> {
        Ok(made_with)
    }
}
