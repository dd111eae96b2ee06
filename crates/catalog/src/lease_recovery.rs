//! Recovers the leases of workers that died or hang, of pairs and blocks in one transaction.

use crate::blocks::block_job::BlockJob;
use crate::db::conn::Conn;
use crate::db::transaction::in_transaction;
use crate::jobs::recovery::{
    self as recovery, DeadWorker, Recovered, RecoveredJobs, holders_but, mark_dead,
};
use crate::queue::pair_job::PairJob;
use crate::{Catalog, Result};
use mocban_core::domain::{UnixMillis, WorkerId};

impl Catalog {
    /// Recovers the leases of dead workers. Each pair or block becomes ready again, or is quarantined if it probably
    /// caused several deaths.
    ///
    /// A pair or block is blamed for a death if it was the worker's only lease. It is quarantined if `is_poisoned`
    /// returns true, which also considers other recent deaths. Therefore, killing processes from outside rarely
    /// quarantines one.
    pub async fn recover(&self, dead: DeadWorker, now: UnixMillis) -> Result<Recovered> {
        in_transaction!(self, |conn| {
            let workers = mark_dead(conn, &dead).await?;
            let items = recovery::orphaned(conn, &workers).await?;
            let deaths = recovery::deaths(conn).await?;
            let left = [&*workers, &items];
            let pairs = recovery::recover::<PairJob>(conn, left, deaths, now).await?;
            let blocks = recovery::recover::<BlockJob>(conn, left, deaths, now).await?;
            Ok(both(pairs, &blocks))
        })
    }

    /// Recovers overdue leases of other workers that are not known to be dead. A lease is overdue if its worker's last
    /// heartbeat is more than `margin_ms` after the deadline. This is rare, because processes enforce their own
    /// deadlines.
    pub async fn recover_overdue(
        &self,
        me: WorkerId,
        margin_ms: i64,
        now: UnixMillis,
    ) -> Result<Recovered> {
        self.in_transaction(move |conn| Box::pin(overdue(conn, me, margin_ms, now)))
            .await
    }
}

async fn overdue(
    conn: &mut Conn,
    me: WorkerId,
    margin_ms: i64,
    now: UnixMillis,
) -> Result<Recovered> {
    let others = holders_but(conn, me).await?;
    let pairs = recovery::recover_overdue::<PairJob>(conn, &others, margin_ms, now).await?;
    let blocks = recovery::recover_overdue::<BlockJob>(conn, &others, margin_ms, now).await?;
    Ok(both(pairs, &blocks))
}

fn both(pairs: RecoveredJobs<PairJob>, blocks: &RecoveredJobs<BlockJob>) -> Recovered {
    Recovered {
        ready: pairs.ready,
        poisoned: pairs.poisoned,
        blocks: blocks.ready,
    }
}
