//! Accuracy against coverage as tables: a line a metric for a terminal, every number for a document.

use super::table::{Table, bounds, count, fixed, interval, number, words};
use crate::report::model::{Basis, Report, RiskCoverage, RiskCoveragePoint};
use crate::report::risk_coverage::{KEPT_PERCENT, LEAST_PERCENT};

/// Heads of the columns of [`short`], one for each of [`KEPT_PERCENT`].
const HEADS: [&str; KEPT_PERCENT.len()] = ["100 %", "99 %", "97 %", "95 %", "90 %", "80 %", "50 %"];

/// A table for each basis there is, a line a metric.
pub(super) fn short(report: &Report) -> Vec<Table> {
    by_basis(report, |basis, curves| {
        let mut columns = vec![words(title(basis)), number("n", 0)];
        columns.extend(HEADS.map(|head| number(head, 3)));
        Table {
            caption: caption(basis, curves),
            columns,
            rows: curves.iter().map(|curve| short_row(curve)).collect(),
        }
    })
}

/// A table for each basis there is, a line a metric and coverage.
pub(super) fn full(report: &Report) -> Vec<Table> {
    by_basis(report, |basis, curves| Table {
        caption: caption(basis, curves),
        columns: vec![
            words(title(basis)),
            number("kept %", 0),
            number("n", 0),
            number("Acc", 3),
            interval(report.interval.title()),
            number("least confidence", 3),
        ],
        rows: curves.iter().flat_map(|curve| full_rows(curve)).collect(),
    })
}

fn by_basis(report: &Report, table: impl Fn(Basis, &[&RiskCoverage]) -> Table) -> Vec<Table> {
    [Basis::Verdicts, Basis::Truth]
        .into_iter()
        .map(|basis| {
            let of_basis = report.coverage.iter().filter(|curve| curve.basis == basis);
            (basis, of_basis.collect::<Vec<_>>())
        })
        .filter(|(_, curves)| !curves.is_empty())
        .map(|(basis, curves)| table(basis, &curves))
        .collect()
}

const fn title(basis: Basis) -> &'static str {
    match basis {
        Basis::Verdicts => "Kept, by reviewers",
        Basis::Truth => "Kept, by truth",
    }
}

/// What the table shows, and how many failures the confidence tells.
fn caption(basis: Basis, curves: &[&RiskCoverage]) -> String {
    let judge = match basis {
        Basis::Verdicts => "by reviewers",
        Basis::Truth => "by truth",
    };
    let wrong = curves.iter().filter(|curve| curve.failures > 0);
    let mut sentences = vec![format!(
        "Acc {judge} when only so many percent of the results are kept, the most confident."
    )];
    sentences.extend(wrong.map(|curve| told(curve)));
    sentences.join(" ")
}

/// How many failures of a metric its confidence tells.
fn told(curve: &RiskCoverage) -> String {
    format!(
        "{}: of the {}, {} among the {LEAST_PERCENT} % least confident ({} of {}).",
        curve.metric.title(),
        counted(curve.failures, "failure"),
        verb(curve.failures_in_least),
        curve.least_n,
        curve.n
    )
}

/// `1 failure`, `2 failures`.
fn counted(n: u64, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// `1 is`, `2 are`.
fn verb(n: u64) -> String {
    format!("{n} {}", if n == 1 { "is" } else { "are" })
}

fn short_row(curve: &RiskCoverage) -> Vec<Option<String>> {
    let mut cells = vec![Some(curve.metric.title().to_owned()), Some(count(curve.n))];
    cells.extend(curve.points.iter().map(|point| fixed(point.acc, 3)));
    cells
}

fn full_rows(curve: &RiskCoverage) -> impl Iterator<Item = Vec<Option<String>>> {
    curve.points.iter().map(|point| full_row(curve, point))
}

fn full_row(curve: &RiskCoverage, point: &RiskCoveragePoint) -> Vec<Option<String>> {
    vec![
        Some(curve.metric.title().to_owned()),
        fixed(Some(100.0 * point.coverage), 0),
        Some(count(point.n)),
        fixed(point.acc, 3),
        bounds(point.acc_ci95),
        fixed(point.least_confidence, 3),
    ]
}

#[cfg(test)]
mod tests {
    use super::{HEADS, full, short};
    use crate::report::risk_coverage::KEPT_PERCENT;
    use crate::report::{ReportAccumulator, TruthEvaluation, test_fixtures};

    #[test]
    fn heads_name_the_coverages() {
        assert_eq!(
            HEADS.map(str::to_owned),
            KEPT_PERCENT.map(|p| format!("{p} %"))
        );
    }

    #[test]
    fn failures_that_confidence_tells_are_counted_in_the_caption() {
        let mut tally = ReportAccumulator::default();
        for (i, (confidence, angle_deg)) in [(0.9, 1.0), (0.2, 170.0), (0.8, 1.0)]
            .into_iter()
            .enumerate()
        {
            let pair = test_fixtures::sure(&format!("p{i}"), confidence);
            tally.add(&pair, &test_fixtures::truth(angle_deg, 1.0, 0.9));
        }
        let report = tally.finish();
        let [table] = &short(&report)[..] else {
            panic!("one basis: nobody has read");
        };
        let said = "Ensemble: of the 1 failure, 1 is among the 3 % least confident (1 of 3).";
        assert!(table.caption.contains(said), "{}", table.caption);
        let row: Vec<_> = table.rows[3].iter().flatten().map(String::as_str).collect();
        assert_eq!(row[..4], ["Relief", "3", "0.667", "1.000"]);
        let [table] = &full(&report)[..] else {
            panic!("one basis: nobody has read");
        };
        assert_eq!(table.rows.len(), report.rows.len() * KEPT_PERCENT.len());
        let row: Vec<_> = table.rows[1].iter().flatten().map(String::as_str).collect();
        let wanted = [
            "Non-luminous SSIM",
            "99",
            "2",
            "1.000",
            "0.342-1.000",
            "0.800",
        ];
        assert_eq!(row, wanted);
    }

    #[test]
    fn without_confidence_there_is_no_table() {
        let mut tally = ReportAccumulator::default();
        tally.add(
            &test_fixtures::done("a", 0.8, &[]),
            &test_fixtures::truth(1.0, 1.0, 0.9),
        );
        tally.add(&test_fixtures::sure("b", 0.8), &TruthEvaluation::default());
        let report = tally.finish();
        assert!(short(&report).is_empty() && full(&report).is_empty());
    }
}
