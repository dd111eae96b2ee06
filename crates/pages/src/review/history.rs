//! The reviewer's history: current answers and manual alignments, by item.

use std::collections::{BTreeMap, BTreeSet};

use super::item::ReviewItem;
use super::options::QueueOptions;
use mocban_catalog::{Answer, AnsweredOn, Catalog, CatalogError, ManualAlignment};
use mocban_core::domain::ContentHash;

/// The latest answers and manual alignments of a reviewer.
#[derive(Debug, Default)]
pub(super) struct ReviewerHistory {
    answers: BTreeMap<AnsweredOn, Answer>,
    alignments: BTreeMap<ContentHash, ManualAlignment>,
    /// Results in which a fault was planted that the reviewer has answered, also if the answer was undone.
    faulty_results: BTreeSet<ContentHash>,
    /// Whether alignments are also shown for items without an answer. False if there are attention checks.
    shows_all_alignments: bool,
}

impl ReviewerHistory {
    /// Reads the reviewer's current answers and alignments, without undone ones.
    pub(super) async fn read(
        catalog: &Catalog,
        options: &QueueOptions,
    ) -> Result<Self, CatalogError> {
        let answered = Self::answers(catalog, &options.reviewer).await?;
        let alignments = catalog.manual_alignments().await?.into_iter();
        let checks = catalog.attention_check_answers().await?.into_iter();
        let own_faults = checks
            .filter(|given| given.reviewer == options.reviewer && given.check.is_fault())
            .map(|given| given.result_hash);
        let current = alignments.filter(|stored| {
            stored.made.reviewer == options.reviewer
                && stored.holds
                && stored.on_current_depth
                && stored.undone_at.is_none()
        });
        Ok(Self {
            alignments: current
                .map(|stored| (stored.made.seen, stored.made))
                .collect(),
            faulty_results: own_faults.collect(),
            shows_all_alignments: !options.has_attention_checks(),
            ..answered
        })
    }

    /// Reads only the reviewer's current answers.
    pub(super) async fn answers(catalog: &Catalog, reviewer: &str) -> Result<Self, CatalogError> {
        let answers = catalog.answers(reviewer).await?.into_iter();
        Ok(Self {
            // Oldest first, so that the latest one replaces the others.
            answers: answers.map(|answer| (answer.on, answer)).collect(),
            ..Self::default()
        })
    }

    /// Returns whether the reviewer has not answered anything yet, in any review of the project.
    pub(super) fn is_empty(&self) -> bool {
        self.answers.is_empty()
    }

    /// Returns the results in which a fault was planted that the reviewer has answered.
    pub(super) const fn faulty_results(&self) -> &BTreeSet<ContentHash> {
        &self.faulty_results
    }

    /// Returns the answer to an item.
    pub(super) fn answer(&self, item: &ReviewItem) -> Option<&Answer> {
        if item.check.is_some() {
            return self.answers.get(&AnsweredOn::Check(item.view.hash()));
        }
        let on_results = item.results.iter();
        on_results
            .filter_map(|(_, hash)| self.answers.get(&AnsweredOn::Result(*hash)))
            .max_by_key(|answer| answer.at)
    }

    /// Returns the reviewer's manual alignment of an item's image. If there are attention checks, returns `None` for an
    /// unanswered item: an alignment would reveal that the item is a duplicate.
    pub(super) fn alignment(&self, item: &ReviewItem) -> Option<&ManualAlignment> {
        let found = self.alignments.get(&item.view.hash());
        found.filter(|_| self.shows_all_alignments || self.answer(item).is_some())
    }
}
