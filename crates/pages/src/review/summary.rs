//! What the page shows after the last answer: the reviewer's verdicts, attention checks, and agreement with others.

use serde::Serialize;

use super::review_queue::ReviewQueue;
use super::state::ServerState;
use mocban_catalog::CatalogError;
use mocban_core::domain::Verdict;
use mocban_results::{ReviewerPair, ReviewerRecord, agreement_of_verdicts, is_inattentive};

/// The summary of a review.
#[derive(Debug, Serialize)]
pub(super) struct ReviewSummary {
    /// Results of the queue by the reviewer's verdict. Attention checks do not count.
    results: VerdictCounts,
    /// The reviewer's attention checks, over all their reviews of the project.
    reviewer: ReviewerRecord,
    /// Whether the reviewer missed most attention checks, which the report says too.
    is_inattentive: bool,
    /// Agreement with every other reviewer who judged the same results.
    others: Vec<ReviewerPair>,
    /// The command line that names this project, for the next commands. `None` if the reviewer was invited.
    command: Option<String>,
    /// Relative address of the project in the app, if the review is part of it.
    project_page: Option<&'static str>,
    /// The rest of the command with which another person judges the same results.
    next_reviewer: String,
}

/// Number of results by verdict.
#[derive(Debug, Default, PartialEq, Eq, Serialize)]
struct VerdictCounts {
    pass: usize,
    fail: usize,
    unsure: usize,
}

impl VerdictCounts {
    fn of(verdicts: impl IntoIterator<Item = Verdict>) -> Self {
        let mut counts = Self::default();
        for verdict in verdicts {
            match verdict {
                Verdict::Pass => counts.pass += 1,
                Verdict::Fail => counts.fail += 1,
                Verdict::Unsure => counts.unsure += 1,
            }
        }
        counts
    }
}

impl ReviewSummary {
    /// Reads the summary of a queue. Returns `None` while an item has no answer, because the counts would reveal which
    /// items are attention checks.
    pub(super) async fn read(
        state: &ServerState,
        queue: &ReviewQueue,
    ) -> Result<Option<Self>, CatalogError> {
        let answers = queue.items.iter().map(|item| {
            let answer = queue.history.answer(item);
            answer.map(|answer| (item.check.is_none(), answer.verdict))
        });
        let Some(answers) = answers.collect::<Option<Vec<_>>>() else {
            return Ok(None);
        };
        let on_results = answers.iter().filter(|(is_result, _)| *is_result);
        let agreement = agreement_of_verdicts(&state.catalog).await?;
        let own = &state.options.queue.reviewer;
        let mut others = agreement.reviewer_pairs;
        others.retain(|pair| pair.a == *own || pair.b == *own);
        let mut reviewers = agreement.reviewers.into_iter();
        let reviewer = reviewers.find(|record| record.reviewer == *own);
        let reviewer = reviewer.unwrap_or_default();
        Ok(Some(Self {
            results: VerdictCounts::of(on_results.map(|(_, verdict)| *verdict)),
            is_inattentive: is_inattentive(&reviewer.attention_checks.all),
            reviewer,
            others,
            command: state.options.command.clone(),
            project_page: state.options.project_page,
            next_reviewer: state.options.queue.for_another_reviewer(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::VerdictCounts;
    use mocban_core::domain::Verdict;

    #[test]
    fn verdicts_are_counted() {
        let verdicts = [Verdict::Pass, Verdict::Fail, Verdict::Pass, Verdict::Unsure];
        let expected = VerdictCounts {
            pass: 2,
            fail: 1,
            unsure: 1,
        };
        assert_eq!(VerdictCounts::of(verdicts), expected);
    }
}
