//! Risk-coverage curves as tables: short tables for a terminal, full tables for documents.

use super::table::Table;
use crate::comparison::Basis;
use crate::model::Report;
use crate::risk_coverage::{COVERAGE_PERCENT, LEAST_CONFIDENT_PERCENT, RiskCoverageCurve};
use mocban_results::number_format::NumberStyle::{Percent, Share};
use mocban_results::number_format::{counted, format_count, format_number};

/// Column headers of [`short_tables`], one for each coverage in [`COVERAGE_PERCENT`].
const HEADERS: [&str; COVERAGE_PERCENT.len()] =
    ["100 %", "99 %", "97 %", "95 %", "90 %", "80 %", "50 %"];

/// Returns a table for each basis, with a row for each metric.
pub(super) fn short_tables(report: &Report) -> Vec<Table> {
    by_basis(report, |basis, curves| {
        let mut table = Table::of(curves.iter().copied())
            .text(title(basis), |curve| curve.metric.title())
            .count("n", |curve| curve.n);
        for (i, header) in HEADERS.into_iter().enumerate() {
            table = table.share(header, |curve| curve.points.get(i)?.acc);
        }
        table.caption(id(basis), caption(basis, curves))
    })
}

/// Returns a table for each basis, with a row for each metric and coverage.
pub(super) fn full_tables(report: &Report) -> Vec<Table> {
    by_basis(report, |basis, curves| {
        let points = curves.iter().flat_map(|curve| {
            let points = curve.points.iter();
            points.map(|point| (curve.metric.title(), point))
        });
        Table::of(points)
            .text(title(basis), |(metric, _)| *metric)
            .number("coverage %", Percent, |(_, point)| {
                Some(100.0 * point.coverage)
            })
            .count("n", |(_, point)| point.n)
            .share("Acc %", |(_, point)| point.acc)
            .interval(report.interval.title(), Share, |(_, point)| point.acc_ci95)
            .score("least confidence", |(_, point)| point.least_confidence)
            .caption(id(basis), caption(basis, curves))
    })
}

fn by_basis(report: &Report, table: impl Fn(Basis, &[&RiskCoverageCurve]) -> Table) -> Vec<Table> {
    let of_basis = |basis| {
        let curves = report.risk_coverage.iter();
        let curves: Vec<_> = curves.filter(|curve| curve.basis == basis).collect();
        (!curves.is_empty()).then(|| table(basis, &curves))
    };
    Basis::ALL.into_iter().filter_map(of_basis).collect()
}

const fn id(basis: Basis) -> &'static str {
    match basis {
        Basis::Verdicts => "coverage-verdicts",
        Basis::Truth => "coverage-truth",
    }
}

const fn title(basis: Basis) -> &'static str {
    match basis {
        Basis::Verdicts => "Coverage, verdicts",
        Basis::Truth => "Coverage, truth",
    }
}

fn caption(basis: Basis, curves: &[&RiskCoverageCurve]) -> String {
    let mut sentences = vec![format!(
        "Acc in percent by {} of the most confident results. Coverage is the share of results that is kept.",
        basis.title()
    )];
    sentences.extend(curves.iter().filter_map(|curve| failures(curve)));
    sentences.join(" ")
}

/// Returns a sentence that counts a metric's failures among its least confident results. Returns `None` if there are no
/// failures, or if 3 % of the results is less than one result.
fn failures(curve: &RiskCoverageCurve) -> Option<String> {
    let is_enough = curve.n * LEAST_CONFIDENT_PERCENT >= 100;
    // The number is rounded up, so its share is above 3 %.
    let percent = 100.0 * curve.least_n as f64 / curve.n as f64;
    (is_enough && curve.failures > 0).then(|| {
        format!(
            "{}: the least confident {} of {} ({} %) hold {} of {}.",
            curve.metric.title(),
            format_count(curve.least_n),
            counted(curve.n, "result"),
            format_number(percent, Percent),
            format_count(curve.failures_in_least),
            counted(curve.failures, "failure")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::{HEADERS, full_tables, short_tables};
    use crate::risk_coverage::COVERAGE_PERCENT;
    use crate::{ReportAccumulator, test_fixtures};
    use mocban_results::TruthEvaluation;

    #[test]
    fn headers_name_the_coverages() {
        let wanted = COVERAGE_PERCENT.map(|percent| format!("{percent} %"));
        assert_eq!(HEADERS.map(str::to_owned), wanted);
    }

    #[test]
    fn failures_among_the_least_confident_are_counted_in_the_caption() {
        let mut report = ReportAccumulator::default();
        for i in 0..34_u32 {
            let (confidence, angle_deg) = match i {
                7 => (0.2, 170.0),
                9 => (0.9, 170.0),
                _ => (0.8, 1.0),
            };
            let pair = test_fixtures::with_confidence(&format!("p{i:02}"), confidence);
            report.add(&pair, &test_fixtures::truth(angle_deg, 1.0, 0.9));
        }
        let report = report.finish();
        let [table] = &short_tables(&report)[..] else {
            panic!("one basis: there are no verdicts");
        };
        let wanted = "Ensemble: the least confident 2 of 34 results (5.9 %) hold 1 of 2 failures.";
        assert!(table.caption.contains(wanted), "{}", table.caption);
        let row: Vec<_> = table.rows[3].iter().flatten().map(String::as_str).collect();
        assert_eq!(row[..4], ["Relief", "34", "94.1", "97.0"]);
        let [table] = &full_tables(&report)[..] else {
            panic!("one basis: there are no verdicts");
        };
        assert_eq!(table.rows.len(), report.rows.len() * COVERAGE_PERCENT.len());
        let row: Vec<_> = table.rows[1].iter().flatten().map(String::as_str).collect();
        let wanted = [
            "Non-luminous SSIM",
            "99.0",
            "33",
            "97.0",
            "84.7–99.5",
            "0.800",
        ];
        assert_eq!(row, wanted);
    }

    #[test]
    fn three_percent_of_few_results_are_not_one_result() {
        let caption = |n: u32| {
            let mut report = ReportAccumulator::default();
            for i in 0..n {
                let pair = test_fixtures::with_confidence(&format!("p{i:02}"), f64::from(i) / 50.0);
                report.add(&pair, &test_fixtures::truth(170.0, 1.0, 0.9));
            }
            short_tables(&report.finish())[0].caption.clone()
        };
        for few in [2, 33] {
            assert!(!caption(few).contains("hold"), "{}", caption(few));
        }
        assert!(
            caption(34).contains("hold 2 of 34 failures"),
            "{}",
            caption(34)
        );
    }

    #[test]
    fn without_confidence_there_is_no_table() {
        let mut report = ReportAccumulator::default();
        report.add(
            &test_fixtures::done("a", 0.8, &[]),
            &test_fixtures::truth(1.0, 1.0, 0.9),
        );
        report.add(
            &test_fixtures::with_confidence("b", 0.8),
            &TruthEvaluation::default(),
        );
        let report = report.finish();
        assert!(short_tables(&report).is_empty() && full_tables(&report).is_empty());
    }
}
