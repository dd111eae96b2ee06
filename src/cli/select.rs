//! Pairs named on the command line.

use super::exit::Refusal;
use crate::catalog::Catalog;
use crate::config::nearest;
use crate::domain::{BlockName, PairName};

/// Looks up pairs by their ids.
///
/// # Errors
/// Returns an error if a pair does not exist. The message suggests similar ids.
pub(super) async fn pairs(catalog: &Catalog, typed: &[String]) -> anyhow::Result<Vec<PairName>> {
    let names: Vec<PairName> = typed.iter().filter_map(|text| text.parse().ok()).collect();
    let unknown = catalog.unknown_names(&names).await?;
    let is_known = |text: &&String| {
        text.parse::<PairName>()
            .is_ok_and(|name| !unknown.contains(&name))
    };
    match typed.iter().find(|text| !is_known(text)) {
        None => Ok(names),
        Some(text) => {
            let all = catalog.pair_names().await?;
            Err(Refusal::NothingSelected(no_such_pair(text, &all)).into())
        }
    }
}

/// Looks up pairs by their ids. Returns `None`, which means all pairs, if no id is given.
///
/// # Errors
/// Returns an error if a pair does not exist.
pub(super) async fn some_or_all(
    catalog: &Catalog,
    typed: &[String],
) -> anyhow::Result<Option<Vec<PairName>>> {
    match typed {
        [] => Ok(None),
        typed => Ok(Some(pairs(catalog, typed).await?)),
    }
}

/// Looks up one pair.
pub(super) async fn pair(catalog: &Catalog, typed: &str) -> anyhow::Result<PairName> {
    let names = pairs(catalog, &[typed.to_owned()]).await?;
    names
        .into_iter()
        .next()
        .ok_or_else(|| Refusal::NothingSelected(no_such_pair(typed, &[])).into())
}

/// Returns the block with this id, if there is one and no pair has the same id.
pub(super) async fn block(catalog: &Catalog, typed: &str) -> anyhow::Result<Option<BlockName>> {
    let Ok(name) = typed.parse::<BlockName>() else {
        return Ok(None);
    };
    if let Ok(pair) = typed.parse::<PairName>()
        && catalog.unknown_names(&[pair]).await?.is_empty()
    {
        return Ok(None);
    }
    Ok(catalog.block_names().await?.contains(&name).then_some(name))
}

/// Looks up one block.
///
/// # Errors
/// Returns an error if the block does not exist. The message suggests similar ids.
pub(super) async fn existing_block(catalog: &Catalog, typed: &str) -> anyhow::Result<BlockName> {
    let all = catalog.block_names().await?;
    let name = typed.parse::<BlockName>().ok();
    if let Some(name) = name.filter(|name| all.contains(name)) {
        return Ok(name);
    }
    let similar = nearest(typed, all.iter().map(BlockName::as_str), 3);
    let hint = if similar.is_empty() {
        String::new()
    } else {
        format!("; similar ids: {}", similar.join(", "))
    };
    Err(Refusal::NothingSelected(format!("there is no block {typed}{hint}")).into())
}

fn no_such_pair(typed: &str, all: &[PairName]) -> String {
    let similar = nearest(typed, all.iter().map(PairName::as_str), 3);
    if similar.is_empty() {
        format!("there is no pair {typed}")
    } else {
        format!(
            "there is no pair {typed}; similar ids: {}",
            similar.join(", ")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::no_such_pair;

    #[test]
    fn similar_ids_are_suggested() {
        let all = ["0001", "0002", "b04-0117"].map(|id| id.parse().expect("valid id"));
        assert_eq!(
            no_such_pair("b4-0117", &all),
            "there is no pair b4-0117; similar ids: b04-0117"
        );
        assert_eq!(no_such_pair("zzz", &all), "there is no pair zzz");
    }
}
