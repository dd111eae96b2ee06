//! The range of numbers of which some at the ends may stand for missing ones.

/// Different numbers at each end that may stand for missing ones.
const ENDS: usize = 3;

/// The numbers at the ends of some numbers, and the range of those between them.
#[derive(Debug, Clone)]
pub(super) struct InnerRange {
    /// Ends from the outside to the inside; one may be there several times.
    ends: Vec<f64>,
    /// The least and the largest number between them.
    inner: [f64; 2],
}

impl InnerRange {
    /// Returns the range of some numbers, of which up to [`ENDS`] different ones at each end are not between. Of two different
    /// ones, the more frequent one is between.
    pub(super) fn of(values: &(impl Iterator<Item = f64> + Clone)) -> Self {
        let mut found = Self::within(values, [f64::NEG_INFINITY, f64::INFINITY]);
        for _ in 1..ENDS {
            if found.inner[0] >= found.inner[1] {
                break;
            }
            // The ends of the inner numbers may stand for missing ones, too.
            let [low, high] = found.inner;
            let next = Self::within(values, [low.next_down(), high.next_up()]);
            found.ends.extend(next.ends);
            found.inner = next.inner;
        }
        found
    }

    /// Returns the range of the numbers between two others.
    fn within(values: &(impl Iterator<Item = f64> + Clone), [above, below]: [f64; 2]) -> Self {
        let values = values.clone();
        let values = values.filter(move |value| above < *value && *value < below);
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let with = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
        let ends = values.clone().fold(none, with);
        let (mut inner, mut at_ends) = (none, [0, 0]);
        for value in values {
            if value == ends[0] {
                at_ends[0] += 1;
            } else if value == ends[1] {
                at_ends[1] += 1;
            } else {
                inner = with(inner, value);
            }
        }
        if inner == none {
            inner = [ends[usize::from(at_ends[1] > at_ends[0])]; 2];
        }
        Self {
            ends: ends.to_vec(),
            inner,
        }
    }

    /// Returns the numbers at the ends.
    pub(super) fn ends(&self) -> impl Iterator<Item = f64> {
        self.ends.iter().copied()
    }

    pub(super) const fn inner(&self) -> [f64; 2] {
        self.inner
    }

    pub(super) fn length(&self) -> f64 {
        self.inner[1] - self.inner[0]
    }

    /// Extends the range by the ends that are at most `room` outside of it.
    pub(super) fn extend_by(&mut self, room: f64) {
        let [low, high] = self.inner;
        for end in &self.ends {
            if (low - room..=high + room).contains(end) {
                self.inner = [self.inner[0].min(*end), self.inner[1].max(*end)];
            }
        }
    }

    /// Returns the ends that are more than `room` outside of the range.
    pub(super) fn ends_beyond(&self, room: f64) -> impl Iterator<Item = f64> {
        let [low, high] = self.inner;
        let ends = self.ends.iter().copied();
        ends.filter(move |end| *end < low - room || *end > high + room)
    }

    /// Returns the largest absolute value in the range.
    pub(super) fn largest(&self) -> f64 {
        self.inner[0].abs().max(self.inner[1].abs())
    }
}

#[cfg(test)]
mod tests {
    use super::InnerRange;

    #[test]
    fn several_numbers_far_outside_are_ends() {
        let mut numbers: Vec<f64> = (0..=20).map(f64::from).collect();
        numbers.extend([-9999.0, -9999.0, -32768.0]);
        let mut range = InnerRange::of(&numbers.iter().copied());
        range.extend_by(range.length());
        assert!((range.length() - 20.0).abs() < 1e-12);
        let mut far: Vec<f64> = range.ends_beyond(100.0).collect();
        far.sort_by(f64::total_cmp);
        assert_eq!(far, [-32768.0, -9999.0]);
    }
}
