//! Agreement of reviewers with each other and with themselves, and their answers to attention checks.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::attention_checks::{self, AttentionCheckRates};
use super::consensus::{Consensus, partition_verdicts};
use super::pair_artifacts::group_identical;
use super::stats::{AgreementTable, Rate};
use mocban_catalog::{
    AnsweredOn, AttentionCheckAnswer, Catalog, CatalogError, FaultyRow, MetricRecord, PairResults,
    SetApart,
};
use mocban_core::domain::{AttentionCheck, ContentHash, PairName, ThresholdMetric, Verdict};

/// Version of the JSON form.
const SCHEMA: u32 = 1;

/// Kappa and AC1 are shown only if both reviewers passed or failed at least this number of the same results.
///
/// If two reviewers agree on all of 30 results, the 95 % interval of their agreement still extends down to 0.89.
pub const MIN_RESULTS: u64 = 30;

/// Agreement of all reviewers of a project.
///
/// Results of one pair with the same threshold and alignment count once; one verdict on several metrics counts for each of
/// their results that differ. Adjudications are not compared, because
/// adjudicators have seen the verdicts of other reviewers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReviewerAgreement {
    /// Version of the JSON form.
    pub schema: u32,
    /// Results on which reviewers disagree and that nobody adjudicated.
    pub conflicts: u64,
    /// The same for each metric that has any. The sum is greater than `conflicts` if metrics have the same threshold and
    /// alignment.
    #[serde(skip)]
    pub conflicts_by_metric: BTreeMap<ThresholdMetric, u64>,
    /// The pairs of these results, in the order of the catalog.
    pub conflicting_pairs: Vec<PairName>,
    /// Every two reviewers who judged the same results, by name.
    pub reviewer_pairs: Vec<ReviewerPair>,
    /// Every reviewer, by name.
    pub reviewers: Vec<ReviewerRecord>,
    /// Planted faults that reviewers failed, as a share of all answers to planted faults.
    pub attention_checks: Rate,
    /// Retired pairs, whose verdicts are in no number.
    pub retired: u64,
    /// Damaged rows that the numbers do not include.
    #[serde(skip_serializing_if = "SetApart::is_empty")]
    pub set_apart: SetApart,
}

/// Two reviewers on the same results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReviewerPair {
    /// The first by name.
    pub a: String,
    /// The second by name.
    pub b: String,
    /// Their agreement.
    #[serde(flatten)]
    pub agreement: VerdictAgreement,
}

/// The agreement of two reviewers. A number that cannot be computed is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct VerdictAgreement {
    /// Number of results that both reviewers passed or failed. All other fields except `unsure` refer to these results.
    pub n: u64,
    /// Results that both judged and at least one was unsure about.
    pub unsure: u64,
    /// Results with equal verdicts.
    pub agreed: u64,
    /// `agreed / n`.
    pub agreement: Option<f64>,
    /// Wilson's 95 % interval of `agreement`.
    pub agreement_ci95: Option<[f64; 2]>,
    /// Cohen's kappa; see [`AgreementTable::cohen_kappa`].
    pub kappa: Option<f64>,
    /// Gwet's AC1; see [`AgreementTable::gwet_ac1`].
    pub ac1: Option<f64>,
    /// Results that at least one failed.
    pub failed_by_any: u64,
    /// Results that both failed.
    pub failed_by_both: u64,
    /// Whether `n` is at least [`MIN_RESULTS`].
    pub sufficient: bool,
}

/// One reviewer's record.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ReviewerRecord {
    /// The reviewer.
    pub reviewer: String,
    /// Current results that they judged, also to settle a conflict.
    pub judged: u64,
    /// Share of results shown twice that got the same verdict both times.
    pub duplicates: Rate,
    /// Share of answered planted faults that they failed.
    pub attention_checks: AttentionCheckRates,
}

/// Pairs in memory at a time.
const PAIRS_PER_PAGE: usize = 256;

