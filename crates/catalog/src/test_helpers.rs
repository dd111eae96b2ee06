//! Methods of the catalog for tests.

use std::path::Path;
use std::time::Duration;

use serde_json::Value;
use tokio::sync::{mpsc, oneshot};

use crate::db::query::query_scalar;
use crate::queue::commit::writer::CommitDelay;
use crate::{
    Catalog, CheckpointOutcome, ImportChunk, ImportRow, ImportSummary, ImportTerms, Lease,
    ListedVerdict, NewVerdict, Result, StageCheckpoint,
};
use mocban_core::domain::{PairId, PairName, Stage, UnixMillis, WorkerId};

impl Catalog {
    /// Imports rows in one transaction.
    pub async fn import(&self, rows: Vec<ImportRow>, now: UnixMillis) -> Result<ImportSummary> {
        let (sender, chunks) = mpsc::channel(2);
        for chunk in [ImportChunk::Rows(rows), ImportChunk::End] {
            sender.try_send(chunk).expect("room for both");
        }
        let (summary, _) = self.import_all(chunks, ImportTerms::default(), now).await?;
        Ok(summary)
    }

    /// Stores true alignments.
    pub async fn set_truth(&self, truths: Vec<(PairName, Value)>) -> Result<u64> {
        let (sender, chunks) = mpsc::channel(1);
        sender.try_send(ImportChunk::End).expect("room");
        let terms = ImportTerms {
            truths,
            ..ImportTerms::default()
        };
        let (_, stored) = self.import_all(chunks, terms, 1).await?;
        Ok(stored)
    }

    /// Appends verdicts on the current results. Returns the number of verdicts of which a row was appended.
    pub async fn verdict_set(&self, verdicts: Vec<NewVerdict>, now: UnixMillis) -> Result<u64> {
        let listed = verdicts.into_iter().map(|verdict| {
            Ok(ListedVerdict {
                verdict,
                judged: None,
                day: None,
            })
        });
        Ok(self.import_verdicts(listed, now).await?.recorded)
    }

    /// Stores a stage without commit delay.
    pub async fn checkpoint_now(
        &self,
        lease: Lease,
        stage: StageCheckpoint,
    ) -> Result<CheckpointOutcome> {
        let _waiting = self.waiting().await?;
        self.checkpoint(lease, vec![stage]).await
    }

    /// Creates a catalog whose writer delays deferrable requests for an hour.
    pub async fn create_patient(path: &Path) -> Result<Self> {
        Self::create(path).await?.close().await;
        Self::with_writer(path, false, CommitDelay::of(Duration::from_hours(1))).await
    }

    /// Returns how often leases of blocks were taken or ended by a recovery.
    pub async fn block_tokens(&self) -> Result<i64> {
        let mut conn = self.read_conn().await?;
        let tokens = query_scalar("SELECT sum(token) FROM block_job");
        tokens.fetch_one(&mut conn).await
    }

    /// Keeps the writer busy until the sender is used or dropped.
    pub async fn hold(&self) -> oneshot::Sender<()> {
        let (held, is_held) = oneshot::channel();
        let (release, released) = oneshot::channel();
        let catalog = self.clone();
        tokio::spawn(async move {
            let wait = catalog.in_transaction(move |_| {
                Box::pin(async move {
                    held.send(()).expect("a receiver");
                    // A dropped sender releases the writer too.
                    let _ = released.await;
                    Ok(())
                })
            });
            wait.await.expect("an empty transaction");
        });
        is_held.await.expect("a busy writer");
        release
    }
}

impl Lease {
    /// Returns the first lease of a pair by the first worker.
    pub fn of_pair(pair: PairId) -> Self {
        Self {
            unit: pair,
            worker: WorkerId(1),
            token: 1,
            cursor: Stage::Fit,
            fingerprint: None,
            attempt: 1,
            exclusive: false,
            cleared: false,
        }
    }
}
