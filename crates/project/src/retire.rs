//! Takes pairs out of every count, and brings them back. Their results and verdicts stay.

use std::collections::BTreeSet;

use crate::empty_import;
use crate::error::ProjectResult;
use crate::exit::Refusal;
use crate::location::{Location, now};
use crate::selection;
use mocban_catalog::{Catalog, CatalogError, ImportedPair};
use mocban_core::domain::{BlockName, PairName, RetireCause, UnixMillis};
use mocban_results::number_format::counted;
use mocban_runner::NamedWork;
use mocban_store::Project;
use mocban_system::time_text::local;

/// What became of some pairs.
#[derive(Debug)]
pub struct RetireOutcome {
    /// The pairs, each once.
    pub names: Vec<PairName>,
    /// How many of them changed.
    pub changed: u64,
    /// Blocks without pairs that were removed.
    pub removed_blocks: Vec<BlockName>,
    /// When the pairs were imported, if those of an import were meant.
    pub imported: Option<UnixMillis>,
    /// When they were retired. `None` if none changed, or if they were brought back.
    pub at: Option<UnixMillis>,
    /// Why pairs did not come back or blocks were not removed, one line each.
    pub warnings: Vec<String>,
}

/// Which pairs are retired or brought back.
#[derive(Debug, Clone)]
pub enum RetireChoice {
    /// These ids; the id of a block stands for the pairs that it has now, or for the block itself if it has none.
    Ids(Vec<String>),
    /// The pairs of the newest import. `Some(time)`: of the newest import that added pairs, refused unless it was at this
    /// time.
    LastImport(Option<UnixMillis>),
    /// The pairs of one of the imports of lists or folders that added any, counted back from the newest one, which is 1.
    NthImport(u32),
    /// The pairs that a person retired at this time, which are brought back.
    RetiredAt(UnixMillis),
}

/// The pairs and blocks of a choice.
#[derive(Debug, Default)]
struct ChosenPairs {
    pairs: Vec<PairName>,
    /// Blocks without pairs.
    blocks: Vec<BlockName>,
    /// When the pairs were imported, if those of an import are meant.
    imported: Option<UnixMillis>,
}

impl RetireChoice {
    async fn chosen(&self, project: &Project, catalog: &Catalog) -> ProjectResult<ChosenPairs> {
        let (later, at) = match self {
            Self::Ids(typed) => {
                let NamedWork { pairs, blocks } = selection::known_pairs_of(catalog, typed).await?;
                return Ok(ChosenPairs {
                    pairs,
                    blocks,
                    imported: None,
                });
            }
            Self::RetiredAt(at) => {
                return Ok(ChosenPairs {
                    pairs: retired_at(catalog, *at).await?,
                    ..ChosenPairs::default()
                });
            }
            Self::LastImport(at) => (0, *at),
            Self::NthImport(number) => (number.saturating_sub(1), None),
        };
        let added = catalog.import_before(later).await?;
        let Some(imported) = added.first().map(|first| first.imported) else {
            let text = match later {
                0 => "no list or folder has added a pair yet".to_owned(),
                _ => format!("fewer than {} imports have added pairs", later + 1),
            };
            return Err(Refusal::NothingSelected(text).into());
        };
        if matches!(self, Self::LastImport(None)) {
            refuse_after_empty(project, &added)?;
        }
        if at.is_some_and(|at| at != imported) {
            let text = "another import has added pairs meanwhile; look at it before you undo it";
            return Err(Refusal::Usage(text.to_owned()).into());
        }
        Ok(ChosenPairs {
            pairs: added.into_iter().map(|pair| pair.name).collect(),
            blocks: Vec::new(),
            imported: Some(imported),
        })
    }

    /// Returns what comes back. Of an import, only the pairs of the last command come back: others were retired for their own
    /// reasons.
    async fn chosen_to_restore(
        &self,
        project: &Project,
        catalog: &Catalog,
    ) -> ProjectResult<ChosenPairs> {
        let mut chosen = self.chosen(project, catalog).await?;
        if let Some(block) = chosen.blocks.first() {
            return Err(selection::no_pairs(block).into());
        }
        if !matches!(self, Self::LastImport(_) | Self::NthImport(_)) {
            return Ok(chosen);
        }
        let names: BTreeSet<PairName> = chosen.pairs.into_iter().collect();
        let mut retired = catalog.retired_pairs().await?;
        retired.retain(|pair| names.contains(&pair.name));
        let last = retired.iter().map(|pair| pair.at).max();
        let retired = retired.into_iter().filter(|pair| Some(pair.at) == last);
        chosen.pairs = retired.map(|pair| pair.name).collect();
        Ok(chosen)
    }
}

/// Refuses if the newest import added no pair, because `added` is then from an earlier import.
fn refuse_after_empty(project: &Project, added: &[ImportedPair]) -> Result<(), Refusal> {
    let Some(first) = added.first() else {
        return Ok(());
    };
    let Some(empty) = empty_import::noted(project).filter(|empty| *empty > first.imported) else {
        return Ok(());
    };
    let (empty, imported) = (local(empty), local(first.imported));
    let pairs = counted(added.len() as u64, "pair");
    Err(Refusal::Usage(format!(
        "the newest import, on {empty}, added no pair; the newest one that did was on {imported} and added {pairs}, first {}: \
         give --import 1 in place of --last-import if it is meant; `retire BLOCK` takes out the pairs of a block",
        first.name
    )))
}

/// Takes pairs out of every count. A process that works on one of them stores nothing more of it. Removes blocks without
/// pairs, of which there is nothing to keep.
pub async fn retire(choice: &RetireChoice, location: &Location) -> ProjectResult<RetireOutcome> {
    let (project, catalog) = location.open().await?;
    let chosen = choice.chosen(&project, &catalog).await?;
    let at = now();
    // First, because a role may lack the right for it.
    let removed_blocks = catalog.remove_blocks(&chosen.blocks).await?;
    let changed = catalog.retire_pairs(&chosen.pairs, at).await?;
    catalog.close().await;
    let left = chosen.blocks.iter();
    let left = left.filter(|block| !removed_blocks.contains(block));
    Ok(RetireOutcome {
        warnings: left.map(is_in_use).collect(),
        names: chosen.pairs,
        changed,
        removed_blocks,
        imported: chosen.imported,
        at: (changed > 0).then_some(at),
    })
}

/// Brings retired pairs back, with their results and verdicts.
///
/// # Errors
/// Returns an error if none comes back, because none is retired or they have no boxes any more in the labels of their
/// blocks.
pub async fn undo(choice: &RetireChoice, location: &Location) -> ProjectResult<RetireOutcome> {
    let (project, catalog) = location.open().await?;
    let ChosenPairs {
        pairs, imported, ..
    } = choice.chosen_to_restore(&project, &catalog).await?;
    let changed = catalog.restore_pairs(&pairs).await?;
    let still_retired = still_retired(&catalog, &pairs).await?;
    catalog.close().await;
    let warnings: Vec<String> = still_retired.iter().map(box_is_gone).collect();
    if changed == 0 {
        let not_retired = || "none of these pairs is retired".to_owned();
        let text = warnings.into_iter().next().unwrap_or_else(not_retired);
        return Err(Refusal::NothingSelected(text).into());
    }
    Ok(RetireOutcome {
        names: pairs,
        changed,
        removed_blocks: Vec::new(),
        imported,
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

fn is_in_use(block: &BlockName) -> String {
    format!(
        "block {block} stays: a run works on it or has just cut its pairs, or people chose points or gave boxes for it"
    )
}
