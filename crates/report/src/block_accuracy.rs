//! How well the characters of whole blocks were found and aligned, against ground truth.

use std::collections::BTreeMap;

use serde::Serialize;

use mocban_catalog::{BlockDetail, Catalog, CatalogError, PairResults};
use mocban_core::domain::{
    BlockCharacterState, BlockName, BlockStage, BoxMatches, ThresholdMetric, TrueBox,
};
use mocban_results::TruthEvaluation;
use mocban_results::ground_truth::TruthErrors;
use mocban_results::stats::ratio;

/// A result is tight if it is right and its mean landmark error is at most this percentage of the character's height.
const TIGHT_TRE_PCT: f64 = 1.5;

/// How well the characters of a block were found and aligned.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BlockAccuracy {
    /// The block.
    pub block: String,
    /// Characters that its page shows whole.
    pub characters: u64,
    /// Characters that were cut and aligned, as far as their true alignment is known.
    pub found: u64,
    /// Found characters whose result is right.
    pub right: u64,
    /// Right characters whose landmark error is at most 1.5 % of their height.
    pub tight: u64,
    /// Precision and recall of the boxes. `None` if they come from labels, or if the block is not finished.
    pub boxes: Option<BoxAccuracy>,
}

/// Precision and recall of the boxes that were found on the page of a block.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BoxAccuracy {
    /// Boxes that were found.
    pub found: u64,
    /// At an intersection over union of at least 0.5.
    pub iou_50: PrecisionRecall,
    /// At an intersection over union of at least 0.7.
    pub iou_70: PrecisionRecall,
}

/// Precision and recall of boxes. Boxes and characters match one to one; boxes of characters of which the page shows only
/// a part count for neither.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PrecisionRecall {
    /// Characters with a box.
    pub matched: u64,
    /// `matched` as a share of the boxes.
    pub precision: Option<f64>,
    /// `matched` as a share of the characters.
    pub recall: Option<f64>,
}

impl PrecisionRecall {
    fn of(truth: &[TrueBox], found: &[[f64; 4]], min_iou: f64) -> Self {
        let counts = BoxMatches::of(truth, found, min_iou);
        let matched = counts.matched as f64;
        Self {
            matched: counts.matched,
            precision: ratio(matched, counts.found),
            recall: ratio(matched, counts.whole),
        }
    }
}

/// True boxes of a block, and the boxes that were found without labels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BlockBoxes {
    /// The block.
    pub(super) block: BlockName,
    /// The true boxes.
    pub(super) truth: Vec<TrueBox>,
    /// Left, top, right and bottom of each found box. `None` if the boxes come from labels, or if the block is not finished.
    pub(super) found: Option<Vec<[f64; 4]>>,
}

/// Numbers of results of one block.
#[derive(Debug, Clone, Copy, Default)]
struct BlockResults {
    found: u64,
    right: u64,
    tight: u64,
}

/// The sums from which the accuracies of blocks are made.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockSums {
    results: BTreeMap<String, BlockResults>,
    boxes: Vec<BlockBoxes>,
}

impl BlockSums {
    /// Reads the true boxes of all blocks that have some, and the boxes that were found.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub(super) async fn of_true_boxes(catalog: &Catalog) -> Result<Self, CatalogError> {
        let mut sums = Self::default();
        for (block, truth) in catalog.true_boxes().await? {
            let found = found_boxes(catalog, &block).await?;
            sums.add_boxes(BlockBoxes {
                block,
                truth,
                found,
            });
        }
        Ok(sums)
    }

    /// Counts the result of a pair, if it belongs to a block and has ground truth.
    pub(super) fn add(&mut self, pair: &PairResults, truth: &TruthEvaluation) {
        let errors = truth.errors.get(&ThresholdMetric::DEFAULT);
        if let (Some(block), Some(errors)) = (&pair.attributes.block, errors) {
            self.add_result(block, errors);
        }
    }

    fn add_result(&mut self, block: &str, errors: &TruthErrors) {
        let is_right = errors.pass();
        let results = self.results.entry(block.to_owned()).or_default();
        results.found += 1;
        results.right += u64::from(is_right);
        results.tight += u64::from(is_right && errors.tre_pct <= TIGHT_TRE_PCT);
    }

    /// Adds the boxes of a block.
    pub(super) fn add_boxes(&mut self, boxes: BlockBoxes) {
        self.boxes.push(boxes);
    }

    /// Returns the accuracies of the blocks whose true boxes are known.
    pub(super) fn finish(self) -> Vec<BlockAccuracy> {
        let results = self.results;
        let accuracy = |BlockBoxes {
                            block,
                            truth,
                            found,
                        }| {
            let BlockResults {
                found: aligned,
                right,
                tight,
            } = results.get(block.as_str()).copied().unwrap_or_default();
            BlockAccuracy {
                block: block.to_string(),
                characters: truth.iter().filter(|one| !one.is_partial).count() as u64,
                found: aligned,
                right,
                tight,
                boxes: found.map(|found| BoxAccuracy {
                    found: found.len() as u64,
                    iou_50: PrecisionRecall::of(&truth, &found, 0.5),
                    iou_70: PrecisionRecall::of(&truth, &found, 0.7),
                }),
            }
        };
        self.boxes.into_iter().map(accuracy).collect()
    }
}