/// Computes the agreement of a project's reviewers from the current state of its catalog. Compares every row of the catalog
/// with its checksum.
///
/// # Errors
/// Returns an error if the catalog cannot be read.
pub async fn agreement(catalog: &Catalog) -> Result<ReviewerAgreement, CatalogError> {
    let (sound, damaged) = catalog.without_faulty_rows().await?;
    count(&sound, &damaged).await
}

/// Computes the same numbers as [`agreement`] in a time that grows with the number of verdicts, not with that of pairs.
/// `set_apart` has only the damaged rows that these numbers depend on.
///
/// # Errors
/// Returns an error if the catalog cannot be read.
pub async fn agreement_of_verdicts(catalog: &Catalog) -> Result<ReviewerAgreement, CatalogError> {
    let (sound, damaged) = catalog.without_faulty_verdicts().await?;
    count(&sound, &damaged).await
}

/// Counts the verdicts of a catalog without damaged rows. A pair without verdicts changes no count.
async fn count(sound: &Catalog, damaged: &[FaultyRow]) -> Result<ReviewerAgreement, CatalogError> {
    let mut counts = AgreementCounts::default();
    let mut pages = sound.judged_pages(PAIRS_PER_PAGE).await?;
    while let Some(page) = pages.next().await? {
        for pair in &page {
            counts.add(pair);
        }
    }
    for (reviewer, answers) in &attention_checks::answers_by_reviewer(sound).await? {
        let own = own_verdicts(sound, reviewer).await?;
        counts.add_checks(reviewer, answers, &own);
    }
    Ok(ReviewerAgreement {
        retired: sound.retired_count().await?,
        set_apart: SetApart::of(damaged),
        ..counts.finish()
    })
}

/// A reviewer's newest verdicts on results.
type OwnVerdicts = BTreeMap<(PairName, ContentHash), Verdict>;

async fn own_verdicts(catalog: &Catalog, reviewer: &str) -> Result<OwnVerdicts, CatalogError> {
    let mut verdicts = OwnVerdicts::new();
    // Answers come oldest first, so the newest of each result is kept.
    for answer in catalog.answers(reviewer).await? {
        if let AnsweredOn::Result(hash) = answer.on {
            verdicts.insert((answer.pair, hash), answer.verdict);
        }
    }
    Ok(verdicts)
}

/// Two reviewers' verdicts on the same results, counted.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct VerdictTable {
    decided: AgreementTable,
    unsure: u64,
}

impl VerdictTable {
    /// Counts one result.
    pub(super) fn add(&mut self, first: Verdict, second: Verdict) {
        if first == Verdict::Unsure || second == Verdict::Unsure {
            self.unsure += 1;
        } else {
            self.decided
                .add(first == Verdict::Pass, second == Verdict::Pass);
        }
    }

    /// Returns the agreement.
    pub(super) fn finish(self) -> VerdictAgreement {
        let agreed = Rate::new(self.decided.agreed(), self.decided.n());
        VerdictAgreement {
            n: agreed.n,
            unsure: self.unsure,
            agreed: agreed.count,
            agreement: agreed.share,
            agreement_ci95: agreed.ci95,
            kappa: self.decided.cohen_kappa(),
            ac1: self.decided.gwet_ac1(),
            failed_by_any: self.decided.failed_by_any(),
            failed_by_both: self.decided.both_fail,
            sufficient: agreed.n >= MIN_RESULTS,
        }
    }
}

/// The counts so far.
#[derive(Debug, Default)]
struct AgreementCounts {
    conflicts: u64,
    conflicts_by_metric: BTreeMap<ThresholdMetric, u64>,
    conflicting_pairs: Vec<PairName>,
    reviewer_pairs: BTreeMap<(String, String), VerdictTable>,
    reviewers: BTreeMap<String, ReviewerRecord>,
}

