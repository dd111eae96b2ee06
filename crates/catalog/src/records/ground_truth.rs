//! Ground truth: the true alignments that a dataset gives for its pairs. Those of pairs that were cut from a block are stored
//! with the crop of the page that they are for, because a box may be moved later.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::query::{query, query_scalar};
use crate::db::row::Row;
use crate::db::rows::json_array;
use crate::db::value::{FromValue, Json};
use crate::records::checksums;
use crate::records::model::PrintPlace;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::PairName;

const SET: &str = "
INSERT INTO truth (pair, body)
SELECT p.id, item.value ->> 'body' FROM json_each(?1) AS item CROSS JOIN pair AS p ON p.name = item.value ->> 'name'
WHERE true
ON CONFLICT (pair) DO UPDATE SET body = excluded.body
RETURNING pair";

const UNKNOWN: &str = "
SELECT item.value ->> 'name' FROM json_each(?1) AS item
WHERE NOT EXISTS (SELECT 1 FROM pair AS p WHERE p.name = item.value ->> 'name') LIMIT 1";

/// The places of the prints of pairs that were cut from blocks, by ids and by names.
pub(crate) const PLACES: &str = "
SELECT c.pair, c.box, c.maps
FROM json_each(?1) AS wanted CROSS JOIN block_character AS c ON c.pair = CAST(wanted.atom AS bigint)
WHERE c.maps IS NOT NULL";
pub(crate) const PLACES_OF_NAMES: &str = "
SELECT p.name, c.box, c.maps
FROM json_each(?1) AS wanted CROSS JOIN pair AS p ON p.name = wanted.atom CROSS JOIN block_character AS c ON c.pair = p.id
WHERE c.maps IS NOT NULL";

impl Catalog {
    /// Returns whether any pair has a true alignment.
    pub async fn has_truth(&self) -> Result<bool> {
        let mut conn = self.read_conn().await?;
        let exists = query_scalar("SELECT EXISTS (SELECT 1 FROM truth)");
        exists.fetch_one(&mut conn).await
    }
}

/// Returns where the prints of pairs lie on the pages of their blocks. Leaves out pairs that were not cut from a block.
pub(crate) async fn print_places(
    conn: &mut Conn,
    pairs: &[i64],
) -> Result<BTreeMap<i64, PrintPlace>> {
    if pairs.is_empty() {
        return Ok(BTreeMap::new());
    }
    read_places(conn, PLACES, json_array(pairs.iter().copied())).await
}

/// Reads the places of the pairs in a list, by the first column of the statement.
async fn read_places<K: FromValue + Ord>(
    conn: &mut Conn,
    sql: &'static str,
    wanted: String,
) -> Result<BTreeMap<K, PrintPlace>> {
    let rows = query(sql).bind(wanted).fetch_all(conn).await?;
    let mut places = BTreeMap::new();
    for row in &rows {
        if let Some(place) = place(row)? {
            places.insert(row.get(0)?, place);
        }
    }
    Ok(places)
}

/// Returns the place in a row, or `None` if its maps are those of another version of the program.
fn place(row: &Row) -> Result<Option<PrintPlace>> {
    let Json(bounds) = row.get("box")?;
    let Json(maps): Json<Value> = row.get("maps")?;
    let map = maps.get("page_from_crop").cloned().unwrap_or_default();
    let map = serde_json::from_value(map).ok();
    Ok(map.map(|page_from_crop| PrintPlace {
        page_from_crop,
        bounds,
    }))
}

/// Returns a true alignment with the crop of the page that it is for.
fn with_crop(body: &Value, place: Option<&PrintPlace>) -> Value {
    let mut body = body.clone();
    if let (Some(place), Some(fields)) = (place, body.as_object_mut()) {
        let crop = json!(place.page_from_crop);
        fields.insert("page_from_crop".to_owned(), crop);
    }
    body
}

/// Stores true alignments, replacing earlier ones. Those of pairs that were cut from a block are for their current crop.
/// Returns their number. The caller begins the transaction.
pub(crate) async fn set(conn: &mut Conn, truths: &[(PairName, Value)]) -> Result<u64> {
    let mut stored = 0;
    for chunk in truths.chunks(500) {
        let names = json_array(chunk.iter().map(|(name, _)| name.as_str()));
        let places: BTreeMap<PairName, PrintPlace> =
            read_places(conn, PLACES_OF_NAMES, names).await?;
        let items = chunk.iter();
        let items = items.map(|(name, body)| {
            let body = with_crop(body, places.get(name));
            json!({ "name": name, "body": body.to_string() })
        });
        let items = json_array(items);
        let unknown = query_scalar(UNKNOWN).bind(&items);
        if let Some(name) = unknown.fetch_optional(&mut *conn).await? {
            return Err(CatalogError::UnknownPair(name));
        }
        let pairs: Vec<i64> = query_scalar(SET).bind(items).fetch_all(&mut *conn).await?;
        checksums::store(conn, ChecksummedTable::Truth, &pairs).await?;
        stored += pairs.len() as u64;
    }
    Ok(stored)
}
