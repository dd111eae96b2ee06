//! Reviewers' answers to attention checks. A check is a planted fault or a result that is shown twice.

use std::collections::BTreeMap;

use serde::Serialize;

use super::stats::{IntervalMethod, Rate};
use mocban_catalog::{AttentionCheckAnswer, Catalog, CatalogError};
use mocban_core::domain::Verdict;

/// Planted faults that reviewers failed, as a share of those they judged. An unsure verdict is not a detection.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct AttentionCheckRates {
    /// Of every kind.
    #[serde(flatten)]
    pub all: Rate,
    /// By kind of fault.
    pub by_kind: BTreeMap<&'static str, Rate>,
    /// By reviewer. Empty for the rates of one reviewer.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub by_reviewer: BTreeMap<String, Rate>,
}

/// Fewest answered planted faults from which a reviewer's rate is judged.
const MIN_CHECKS: u64 = 4;

impl AttentionCheckRates {
    /// Returns the rates of detected faults among the answers of one or more reviewers. Ignores answers to duplicates.
    pub fn of<'a>(answers: impl IntoIterator<Item = &'a AttentionCheckAnswer>) -> Self {
        let mut rates = Self::default();
        for answer in answers.into_iter().filter(|answer| answer.check.is_fault()) {
            let is_detected = answer.verdict == Verdict::Fail;
            let of_kind = rates.by_kind.entry(answer.check.name()).or_default();
            of_kind.add(is_detected);
            rates.all.add(is_detected);
        }
        rates
    }

    /// Returns the reviewers who detected fewer than half of at least `MIN_CHECKS` planted faults.
    pub fn inattentive(&self) -> Vec<(&str, &Rate)> {
        let reviewers = self.by_reviewer.iter();
        let reviewers = reviewers.filter(|(_, rate)| is_inattentive(rate));
        reviewers
            .map(|(name, rate)| (name.as_str(), rate))
            .collect()
    }

    /// Computes the intervals by `method`.
    pub fn set_interval(&mut self, method: IntervalMethod) {
        let rates = self.by_kind.values_mut();
        let rates = rates.chain(self.by_reviewer.values_mut());
        for rate in rates.chain([&mut self.all]) {
            rate.set_interval(method);
        }
    }
}

/// Returns whether fewer than half of at least four planted faults were detected.
pub fn is_inattentive(rate: &Rate) -> bool {
    rate.n >= MIN_CHECKS && rate.count * 2 < rate.n
}

/// Returns the rates of detected faults among the answers of all reviewers of a project.
///
/// # Errors
/// Returns an error if the catalog cannot be read.
pub async fn project_rates(catalog: &Catalog) -> Result<AttentionCheckRates, CatalogError> {
    let answers = answers_by_reviewer(catalog).await?;
    let mut rates = AttentionCheckRates::of(answers.values().flat_map(|answers| newest(answers)));
    let by_reviewer = answers.iter().map(|(reviewer, answers)| {
        let rate = AttentionCheckRates::of(newest(answers)).all;
        (reviewer.clone(), rate)
    });
    rates.by_reviewer = by_reviewer.filter(|(_, rate)| rate.n > 0).collect();
    Ok(rates)
}

/// Returns each reviewer's answers that were not undone, with the oldest first.
///
/// # Errors
/// Returns an error if the catalog cannot be read.
pub async fn answers_by_reviewer(
    catalog: &Catalog,
) -> Result<BTreeMap<String, Vec<AttentionCheckAnswer>>, CatalogError> {
    let mut by_reviewer: BTreeMap<String, Vec<AttentionCheckAnswer>> = BTreeMap::new();
    for answer in catalog.attention_check_answers().await? {
        if answer.undone_at.is_none() {
            let answers = by_reviewer.entry(answer.reviewer.clone()).or_default();
            answers.push(answer);
        }
    }
    Ok(by_reviewer)
}

/// Returns a reviewer's newest answer to each item. `answers` must be sorted with the oldest first.
pub fn newest(answers: &[AttentionCheckAnswer]) -> Vec<&AttentionCheckAnswer> {
    let shown = |answer: &AttentionCheckAnswer| {
        let hashes = (answer.result_hash, answer.context.seen);
        (answer.pair.clone(), answer.check.name(), hashes)
    };
    let newest: BTreeMap<_, _> = answers
        .iter()
        .map(|answer| (shown(answer), answer))
        .collect();
    newest.into_values().collect()
}