impl AgreementCounts {
    /// Counts the distinct results of one pair.
    fn add(&mut self, pair: &PairResults) {
        let conflicts_before = self.conflicts;
        let is_conflict = |record: &&MetricRecord| Consensus::of(record) == Consensus::Conflict;
        for record in pair.metrics.iter().filter(is_conflict) {
            let of_metric = self.conflicts_by_metric.entry(record.outcome.metric);
            *of_metric.or_default() += 1;
        }
        for group in group_identical(&pair.metrics) {
            self.conflicts += u64::from(group.iter().any(is_conflict));
            for reviewer in reviewers_of(&group) {
                self.record(reviewer).judged += 1;
            }
            let verdicts: Vec<(&str, Verdict)> = independent_verdicts(&group).into_iter().collect();
            for (i, (a, first)) in verdicts.iter().enumerate() {
                for (b, second) in &verdicts[i + 1..] {
                    let two = ((*a).to_owned(), (*b).to_owned());
                    let table = self.reviewer_pairs.entry(two).or_default();
                    table.add(*first, *second);
                }
            }
        }
        if self.conflicts > conflicts_before {
            self.conflicting_pairs.push(pair.attributes.name.clone());
        }
    }

    /// Counts a reviewer's answers to attention checks.
    fn add_checks(&mut self, reviewer: &str, answers: &[AttentionCheckAnswer], own: &OwnVerdicts) {
        let answers = attention_checks::newest(answers);
        let duplicates = answers
            .iter()
            .filter(|answer| answer.check == AttentionCheck::Duplicate);
        let same = duplicates.filter_map(|answer| {
            let first = own.get(&(answer.pair.clone(), answer.result_hash))?;
            Some(*first == answer.verdict)
        });
        let record = self.record(reviewer);
        record.duplicates = Rate::of(same);
        record.attention_checks = AttentionCheckRates::of(answers.iter().copied());
    }

    fn record(&mut self, reviewer: &str) -> &mut ReviewerRecord {
        let record = self.reviewers.entry(reviewer.to_owned());
        record.or_insert_with(|| ReviewerRecord {
            reviewer: reviewer.to_owned(),
            ..ReviewerRecord::default()
        })
    }

    fn finish(self) -> ReviewerAgreement {
        let reviewer_pairs = self.reviewer_pairs.into_iter();
        let reviewers: Vec<ReviewerRecord> = self.reviewers.into_values().collect();
        ReviewerAgreement {
            schema: SCHEMA,
            conflicts: self.conflicts,
            conflicts_by_metric: self.conflicts_by_metric,
            conflicting_pairs: self.conflicting_pairs,
            reviewer_pairs: reviewer_pairs
                .map(|((a, b), table)| ReviewerPair {
                    a,
                    b,
                    agreement: table.finish(),
                })
                .collect(),
            attention_checks: Rate::total(
                reviewers.iter().map(|record| record.attention_checks.all),
            ),
            retired: 0,
            set_apart: SetApart::default(),
            reviewers,
        }
    }
}

/// Returns everybody who judged results with the same threshold and alignment, or settled a conflict about them.
fn reviewers_of<'a>(group: &[&'a MetricRecord]) -> BTreeSet<&'a str> {
    let verdicts = group.iter().flat_map(|record| &record.verdicts);
    verdicts.map(|given| given.reviewer.as_str()).collect()
}

/// Returns each reviewer's independent verdict on results with the same threshold and alignment.
fn independent_verdicts<'a>(group: &[&'a MetricRecord]) -> BTreeMap<&'a str, Verdict> {
    let mut by_reviewer = BTreeMap::new();
    for record in group {
        for given in partition_verdicts(record).1 {
            // The review page stores one verdict for all results of the group. If stored verdicts differ, the first
            // counts.
            by_reviewer
                .entry(given.reviewer.as_str())
                .or_insert(given.verdict);
        }
    }
    by_reviewer
}

#[cfg(test)]
mod tests;
