//! Answers to what only tests a reviewer: planted faults and repeats.

use std::collections::BTreeMap;

use serde::Serialize;

use super::interval::IntervalMethod;
use super::rate::Rate;
use crate::catalog::{AttentionCheckAnswer, Catalog, CatalogError};
use crate::domain::Verdict;

/// Planted faults that reviewers failed, of those that they answered; unsure is not caught.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct AttentionCheckRates {
    /// Of every kind.
    #[serde(flatten)]
    pub all: Rate,
    /// By kind of fault.
    pub by_fault: BTreeMap<&'static str, Rate>,
}

impl AttentionCheckRates {
    /// Of a reviewer's answers; those to repeats are left out.
    pub(super) fn of<'a>(answers: impl Iterator<Item = &'a AttentionCheckAnswer>) -> Self {
        let mut told: BTreeMap<_, Vec<bool>> = BTreeMap::new();
        for answer in answers.filter(|answer| answer.check.is_fault()) {
            let of_kind = told.entry(answer.check.name()).or_default();
            of_kind.push(answer.verdict == Verdict::Fail);
        }
        Self {
            all: Rate::of(told.values().flatten().copied()),
            by_fault: told
                .into_iter()
                .map(|(name, told)| (name, Rate::of(told)))
                .collect(),
        }
    }

    /// Of several reviewers together.
    pub(super) fn total<'a>(reviewers: impl Iterator<Item = &'a Self> + Clone) -> Self {
        let mut by_fault: BTreeMap<_, Vec<Rate>> = BTreeMap::new();
        for (name, rate) in reviewers.clone().flat_map(|caught| &caught.by_fault) {
            by_fault.entry(*name).or_default().push(*rate);
        }
        Self {
            all: Rate::total(reviewers.map(|caught| caught.all)),
            by_fault: by_fault
                .into_iter()
                .map(|(name, rates)| (name, Rate::total(rates.into_iter())))
                .collect(),
        }
    }

    /// The same with another interval.
    #[must_use]
    pub fn with_interval(self, interval: IntervalMethod) -> Self {
        let by_fault = self.by_fault.into_iter();
        Self {
            all: self.all.with_interval(interval),
            by_fault: by_fault
                .map(|(name, rate)| (name, rate.with_interval(interval)))
                .collect(),
        }
    }
}

/// Planted faults that all reviewers of a project caught.
///
/// # Errors
/// When the catalog cannot be read.
pub(super) async fn caught(catalog: &Catalog) -> Result<AttentionCheckRates, CatalogError> {
    let answers = by_reviewer(catalog).await?;
    let reviewers: Vec<AttentionCheckRates> = answers
        .values()
        .map(|answers| AttentionCheckRates::of(newest(answers).into_iter()))
        .collect();
    Ok(AttentionCheckRates::total(reviewers.iter()))
}

/// Answers that were not taken back, by reviewer, oldest first.
///
/// # Errors
/// When the catalog cannot be read.
pub(super) async fn by_reviewer(
    catalog: &Catalog,
) -> Result<BTreeMap<String, Vec<AttentionCheckAnswer>>, CatalogError> {
    let mut checks: BTreeMap<String, Vec<AttentionCheckAnswer>> = BTreeMap::new();
    for answer in catalog.attention_check_answers().await? {
        if answer.undone_at.is_none() {
            let of_reviewer = checks.entry(answer.reviewer.clone()).or_default();
            of_reviewer.push(answer);
        }
    }
    Ok(checks)
}

/// The newest of a reviewer's answers to each thing that was shown; they come oldest first.
pub(super) fn newest(answers: &[AttentionCheckAnswer]) -> Vec<&AttentionCheckAnswer> {
    let shown = |answer: &AttentionCheckAnswer| {
        let hashes = (answer.result_hash, answer.look.seen);
        (answer.pair.clone(), answer.check.name(), hashes)
    };
    let newest: BTreeMap<_, _> = answers
        .iter()
        .map(|answer| (shown(answer), answer))
        .collect();
    newest.into_values().collect()
}
