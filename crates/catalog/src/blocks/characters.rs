//! Rows of the characters of a block.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::blocks::model::{CutOrigin, NewCharacter, StoredCharacter};
use crate::db::conn::Conn;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::FromRow as _;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{BlockCharacterState, BlockId, BlockName, PairId, PairName};

const UPSERT: &str = "
INSERT INTO block_character (block, label, place, character, box, confidence, state, reason, maps, pair)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, (SELECT id FROM pair WHERE name = ?10))
ON CONFLICT (block, label) DO UPDATE SET place = excluded.place, character = excluded.character, box = excluded.box,
    confidence = excluded.confidence, state = excluded.state, reason = excluded.reason, maps = excluded.maps,
    pair = coalesce(excluded.pair, block_character.pair)";

/// Marks the characters that are not among the labels `?2` as retired. Removes characters that never had a pair.
const GONE: [&str; 2] = [
    "UPDATE block_character SET state = 'retired', reason = NULL
    WHERE block = ?1 AND label NOT IN (SELECT atom FROM json_each(?2))",
    "DELETE FROM block_character WHERE block = ?1 AND pair IS NULL AND label NOT IN (SELECT atom FROM json_each(?2))",
];

/// Selects the pairs of characters that are not cut any more.
const UNCUT: &str =
    "SELECT pair FROM block_character WHERE block = ?1 AND state <> 'cut' AND pair IS NOT NULL";

const LIST: &str = "
SELECT c.label, c.character, c.box, c.confidence, c.state, c.reason, c.maps, p.name AS pair
FROM block_character AS c JOIN block AS b ON b.id = c.block LEFT JOIN pair AS p ON p.id = c.pair
WHERE b.name = ?1 ORDER BY c.state = 'retired', c.place, c.label";

const ORIGINS: &str = "
SELECT p.name, c.label, c.box, c.maps
FROM pair AS p JOIN block_character AS c ON c.pair = p.id AND c.state = 'cut'
WHERE p.name BETWEEN ?1 AND ?2";

impl Catalog {
    /// Returns the characters of a block in reading order, retired ones last.
    pub async fn block_characters(&self, block: &BlockName) -> Result<Vec<StoredCharacter>> {
        let mut conn = self.read_conn().await?;
        let list = query_as(LIST).bind(block.as_str());
        list.fetch_all(&mut conn).await
    }

    /// Returns from where the pairs with a name from `first` to `last` were cut. Leaves out pairs that were not cut from a
    /// block.
    ///
    /// # Errors
    /// Returns an error if a stored value is invalid or a database operation fails.
    pub async fn cut_origins_between(
        &self,
        first: &PairName,
        last: &PairName,
    ) -> Result<BTreeMap<PairName, CutOrigin>> {
        let mut conn = self.read_conn().await?;
        let query = query(ORIGINS).bind(first.as_str()).bind(last.as_str());
        let rows = query.fetch_all(&mut conn).await?;
        rows.iter()
            .map(|row| Ok((row.get("name")?, CutOrigin::from_row(row)?)))
            .collect()
    }
}

/// Returns the name of the pair of a character.
///
/// # Errors
/// Returns an error if the label cannot be part of a name.
pub(crate) fn pair_name(block: &BlockName, label: &str) -> Result<PairName> {
    let name = block.pair(label);
    name.map_err(|error| CatalogError::Corrupt(error.to_string()))
}

/// Stores the characters of a block. Returns the pairs of characters whose boxes are gone, or which are not cut any
/// more.
pub(crate) async fn store(
    conn: &mut Conn,
    block: BlockId,
    name: &BlockName,
    characters: &[NewCharacter],
) -> Result<Vec<PairId>> {
    for (place, one) in characters.iter().enumerate() {
        let pair = match &one.cut {
            Ok(_) => Some(pair_name(name, &one.label)?),
            Err(_) => None,
        };
        let state = match pair {
            Some(_) => BlockCharacterState::Cut,
            None => BlockCharacterState::Left,
        };
        query(UPSERT)
            .bind(block.0)
            .bind(&one.label)
            .bind(place as i64)
            .bind(&one.character)
            .bind(serde_json::to_string(&one.bounds)?)
            .bind(one.confidence)
            .bind(state.name())
            .bind(one.cut.as_ref().err())
            .bind(one.maps.as_ref().map(Value::to_string))
            .bind(pair.as_ref().map(PairName::as_str))
            .execute(&mut *conn)
            .await?;
    }
    let labels: Vec<&str> = characters.iter().map(|one| one.label.as_str()).collect();
    let labels = serde_json::to_string(&labels)?;
    for sql in GONE {
        let gone = query(sql).bind(block.0).bind(&labels);
        gone.execute(&mut *conn).await?;
    }
    query_scalar(UNCUT).bind(block.0).fetch_all(conn).await
}
