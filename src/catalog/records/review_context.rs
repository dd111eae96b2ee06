//! Context in which a verdict was given.

use serde::{Deserialize, Serialize};
use sqlx::Row as _;
use sqlx::sqlite::SqliteRow;

use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::domain::{ContentHash, ReviewOrder};

/// Context of a verdict; empty for verdicts that were not given on the review page.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ReviewContext {
    /// Idempotency key of the client: a verdict sent twice is stored once.
    pub event: Option<String>,
    /// Hash of everything that the shown image was made from.
    pub seen: Option<ContentHash>,
    /// How long the image was shown, milliseconds.
    pub shown_ms: Option<u64>,
    /// Rotation that the reviewer found missing between relief and print, degrees clockwise.
    pub angle_read_deg: Option<f64>,
    /// Order of the review queue.
    pub review_order: Option<ReviewOrder>,
}

impl ReviewContext {
    /// Reads it from the columns of the same names.
    pub(crate) fn read(row: &SqliteRow) -> Result<Self> {
        let order: Option<String> = row.try_get("review_order")?;
        Ok(Self {
            event: row.try_get("event")?,
            seen: rows::hash_option(row.try_get::<Option<Vec<u8>>, _>("seen")?.as_deref())?,
            shown_ms: row
                .try_get::<Option<i64>, _>("shown_ms")?
                .map(i64::unsigned_abs),
            angle_read_deg: row.try_get("angle_read_deg")?,
            review_order: order.map(|order| rows::name(&order)).transpose()?,
        })
    }
}
