//! How far reviewers can be trusted: each with the others, with themselves, and on planted faults.

use std::collections::BTreeMap;

use serde::Serialize;

use super::agreement::{Agreement, Crosstab};
use super::attention_checks::{self, AttentionCheckRates};
use super::build::PAGE;
use super::consensus::{Consensus, split};
use super::pair_artifacts::alike;
use super::rate::Rate;
use crate::catalog::{
    AnsweredOn, AttentionCheckAnswer, Catalog, CatalogError, MetricRecord, PairResults,
};
use crate::domain::{AttentionCheck, ContentHash, PairName, Verdict};

/// Version of the JSON form.
const SCHEMA: u32 = 1;

/// Agreement of all reviewers of a project.
///
/// Results of one pair that look the same count once. Who settles what others contradict each other on has seen their
/// verdicts and is not compared with them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReviewerAgreement {
    /// Version of this form.
    pub schema: u32,
    /// Pictures on which reviewers contradict each other and nobody has settled it.
    pub conflicts: u64,
    /// Every two reviewers who have read the same results, by name.
    pub reviewer_pairs: Vec<ReviewerPair>,
    /// Every reviewer, by name.
    pub reviewers: Vec<ReviewerRecord>,
    /// Planted faults that all reviewers together failed, of those that they answered.
    pub caught: Rate,
}

/// Two reviewers on the same results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReviewerPair {
    /// The first by name.
    pub a: String,
    /// The second.
    pub b: String,
    /// How far they agree.
    #[serde(flatten)]
    pub agreement: Agreement,
}

/// What is known of one reviewer alone.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ReviewerRecord {
    /// The reviewer.
    pub reviewer: String,
    /// Pictures of current results that they have judged.
    pub read: u64,
    /// Results shown a second time that got the same verdict again.
    pub repeats: Rate,
    /// Planted faults that they failed, of those that they answered; unsure is not caught.
    pub caught: Rate,
    /// The same by kind of fault.
    pub caught_by_fault: BTreeMap<&'static str, Rate>,
}

/// Reads the agreement of a project as its catalog stands.
///
/// # Errors
/// When the catalog cannot be read.
pub async fn agree(catalog: &Catalog) -> Result<ReviewerAgreement, CatalogError> {
    let mut counts = AgreementCounts::default();
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        for pair in &page {
            counts.add(pair);
        }
    }
    for (reviewer, answers) in &attention_checks::by_reviewer(catalog).await? {
        let own = own_verdicts(catalog, reviewer).await?;
        counts.test(reviewer, answers, &own);
    }
    Ok(counts.finish())
}

/// A reviewer's newest verdicts on results.
type OwnVerdicts = BTreeMap<(PairName, ContentHash), Verdict>;

async fn own_verdicts(catalog: &Catalog, reviewer: &str) -> Result<OwnVerdicts, CatalogError> {
    let answers = catalog.answers(reviewer).await?.into_iter();
    // Oldest first, so that the newest stays.
    Ok(answers
        .filter_map(|answer| match answer.on {
            AnsweredOn::Result(hash) => Some(((answer.pair, hash), answer.verdict)),
            AnsweredOn::Check(_) => None,
        })
        .collect())
}

/// The sums so far.
#[derive(Debug, Default)]
struct AgreementCounts {
    conflicts: u64,
    reviewer_pairs: BTreeMap<(String, String), Crosstab>,
    reviewers: BTreeMap<String, ReviewerRecord>,
}

impl AgreementCounts {
    /// Counts the pictures of one pair in.
    fn add(&mut self, pair: &PairResults) {
        for picture in pictures(pair) {
            self.conflicts += u64::from(picture.is_conflict);
            for (i, (a, first)) in picture.read.iter().enumerate() {
                self.reviewer(a).read += 1;
                for (b, second) in &picture.read[i + 1..] {
                    let two = ((*a).to_owned(), (*b).to_owned());
                    self.reviewer_pairs
                        .entry(two)
                        .or_default()
                        .add(*first, *second);
                }
            }
        }
    }

    /// Holds a reviewer's answers to controls against what they should be.
    fn test(&mut self, reviewer: &str, answers: &[AttentionCheckAnswer], own: &OwnVerdicts) {
        let answers = attention_checks::newest(answers);
        let repeats = answers
            .iter()
            .filter(|answer| answer.check == AttentionCheck::Duplicate);
        let same = repeats.filter_map(|answer| {
            let first = own.get(&(answer.pair.clone(), answer.result_hash))?;
            Some(*first == answer.verdict)
        });
        let record = self.reviewer(reviewer);
        record.repeats = Rate::of(same);
        let caught = AttentionCheckRates::of(answers.iter().copied());
        (record.caught, record.caught_by_fault) = (caught.all, caught.by_fault);
    }

    fn reviewer(&mut self, name: &str) -> &mut ReviewerRecord {
        let record = self.reviewers.entry(name.to_owned());
        record.or_insert_with(|| ReviewerRecord {
            reviewer: name.to_owned(),
            ..ReviewerRecord::default()
        })
    }

    fn finish(self) -> ReviewerAgreement {
        let reviewer_pairs = self.reviewer_pairs.into_iter();
        ReviewerAgreement {
            schema: SCHEMA,
            conflicts: self.conflicts,
            reviewer_pairs: reviewer_pairs
                .map(|((a, b), crosstab)| ReviewerPair {
                    a,
                    b,
                    agreement: crosstab.finish(),
                })
                .collect(),
            caught: Rate::total(self.reviewers.values().map(|record| record.caught)),
            reviewers: self.reviewers.into_values().collect(),
        }
    }
}

