//! What a reviewer has done so far, card by card: answers and corrections by hand.

use std::collections::BTreeMap;

use super::card::Card;
use super::correction::Corrections;
use super::deck::DeckOptions;
use crate::catalog::{Answer, AnsweredOn, Catalog, CatalogError, ManualAlignment};

/// A reviewer's newest answers and corrections.
#[derive(Debug, Default)]
pub(super) struct Known {
    answers: BTreeMap<AnsweredOn, Answer>,
    corrections: Corrections,
    /// Whether the reviewer may know a pair again, because no card is there to test the reviewer.
    is_open: bool,
}

impl Known {
    /// Reads those that were not taken back.
    ///
    /// # Errors
    /// When the catalog refuses.
    pub(super) async fn read(
        catalog: &Catalog,
        options: &DeckOptions,
    ) -> Result<Self, CatalogError> {
        let answers = catalog.answers(&options.reviewer).await?.into_iter();
        Ok(Self {
            // Oldest first, so that the newest stays.
            answers: answers.map(|answer| (answer.on, answer)).collect(),
            corrections: Corrections::read(catalog, &options.reviewer).await?,
            is_open: !options.tests_the_reviewer(),
        })
    }

    /// The answer to a card, if there is one.
    pub(super) fn answer(&self, card: &Card) -> Option<&Answer> {
        if card.control.is_some() {
            return self.answers.get(&AnsweredOn::Check(card.view.seen()));
        }
        let on_results = card.results.iter();
        on_results
            .filter_map(|(_, hash)| self.answers.get(&AnsweredOn::Result(*hash)))
            .max_by_key(|answer| answer.at)
    }

    /// The correction of what a card shows. A repeat shows what was corrected before: it is told of no card that is
    /// not answered, unless nothing comes twice.
    pub(super) fn correction(&self, card: &Card) -> Option<&ManualAlignment> {
        let found = self.corrections.of(card);
        found.filter(|_| self.is_open || self.answer(card).is_some())
    }
}
