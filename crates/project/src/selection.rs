//! Pairs and blocks that a user names by their ids. An id that does not exist is refused, with similar ids.

use std::collections::BTreeSet;

use crate::error::ProjectResult;
use crate::exit::Refusal;
use mocban_catalog::{Catalog, RetiredPair};
use mocban_core::domain::shell::quoted_id;
use mocban_core::domain::spelling::nearest;
use mocban_core::domain::{BlockName, PairName, RetireCause};
use mocban_runner::NamedWork;
use mocban_system::time_text::local;

/// Largest number of similar ids in a message.
const MAX_SIMILAR: usize = 3;
/// Largest number of blocks of lists that are compared with a mistyped id.
const MAX_COMPARED_BLOCKS: usize = 1000;
/// Fewest characters by which ids that contain a text are similar to it, such as `b1_c01-r01` to `c01-r01`.
const MIN_PART_CHARS: usize = 3;

/// Looks up pairs by their ids.
///
/// # Errors
/// Returns an error if a pair does not exist, or is retired.
pub async fn pairs(catalog: &Catalog, typed: &[String]) -> ProjectResult<Vec<PairName>> {
    let names = known_pairs(catalog, typed).await?;
    refuse_retired(catalog, &names).await?;
    Ok(names)
}

/// Refuses pairs that are retired. Reads all retired pairs only if one of these is.
async fn refuse_retired(catalog: &Catalog, names: &[PairName]) -> ProjectResult<()> {
    let selected = catalog.select(names).await?;
    if catalog.retired_among(&selected).await?.is_empty() {
        return Ok(());
    }
    let names: BTreeSet<&PairName> = names.iter().collect();
    let retired = catalog.retired_pairs().await?;
    let Some(pair) = retired.iter().find(|pair| names.contains(&pair.name)) else {
        return Ok(());
    };
    Err(Refusal::NothingSelected(retired_text(pair)).into())
}

/// Says who retired a pair, and how it comes back.
pub(crate) fn retired_text(pair: &RetiredPair) -> String {
    let (name, date) = (&pair.name, local(pair.at));
    match pair.cause {
        RetireCause::Person => format!(
            "pair {name} was retired on {date}; its results and verdicts are kept, and `retire --undo` brings it back"
        ),
        RetireCause::List => format!(
            "pair {name} was retired on {date}, because a list that replaced the others does not have it; its results and \
             verdicts are kept, and `retire --undo` or a list with it brings it back"
        ),
        RetireCause::Labels => format!(
            "pair {name} is retired, because its box is gone from the labels of its block; its verdicts are kept"
        ),
    }
}

/// Looks up pairs by their ids, also retired ones.
pub(crate) async fn known_pairs(
    catalog: &Catalog,
    typed: &[String],
) -> ProjectResult<Vec<PairName>> {
    let names: Vec<PairName> = typed.iter().filter_map(|text| text.parse().ok()).collect();
    let unknown = catalog.unknown_names(&names).await?;
    let is_known = |text: &&String| {
        text.parse::<PairName>()
            .is_ok_and(|name| !unknown.contains(&name))
    };
    match typed.iter().find(|text| !is_known(text)) {
        None => Ok(names),
        Some(text) => {
            refuse_block(catalog, text).await?;
            let all = catalog.pair_names().await?;
            Err(no_such("pair", text, all.iter().map(PairName::as_str)).into())
        }
    }
}

/// Refuses the id of a block with pairs where one pair is meant.
async fn refuse_block(catalog: &Catalog, typed: &str) -> ProjectResult<()> {
    let pairs = catalog.pairs_of_listed_block(typed).await?;
    let (number, first) = match pairs.as_slice() {
        [] => return Ok(()),
        [first] => ("1 pair".to_owned(), first),
        [first, ..] => (format!("{} pairs", pairs.len()), first),
    };
    Err(Refusal::NothingSelected(format!(
        "{typed} is a block with {number}, and no pair; give the id of a pair, such as {first}"
    ))
    .into())
}

