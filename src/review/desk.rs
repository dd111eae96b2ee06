//! What the handlers share: the catalog, the reviewer, the cards that were dealt.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::card::Card;
use super::deck::{Deck, DeckError, DeckOptions};
use super::pictures::{Drawn, PictureError, Pictures};
use super::session::Session;
use super::words::Language;
use crate::catalog::Catalog;
use crate::domain::UnixMillis;
use crate::store::Project;

/// One reviewer's desk.
#[derive(Debug)]
pub(super) struct Desk {
    pub(super) catalog: Catalog,
    pub(super) project: Project,
    pub(super) deck_options: DeckOptions,
    pub(super) language: Language,
    pub(super) keys: BTreeMap<String, String>,
    pub(super) min_view_ms: u64,
    pub(super) now: fn() -> UnixMillis,
    pub(super) session: Session,
    /// Names with port that requests may be sent to.
    pub(super) hosts: Vec<String>,
    pub(super) pictures: Pictures,
    /// Every card that was dealt since the start: an answer to one is taken also when results changed meanwhile.
    pub(super) dealt: Mutex<BTreeMap<String, Arc<Card>>>,
}

impl Desk {
    /// Reads the deck as the catalog stands.
    ///
    /// # Errors
    /// When the catalog refuses.
    pub(super) async fn deal(&self) -> Result<Deck, DeckError> {
        let deck = Deck::read(&self.catalog, &self.project, &self.deck_options).await?;
        // A poisoned lock holds a map that is whole: nothing is half inserted.
        let mut dealt = self.dealt.lock().unwrap_or_else(PoisonError::into_inner);
        for card in &deck.cards {
            dealt.insert(card.id.clone(), Arc::clone(card));
        }
        Ok(deck)
    }

    /// A card that was dealt.
    pub(super) fn card(&self, id: &str) -> Option<Arc<Card>> {
        let dealt = self.dealt.lock().unwrap_or_else(PoisonError::into_inner);
        dealt.get(id).cloned()
    }

    /// The pictures of a card.
    ///
    /// # Errors
    /// When something of the pair cannot be read.
    pub(super) async fn pictures(&self, card: &Arc<Card>) -> Result<Arc<Drawn>, PictureError> {
        self.pictures.of(card).await
    }
}
