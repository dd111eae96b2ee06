//! Refuses new pairs and blocks whose names differ from those of others only in upper and lower case, because their files
//! would fall together on Windows and macOS; and new pairs that are known under a name with other leading zeros.

use std::collections::{HashMap, HashSet};

use crate::db::conn::Conn;
use crate::db::query::{query_as, query_scalar};
use crate::db::row::from_row;
use crate::{CatalogError, Result};
use mocban_core::domain::spelling::without_leading_zeros;
use mocban_core::domain::{BlockId, BlockName, ContentHash, PairName};

const LAST: &str = "SELECT coalesce(max(id), 0) FROM pair";

/// Names of a page of pairs, which follow an id.
const PAGE: &str = "SELECT id, name FROM pair WHERE id > ?1 AND id <= ?2 ORDER BY id LIMIT 10000";

const FILES: &str = "SELECT name, mesh_path, print_path FROM pair WHERE id = ?1";

/// Names of a page of pairs that were not cut from a block.
const OTHERS: &str = "
SELECT p.id, p.name FROM pair AS p WHERE p.id > ?2 AND NOT EXISTS (
    SELECT 1 FROM block_character AS c WHERE c.block = ?1 AND c.pair = p.id) ORDER BY p.id LIMIT 10000";

const BLOCKS: &str = "SELECT name FROM block ORDER BY id";

/// Id and name of a pair. The name may be damaged.
struct NamedPair {
    id: i64,
    name: String,
}

from_row! { NamedPair { id, name } }

/// A pair with its files.
struct PairFiles {
    name: PairName,
    mesh_path: String,
    print_path: String,
}

from_row! { PairFiles { name, mesh_path, print_path } }

/// Returns the id of the newest pair, 0 if there is none.
pub(crate) async fn last_pair(conn: &mut Conn) -> Result<i64> {
    query_scalar(LAST).fetch_one(conn).await
}

/// Refuses the pairs after `last` if one is similar to an earlier one.
pub(crate) async fn refuse_pairs(conn: &mut Conn, last: i64) -> Result<()> {
    if last == 0 {
        return Ok(());
    }
    let mut new = Vec::new();
    let mut after = last;
    while let Some(page) = page(conn, after, i64::MAX).await? {
        after = page.last().map_or(after, |pair| pair.id);
        new.extend(
            page.iter()
                .filter_map(|pair| Some((key(&pair.name)?, pair.id))),
        );
    }
    new.sort_unstable();
    if new.is_empty() {
        return Ok(());
    }
    let mut after = 0;
    while let Some(page) = page(conn, after, last).await? {
        after = page.last().map_or(after, |pair| pair.id);
        for known in &page {
            let Some(key) = key(&known.name) else {
                continue;
            };
            let first = new.partition_point(|(other, _)| *other < key);
            for (_, id) in new[first..].iter().take_while(|(other, _)| *other == key) {
                refuse_similar(conn, *id, known.id).await?;
            }
        }
    }
    Ok(())
}

async fn page(conn: &mut Conn, after: i64, last: i64) -> Result<Option<Vec<NamedPair>>> {
    let page = query_as(PAGE).bind(after).bind(last);
    let page: Vec<NamedPair> = page.fetch_all(conn).await?;
    Ok((!page.is_empty()).then_some(page))
}

/// Returns a number that is equal for names that differ only in case and in leading zeros. `None` if a name is damaged.
fn key(name: &str) -> Option<u64> {
    let folded = PairName::new(name).ok()?.folded();
    let hash = ContentHash::of(without_leading_zeros(&folded).as_bytes());
    let (bytes, _) = hash.as_bytes().split_first_chunk()?;
    Some(u64::from_le_bytes(*bytes))
}

/// Refuses a new pair if its name differs from that of a known one only in case, or if it has the same files.
async fn refuse_similar(conn: &mut Conn, new: i64, known: i64) -> Result<()> {
    let new: PairFiles = query_as(FILES).bind(new).fetch_one(&mut *conn).await?;
    let known: PairFiles = query_as(FILES).bind(known).fetch_one(&mut *conn).await?;
    if new.name.folded() == known.name.folded() {
        return Err(CatalogError::SimilarName {
            kind: "pair",
            new: new.name.to_string(),
            known: known.name.to_string(),
        });
    }
    if (&new.mesh_path, &new.print_path) == (&known.mesh_path, &known.print_path) {
        return Err(CatalogError::SameFiles {
            new: new.name,
            known: known.name,
        });
    }
    Ok(())
}

/// Returns a pair after `after` that was not cut from a block and whose name differs at most in case from one of these.
pub(crate) async fn taken(
    conn: &mut Conn,
    block: BlockId,
    names: &[PairName],
    mut after: i64,
) -> Result<Option<PairName>> {
    if names.is_empty() {
        return Ok(None);
    }
    let folded: HashSet<String> = names.iter().map(PairName::folded).collect();
    loop {
        let page = query_as(OTHERS).bind(block.0).bind(after);
        let page: Vec<NamedPair> = page.fetch_all(&mut *conn).await?;
        let Some(last) = page.last() else {
            return Ok(None);
        };
        after = last.id;
        // A damaged name is reported by `check`.
        let others = page
            .iter()
            .filter_map(|pair| PairName::new(&pair.name).ok());
        let mut others = others.filter(|name| folded.contains(&name.folded()));
        if let Some(other) = others.next() {
            return Ok(Some(other));
        }
    }
}

/// Refuses blocks whose names differ only in case.
pub(crate) async fn refuse_blocks(conn: &mut Conn) -> Result<()> {
    let names: Vec<BlockName> = query_scalar(BLOCKS).fetch_all(conn).await?;
    let mut known: HashMap<String, BlockName> = HashMap::new();
    for new in names {
        if let Some(known) = known.insert(new.as_pair().folded(), new.clone()) {
            return Err(CatalogError::SimilarName {
                kind: "block",
                new: new.to_string(),
                known: known.to_string(),
            });
        }
    }
    Ok(())
}
