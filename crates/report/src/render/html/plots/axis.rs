//! Axes with ticks at round numbers.

/// Most intervals of an axis.
const MAX_INTERVALS: f64 = 6.0;

/// An axis of a plot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlotAxis {
    /// Values at both ends.
    pub(super) ends: [f64; 2],
    /// Coordinates of both ends, in SVG units.
    places: [f64; 2],
    /// Distance of ticks.
    step: f64,
}

impl PlotAxis {
    /// Returns the axis from `low` to `high` in steps of 1, 2 or 5 times a power of ten. It begins and ends at ticks.
    pub(super) fn covering(low: f64, high: f64, places: [f64; 2]) -> Self {
        let unit = 10.0_f64.powf(((high - low).max(1e-9) / MAX_INTERVALS).log10().floor());
        let ends = |step: f64| [(low / step).floor() * step, (high / step).ceil() * step];
        let steps = [1.0, 2.0, 5.0, 10.0, 20.0].map(|times| times * unit);
        let is_enough = |step: &f64| {
            let [from, to] = ends(*step);
            ((to - from) / step).round() <= MAX_INTERVALS
        };
        let step = steps.into_iter().find(is_enough).unwrap_or(20.0 * unit);
        Self {
            ends: ends(step),
            places,
            step,
        }
    }

    /// Returns the axis of a percentage from below `lowest` to 100, which begins at 90 or below, so that values near 100
    /// stay apart.
    pub(super) fn percent(lowest: f64, places: [f64; 2]) -> Self {
        Self::covering(lowest.clamp(0.0, 90.0), 100.0, places)
    }

    /// Returns the values of the ticks.
    pub(super) fn ticks(&self) -> impl Iterator<Item = f64> {
        let [from, to] = self.ends;
        let (step, n) = (self.step, ((to - from) / self.step).round() as usize);
        (0..=n).map(move |i| from + step * i as f64)
    }

    /// Returns the coordinate of a value.
    pub(super) fn place(&self, value: f64) -> f64 {
        let share = (value - self.ends[0]) / (self.ends[1] - self.ends[0]);
        self.places[0] + (self.places[1] - self.places[0]) * share
    }

    /// Returns the coordinate of the middle.
    pub(super) fn middle(&self) -> f64 {
        f64::midpoint(self.places[0], self.places[1])
    }

    /// Formats the label of a tick with the decimals that the steps need.
    pub(super) fn label(&self, value: f64) -> String {
        let decimals = (-self.step.log10().floor()).max(0.0) as usize;
        format!("{value:.decimals$}")
    }
}

#[cfg(test)]
mod tests {
    use super::PlotAxis;

    fn labels(axis: &PlotAxis) -> Vec<String> {
        axis.ticks().map(|value| axis.label(value)).collect()
    }

    #[test]
    fn ticks_are_at_round_numbers_and_enclose_the_values() {
        let axis = |low, high| labels(&PlotAxis::covering(low, high, [0.0, 1.0]));
        assert_eq!(axis(0.0, 1.0), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(
            axis(0.0, 114.0),
            ["0", "20", "40", "60", "80", "100", "120"]
        );
        assert_eq!(
            axis(0.0, 3.0),
            ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]
        );
        assert_eq!(axis(69.6, 100.0), ["60", "70", "80", "90", "100"]);
    }

    #[test]
    fn percentages_near_100_stay_apart() {
        let axis = PlotAxis::percent(99.5, [100.0, 200.0]);
        assert_eq!(axis.ends, [90.0, 100.0]);
        assert_eq!((axis.place(90.0), axis.place(95.0)), (100.0, 150.0));
        assert_eq!(PlotAxis::percent(9.5, [0.0, 1.0]).ends, [0.0, 100.0]);
    }
}
