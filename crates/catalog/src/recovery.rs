//! Recovers the leases of workers that died or hang, of pairs and blocks in one transaction.

use crate::blocks::recovery as blocks;
use crate::queue::recovery::{self as pairs, DeadWorker, Recovered};
use crate::{Catalog, Result};
use mocban_core::domain::{UnixMillis, WorkerId};

impl Catalog {
    /// Recovers the leases of dead workers. Each pair becomes ready again, or is quarantined if it probably caused
    /// several deaths.
    ///
    /// A pair is blamed for a death if it was the worker's only lease. It is quarantined if `is_poisoned` returns true,
    /// which also considers other recent deaths. Therefore, killing processes from outside rarely quarantines a pair.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn recover(&self, dead: DeadWorker, now: UnixMillis) -> Result<Recovered> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let workers = pairs::mark_dead(conn, &dead).await?;
                let deaths = pairs::deaths(conn).await?;
                // Before the pairs: a block is blamed only if its worker holds no pair.
                let most = u32::try_from(deaths).unwrap_or(u32::MAX);
                let blocks = blocks::recover(conn, &workers, most, now).await?;
                let recovered = pairs::recover(conn, &workers, deaths, now).await?;
                Ok(Recovered {
                    blocks,
                    ..recovered
                })
            })
        })
        .await
    }

    /// Recovers overdue leases of other workers that are not known to be dead. A lease is overdue if its worker's last
    /// heartbeat is more than `margin_ms` after the deadline. This is rare, because processes enforce their own
    /// deadlines.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
    pub async fn recover_overdue(
        &self,
        me: WorkerId,
        margin_ms: i64,
        now: UnixMillis,
    ) -> Result<Recovered> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let others = pairs::holders_but(conn, me).await?;
                let blocks = blocks::recover_overdue(conn, &others, margin_ms, now).await?;
                let recovered = pairs::recover_overdue(conn, &others, margin_ms, now).await?;
                Ok(Recovered {
                    blocks,
                    ..recovered
                })
            })
        })
        .await
    }
}
