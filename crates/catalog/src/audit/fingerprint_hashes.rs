//! Checks the fingerprints that jobs use against their settings, and repairs them.

use serde_json::Value;

use crate::db::conn::Conn;
use crate::db::query::{query, query_scalar};
use crate::db::row::Row;
use crate::db::transaction::in_transaction;
use crate::jobs::fingerprint::hash_of;
use crate::{Catalog, Result};
use mocban_core::domain::{ContentHash, Stage};

/// A fingerprint whose hash does not follow from its settings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultyFingerprint {
    /// The row.
    pub row: i64,
    /// The stage, unless it is invalid.
    pub stage: Option<Stage>,
}

/// Selects the fingerprints of jobs, and all fingerprints upstream of these, sorted by stage.
const USED: &str = "
WITH RECURSIVE used (id) AS (
    SELECT DISTINCT fingerprint FROM job WHERE fingerprint IS NOT NULL
    UNION SELECT f.upstream FROM used JOIN fingerprint AS f ON f.id = used.id WHERE f.upstream IS NOT NULL)
SELECT f.id, f.stage, f.hash, f.fields, (SELECT b.hash FROM fingerprint AS b WHERE b.id = f.upstream) AS upstream
FROM used JOIN fingerprint AS f ON f.id = used.id ORDER BY f.stage, f.id";

const SET: &str = "UPDATE fingerprint SET hash = ?2, fields = ?3 WHERE id = ?1";

const UPSTREAM: &str = "
SELECT b.hash FROM fingerprint AS f JOIN fingerprint AS b ON b.id = f.upstream WHERE f.id = ?1";

/// Makes the next run compare all results with its settings.
const MARK_ALL: &str = "UPDATE job SET dirty = 1 WHERE dirty = 0";

impl Catalog {
    /// Returns the fingerprints of jobs whose hash does not follow from their settings.
    pub async fn faulty_fingerprints(&self) -> Result<Vec<FaultyFingerprint>> {
        let mut conn = self.read_conn().await?;
        let used = query(USED).fetch_all(&mut conn).await?;
        let mut faulty = Vec::new();
        for row in &used {
            if !is_sound(row) {
                faulty.push(FaultyFingerprint {
                    row: row.get("id")?,
                    stage: row.get("stage").ok(),
                });
            }
        }
        Ok(faulty)
    }

    /// Gives each faulty fingerprint a hash that no settings have, so that the next run computes the results again.
    ///
    /// # Errors
    /// Returns an error if a database operation fails. In that case nothing is changed.
    pub async fn retire_fingerprints(&self, faulty: Vec<FaultyFingerprint>) -> Result<()> {
        in_transaction!(self, |conn| {
            for fingerprint in &faulty {
                retire(conn, fingerprint).await?;
            }
            query(MARK_ALL).execute(conn).await?;
            Ok(())
        })
    }
}

fn is_sound(row: &Row) -> bool {
    let (Ok(stage), Ok(hash), Ok(fields), Ok(upstream)) = (
        row.get::<Stage>("stage"),
        row.get::<ContentHash>("hash"),
        row.get::<String>("fields"),
        row.get::<Option<ContentHash>>("upstream"),
    ) else {
        return false;
    };
    serde_json::from_str::<Value>(&fields)
        .is_ok_and(|fields| hash_of(stage, &fields, upstream) == hash)
}

/// Replaces the settings of a fingerprint by a note, and its hash by a hash of the note.
async fn retire(conn: &mut Conn, faulty: &FaultyFingerprint) -> Result<()> {
    let fields = serde_json::json!({ "damaged_row": faulty.row });
    let stage = faulty.stage.unwrap_or(Stage::Fit);
    let upstream = query_scalar(UPSTREAM).bind(faulty.row);
    let upstream: Option<ContentHash> = upstream.fetch_optional(&mut *conn).await?;
    let hash = hash_of(stage, &fields, upstream);
    let set = query(SET).bind(faulty.row).bind(&hash.as_bytes()[..]);
    set.bind(fields.to_string()).execute(conn).await?;
    Ok(())
}
