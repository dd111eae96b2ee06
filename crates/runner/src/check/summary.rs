//! Summary of a check: counts by kind, with the first findings of each.

use std::collections::BTreeMap;

use serde::Serialize;

use super::finding::{Finding, Kind};
use super::pairs::PairCheck;
use mocban_catalog::{SameContents, SetApart};
use mocban_store::{UnreferencedFile, UnreferencedKind};

/// Number of findings listed per kind, and of input files listed.
const NAMED: usize = 20;

/// Result of a check; serialized by `check --json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CheckSummary {
    /// Version of this JSON schema.
    pub schema: u32,
    /// Whether only the lengths of files were compared.
    pub quick: bool,
    /// Number of pairs checked.
    pub pairs: u64,
    /// Number of result files checked.
    pub files: u64,
    /// Damage by kind, without kinds that were not found.
    pub damage: BTreeMap<Kind, Found>,
    /// Damaged rows that the owner has set apart. They are not counted, and are no damage any more.
    #[serde(skip_serializing_if = "SetApart::is_empty")]
    pub set_apart: SetApart,
    /// Pairs and blocks with the contents of others. This is not damage.
    #[serde(skip_serializing_if = "SameContents::is_empty")]
    pub same_contents: SameContents,
    /// Missing input files. This is not damage: results computed from them stay valid.
    pub inputs_missing: Notes,
    /// Input files that changed after they were read. This is not damage: the next run handles it.
    pub inputs_changed: Notes,
    /// Input files that cannot be read, with the reasons. They may be unchanged.
    pub inputs_unreadable: Notes,
    /// Unreferenced files in the artifact folder. `None` if not counted, for example because a run may be writing.
    pub unreferenced: Option<Unreferenced>,
    /// Why the artifacts do not belong to this catalog, if another catalog is their owner.
    pub foreign_artifacts: Option<String>,
    /// Repairs made.
    pub repaired: Repaired,
    /// Number of damaged rows that a repair by this user would set apart.
    #[serde(skip)]
    rows_to_set_apart: u64,
}

/// Damage of one kind.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Found {
    /// Number of findings.
    pub found: u64,
    /// Number of findings that remain after the repair.
    pub left: u64,
    /// The first findings.
    pub first: Vec<Finding>,
    /// Number of findings that disappear if the damaged pairs and blocks are queued again.
    #[serde(skip)]
    pub(super) repairable: u64,
}

/// Notes about files: their number and the first of them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Notes {
    /// Number of files.
    pub count: u64,
    /// The first findings.
    pub first: Vec<String>,
}

/// Unreferenced files.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Unreferenced {
    /// Result files that no row references, partly written ones included.
    pub files: u64,
    /// Total length in bytes.
    pub bytes: u64,
    /// Number of files deleted.
    pub removed: u64,
    /// Files that the program did not write; they are never deleted.
    pub unknown: u64,
}

/// Repairs made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a choice of its own, with a name"
)]
pub struct Repaired {
    /// Number of pairs sent back to an earlier stage.
    pub requeued: u64,
    /// Number of blocks sent back to an earlier stage.
    pub requeued_blocks: u64,
    /// Number of damaged pairs that were not sent back, because an input is missing or unreadable.
    pub not_requeued: u64,
    /// Number of damaged rows that were set apart.
    pub set_apart: u64,
    /// Whether nothing was sent back, because most result files are missing.
    pub withheld: bool,
    /// Whether the counters were rebuilt.
    pub counters: bool,
    /// Whether the indexes were rebuilt.
    pub indexes: bool,
    /// Whether missing indexes or triggers were created.
    pub schema: bool,
}

impl CheckSummary {
    pub(super) fn new(quick: bool) -> Self {
        Self {
            schema: 1,
            quick,
            pairs: 0,
            files: 0,
            damage: BTreeMap::new(),
            set_apart: SetApart::default(),
            same_contents: SameContents::default(),
            inputs_missing: Notes::default(),
            inputs_changed: Notes::default(),
            inputs_unreadable: Notes::default(),
            unreferenced: None,
            foreign_artifacts: None,
            repaired: Repaired::default(),
            rows_to_set_apart: 0,
        }
    }

