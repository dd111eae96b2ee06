//! Takes pairs out of every count, and brings them back. Their results and verdicts stay.

use std::collections::BTreeSet;

use crate::error::ProjectResult;
use crate::exit::Refusal;
use crate::location::{Location, now};
use crate::selection;
use mocban_catalog::{Catalog, CatalogError};
use mocban_core::domain::{PairName, RetireCause, UnixMillis};

/// What became of some pairs.
#[derive(Debug)]
pub struct RetireOutcome {
    /// The pairs, each once.
    pub names: Vec<PairName>,
    /// How many of them changed.
    pub changed: u64,
    /// When they were retired. `None` if none changed, or if they were brought back.
    pub at: Option<UnixMillis>,
    /// Why pairs did not come back, one line each.
    pub warnings: Vec<String>,
}

/// Which pairs are retired or brought back.
#[derive(Debug, Clone)]
pub enum RetireChoice {
    /// These ids; the id of a block stands for the pairs that it has now.
    Ids(Vec<String>),
    /// The pairs that the newest import of a list or of folders added. With a time, only if that import was then.
    LastImport(Option<UnixMillis>),
    /// The pairs that a person retired at this time, which are brought back.
    RetiredAt(UnixMillis),
}

impl RetireChoice {
    async fn names(&self, catalog: &Catalog) -> ProjectResult<Vec<PairName>> {
        let at = match self {
            Self::Ids(typed) => return selection::known_pairs_of(catalog, typed).await,
            Self::RetiredAt(at) => return retired_at(catalog, *at).await,
            Self::LastImport(at) => *at,
        };
        let added = catalog.last_import().await?;
        let Some(first) = added.first() else {
            let text = "no list or folder has added a pair yet";
            return Err(Refusal::NothingSelected(text.to_owned()).into());
        };
        if at.is_some_and(|at| at != first.imported) {
            let text = "another import has added pairs meanwhile; look at it before you undo it";
            return Err(Refusal::Usage(text.to_owned()).into());
        }
        Ok(added.into_iter().map(|pair| pair.name).collect())
    }

    /// Returns the pairs that come back. Of an import, only the pairs of the last command come back:
    /// others were retired for their own reasons.
    async fn names_to_restore(&self, catalog: &Catalog) -> ProjectResult<Vec<PairName>> {
        let names = self.names(catalog).await?;
        if !matches!(self, Self::LastImport(_)) {
            return Ok(names);
        }
        let names: BTreeSet<PairName> = names.into_iter().collect();
        let mut retired = catalog.retired_pairs().await?;
        retired.retain(|pair| names.contains(&pair.name));
        let last = retired.iter().map(|pair| pair.at).max();
        let retired = retired.into_iter().filter(|pair| Some(pair.at) == last);
        Ok(retired.map(|pair| pair.name).collect())
    }
}

/// Takes pairs out of every count. A process that works on one of them stores nothing more of it.
pub async fn retire(choice: &RetireChoice, location: &Location) -> ProjectResult<RetireOutcome> {
    let (_project, catalog) = location.open().await?;
    let names = choice.names(&catalog).await?;
    let at = now();
    let changed = catalog.retire_pairs(&names, at).await?;
    catalog.close().await;
    Ok(RetireOutcome {
        names,
        changed,
        at: (changed > 0).then_some(at),
        warnings: Vec::new(),
    })
}

/// Brings retired pairs back, with their results and verdicts.
///
/// # Errors
/// Returns an error if none comes back, because none is retired or they have no boxes any more in the labels of their
/// blocks.
pub async fn undo(choice: &RetireChoice, location: &Location) -> ProjectResult<RetireOutcome> {
    let (_project, catalog) = location.open().await?;
    let names = choice.names_to_restore(&catalog).await?;
    let changed = catalog.restore_pairs(&names).await?;
    let still_retired = still_retired(&catalog, &names).await?;
    catalog.close().await;
    let warnings: Vec<String> = still_retired.iter().map(box_is_gone).collect();
    if changed == 0 {
        let not_retired = || "none of these pairs is retired".to_owned();
        let text = warnings.into_iter().next().unwrap_or_else(not_retired);
        return Err(Refusal::NothingSelected(text).into());
    }
    Ok(RetireOutcome {
        names,
        changed,
        at: None,
        warnings,
    })
}

/// Returns the pairs that a person retired at a time.
pub async fn retired_at(catalog: &Catalog, at: UnixMillis) -> ProjectResult<Vec<PairName>> {
    let mut retired = catalog.retired_pairs().await?;
    retired.retain(|pair| pair.at == at && pair.cause == RetireCause::Person);
    Ok(retired.into_iter().map(|pair| pair.name).collect())
}

/// Returns the pairs among `names` that are retired.
async fn still_retired(
    catalog: &Catalog,
    names: &[PairName],
) -> Result<Vec<PairName>, CatalogError> {
    let retired = catalog.retired_pairs().await?.into_iter();
    let names: BTreeSet<&PairName> = names.iter().collect();
    Ok(retired
        .map(|pair| pair.name)
        .filter(|name| names.contains(name))
        .collect())
}

fn box_is_gone(pair: &PairName) -> String {
    format!(
        "pair {pair} has no box any more in the labels of its block; it comes back with its box, when the block runs again"
    )
}