/// Returns the boxes of a block that were found without labels; `None` if there are labels, or the block is not finished.
async fn found_boxes(
    catalog: &Catalog,
    block: &BlockName,
) -> Result<Option<Vec<[f64; 4]>>, CatalogError> {
    let detail = catalog.block(block).await?;
    if !detail.is_some_and(|detail| has_found_boxes(&detail)) {
        return Ok(None);
    }
    let all = catalog.block_characters(block).await?.into_iter();
    let current = all.filter(|one| one.state != BlockCharacterState::Retired);
    Ok(Some(current.map(|one| one.bounds).collect()))
}

/// Returns whether a block is finished and its boxes were found without labels.
fn has_found_boxes(detail: &BlockDetail) -> bool {
    let mut stages = detail.stages.iter();
    let boxes = stages.find(|stage| stage.stage == BlockStage::Boxes);
    detail.state.next_stage.is_none()
        && boxes.is_some_and(|boxes| boxes.outcome["labels"].is_null())
}

#[cfg(test)]
mod tests {
    use super::{BlockBoxes, BlockSums};
    use crate::test_fixtures::block_boxes;
    use mocban_results::ground_truth::TruthErrors;

    fn errors(angle_deg: f64, tre_pct: f64) -> TruthErrors {
        TruthErrors {
            angle_deg,
            mirrored: false,
            tre_pct,
            mask_iou: None,
        }
    }

    /// Three characters are whole. Of the five boxes, one has an IoU of 1, one of 0.6 and one of 0.4, one is of a part of a
    /// character, and one of nothing.
    #[test]
    fn shares_are_those_counted_by_hand() {
        let mut sums = BlockSums::default();
        for (angle_deg, tre_pct) in [(1.0, 1.5), (1.0, 1.6), (6.0, 1.0), (0.5, 0.2)] {
            sums.add_result("b", &errors(angle_deg, tre_pct));
        }
        sums.add_result("of no block", &errors(0.0, 0.0));
        sums.add_boxes(block_boxes("b", true));
        sums.add_boxes(block_boxes("labelled", false));
        let [block, labelled] = sums.finish().try_into().expect("two blocks");
        assert_eq!((block.characters, block.found), (3, 4));
        assert_eq!((block.right, block.tight), (3, 2));
        let boxes = block.boxes.expect("found boxes");
        assert_eq!(boxes.found, 5);
        assert_eq!(boxes.iou_50.matched, 2);
        assert_eq!(boxes.iou_50.precision, Some(0.5));
        assert_eq!(boxes.iou_50.recall, Some(2.0 / 3.0));
        assert_eq!(boxes.iou_70.precision, Some(0.25));
        assert_eq!(boxes.iou_70.recall, Some(1.0 / 3.0));
        assert_eq!((labelled.characters, labelled.found), (3, 0));
        assert_eq!(labelled.boxes, None);
    }

    #[test]
    fn no_boxes_have_no_precision() {
        let mut sums = BlockSums::default();
        sums.add_boxes(BlockBoxes {
            found: Some(Vec::new()),
            ..block_boxes("b", true)
        });
        let [block] = sums.finish().try_into().expect("one block");
        let at = block.boxes.expect("searched").iou_50;
        assert_eq!((at.precision, at.recall), (None, Some(0.0)));
    }
}
