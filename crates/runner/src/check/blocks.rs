//! Checks one block: its results against their files. The files of the characters that were cut are files of the result
//! of the last stage.

use super::finding::{Finding, Kind};
use super::pairs::kind_of;
use crate::result_hash;
use mocban_catalog::AuditedBlock;
use mocban_core::domain::{BlockId, BlockStage};
use mocban_store::{ArtifactError, Project};

/// Result of the check of one block.
#[derive(Debug)]
pub(super) struct BlockCheck {
    pub(super) block: BlockId,
    pub(super) damage: Vec<Finding>,
    /// The first stage with damage that a run repairs, from which the block must run again.
    pub(super) from: Option<BlockStage>,
    /// Number of files checked.
    pub(super) files: u64,
}

/// Checks the rows and files of a block. With `quick`, checks only the length of each file. Results of stages that will
/// run again (from the job's cursor on) are not checked.
///
/// # Errors
/// Returns an error if no artifact can be read, for example because the object store refuses the request.
pub(super) fn check_block(
    project: &Project,
    block: &AuditedBlock,
    quick: bool,
) -> Result<BlockCheck, ArtifactError> {
    let mut check = BlockCheck {
        block: block.block,
        damage: Vec::new(),
        from: None,
        files: 0,
    };
    let Some(cursor) = block.cursor else {
        check.add(block, Kind::JobMissing, BlockStage::Face, "it has no job");
        return Ok(check);
    };
    let stages = BlockStage::ALL.into_iter();
    for stage in stages.take_while(|stage| (stage.index() as i64) < cursor) {
        let found = block.results.iter().find(|result| result.stage == stage);
        let Some(result) = found else {
            check.add(block, Kind::ResultMissing, stage, "the result is missing");
            continue;
        };
        if result_hash(&result.outcome, &result.files) != result.result_hash {
            let text = "the result differs from its hash";
            check.add(block, Kind::ResultChanged, stage, text);
        }
        check.files += result.files.len() as u64;
        for artifact in result.files.values() {
            if let Err(error) = project.check_artifact(artifact, quick) {
                let text = error.to_string();
                check.add(block, kind_of(error)?, stage, &text);
            }
        }
    }
    Ok(check)
}

impl BlockCheck {
    fn add(&mut self, block: &AuditedBlock, kind: Kind, stage: BlockStage, what: &str) {
        let what = format!("block {} at {stage}: {what}", block.name);
        self.damage.push(Finding::new(kind, what));
        if kind.is_repairable() {
            self.from = Some(self.from.map_or(stage, |from| from.min(stage)));
        }
    }
}
