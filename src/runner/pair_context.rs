//! A pair in a worker's hand: what is known of it, and what the stages have left in memory.

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::catalog::{InputVersions, PairAttributes, PairWork};
use crate::domain::{ArtifactSet, ContentHash, FitOutcome, Stage};
use crate::raster::DepthMap;
use crate::stages::normalize::Normalized;
use crate::stages::{Print, Scan};

/// What an earlier stage stored.
#[derive(Debug, Clone)]
pub(super) struct StoredStage {
    pub(super) outcome: Value,
    pub(super) files: ArtifactSet,
    pub(super) mesh_hash: ContentHash,
    pub(super) print_hash: Option<ContentHash>,
}

/// A pair between two stages.
#[derive(Debug)]
pub(super) struct PairContext {
    /// As imported.
    pub(super) attributes: PairAttributes,
    /// What the manifest said that results depend on, as the catalog compares it.
    pub(super) attributes_json: String,
    /// What the stages behind it stored.
    pub(super) stored: BTreeMap<Stage, StoredStage>,
    /// Input files as read by this worker.
    pub(super) inputs: InputVersions,
    /// What of those was given to the catalog with a stage.
    pub(super) told: InputVersions,
    /// The scan, from fit to depth.
    pub(super) scan: Option<Scan>,
    /// The print, from the first stage that reads it to normalize.
    pub(super) print: Option<Print>,
    /// From fit on.
    pub(super) fit: Option<FitOutcome>,
    /// From depth on.
    pub(super) depth: Option<DepthMap>,
    /// From normalize on.
    pub(super) normalized: Option<Normalized>,
}

impl PairContext {
    /// A pair as the catalog gives it, nothing in memory yet.
    pub(super) fn new(work: PairWork) -> Self {
        let stored = work.results.into_iter().map(|record| {
            let stored = StoredStage {
                outcome: record.outcome,
                files: record.files,
                mesh_hash: record.mesh_hash,
                print_hash: record.print_hash,
            };
            (record.stage, stored)
        });
        Self {
            attributes: work.attributes,
            attributes_json: work.attributes_json,
            stored: stored.collect(),
            inputs: InputVersions::default(),
            told: InputVersions::default(),
            scan: None,
            print: None,
            fit: None,
            depth: None,
            normalized: None,
        }
    }

    /// Input files as read, if the catalog was not given them with an earlier stage.
    pub(super) fn news(&mut self) -> InputVersions {
        if self.told == self.inputs {
            return InputVersions::default();
        }
        self.told = self.inputs.clone();
        self.told.clone()
    }

    /// The stored outcome of a stage; `None` when it is not there or not of this type any more.
    pub(super) fn outcome<T: DeserializeOwned>(&self, stage: Stage) -> Option<T> {
        let stored = self.stored.get(&stage)?;
        T::deserialize(&stored.outcome).ok()
    }

    /// Content of the mesh that the results are of: as read now, or as read for the fit.
    pub(super) fn mesh_hash(&self) -> Option<ContentHash> {
        let read = self.inputs.mesh.as_ref().map(|seen| seen.hash);
        read.or_else(|| Some(self.stored.get(&Stage::Fit)?.mesh_hash))
    }

    /// Content of the print that the results are of: as read now, or as an earlier stage read it; `None` while none
    /// has.
    pub(super) fn print_hash(&self) -> Option<ContentHash> {
        let read = self.inputs.print.as_ref().map(|seen| seen.hash);
        let mut stored = self.stored.values().rev();
        read.or_else(|| stored.find_map(|stored| stored.print_hash))
    }
}
