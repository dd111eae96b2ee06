//! Leases that this process has received from a server. The reply to a claim can be lost after its commit. Then the
//! catalog contains leases that this process has not received, and its heartbeats keep them valid.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::queue::lease::{Lease, leases};
use crate::queue::pair_job::PairJob;
use mocban_core::domain::{PairId, WorkerId};

/// Time after a reconnection or a failed claim during which unknown leases are searched for. A server may execute a commit
/// of the broken connection until it notices that the connection is broken.
const SEARCH_TIME: Duration = Duration::from_mins(2);

/// Tokens of known leases by pair.
#[derive(Debug, Default)]
pub(crate) struct KnownLeases {
    tokens: BTreeMap<PairId, i64>,
    search_until: Option<Instant>,
}

impl KnownLeases {
    /// Records that replies may have been lost.
    pub(crate) fn replies_may_be_lost(&mut self) {
        self.search_until = Some(Instant::now() + SEARCH_TIME);
    }

    /// Returns whether an earlier commit may have been stored although its reply was lost.
    pub(crate) fn is_searching(&self) -> bool {
        self.search_until
            .is_some_and(|until| Instant::now() <= until)
    }

    /// Adds leases that a claim returned.
    pub(crate) fn add(&mut self, leases: &[Lease]) {
        let tokens = leases.iter().map(|lease| (lease.unit, lease.token));
        self.tokens.extend(tokens);
    }

    /// Removes a lease that has ended. A later lease of the same pair stays.
    pub(crate) fn remove(&mut self, lease: &Lease) {
        if self.tokens.get(&lease.unit) == Some(&lease.token) {
            self.tokens.remove(&lease.unit);
        }
    }

    /// Returns the leases of a worker that this process has not received. Queries the server only for `SEARCH_TIME` after
    /// a reconnection or a failed claim.
    pub(crate) async fn unknown(&self, conn: &mut Conn, worker: WorkerId) -> Result<Vec<Lease>> {
        if !self.is_searching() {
            return Ok(Vec::new());
        }
        let mut leases = leases::<PairJob>(conn, worker).await?;
        leases.retain(|lease| self.tokens.get(&lease.unit) != Some(&lease.token));
        Ok(leases)
    }
}
