//! Runs of several machines on a catalog in PostgreSQL: the settings that all of them use, and the lock of planning.
//! Runs on a catalog in a file use lock files instead.

use serde_json::Value;

use crate::db::conn::Conn;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::from_row;
use crate::db::transaction::in_transaction;
use crate::jobs::fingerprint::{differences, fields_of};
use crate::jobs::plan::FieldChange;
use crate::jobs::workers::WorkerSettings;
use crate::queue::provenance::FingerprintId;
use crate::{Catalog, Result};
use mocban_core::domain::{Stage, UnixMillis};

/// Time without a heartbeat after which `status` no longer counts a worker, in milliseconds. Only for display, because
/// the clocks of two machines may differ.
pub(crate) const SHOWN_ACTIVE_MS: i64 = 60_000;

/// Selects the settings of a worker that holds leases and has other settings.
const OTHERS: &str = "
SELECT w.fingerprints, w.block_settings FROM worker AS w
WHERE (w.fingerprints <> ?1 OR w.block_settings <> ?2) AND w.id IN (
    SELECT worker FROM job WHERE status = 1 UNION ALL SELECT worker FROM block_job WHERE status = 1)
ORDER BY w.id LIMIT 1";

const SET: &str = "
INSERT INTO run_settings (id, fingerprints, block_settings) VALUES (1, ?1, ?2)
ON CONFLICT (id) DO UPDATE SET fingerprints = excluded.fingerprints, block_settings = excluded.block_settings";

const ACTIVE: &str =
    "SELECT count(*) FROM worker WHERE ended IS NULL AND died = 0 AND heartbeat > ?1";

/// A lock that belongs to the connection, so it is free when the process ends.
const TRY_LOCK: &str =
    "SELECT pg_try_advisory_lock(hashtextextended(current_setting('search_path'), 1))";
const UNLOCK: &str =
    "SELECT pg_advisory_unlock(hashtextextended(current_setting('search_path'), 1))";

/// Result of comparing the settings of a run with those of other workers.
#[derive(Debug, Clone, PartialEq)]
pub enum SharedSettings {
    /// All workers use them.
    Same,
    /// Others use other settings, which differ in these fields.
    Other(Vec<FieldChange>),
}

impl Catalog {
    /// Makes these the settings of all workers, unless pairs or blocks are leased by workers with other settings. Workers
    /// with other settings get no more pairs and blocks.
    pub async fn set_run_settings(&self, settings: WorkerSettings) -> Result<SharedSettings> {
        in_transaction!(self, |conn| {
            let (pairs, blocks) = (settings.fingerprints.json(), settings.blocks.json());
            let others = query_as(OTHERS).bind(&pairs).bind(&blocks);
            if let Some(others) = others.fetch_optional(&mut *conn).await? {
                return other(conn, others, &settings).await;
            }
            query(SET).bind(&pairs).bind(&blocks).execute(conn).await?;
            Ok(SharedSettings::Same)
        })
    }

    /// Compares the settings of a new worker with those of the last plan. Without a plan, any settings are accepted.
    pub async fn compare_run_settings(&self, settings: &WorkerSettings) -> Result<SharedSettings> {
        let mut conn = self.snapshot().await?;
        let planned = query_as("SELECT fingerprints, block_settings FROM run_settings");
        let planned: Option<StoredSettings> = planned.fetch_optional(&mut conn).await?;
        let mine = (settings.fingerprints.json(), settings.blocks.json());
        match planned {
            Some(planned)
                if (&planned.fingerprints, &planned.block_settings) != (&mine.0, &mine.1) =>
            {
                other(&mut conn, planned, settings).await
            }
            Some(_) | None => Ok(SharedSettings::Same),
        }
    }

    /// Counts the workers whose last heartbeat is recent.
    pub async fn active_workers(&self, now: UnixMillis) -> Result<u64> {
        let mut conn = self.read_conn().await?;
        let active = query_scalar(ACTIVE).bind(now - SHOWN_ACTIVE_MS);
        active.fetch_one(&mut conn).await
    }

    /// Takes the lock of planning. Returns `false` if another process plans.
    pub async fn try_lock_planning(&self) -> Result<bool> {
        self.in_transaction(|conn| Box::pin(query_scalar(TRY_LOCK).fetch_one(conn)))
            .await
    }

    /// Releases the lock of planning.
    pub async fn unlock_planning(&self) -> Result<()> {
        self.in_transaction(|conn| Box::pin(query(UNLOCK).execute(conn)))
            .await
    }
}

/// The settings of a worker or of the last plan.
struct StoredSettings {
    /// Ids of the fingerprints by stage, as a JSON array.
    fingerprints: String,
    /// As [`BlockSettings::json`](crate::BlockSettings::json).
    block_settings: String,
}

from_row! { StoredSettings { fingerprints, block_settings } }

/// Returns the fields in which the settings differ from others.
async fn other(
    conn: &mut Conn,
    others: StoredSettings,
    settings: &WorkerSettings,
) -> Result<SharedSettings> {
    let ids: [i64; Stage::COUNT] = serde_json::from_str(&others.fingerprints)?;
    let mut changes = Vec::new();
    for (stage, id) in Stage::ALL.into_iter().zip(ids) {
        let mine: Value = fields_of(conn, settings.fingerprints.of(stage)).await?;
        let other = fields_of(conn, FingerprintId(id)).await?;
        changes.extend(differences(stage.name(), &other, &mine));
    }
    changes.extend(settings.blocks.changes_from(&others.block_settings));
    Ok(SharedSettings::Other(changes))
}
