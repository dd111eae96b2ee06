//! How a verdict came about.

use serde::Serialize;
use sqlx::Row as _;
use sqlx::sqlite::SqliteRow;

use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::domain::{ContentHash, ReviewOrder};

/// What is known of a verdict besides what it says; nothing of one that came from elsewhere.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ReviewContext {
    /// The client's number of the act: sent twice, it is stored once.
    pub event: Option<String>,
    /// Hash of all that the picture on the screen was made from.
    pub seen: Option<ContentHash>,
    /// How long the picture was there, milliseconds.
    pub shown_ms: Option<u64>,
    /// How far the reviewer had to turn the relief until it lay on the print, degrees clockwise.
    pub angle_read_deg: Option<f64>,
    /// The order in which results came.
    pub review_order: Option<ReviewOrder>,
}

impl ReviewContext {
    /// From the columns of its names.
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
