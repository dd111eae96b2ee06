//! What a check found, counted, with the first of each kind by name.

use std::collections::BTreeMap;

use serde::Serialize;

use super::finding::{Finding, Kind};
use super::pairs::Look;
use crate::store::{UnreferencedFile, UnreferencedKind};

/// Findings of a kind, and inputs, that are kept by name.
const NAMED: usize = 20;

/// What a check found; serialises to what `check --json` prints.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CheckSummary {
    /// Version of this form.
    pub schema: u32,
    /// Whether only lengths of files were compared.
    pub quick: bool,
    /// Pairs that were looked at.
    pub pairs: u64,
    /// Files of results that were looked at.
    pub files: u64,
    /// Damage by kind; only what there is.
    pub damage: BTreeMap<Kind, Found>,
    /// Input files that are not there. No damage: results made from them stand.
    pub inputs_missing: Notes,
    /// Input files that are no longer what was read. No damage: the next run takes them up.
    pub inputs_changed: Notes,
    /// Files in the folder of artifacts that no row names; `None` where it cannot be told, because a run goes on.
    pub spare: Option<Spare>,
    /// What was mended.
    pub repaired: Repaired,
}

/// Damage of one kind.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Found {
    /// How often it was found.
    pub found: u64,
    /// How often it is still there.
    pub left: u64,
    /// The first ones.
    pub first: Vec<Finding>,
}

/// Things to know, counted, the first by name.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Notes {
    /// How many.
    pub count: u64,
    /// The first ones.
    pub first: Vec<String>,
}

/// Files that no row names.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Spare {
    /// Files of results that no row names any more, or never did, with those half-written.
    pub files: u64,
    /// Their length together.
    pub bytes: u64,
    /// How many of them were removed.
    pub removed: u64,
    /// Files that are not the program's; they are left alone.
    pub strangers: u64,
}

/// What was mended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Repaired {
    /// Pairs that were put back to be done.
    pub put_back: u64,
    /// Whether counters were counted anew.
    pub counters: bool,
    /// Whether indexes were made anew.
    pub indexes: bool,
    /// Whether indexes or triggers that were gone were made.
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
            inputs_missing: Notes::default(),
            inputs_changed: Notes::default(),
            spare: None,
            repaired: Repaired::default(),
        }
    }

    /// Damage that is still there.
    pub fn left(&self) -> u64 {
        self.damage.values().map(|found| found.left).sum()
    }

    /// Damage that was found.
    pub fn found(&self) -> u64 {
        self.damage.values().map(|found| found.found).sum()
    }

    pub(super) fn add(&mut self, finding: Finding) {
        let found = self.damage.entry(finding.kind).or_default();
        found.found += 1;
        found.left += 1;
        if found.first.len() < NAMED {
            found.first.push(finding);
        }
    }

    /// All of a kind was mended.
    pub(super) fn mended(&mut self, kind: Kind) {
        self.mended_but(kind, 0);
    }

    /// All of a kind was mended but a number.
    pub(super) fn mended_but(&mut self, kind: Kind, left: u64) {
        if let Some(found) = self.damage.get_mut(&kind) {
            found.left = left;
        }
    }

    /// Counts what a look at a pair gave; `put_back` when it is to be done again by now.
    pub(super) fn count(&mut self, look: Look, put_back: bool) {
        self.pairs += 1;
        self.files += look.files;
        for finding in look.damage {
            let kind = finding.kind;
            self.add(finding);
            if let (true, Some(found)) = (put_back, self.damage.get_mut(&kind)) {
                found.left -= 1;
            }
        }
        self.inputs_missing.add(look.inputs_missing);
        self.inputs_changed.add(look.inputs_changed);
    }
}

impl Notes {
    fn add(&mut self, notes: Vec<String>) {
        self.count += notes.len() as u64;
        let room = NAMED.saturating_sub(self.first.len());
        self.first.extend(notes.into_iter().take(room));
    }
}

impl Spare {
    pub(super) const fn count(&mut self, unnamed: &UnreferencedFile, removed: bool) {
        match unnamed.kind {
            UnreferencedKind::UnknownFile => self.strangers += 1,
            UnreferencedKind::Orphan | UnreferencedKind::Temporary => {
                self.files += 1;
                self.bytes += unnamed.bytes;
                self.removed += removed as u64;
            }
        }
    }
}
