//! Reviewers' answers to attention checks: planted faults, and results shown a second time.

use std::collections::BTreeMap;

use serde::Serialize;

use super::stats::{IntervalMethod, Rate};
use crate::catalog::{AttentionCheckAnswer, Catalog, CatalogError};
use crate::domain::Verdict;

/// Share of answered planted faults that reviewers failed. An unsure answer does not detect the fault.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct AttentionCheckRates {
    /// Of every kind.
    #[serde(flatten)]
    pub all: Rate,
    /// By kind of fault.
    pub by_kind: BTreeMap<&'static str, Rate>,
}

impl AttentionCheckRates {
    /// Returns the rates of one reviewer; answers to duplicates are left out.
    pub(super) fn of<'a>(answers: impl IntoIterator<Item = &'a AttentionCheckAnswer>) -> Self {
        let mut outcomes: BTreeMap<_, Vec<bool>> = BTreeMap::new();
        for answer in answers.into_iter().filter(|answer| answer.check.is_fault()) {
            let of_kind = outcomes.entry(answer.check.name()).or_default();
            of_kind.push(answer.verdict == Verdict::Fail);
        }
        let by_kind = outcomes.into_iter();
        Self::from_kinds(by_kind.map(|(kind, outcomes)| (kind, Rate::of(outcomes))))
    }

    /// Returns the rates of several reviewers together.
    pub(super) fn total(reviewers: impl IntoIterator<Item = Self>) -> Self {
        let mut by_kind: BTreeMap<_, Vec<Rate>> = BTreeMap::new();
        for (kind, rate) in reviewers.into_iter().flat_map(|rates| rates.by_kind) {
            by_kind.entry(kind).or_default().push(rate);
        }
        let by_kind = by_kind.into_iter();
        Self::from_kinds(by_kind.map(|(kind, rates)| (kind, Rate::total(rates))))
    }

    fn from_kinds(by_kind: impl Iterator<Item = (&'static str, Rate)>) -> Self {
        let by_kind: BTreeMap<_, _> = by_kind.collect();
        Self {
            all: Rate::total(by_kind.values().copied()),
            by_kind,
        }
    }

    /// Returns the same rates with intervals computed by `method`.
    #[must_use]
    pub fn with_interval(self, method: IntervalMethod) -> Self {
        let by_kind = self.by_kind.into_iter();
        Self {
            all: self.all.with_interval(method),
            by_kind: by_kind
                .map(|(kind, rate)| (kind, rate.with_interval(method)))
                .collect(),
        }
    }
}

/// Returns the rates of all reviewers of a project together.
///
/// # Errors
/// When the catalog cannot be read.
pub(super) async fn project_rates(catalog: &Catalog) -> Result<AttentionCheckRates, CatalogError> {
    let answers = answers_by_reviewer(catalog).await?;
    let rates = |answers: &Vec<_>| AttentionCheckRates::of(newest(answers));
    Ok(AttentionCheckRates::total(answers.values().map(rates)))
}

/// Returns each reviewer's answers that were not undone, oldest first.
///
/// # Errors
/// When the catalog cannot be read.
pub(super) async fn answers_by_reviewer(
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

/// Returns the newest of a reviewer's answers to each thing that was shown; `answers` are sorted oldest first.
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
