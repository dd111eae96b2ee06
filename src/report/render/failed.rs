//! What went wrong as tables: why reviewers failed results, and which planted faults they caught.

use super::table::{Table, bounds, count, fixed, interval, number, words};
use crate::domain::Reason;
use crate::report::Rate;
use crate::report::model::Report;

/// Failed results by reason, a column a metric; `None` where reviewers failed nothing.
pub(super) fn reasons(report: &Report) -> Option<Table> {
    let given = |reason| {
        let counts = report.rows.iter().map(move |row| row.failed_for(reason));
        counts.collect::<Vec<u64>>()
    };
    let reasons = Reason::ALL.into_iter().map(Some).chain([None]);
    let rows: Vec<_> = reasons
        .map(|reason| (reason, given(reason)))
        .filter(|(_, counts)| counts.iter().any(|n| *n > 0))
        .map(|(reason, counts)| {
            let mut cells = vec![Some(
                reason.map_or("no reason given", Reason::title).to_owned(),
            )];
            cells.extend(counts.into_iter().map(|n| Some(count(n))));
            cells
        })
        .collect();
    let heads = report.rows.iter().map(|row| number(row.metric.title(), 0));
    (!rows.is_empty()).then(|| Table {
        caption: "Results that reviewers failed, by the reasons they gave; one may have several."
            .to_owned(),
        columns: [words("Failed for")].into_iter().chain(heads).collect(),
        rows,
    })
}

/// Planted faults that reviewers caught; `None` where none were answered.
pub(super) fn caught(report: &Report) -> Option<Table> {
    let caught = report.caught.as_ref()?;
    let cells = |name: &str, rate: &Rate| {
        vec![
            Some(name.to_owned()),
            Some(count(rate.n)),
            Some(count(rate.count)),
            fixed(rate.share, 3),
            bounds(rate.ci95),
        ]
    };
    let by_fault = caught.by_fault.iter();
    let mut rows: Vec<_> = by_fault.map(|(name, rate)| cells(name, rate)).collect();
    rows.push(cells("all", &caught.all));
    Some(Table {
        caption: "Faults planted in good results that reviewers failed, of those that they answered: how well they find \
                  such faults, and no others."
            .to_owned(),
        columns: vec![
            words("Planted faults"),
            number("n", 0),
            number("caught", 0),
            number("share", 3),
            interval(report.interval.title()),
        ],
        rows,
    })
}

#[cfg(test)]
mod tests {
    use super::{caught, reasons};
    use crate::domain::{Reason, Verdict};
    use crate::report::{
        AttentionCheckRates, Rate, ReportAccumulator, TruthEvaluation, test_fixtures,
    };

    #[test]
    fn reasons_that_were_given_have_a_line_and_others_none() {
        let mut tally = ReportAccumulator::default();
        for (name, reason) in [("a", Some(Reason::Angle)), ("b", None)] {
            let mut pair = test_fixtures::done(name, 0.8, &[Verdict::Fail]);
            pair.metrics[0].verdicts[0].reason = reason;
            pair.metrics.truncate(1);
            tally.add(&pair, &TruthEvaluation::default());
        }
        let table = reasons(&tally.finish()).expect("two failures");
        let rows: Vec<Vec<&str>> = table
            .rows
            .iter()
            .map(|row| row.iter().flatten().map(String::as_str).collect())
            .collect();
        assert_eq!(
            rows,
            [["angle", "1", "0", "0"], ["no reason given", "1", "0", "0"]]
        );
        assert_eq!(reasons(&ReportAccumulator::default().finish()), None);
    }

    #[test]
    fn caught_faults_have_their_interval_by_kind_and_in_all() {
        let mut tally = ReportAccumulator::default();
        let turned = Rate::new(19, 20);
        tally.caught(AttentionCheckRates {
            all: Rate::new(20, 22),
            by_fault: [("turned", turned), ("cut", Rate::new(1, 2))].into(),
        });
        let table = caught(&tally.finish()).expect("22 were answered");
        let last: Vec<_> = table.rows[1].iter().flatten().collect();
        assert_eq!(last, ["turned", "20", "19", "0.950", "0.764-0.991"]);
        assert_eq!(table.rows[2][1].as_deref(), Some("22"));
        let mut none = ReportAccumulator::default();
        none.caught(AttentionCheckRates::default());
        assert_eq!(caught(&none.finish()), None);
    }
}
