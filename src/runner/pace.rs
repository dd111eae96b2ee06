//! How fast pairs go by, and how many of them to take ahead.

use std::time::Duration;

/// What is taken ahead is begun within about so long: one claim serves all pairs of that time.
const AHEAD: Duration = Duration::from_millis(250);
/// Most pairs that are taken ahead for a slot, however short they are.
const MOST: u128 = 16;

/// The time that pairs take in a slot, the last ones above all.
#[derive(Debug, Default)]
pub(super) struct DurationEstimate {
    mean: Option<Duration>,
    is_single: bool,
}

impl DurationEstimate {
    /// Takes in how long a pair was in its slot.
    pub(super) fn took(&mut self, time: Duration) {
        self.mean = Some(self.mean.map_or(time, |mean| (mean * 3 + time) / 4));
    }

    /// From now on none are taken that might have to be given back, because the memory does not go so far.
    pub(super) const fn stay_single(&mut self) {
        self.is_single = true;
    }

    /// Pairs that a slot gets through while what was taken ahead may wait.
    pub(super) fn ahead(&self) -> usize {
        match self.mean {
            Some(mean) if !self.is_single => {
                let pairs = AHEAD.as_micros() / mean.as_micros().max(1);
                pairs.min(MOST) as usize
            }
            Some(_) | None => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::{DurationEstimate, MOST};

    /// What is taken ahead after pairs of these milliseconds.
    fn ahead(times: &[u64]) -> usize {
        let mut pace = DurationEstimate::default();
        for ms in times {
            pace.took(Duration::from_millis(*ms));
        }
        pace.ahead()
    }

    #[test]
    fn short_pairs_are_taken_ahead_and_long_ones_are_not() {
        assert_eq!(ahead(&[]), 0);
        assert_eq!(ahead(&[100]), 2);
        assert_eq!(ahead(&[0, 0]), MOST as usize);
        assert_eq!(ahead(&[5000]), 0);
        assert_eq!(ahead(&[100, 5000]), 0, "they have become long");
    }

    #[test]
    fn where_memory_is_short_none_are_taken_ahead() {
        let mut pace = DurationEstimate::default();
        pace.took(Duration::from_millis(1));
        pace.stay_single();
        assert_eq!(pace.ahead(), 0);
    }
}