/// Looks up pairs by their ids or those of their blocks, each once. Returns `None`, which means all pairs, if no id is given.
///
/// # Errors
/// Returns an error like [`pairs_and_blocks`], and if a block has no pairs.
pub(crate) async fn some_or_all(
    catalog: &Catalog,
    typed: &[String],
) -> ProjectResult<Option<Vec<PairName>>> {
    if typed.is_empty() {
        return Ok(None);
    }
    let NamedWork { mut pairs, blocks } = pairs_and_blocks(catalog, typed).await?;
    for block in blocks {
        let of_block = catalog.pairs_of_listed_block(block.as_str()).await?;
        if of_block.is_empty() {
            let known = catalog.pairs_of_block_with_retired(block.as_str()).await?;
            let refusal = if known.is_empty() {
                no_pairs(&block)
            } else {
                Refusal::NothingSelected(format!(
                    "all pairs of block {block} are retired; `status --retired` lists them"
                ))
            };
            return Err(refusal.into());
        }
        pairs.extend(of_block);
    }
    keep_each_once(&mut pairs);
    Ok(Some(pairs))
}

/// Removes the pairs that occur earlier in a list.
fn keep_each_once(pairs: &mut Vec<PairName>) {
    let mut seen = BTreeSet::new();
    pairs.retain(|pair| seen.insert(pair.clone()));
}

/// Refuses a block from which no pair was cut.
pub(crate) fn no_pairs(block: &BlockName) -> Refusal {
    Refusal::NothingSelected(format!("block {block} has no pairs yet; `run` cuts them"))
}

/// Looks up one pair.
pub async fn pair(catalog: &Catalog, typed: &str) -> ProjectResult<PairName> {
    let names = pairs(catalog, &[typed.to_owned()]).await?;
    names
        .into_iter()
        .next()
        .ok_or_else(|| no_such("pair", typed, std::iter::empty()).into())
}

/// Returns the block with this id, if there is one and no pair has the same id.
pub async fn block(catalog: &Catalog, typed: &str) -> ProjectResult<Option<BlockName>> {
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

/// Looks up pairs and blocks by their ids. An id of both is that of the pair. The id of a block that only lists of pairs
/// have stands for its pairs. Returns each pair once.
///
/// # Errors
/// Returns an error if there is neither a pair nor a block with an id, or a pair is retired.
pub async fn pairs_and_blocks(catalog: &Catalog, typed: &[String]) -> ProjectResult<NamedWork> {
    let names: Vec<PairName> = typed.iter().filter_map(|text| text.parse().ok()).collect();
    let unknown = catalog.unknown_names(&names).await?;
    let are_all_pairs = unknown.is_empty() && names.len() == typed.len();
    let all_blocks = if are_all_pairs {
        Vec::new()
    } else {
        catalog.block_names().await?
    };
    let mut found = NamedWork::default();
    for text in typed {
        let pair = text.parse::<PairName>().ok();
        if let Some(pair) = pair.filter(|name| !unknown.contains(name)) {
            found.pairs.push(pair);
            continue;
        }
        let block = text.parse::<BlockName>().ok();
        if let Some(block) = block.filter(|name| all_blocks.contains(name)) {
            found.blocks.push(block);
            continue;
        }
        let listed = catalog.pairs_of_listed_block(text).await?;
        if !listed.is_empty() {
            found.pairs.extend(listed);
            continue;
        }
        return Err(no_such_pair_or_block(catalog, text, &all_blocks)
            .await?
            .into());
    }
    keep_each_once(&mut found.pairs);
    refuse_retired(catalog, &found.pairs).await?;
    Ok(found)
}

/// Looks up pairs by their ids or those of their blocks, also retired ones. Returns each pair once, sorted, and the blocks
/// from which no pair was cut. An id of both is that of the pair.
///
/// # Errors
/// Returns an error if there is neither a pair nor a block with an id.
pub(crate) async fn known_pairs_of(
    catalog: &Catalog,
    typed: &[String],
) -> ProjectResult<NamedWork> {
    let names: Vec<PairName> = typed.iter().filter_map(|text| text.parse().ok()).collect();
    let unknown = catalog.unknown_names(&names).await?;
    let (mut found, mut blocks) = (BTreeSet::new(), Vec::new());
    for text in typed {
        let pair = text.parse::<PairName>().ok();
        if let Some(pair) = pair.filter(|name| !unknown.contains(name)) {
            found.insert(pair);
            continue;
        }
        let block = text.parse::<BlockName>().ok();
        let id = block.as_ref().map_or(text.as_str(), BlockName::as_str);
        let of_block = catalog.pairs_of_block_with_retired(id).await?;
        if of_block.is_empty() {
            let all = catalog.block_names().await?;
            match block.filter(|name| all.contains(name)) {
                Some(block) => blocks.push(block),
                None => return Err(no_such_pair_or_block(catalog, text, &all).await?.into()),
            }
        }
        found.extend(of_block);
    }
    let pairs = found.into_iter().collect();
    Ok(NamedWork { pairs, blocks })
}

async fn no_such_pair_or_block(
    catalog: &Catalog,
    typed: &str,
    blocks: &[BlockName],
) -> ProjectResult<Refusal> {
    let pairs = catalog.pair_names().await?;
    let listed = catalog.first_listed_blocks(MAX_COMPARED_BLOCKS).await?;
    let blocks = blocks.iter().map(BlockName::as_str);
    let blocks: BTreeSet<&str> = blocks.chain(listed.iter().map(String::as_str)).collect();
    let all = pairs.iter().map(PairName::as_str);
    let all = all.chain(blocks.iter().copied());
    Ok(no_such("pair or block", typed, all))
}

/// Looks up one block.
pub(crate) async fn existing_block(catalog: &Catalog, typed: &str) -> ProjectResult<BlockName> {
    let all = catalog.block_names().await?;
    let name = typed.parse::<BlockName>().ok();
    if let Some(name) = name.filter(|name| all.contains(name)) {
        return Ok(name);
    }
    if !catalog.pairs_of_listed_block(typed).await?.is_empty() {
        let quoted = quoted_id(typed);
        let text = format!(
            "block {typed} has no page, because a list names it for its pairs; `contact-sheet {quoted}` draws them"
        );
        return Err(Refusal::NothingSelected(text).into());
    }
    Err(no_such("block", typed, all.iter().map(BlockName::as_str)).into())
}

/// Returns the refusal of an id that does not exist, with similar ids.
fn no_such<'a>(what: &str, typed: &str, all: impl Iterator<Item = &'a str> + Clone) -> Refusal {
    let mut similar = nearest(typed, all.clone(), MAX_SIMILAR);
    if similar.is_empty() && typed.chars().count() >= MIN_PART_CHARS {
        similar = all
            .filter(|name| name.contains(typed))
            .take(MAX_SIMILAR)
            .collect();
    }
    let hint = if similar.is_empty() {
        String::new()
    } else {
        format!("; similar ids: {}", similar.join(", "))
    };
    Refusal::NothingSelected(format!("there is no {what} {typed}{hint}"))
}

