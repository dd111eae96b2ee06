//! State of a pair between two stages: its data from the catalog, and the values that stages keep in memory.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::stop::{Stop, StopLevel};
use mocban_align::stages::normalize::Normalized;
use mocban_align::stages::{Print, Scan};
use mocban_catalog::{InputVersions, PairAttributes, PairWork};
use mocban_core::domain::{ArtifactSet, ContentHash, FitOutcome, Stage};
use mocban_core::locked;
use mocban_core::raster::DepthMap;
use mocban_system::platform::ActiveClock;

/// The stored result of an earlier stage.
#[derive(Debug, Clone)]
pub(super) struct StoredStage {
    pub(super) outcome: Value,
    pub(super) files: ArtifactSet,
    pub(super) mesh_hash: ContentHash,
    pub(super) print_hash: Option<ContentHash>,
}

/// The input file that a pair's thread is reading. Other threads name this file in messages if the read hangs.
#[derive(Debug, Clone, Default)]
pub(super) struct FileInUse(Arc<Mutex<Option<PathBuf>>>);

impl FileInUse {
    /// Stores the path of the file that is read from now on. `None` means that no file is read.
    pub(super) fn set(&self, path: Option<&Path>) {
        let mut file = locked(&self.0);
        *file = path.map(Path::to_owned);
    }

    /// Returns the file.
    pub(super) fn get(&self) -> Option<PathBuf> {
        let file = locked(&self.0);
        file.clone()
    }
}

/// Longest time for which a file is read after a stop request. It includes decoding, so it is longer than that of the
/// largest usual scans.
const LONGEST_READ_AFTER_STOP: Duration = Duration::from_secs(5);
/// Interval at which the file in use is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// Waits for a stop request, and then until one file has been read for too long: its disk or object store may be
/// unavailable.
pub(super) async fn reading_after_stop(file: &FileInUse, stop: &Stop) {
    stop.reached(StopLevel::Drain).await;
    let mut clock = ActiveClock::start(2 * LOOK_EVERY);
    let (mut path, mut since) = (file.get(), clock.now());
    loop {
        tokio::time::sleep(LOOK_EVERY).await;
        let (found, now) = (file.get(), clock.now());
        if found != path {
            (path, since) = (found, now);
        } else if path.is_some() && now.saturating_sub(since) >= LONGEST_READ_AFTER_STOP {
            return;
        }
    }
}

/// Values that the stages of a pair share. A value stays in memory from the stage that computes it to the last one
/// that needs it.
#[derive(Debug)]
pub(super) struct PairContext {
    /// The pair as imported.
    pub(super) attributes: PairAttributes,
    /// The manifest attributes that results depend on, as JSON. The catalog stores this text with each result.
    pub(super) attributes_json: String,
    /// Results of earlier stages.
    pub(super) stored: BTreeMap<Stage, StoredStage>,
    /// Input files as read by this thread.
    pub(super) inputs: InputVersions,
    /// The `inputs` that were last reported to the catalog.
    reported: InputVersions,
    pub(super) file_in_use: FileInUse,
    pub(super) scan: Option<Scan>,
    pub(super) print: Option<Print>,
    pub(super) fit: Option<FitOutcome>,
    pub(super) depth: Option<DepthMap>,
    pub(super) normalized: Option<Normalized>,
}

impl PairContext {
    /// A pair as the catalog returns it, with nothing in memory yet.
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
            reported: InputVersions::default(),
            file_in_use: FileInUse::default(),
            scan: None,
            print: None,
            fit: None,
            depth: None,
            normalized: None,
        }
    }

    /// Returns the versions of the input files that were read, or nothing if they have not changed since the last call.
    pub(super) fn unreported_inputs(&mut self) -> InputVersions {
        if self.reported == self.inputs {
            return InputVersions::default();
        }
        self.reported = self.inputs.clone();
        self.inputs.clone()
    }

    /// Returns the stored outcome of a stage. Returns `None` if the stage has none, or if it cannot be parsed as `T`.
    pub(super) fn outcome<T: DeserializeOwned>(&self, stage: Stage) -> Option<T> {
        let stored = self.stored.get(&stage)?;
        T::deserialize(&stored.outcome).ok()
    }

    /// Returns the hash of the mesh file that this thread read. If it read none, returns the hash of the file that the
    /// fit read.
    pub(super) fn mesh_hash(&self) -> Option<ContentHash> {
        let read = self.inputs.mesh.as_ref().map(|input| input.hash);
        read.or_else(|| Some(self.stored.get(&Stage::Fit)?.mesh_hash))
    }

    /// Returns the hash of the print file that this thread read. If it read none, returns the hash of the file that the
    /// latest stage read. Returns `None` if no stage has read the print.
    pub(super) fn print_hash(&self) -> Option<ContentHash> {
        let read = self.inputs.print.as_ref().map(|input| input.hash);
        let mut stored = self.stored.values().rev();
        read.or_else(|| stored.find_map(|stored| stored.print_hash))
    }
}