/// A picture with the verdicts of those who judged it by themselves, in the order of their names.
struct DistinctResult<'a> {
    read: Vec<(&'a str, Verdict)>,
    is_conflict: bool,
}

/// The pictures of a pair: results that look the same are one.
fn pictures(pair: &PairResults) -> Vec<DistinctResult<'_>> {
    let groups = alike(&pair.metrics);
    groups
        .iter()
        .map(|group| DistinctResult::of(group))
        .collect()
}

impl<'a> DistinctResult<'a> {
    fn of(group: &[&'a MetricRecord]) -> Self {
        let mut read = BTreeMap::new();
        for record in group {
            for verdict in split(record).1 {
                // The page gives all of them one verdict; where it was given one by one, the first stands.
                read.entry(verdict.reviewer.as_str())
                    .or_insert(verdict.verdict);
            }
        }
        let is_conflict = |record: &&MetricRecord| Consensus::of(record) == Consensus::Conflict;
        Self {
            read: read.into_iter().collect(),
            is_conflict: group.iter().any(is_conflict),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{AgreementCounts, OwnVerdicts};
    use crate::catalog::{AttentionCheckAnswer, Look, MetricRecord, ReviewerVerdict};
    use crate::domain::{
        AttentionCheck, ContentHash, PairName, ReviewOrder, ThresholdMetric, Verdict,
    };
    use crate::report::test_fixtures;

    fn answer(pair: &str, check: AttentionCheck, verdict: Verdict) -> AttentionCheckAnswer {
        AttentionCheckAnswer {
            pair: PairName::new(pair).expect("test names are ids"),
            metric: ThresholdMetric::Density,
            result_hash: ContentHash::of(pair.as_bytes()),
            check,
            verdict,
            reviewer: "lan".to_owned(),
            reason: None,
            note: None,
            look: Look::default(),
            at: 0,
            undone_at: None,
        }
    }

    #[test]
    fn results_that_look_the_same_count_once() {
        let mut counts = AgreementCounts::default();
        counts.add(&test_fixtures::done(
            "a",
            0.8,
            &[Verdict::Pass, Verdict::Fail],
        ));
        let mut apart = test_fixtures::done("b", 0.8, &[Verdict::Pass, Verdict::Pass]);
        apart.metrics[0].outcome.threshold_level += 1;
        counts.add(&apart);
        let found = counts.finish();
        assert_eq!((found.conflicts, found.reviewers[0].read), (1, 3));
        let two = &found.reviewer_pairs[0];
        assert_eq!((two.a.as_str(), two.b.as_str()), ("r0", "r1"));
        assert_eq!((two.agreement.n, two.agreement.agreed), (3, 2));
    }

    #[test]
    fn who_settles_a_conflict_is_compared_with_nobody() {
        let mut counts = AgreementCounts::default();
        let mut pair = test_fixtures::done("a", 0.8, &[Verdict::Pass, Verdict::Fail]);
        let settle = |record: &mut MetricRecord| {
            record.verdicts.push(ReviewerVerdict {
                reviewer: "third".to_owned(),
                verdict: Verdict::Fail,
                reason: None,
                review_order: Some(ReviewOrder::Adjudicate),
            });
        };
        pair.metrics.iter_mut().for_each(settle);
        counts.add(&pair);
        let found = counts.finish();
        assert_eq!((found.conflicts, found.reviewer_pairs.len()), (0, 1));
        assert_eq!(found.reviewers.len(), 2);
    }

    #[test]
    fn every_two_of_three_reviewers_are_compared() {
        let mut counts = AgreementCounts::default();
        counts.add(&test_fixtures::done("a", 0.8, &[Verdict::Pass; 3]));
        let found = counts.finish().reviewer_pairs;
        let names: Vec<_> = found
            .iter()
            .map(|two| (two.a.as_str(), two.b.as_str()))
            .collect();
        assert_eq!(names, [("r0", "r1"), ("r0", "r2"), ("r1", "r2")]);
    }

    #[test]
    fn a_fault_is_caught_by_a_fail_and_the_newest_answer_counts() {
        let turned = AttentionCheck::Turned { angle_deg: 9.0 };
        let answers = [
            answer("a", turned, Verdict::Pass),
            answer("a", turned, Verdict::Fail),
            answer("b", turned, Verdict::Unsure),
            answer("b", AttentionCheck::Mirrored, Verdict::Fail),
        ];
        let mut counts = AgreementCounts::default();
        counts.test("lan", &answers, &OwnVerdicts::new());
        let found = counts.finish();
        let lan = &found.reviewers[0];
        assert_eq!((lan.caught.count, lan.caught.n), (2, 3));
        let turned = lan.caught_by_fault["turned"];
        assert_eq!((turned.count, turned.n), (1, 2));
        assert_eq!((lan.caught, lan.repeats.n), (found.caught, 0));
    }

    #[test]
    fn a_repeat_is_held_against_the_reviewers_own_verdict() {
        let own = OwnVerdicts::from(["a", "b"].map(|name| {
            let first = answer(name, AttentionCheck::Duplicate, Verdict::Pass);
            ((first.pair, first.result_hash), Verdict::Pass)
        }));
        let answers = [
            answer("a", AttentionCheck::Duplicate, Verdict::Pass),
            answer("b", AttentionCheck::Duplicate, Verdict::Fail),
            // Its first look was taken back.
            answer("c", AttentionCheck::Duplicate, Verdict::Pass),
        ];
        let mut counts = AgreementCounts::default();
        counts.test("lan", &answers, &own);
        let lan = counts.finish().reviewers.remove(0);
        assert_eq!((lan.repeats.count, lan.repeats.n), (1, 2));
        assert_eq!((lan.caught.n, lan.caught.share), (0, None));
    }
}
