//! How the metrics cut and how long the stages took, as tables.

use super::table::{Table, count, fixed, number, words};
use crate::report::model::Report;

/// The distribution of thresholds; `None` without results.
pub(super) fn thresholds(report: &Report) -> Option<Table> {
    let found = report.thresholds.iter();
    let rows: Vec<_> = found
        .map(|cuts| {
            vec![
                Some(cuts.metric.title().to_owned()),
                Some(count(cuts.n)),
                fixed(Some(cuts.p5), 3),
                fixed(Some(cuts.median), 3),
                fixed(Some(cuts.p95), 3),
            ]
        })
        .collect();
    (!rows.is_empty()).then(|| Table {
        caption: "Heights at which the relief is cut, from 0, the lowest point of a depth map, to 1, its highest: \
                  median, and the percentiles between which nine in ten lie."
            .to_owned(),
        columns: vec![
            words("ThresholdDistribution"),
            number("n", 0),
            number("5 %", 3),
            number("median", 3),
            number("95 %", 3),
        ],
        rows,
    })
}

/// Computing times by stage; `None` where they are not told.
pub(super) fn times(report: &Report) -> Option<Table> {
    let found = report.times.iter();
    let rows: Vec<_> = found
        .map(|time| {
            vec![
                Some(time.stage.name().to_owned()),
                Some(count(time.n)),
                fixed(Some(time.median_ms), 0),
                fixed(Some(time.p95_ms), 0),
                fixed(Some(time.total_s), 1),
            ]
        })
        .collect();
    (!rows.is_empty()).then(|| Table {
        caption: "Computing time of the current results by stage, on one core: median and 95th percentile in \
                  milliseconds, sum in seconds."
            .to_owned(),
        columns: vec![
            words("StageTimeSamples"),
            number("n", 0),
            number("median ms", 0),
            number("95 % ms", 0),
            number("sum s", 1),
        ],
        rows,
    })
}

#[cfg(test)]
mod tests {
    use super::{thresholds, times};
    use crate::domain::Stage;
    use crate::report::{ReportAccumulator, TruthEvaluation, test_fixtures};

    #[test]
    fn times_are_told_until_they_are_left_out_and_thresholds_always() {
        let mut tally = ReportAccumulator::default();
        let mut pair = test_fixtures::done("a", 0.8, &[]);
        pair.stages = vec![test_fixtures::stage(Stage::Fit, 12)];
        tally.add(&pair, &TruthEvaluation::default());
        let report = tally.finish();
        let table = times(&report).expect("one stage");
        let row: Vec<_> = table.rows[0].iter().flatten().collect();
        assert_eq!(row, ["fit", "1", "12", "12", "0.0"]);
        let report = report.without_times();
        assert_eq!(times(&report), None);
        let table = thresholds(&report).expect("four results");
        let row: Vec<_> = table.rows[3].iter().flatten().collect();
        assert_eq!(row, ["Relief", "1", "0.458", "0.458", "0.458"]);
    }
}
