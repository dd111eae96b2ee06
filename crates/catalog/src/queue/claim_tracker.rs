//! Where claims on a server begin to search for ready pairs.
//!
//! A claim reads the index of ready jobs in its order. Claimed jobs leave entries there until the server removes them,
//! which it cannot do while another session holds a snapshot, such as a backup. So a claim begins behind the pair that
//! this process claimed last, and reads from the beginning only if it finds too few pairs there, or if earlier pairs may
//! have become ready.

use std::time::{Duration, Instant};

use crate::queue::claim::{ClaimCursor, ClaimRequest};
use crate::queue::counters::cursor;
use crate::queue::lease::Lease;
use mocban_core::domain::{Stage, WorkerId};

/// Time between searches from the beginning, which find earlier pairs that other processes made ready.
const SEARCH_ALL_EVERY: Duration = Duration::from_secs(5);
/// Such searches take at most this part of the time, unless they are further apart than the limit below.
const SEARCH_ALL_SHARE: u32 = 20;
const SEARCH_ALL_AT_LEAST_EVERY: Duration = Duration::from_mins(1);
/// Time after a claim that found too few pairs in which claims do not search from the beginning again. Shorter than the
/// interval at which an idle worker claims.
const PAUSE: Duration = Duration::from_millis(200);

/// Where the claims of this process begin.
#[derive(Debug, Default)]
pub(crate) struct ClaimTracker {
    /// Position of the last claimed pair, and the last stage that the claim permitted.
    last: Option<(ClaimCursor, Stage)>,
    /// `None` if the next claim must search from the beginning.
    search_all_at: Option<Instant>,
    /// A worker whose last claim found too few pairs, and the end of its pause.
    pause: Option<(WorkerId, Instant)>,
}

impl ClaimTracker {
    /// Returns where a claim begins, or `None` if it begins at the first pair.
    pub(crate) fn of(&self, request: &ClaimRequest, now: Instant) -> Option<ClaimCursor> {
        let (last, until) = self.last?;
        let is_due = self.search_all_at.is_none_or(|at| at <= now);
        if is_due || until != request.until || !Self::applies_to(request) {
            return None;
        }
        let is_paused = |(worker, end)| worker == request.worker && now < end;
        Some(ClaimCursor {
            or_anywhere: !self.pause.is_some_and(is_paused),
            ..last
        })
    }

    /// Records what a claim found, in the order of the claim. `times` says when the claim began and ended.
    pub(crate) fn note(
        &mut self,
        request: &ClaimRequest,
        behind: Option<ClaimCursor>,
        leases: &[Lease],
        times: [Instant; 2],
    ) {
        let [began, now] = times;
        if !Self::applies_to(request) {
            return;
        }
        let is_enough = leases.len() >= request.slots;
        let is_behind = |lease: &&Lease| behind.is_some_and(|start| start.is_before(lease));
        let found_behind = leases.iter().filter(is_behind).count();
        if behind.is_none_or(|start| start.or_anywhere && found_behind < request.slots) {
            let wait = (now - began) * SEARCH_ALL_SHARE;
            let wait = wait.clamp(SEARCH_ALL_EVERY, SEARCH_ALL_AT_LEAST_EVERY);
            self.search_all_at = Some(now + wait);
            self.pause = (!is_enough).then_some((request.worker, now + PAUSE));
        }
        // If there were enough pairs, more may follow those found from the beginning. Otherwise, all were found.
        let anywhere = leases.iter().rfind(|lease| !is_behind(lease));
        let next = match (anywhere.filter(|_| is_enough), self.last) {
            (Some(lease), _) => Some(lease),
            (None, Some((last, until))) if until == request.until => {
                leases.last().filter(|lease| last.is_before_in_order(lease))
            }
            (None, _) => leases.last(),
        };
        if let Some(lease) = next {
            self.last = Some((ClaimCursor::pair_of(lease), request.until));
        }
    }

    /// Lets the next claim search from the beginning, because this process may have changed which pairs are ready or may
    /// be claimed.
    pub(crate) const fn begin_again(&mut self) {
        self.search_all_at = None;
        self.pause = None;
    }

    /// Notes that a lease ends before its pair is done. An exclusive lease also prevented claims.
    pub(crate) fn note_release(&mut self, lease: &Lease) {
        // Claims for earlier stages do not look for the pair: a run of one stage releases all its pairs.
        let may_be_claimed = |(_, until)| cursor(lease.cursor) <= cursor(until);
        if lease.exclusive || self.last.is_some_and(may_be_claimed) {
            self.begin_again();
        }
    }