#[cfg(test)]
mod tests {
    use super::{no_such, pairs_and_blocks, some_or_all};
    use crate::import_pairs::{AllowedChanges, PairImport, PairSource, import_pairs};
    use crate::location::Location;
    use crate::pair_choices::PairChoices;
    use mocban_core::domain::PairName;

    #[tokio::test]
    async fn the_block_of_a_list_stands_for_its_pairs() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let list = "id,mesh,print,block\na,a.stl,a.png,Ván 01\nb,b.stl,b.png,Ván 02\nc,c.stl,c.png,Ván 01\n";
        let location = Location::new(dir.path().join("project"));
        let import = PairImport {
            source: PairSource::List {
                file: dir.path().join("pairs.csv"),
                bytes: Some(list.as_bytes().to_vec()),
            },
            truth: None,
            allowed: AllowedChanges {
                missing: true,
                ..AllowedChanges::default()
            },
            choices: PairChoices::default(),
        };
        import_pairs(import, &location, &())
            .await
            .expect("imported");
        let (_, catalog) = location.open_read_only().await.expect("a project");
        let found = pairs_and_blocks(&catalog, &["Ván 01".to_owned()])
            .await
            .expect("pairs");
        assert_eq!(
            found.pairs.iter().map(PairName::as_str).collect::<Vec<_>>(),
            ["a", "c"]
        );
        let refused = pairs_and_blocks(&catalog, &["ván 1".to_owned()]).await;
        let text = refused.expect_err("another case").to_string();
        assert!(text.contains("; similar ids: Ván 01"), "{text}");
        // Pairs that are named beside their block.
        let typed = ["c", "Ván 01", "c"].map(str::to_owned);
        let chosen = some_or_all(&catalog, &typed).await.expect("pairs");
        let chosen = chosen.expect("not all");
        assert_eq!(
            chosen.iter().map(PairName::as_str).collect::<Vec<_>>(),
            ["c", "a"]
        );
        catalog.close().await;
    }

    #[test]
    fn similar_ids_are_suggested() {
        let text = |typed| no_such("pair", typed, ["0001", "0002", "b04-0117"].into_iter());
        assert_eq!(
            text("b4-0117").to_string(),
            "there is no pair b4-0117; similar ids: b04-0117"
        );
        assert_eq!(text("zzz").to_string(), "there is no pair zzz");
        assert!(text("117").to_string().ends_with("; similar ids: b04-0117"));
    }
}
