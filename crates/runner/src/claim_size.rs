//! How many pairs to claim: enough to keep every slot busy until the next claim, but few if pairs take long.

use std::time::Duration;

/// Pairs are claimed ahead to keep each slot busy for this time. One claim then covers several short pairs.
pub(super) const CLAIM_AHEAD: Duration = Duration::from_millis(250);
/// Inputs in an object store are read ahead to keep each slot busy for this time.
pub(super) const FETCH_AHEAD: Duration = Duration::from_secs(2);
/// Most pairs claimed ahead for one slot, however short they are.
const MAX_AHEAD_PER_SLOT: u128 = 16;

/// How busy the slots are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load {
    pub(super) free: usize,
    pub(super) running: usize,
    /// Running pairs at their last stage.
    pub(super) soon_free: usize,
    /// Leased pairs that wait for a slot.
    pub(super) queued: usize,
}

impl Load {
    /// Returns how many pairs to claim, or 0 if enough pairs are queued. `ahead_per_slot` is the number of pairs to
    /// claim ahead for each slot.
    pub(super) const fn pairs_to_claim(self, ahead_per_slot: usize) -> usize {
        match (self.free + self.soon_free).saturating_sub(self.queued) {
            0 => 0,
            needed => needed + (self.free + self.running) * ahead_per_slot,
        }
    }

    /// Returns how many pairs to claim if their inputs have to be read first: the queue is filled again when half of it
    /// has started.
    pub(super) fn pairs_to_fetch(self, ahead_per_slot: usize) -> usize {
        let slots = self.free + self.running;
        let full = self.free + slots * ahead_per_slot.max(1);
        if self.queued * 2 > full {
            0
        } else {
            full - self.queued
        }
    }
}

/// Estimate of how long a pair occupies its slot: a moving average in which recent pairs weigh most.
#[derive(Debug, Default)]
pub(super) struct DurationEstimate {
    mean: Option<Duration>,
    is_disabled: bool,
}

impl DurationEstimate {
    /// Takes in how long a pair occupied its slot.
    pub(super) fn add(&mut self, elapsed: Duration) {
        self.mean = Some(self.mean.map_or(elapsed, |mean| (mean * 3 + elapsed) / 4));
    }

    /// Ends claiming ahead. Called if memory is short, because the pairs would have to be released again.
    pub(super) const fn disable(&mut self) {
        self.is_disabled = true;
    }

    /// Returns how many pairs one slot finishes within this time.
    pub(super) fn pairs_within(&self, time: Duration) -> usize {
        match self.mean {
            Some(mean) if !self.is_disabled => {
                let pairs = time.as_micros() / mean.as_micros().max(1);
                pairs.min(MAX_AHEAD_PER_SLOT) as usize
            }
            Some(_) | None => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::{CLAIM_AHEAD, DurationEstimate, Load, MAX_AHEAD_PER_SLOT};

    /// Returns how many pairs are claimed ahead per slot, given the durations of earlier pairs in milliseconds.
    fn pairs_ahead(durations: &[u64]) -> usize {
        let mut estimate = DurationEstimate::default();
        for ms in durations {
            estimate.add(Duration::from_millis(*ms));
        }
        estimate.pairs_within(CLAIM_AHEAD)
    }

    #[test]
    fn pairs_are_claimed_for_slots_that_soon_become_free_and_more_where_they_are_short() {
        let load = |free, soon_free, queued| Load {
            free,
            running: 2 - free,
            soon_free,
            queued,
        };
        assert_eq!(load(2, 0, 0).pairs_to_claim(0), 2);
        assert_eq!(load(0, 0, 0).pairs_to_claim(0), 0);
        assert_eq!(load(0, 1, 0).pairs_to_claim(0), 1);
        assert_eq!(load(0, 1, 1).pairs_to_claim(2), 0);
        assert_eq!(load(0, 1, 0).pairs_to_claim(2), 1 + 4);
        assert_eq!(load(1, 1, 0).pairs_to_claim(2), 2 + 4);
    }

    #[test]
    fn inputs_are_fetched_again_when_half_of_the_queue_has_started() {
        let load = |queued| Load {
            free: 0,
            running: 2,
            soon_free: 0,
            queued,
        };
        assert_eq!(load(0).pairs_to_fetch(8), 16);
        assert_eq!(load(8).pairs_to_fetch(8), 8);
        assert_eq!(load(9).pairs_to_fetch(8), 0);
        assert_eq!(load(0).pairs_to_fetch(0), 2);
    }

    #[test]
    fn short_pairs_are_claimed_ahead_and_long_ones_are_not() {
        assert_eq!(pairs_ahead(&[]), 0);
        assert_eq!(pairs_ahead(&[100]), 2);
        assert_eq!(pairs_ahead(&[0, 0]), MAX_AHEAD_PER_SLOT as usize);
        assert_eq!(pairs_ahead(&[5000]), 0);
        assert_eq!(pairs_ahead(&[100, 5000]), 0, "they have become long");
    }

    #[test]
    fn no_pairs_are_claimed_ahead_where_memory_is_short() {
        let mut estimate = DurationEstimate::default();
        estimate.add(Duration::from_millis(1));
        estimate.disable();
        assert_eq!(estimate.pairs_within(CLAIM_AHEAD), 0);
    }
}