    /// Returns whether claims of this kind have a start. Others are rare or read few jobs.
    const fn applies_to(request: &ClaimRequest) -> bool {
        !request.exclusive && request.selection.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::{ClaimTracker, PAUSE, SEARCH_ALL_EVERY};
    use crate::queue::claim::{ClaimCursor, ClaimRequest};
    use crate::queue::lease::Lease;
    use mocban_core::domain::{PairId, Stage, WorkerId};
    use std::time::Instant;

    fn request(slots: usize) -> ClaimRequest {
        ClaimRequest::new(WorkerId(1), slots, 0)
    }

    fn lease(pair: i64, cursor: Stage) -> Lease {
        Lease {
            unit: PairId(pair),
            worker: WorkerId(1),
            token: 1,
            cursor,
            fingerprint: None,
            attempt: 1,
            exclusive: false,
            cleared: false,
        }
    }

    const fn behind(pair: i64, or_anywhere: bool) -> ClaimCursor {
        ClaimCursor {
            turn: 0,
            pair,
            or_anywhere,
        }
    }

    /// Returns a start after a claim of one slot that leased pair 7.
    fn after_one(now: Instant) -> ClaimTracker {
        let mut start = ClaimTracker::default();
        assert_eq!(start.of(&request(1), now), None);
        start.note(&request(1), None, &[lease(7, Stage::Fit)], [now; 2]);
        start
    }

    #[test]
    fn claims_begin_behind_the_last_pair_for_some_time() {
        let now = Instant::now();
        let start = after_one(now);
        assert_eq!(start.of(&request(2), now), Some(behind(7, true)));
        assert_eq!(start.of(&request(2), now + SEARCH_ALL_EVERY), None);
        let until = Stage::Fit;
        let other = ClaimRequest {
            until,
            ..request(1)
        };
        assert_eq!(start.of(&other, now), None);
    }

    #[test]
    fn a_claim_that_finds_too_few_pairs_is_followed_by_a_pause() {
        let now = Instant::now();
        let mut start = after_one(now);
        start.note(
            &request(2),
            Some(behind(7, true)),
            &[lease(3, Stage::Fit)],
            [now; 2],
        );
        assert_eq!(start.of(&request(2), now), Some(behind(7, false)));
        assert_eq!(start.of(&request(2), now + PAUSE), Some(behind(7, true)));
        let other = ClaimRequest::new(WorkerId(2), 2, 0);
        assert_eq!(start.of(&other, now), Some(behind(7, true)));
        start.begin_again();
        assert_eq!(start.of(&request(2), now), None);
    }

    #[test]
    fn a_full_claim_continues_where_its_search_from_the_beginning_ended() {
        let now = Instant::now();
        let mut start = after_one(now);
        let leases = [
            lease(3, Stage::Depth),
            lease(4, Stage::Fit),
            lease(8, Stage::Fit),
        ];
        start.note(&request(3), Some(behind(7, true)), &leases, [now; 2]);
        assert_eq!(start.of(&request(3), now), Some(behind(4, true)));
    }

    #[test]
    fn slow_searches_from_the_beginning_are_rarer() {
        let now = Instant::now();
        let mut start = ClaimTracker::default();
        let ended = now + SEARCH_ALL_EVERY / 10;
        start.note(&request(1), None, &[lease(7, Stage::Fit)], [now, ended]);
        let later = ended + SEARCH_ALL_EVERY;
        assert_eq!(start.of(&request(1), later), Some(behind(7, true)));
        assert_eq!(start.of(&request(1), later + SEARCH_ALL_EVERY), None);
    }

    #[test]
    fn releases_of_pairs_that_claims_may_lease_begin_again() {
        let now = Instant::now();
        let until = Stage::Fit;
        let one = ClaimRequest {
            until,
            ..request(1)
        };
        let mut start = ClaimTracker::default();
        start.note(&one, None, &[lease(7, Stage::Fit)], [now; 2]);
        start.note_release(&lease(7, Stage::Depth));
        assert_eq!(start.of(&one, now), Some(behind(7, true)));
        start.note_release(&lease(6, Stage::Fit));
        assert_eq!(start.of(&one, now), None);
    }
}
