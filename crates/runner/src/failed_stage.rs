//! What is known of a pair whose stage failed, for the record of the failure.

use std::path::PathBuf;
use std::time::Duration;

use super::input_changes;
use super::input_reads::ReadLimits;
use super::pair_context::{FileInUse, PairContext};
use super::run_context::RunContext;
use super::stop::StopLevel;
use mocban_catalog::{InputVersions, PairAttributes};
use mocban_core::domain::{Failure, FailureClass, Stage};

/// Data that is stored if the pair fails. The task keeps this copy, because the thread's data is lost if the thread
/// hangs or panics.
pub(super) struct PairSummary {
    pub(super) attributes: PairAttributes,
    pub(super) attributes_json: String,
    pub(super) inputs: InputVersions,
    pub(super) file_in_use: FileInUse,
}

impl PairSummary {
    /// Copies the data of a pair before its thread starts.
    pub(super) fn of(pair: &PairContext) -> Self {
        Self {
            attributes: pair.attributes.clone(),
            attributes_json: pair.attributes_json.clone(),
            inputs: pair.inputs.clone(),
            file_in_use: pair.file_in_use.clone(),
        }
    }

    /// Returns the versions of the input files that the thread reported. For an unreported file, returns the current
    /// version, if it can be read. Later runs compare the files with these versions to notice a replacement.
    pub(super) async fn inputs_now(&self, context: &RunContext) -> InputVersions {
        let read = self.inputs.clone();
        if read.mesh.is_some() && read.print.is_some() {
            return read;
        }
        let paths = [&self.attributes.mesh_path, &self.attributes.print_path]
            .map(|path| context.project.input(path));
        let limits = ReadLimits {
            timeout: context.stage_timeout.min(MAX_REREAD),
            stop: context.stop.clone(),
            until: StopLevel::Now,
        };
        let [mesh, print] = input_changes::current_of_both(paths, &limits).await;
        InputVersions {
            mesh: read.mesh.or(mesh),
            print: read.print.or(print),
        }
    }
}

/// Longest time for reading the input files again after a stage hung or panicked.
const MAX_REREAD: Duration = Duration::from_secs(30);

/// How a stage failed.
#[derive(Debug)]
pub(super) struct FailedStage {
    pub(super) failure: Failure,
    /// Whether a retry may succeed.
    pub(super) is_transient: bool,
    /// The input files as read, if the pair's data was not lost.
    pub(super) inputs: Option<InputVersions>,
    pub(super) ms: Option<u64>,
}

impl FailedStage {
    /// A failure after which the pair's data is lost.
    pub(super) fn without_pair(class: FailureClass, text: String) -> Self {
        Self {
            failure: Failure::new(class, text),
            is_transient: false,
            inputs: None,
            ms: None,
        }
    }
}

/// Describes a stage that took too long, and the input file that it was reading.
pub(super) fn timeout_text(stage: Stage, timeout: Duration, reading: Option<PathBuf>) -> String {
    let seconds = timeout.as_secs_f64();
    let text = format!("{stage} took longer than {seconds} s");
    match reading {
        Some(path) => format!(
            "{text} while it read {}; its disk or network may hang",
            path.display()
        ),
        None => text,
    }
}