    /// Returns the number of findings that remain.
    pub fn left(&self) -> u64 {
        self.damage.values().map(|found| found.left).sum()
    }

    /// Returns the number of findings.
    pub fn found(&self) -> u64 {
        self.damage.values().map(|found| found.found).sum()
    }

    /// Returns whether more than half of the result files are missing, as if their disk were not mounted.
    pub fn lacks_most_files(&self) -> bool {
        let missing = self.damage.get(&Kind::FileMissing);
        missing.is_some_and(|missing| missing.found * 2 > self.files)
    }

    /// Adds damage that queueing a pair or block again does not repair.
    pub(super) fn note(&mut self, finding: Finding) {
        self.add(finding, false);
    }

    /// Adds damage.
    pub(super) fn add(&mut self, finding: Finding, is_repairable: bool) {
        let found = self.damage.entry(finding.kind).or_default();
        found.found += 1;
        found.left += 1;
        found.repairable += u64::from(is_repairable);
        if found.first.len() < NAMED {
            found.first.push(finding);
        }
    }

    /// Adds a damaged row. `is_repairable` is whether a repair would set it apart.
    pub(super) fn add_row(&mut self, finding: Finding, is_repairable: bool) {
        self.add(finding, false);
        self.rows_to_set_apart += u64::from(is_repairable);
    }

    /// Records that all damaged rows that can be set apart were set apart.
    pub(super) fn set_rows_apart(&mut self, rows: u64) {
        self.repaired.set_apart = rows;
        if let Some(found) = self.damage.get_mut(&Kind::Row) {
            found.left -= rows.min(found.left);
        }
    }

    /// Returns whether `check --repair` by this user could repair something.
    pub fn is_repairable(&self) -> bool {
        let is_missing = |finding: &Finding| finding.what.ends_with(" is missing");
        self.rows_to_set_apart > 0
            || self.damage.iter().any(|(kind, found)| match kind {
                Kind::Database | Kind::Reference | Kind::Row | Kind::FileUnreadable => false,
                // A repair creates what is missing, and leaves what other programs added.
                Kind::Schema => found.first.iter().any(is_missing),
                _ => true,
            })
    }

    /// Marks all findings of a kind as repaired, except `left` of them.
    pub(super) fn mark_repaired(&mut self, kind: Kind, left: u64) {
        if let Some(found) = self.damage.get_mut(&kind) {
            found.left = left;
        }
    }

    /// Marks the findings as repaired that queueing pairs and blocks again repairs.
    pub(super) fn mark_repairable(&mut self) {
        for found in self.damage.values_mut() {
            found.left -= found.repairable;
        }
    }

    /// Adds the check of a pair.
    pub(super) fn count(&mut self, check: PairCheck, repair: bool) {
        let can_run = check.back_to().is_some();
        self.repaired.not_requeued += u64::from(repair && check.lacks_inputs());
        self.pairs += 1;
        self.files += check.files;
        for finding in check.damage {
            let is_repairable = can_run && finding.kind.is_repairable();
            self.add(finding, is_repairable);
        }
        self.inputs_missing.add(check.inputs_missing);
        self.inputs_changed.add(check.inputs_changed);
        self.inputs_unreadable.add(check.inputs_unreadable);
    }
}

impl Notes {
    fn add(&mut self, notes: Vec<String>) {
        self.count += notes.len() as u64;
        let room = NAMED.saturating_sub(self.first.len());
        self.first.extend(notes.into_iter().take(room));
    }
}

impl Unreferenced {
    pub(super) const fn count(&mut self, file: &UnreferencedFile, removed: bool) {
        match file.kind {
            UnreferencedKind::UnknownFile => self.unknown += 1,
            UnreferencedKind::Orphan | UnreferencedKind::Temporary => {
                self.files += 1;
                self.bytes += file.bytes;
                self.removed += removed as u64;
            }
        }
    }
}
