//! Finds and replaces the paths of meshes, prints, pages and labels.

use serde_json::{Value, json};

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::{query, query_as};
use crate::records::checksums;
use crate::{Catalog, Result};
use mocban_core::domain::{ArtifactRef, InputVersion};

/// Number of pairs that are read at a time.
const PAGE: i64 = 2_000;

const SELECT: &str =
    "SELECT id, mesh_path, print_path FROM pair WHERE id > ?1 ORDER BY id LIMIT ?2";

/// Returns a `stat` that no file has, so that the next run reads the file again. What is known of a file that an import
/// changed (`''`) or that is missing stays. The second argument is the parameter with [`InputVersion::RESTORED`].
macro_rules! unread {
    ($stat:literal, $restored:literal) => {
        concat!(
            "CASE WHEN ",
            $stat,
            " IN ('', 'gone') THEN ",
            $stat,
            " WHEN ",
            $stat,
            " IS NOT NULL THEN ",
            $restored,
            " END"
        )
    };
}

const UPDATE: &str = concat!(
    "
UPDATE pair SET mesh_path = item.value ->> 1, mesh_stat = ",
    unread!("mesh_stat", "?2"),
    ", print_path = item.value ->> 2, print_stat = ",
    unread!("print_stat", "?2"),
    "
FROM json_each(?1) AS item WHERE pair.id = CAST(item.value ->> 0 AS bigint)"
);

const SELECT_BLOCKS: &str = "SELECT id, mesh_path, page_path, labels_path FROM block ORDER BY id";

const UPDATE_BLOCK: &str = concat!(
    "
UPDATE block SET mesh_path = ?2, mesh_stat = ",
    unread!("mesh_stat", "?5"),
    ", page_path = ?3, page_stat = ",
    unread!("page_stat", "?5"),
    ", labels_path = ?4, labels_stat = ",
    unread!("labels_stat", "?5"),
    " WHERE id = ?1"
);

/// Selects the input files whose paths end with one of two texts.
const NAMED: Sql = Sql::pair(
    "
SELECT name, path FROM (
    SELECT id, name, mesh_path AS path FROM pair
    UNION ALL SELECT id, name, print_path FROM pair
    UNION ALL SELECT id, name, body ->> 'tops_mask' FROM pair JOIN truth ON truth.pair = pair.id
    UNION ALL SELECT id, name, mesh_path FROM block
    UNION ALL SELECT id, name, page_path FROM block
    UNION ALL SELECT id, name, labels_path FROM block
) WHERE substr(path, -length(?1)) = ?1 OR substr(path, -length(?2)) = ?2 ORDER BY id",
    "
SELECT name, path FROM (
    SELECT id, name, mesh_path AS path FROM pair
    UNION ALL SELECT id, name, print_path FROM pair
    UNION ALL SELECT id, name, body ->> 'tops_mask' FROM pair JOIN truth ON truth.pair = pair.id
    UNION ALL SELECT id, name, mesh_path FROM block
    UNION ALL SELECT id, name, page_path FROM block
    UNION ALL SELECT id, name, labels_path FROM block
) AS inputs WHERE right(path, length(?1)) = ?1 OR right(path, length(?2)) = ?2 ORDER BY id",
);

impl Catalog {
    /// Returns the meshes, prints, true masks, pages and labels whose stored paths end with one of two file names, each with
    /// the name of its pair or block.
    pub async fn inputs_named(&self, file_names: [String; 2]) -> Result<Vec<(String, String)>> {
        let [one, other] = file_names;
        let query = query_as(NAMED).bind(one).bind(other);
        let mut conn = self.read_conn().await?;
        query.fetch_all(&mut conn).await
    }

    /// Replaces the paths of the input files of pairs and blocks in one transaction, for a project that is restored at
    /// another place. `find` receives a stored path and returns the new one, or `None` to keep the stored path. Returns
    /// the paths that were kept.
    ///
    /// # Errors
    /// Returns an error, and replaces no path, if a row differs from its checksum or a database operation fails.
    pub async fn replace_input_paths(
        &self,
        find: impl FnMut(&str) -> Option<String> + Send + 'static,
    ) -> Result<Vec<String>> {
        // Verifies first, because the update would give a damaged row a valid checksum.
        let tables = [ChecksummedTable::Pair, ChecksummedTable::Block];
        self.verify_checksums(&tables).await?;
        self.in_transaction(move |conn| Box::pin(replace(conn, find)))
            .await
    }
}

async fn replace(
    conn: &mut Conn,
    mut find: impl FnMut(&str) -> Option<String> + Send,
) -> Result<Vec<String>> {
    let mut kept = Vec::new();
    let mut after = 0_i64;
    loop {
        let rows = query_as(SELECT).bind(after).bind(PAGE);
        let rows: Vec<(i64, String, String)> = rows.fetch_all(&mut *conn).await?;
        let Some((last, ..)) = rows.last() else {
            replace_in_blocks(conn, find, &mut kept).await?;
            return Ok(kept);
        };
        after = *last;
        let ids: Vec<i64> = rows.iter().map(|(id, ..)| *id).collect();
        let mut new_path = |stored: String| {
            // The files of pairs that were cut from blocks are artifacts, which a run writes again.
            if ArtifactRef::at_path(&stored).is_some() {
                return stored;
            }
            found_or_kept(stored, &mut find, &mut kept)
        };
        let items = rows
            .into_iter()
            .map(|(id, mesh, print)| json!([id, new_path(mesh), new_path(print)]));
        let items = items.collect::<Value>().to_string();
        let update = query(UPDATE).bind(items).bind(InputVersion::RESTORED);
        update.execute(&mut *conn).await?;
        checksums::store(conn, ChecksummedTable::Pair, &ids).await?;
    }
}

/// Replaces the paths of the input files of blocks.
async fn replace_in_blocks(
    conn: &mut Conn,
    mut find: impl FnMut(&str) -> Option<String>,
    kept: &mut Vec<String>,
) -> Result<()> {
    let rows: Vec<(i64, String, String, Option<String>)> =
        query_as(SELECT_BLOCKS).fetch_all(&mut *conn).await?;
    for (id, mesh, page, labels) in rows {
        let mut new_path = |stored| found_or_kept(stored, &mut find, kept);
        let (mesh, page, labels) = (new_path(mesh), new_path(page), labels.map(new_path));
        let update = query(UPDATE_BLOCK).bind(id).bind(mesh).bind(page);
        let update = update.bind(labels).bind(InputVersion::RESTORED);
        update.execute(&mut *conn).await?;
        checksums::store(conn, ChecksummedTable::Block, &[id]).await?;
    }
    Ok(())
}

/// Returns the new path of an input, or records that the stored path is kept.
fn found_or_kept(
    stored: String,
    find: &mut impl FnMut(&str) -> Option<String>,
    kept: &mut Vec<String>,
) -> String {
    find(&stored).unwrap_or_else(|| {
        kept.push(stored.clone());
        stored
    })
}
