//! Commits requests in PostgreSQL. Checkpoints, and each claim, are one statement that commits by itself; the rarer
//! requests share a transaction.

use std::time::Instant;

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::queue::claim::ClaimRequest;
use crate::queue::commit::group_commit::{Batch, BatchReply};
use crate::queue::commit::write_connection::CatalogServerState;
use crate::queue::counters::{self, cursor};
use crate::queue::lease::{Lease, LeasedCheckpoints, is_late, position_after, stored_before};
use crate::queue::{server_checkpoint, server_claim};
use mocban_core::domain::JobStatus;

/// Commits a batch of [`Batch::split_for_server`]. An earlier commit of the same batch may have been stored although its
/// reply was lost.
///
/// # Errors
/// Returns an error if a database operation fails. A part of the batch may be stored nevertheless.
pub(crate) async fn commit(
    batch: &Batch,
    conn: &mut Conn,
    state: &mut CatalogServerState,
) -> Result<BatchReply> {
    let outcome = commit_parts(batch, conn, state).await;
    // The leases may exist although the claim failed.
    if outcome.is_err() && !batch.claims.is_empty() {
        state.leases.replies_may_be_lost();
    }
    outcome
}

async fn commit_parts(
    batch: &Batch,
    conn: &mut Conn,
    state: &mut CatalogServerState,
) -> Result<BatchReply> {
    let mut reply = BatchReply::default();
    if batch.has_shared_transaction() {
        reply = batch.apply(conn, state.leases.is_searching()).await?;
        if !batch.heartbeats.is_empty() {
            state.claim_tracker.begin_again();
            // The reply does not depend on it. A broken connection shows at the next statement.
            match counters::fold(conn, !state.has_folded_all).await {
                Ok(()) => state.has_folded_all = true,
                Err(error) => tracing::debug!(%error, "counters are added up later"),
            }
        }
        let failed = || batch.failures.items().map(|item| &item.0);
        for lease in batch.releases.items().chain(failed()) {
            state.leases.remove(lease);
        }
        for lease in batch.releases.items() {
            state.claim_tracker.note_release(lease);
        }
        note_exclusive(failed(), state);
    }
    if !batch.checkpoints.is_empty() {
        let checkpoints: Vec<_> = batch.checkpoints.items().map(|item| &**item).collect();
        reply.checkpoints = store(conn, &checkpoints, state).await?;
    }
    for request in batch.claims.items() {
        reply.claims.push(claim(conn, request, state).await?);
    }
    Ok(reply)
}

/// Returns whether stages that were computed again end where their lease began. The position of the job then does not show
/// whether they are stored.
fn ends_at_its_start((lease, stages): &LeasedCheckpoints) -> bool {
    position_after(stages).is_some_and(|(end, _)| end == cursor(lease.cursor))
}

/// Stores checkpoints. Returns for each whether it is stored.
async fn store(
    conn: &mut Conn,
    checkpoints: &[&LeasedCheckpoints],
    state: &mut CatalogServerState,
) -> Result<Vec<bool>> {
    let Conn::Postgres(server) = conn else {
        unreachable!("a server is PostgreSQL");
    };
    let (late, timely): (Vec<&LeasedCheckpoints>, Vec<_>) =
        checkpoints.iter().partition(|item| is_late(**item));
    let stored = server_checkpoint::store(server, &timely).await?;
    if !late.is_empty() {
        // The next claim gets these leases back, and computes the stages again.
        state.leases.replies_may_be_lost();
    }
    let mut earlier = Vec::new();
    // Otherwise, a refused checkpoint of an earlier stage, computed again, would look as if it were stored.
    if state.leases.is_searching() {
        let refused = timely.iter().filter(|(lease, _)| !lease.is_in(&stored));
        let late = late.iter().filter(|item| !ends_at_its_start(item));
        earlier = stored_before(conn, refused.chain(late).copied(), [].into_iter()).await?;
    }
    let is_kept = |lease: &Lease| lease.is_in(&stored) || lease.is_in(&earlier);
    let kept: Vec<bool> = checkpoints
        .iter()
        .map(|(lease, _)| is_kept(lease))
        .collect();
    for ((lease, stages), kept) in checkpoints.iter().zip(&kept) {
        let is_done = position_after(stages).is_some_and(|(_, status)| status == JobStatus::Done);
        if is_done || !kept {
            state.leases.remove(lease);
        }
    }
    note_exclusive(checkpoints.iter().map(|(lease, _)| lease), state);
    Ok(kept)
}

/// Leases pairs. Also returns leases of the worker that an earlier claim received without a reply.
async fn claim(
    conn: &mut Conn,
    request: &ClaimRequest,
    state: &mut CatalogServerState,
) -> Result<Vec<Lease>> {
    // Before the claim, because nothing may fail between its commit and its reply.
    let unknown = state.leases.unknown(conn, request.worker).await?;
    let began = Instant::now();
    let start = state.claim_tracker.of(request, began);
    let mut claimed = server_claim::claim(conn, request, start).await?;
    let times = [began, Instant::now()];
    state.claim_tracker.note(request, start, &claimed, times);
    claimed.extend(without_pairs_of(unknown, &claimed));
    state.leases.add(&claimed);
    Ok(claimed)
}

/// Returns leases without those of a pair that was leased again meanwhile.
fn without_pairs_of(mut leases: Vec<Lease>, later: &[Lease]) -> Vec<Lease> {
    leases.retain(|lease| later.iter().all(|other| other.unit != lease.unit));
    leases
}

/// Lets claims search from the beginning after an exclusive lease, which prevented claims.
fn note_exclusive<'l>(leases: impl Iterator<Item = &'l Lease>, state: &mut CatalogServerState) {
    for lease in leases.filter(|lease| lease.exclusive) {
        state.claim_tracker.note_release(lease);
    }
}
