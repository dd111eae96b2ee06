//! Takes pairs out of every count, and brings them back. Their results and verdicts stay.

use std::collections::BTreeSet;

use crate::error::ProjectResult;
use crate::exit::Refusal;
use crate::location::{Location, now};
use crate::selection;
use mocban_catalog::{Catalog, CatalogError};
use mocban_core::domain::PairName;

/// What became of some pairs.
#[derive(Debug)]
pub struct RetireOutcome {
    /// The pairs, each once.
    pub names: Vec<PairName>,
    /// How many of them changed.
    pub changed: u64,
    /// Why pairs did not come back, one line each.
    pub warnings: Vec<String>,
}

/// Takes pairs out of every count; the id of a block stands for the pairs that it has now. A process that works on one of
/// them stores nothing more of it.
pub async fn retire(typed: &[String], location: &Location) -> ProjectResult<RetireOutcome> {
    let (_project, catalog) = location.open().await?;
    let names = selection::known_pairs_of(&catalog, typed).await?;
    let changed = catalog.retire_pairs(&names, now()).await?;
    catalog.close().await;
    Ok(RetireOutcome {
        names,
        changed,
        warnings: Vec::new(),
    })
}

/// Brings retired pairs back, with their results and verdicts; the id of a block stands for its pairs.
///
/// # Errors
/// Returns an error if none comes back, because none is retired or they have no boxes any more in the labels of their
/// blocks.
pub async fn undo(typed: &[String], location: &Location) -> ProjectResult<RetireOutcome> {
    let (_project, catalog) = location.open().await?;
    let names = selection::known_pairs_of(&catalog, typed).await?;
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
        warnings,
    })
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
