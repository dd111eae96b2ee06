//! The tables of a report with their cells as text: what text, Markdown and LaTeX have in common.

use super::{failed, scored, work};
use crate::report::adjudication::AdjudicationRules;
use crate::report::manual_alignment::ManualAlignmentErrors;
use crate::report::model::{Basis, Comparison, MetricRow, Report, TruthSummary};

/// A table of text cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Table {
    /// One sentence on what it shows.
    pub(super) caption: String,
    /// Its columns.
    pub(super) columns: Vec<TableColumn>,
    /// Its rows; `None` is a quantity that does not exist.
    pub(super) rows: Vec<Vec<Option<String>>>,
}

/// A column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TableColumn {
    /// What stands over it.
    pub(super) head: &'static str,
    /// How its cells stand.
    pub(super) kind: ColumnFormat,
}

/// How the cells of a column stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ColumnFormat {
    /// Words, from the left.
    Words,
    /// Two numbers with a hyphen between them, from the left.
    IntervalMethod,
    /// Numbers with so many decimals, aligned at the point.
    Number(usize),
}

/// A column of words.
pub(super) const fn words(head: &'static str) -> TableColumn {
    TableColumn {
        head,
        kind: ColumnFormat::Words,
    }
}

/// A column of intervals.
pub(super) const fn interval(head: &'static str) -> TableColumn {
    TableColumn {
        head,
        kind: ColumnFormat::IntervalMethod,
    }
}

/// A column of numbers with so many decimals.
pub(super) const fn number(head: &'static str, decimals: usize) -> TableColumn {
    TableColumn {
        head,
        kind: ColumnFormat::Number(decimals),
    }
}

/// The tables a report calls for: scores always, verdicts and truth where there are any.
pub(super) fn tables(report: &Report) -> Vec<Table> {
    let mut tables = vec![scores(report)];
    tables.extend(scored::intervals(report));
    tables.extend(report.anybody_read().then(|| verdicts(report)));
    tables.extend(rules(report));
    tables.extend(failed::reasons(report));
    tables.extend(failed::caught(report));
    tables.extend(report.has_truth().then(|| truth(report)));
    tables.extend(by_hand(report));
    tables.extend(work::thresholds(report));
    tables.extend(work::times(report));
    tables
}

/// The paper's table.
pub(super) fn scores(report: &Report) -> Table {
    Table {
        caption: format!(
            "Acc is the share passed of those passed or failed by reviewers{}; SSIM, IoU and Dice are means over the \
             n finished pairs, by pixel; IoU box is of bounding boxes.",
            passed(report)
        ),
        columns: vec![
            words("Method"),
            number("n", 0),
            number("Acc", 3),
            interval(report.interval.title()),
            number("SSIM", 3),
            number("IoU", 3),
            number("IoU box", 3),
            number("Dice", 3),
        ],
        rows: report.rows.iter().map(score_cells).collect(),
    }
}

/// Of how many results Acc is the share, such as ` (Ensemble 586 of 587)`.
fn passed(report: &Report) -> String {
    let told = |row: &MetricRow| row.passed + row.failed;
    let read = report.rows.iter().filter(|row| told(row) > 0);
    let counts: Vec<String> = read
        .map(|row| format!("{} {} of {}", row.metric.title(), row.passed, told(row)))
        .collect();
    if counts.is_empty() {
        return String::new();
    }
    format!(" ({})", counts.join(", "))
}

fn score_cells(row: &MetricRow) -> Vec<Option<String>> {
    vec![
        Some(row.metric.title().to_owned()),
        Some(count(row.n)),
        fixed(row.acc, 3),
        bounds(row.acc_ci95),
        fixed(row.ssim, 3),
        fixed(row.iou, 3),
        fixed(row.iou_box, 3),
        fixed(row.dice, 3),
    ]
}

/// Who said what.
pub(super) fn verdicts(report: &Report) -> Table {
    let cells = |row: &MetricRow| {
        vec![
            Some(row.metric.title().to_owned()),
            Some(count(row.read)),
            Some(count(row.n - row.read)),
            Some(count(row.passed)),
            Some(count(row.failed)),
            Some(count(row.unsure)),
            Some(count(row.stale)),
        ]
    };
    Table {
        caption: "Verdicts by result; stale ones have a verdict for an older result only."
            .to_owned(),
        columns: vec![
            words("Verdicts"),
            number("read", 0),
            number("unread", 0),
            number("passed", 0),
            number("failed", 0),
            number("unsure", 0),
            number("stale", 0),
        ],
        rows: report.rows.iter().map(cells).collect(),
    }
}

/// Acc under three rules, where two reviewers have told of the same result.
pub(super) fn rules(report: &Report) -> Option<Table> {
    let told_twice = |row: &MetricRow| row.rules.as_ref().is_some_and(|rules| rules.told_twice > 0);
    report.rows.iter().any(told_twice).then(|| Table {
        caption: "Acc if one reviewer who fails it is enough, if a third settles conflicts (the Acc above), and if both \
                  must fail it; n are the results told of, twice those that two reviewers told of."
            .to_owned(),
        columns: vec![
            words("Rules"),
            number("twice", 0),
            number("either", 3),
            number("n", 0),
            number("settled", 3),
            number("n", 0),
            number("both", 3),
            number("n", 0),
        ],
        rows: report.rows.iter().map(rule_cells).collect(),
    })
}

fn rule_cells(row: &MetricRow) -> Vec<Option<String>> {
    let rules = row.rules.as_ref();
    let mut cells = vec![
        Some(row.metric.title().to_owned()),
        rules.map(|rules| count(rules.told_twice)),
    ];
    for i in 0..AdjudicationRules::NAMES.len() {
        let rate = rules.map(|rules| rules.rates()[i]);
        cells.push(fixed(rate.and_then(|rate| rate.share), 3));
        cells.push(rate.map(|rate| count(rate.n)));
    }
    cells
}

/// Agreement with true alignments.
pub(super) fn truth(report: &Report) -> Table {
    Table {
        caption: "Against the true alignments. Acc here: angle within 5 degrees, landmarks within 5 % of the \
                  character's height, mask IoU with the true stroke tops at least 0.7. Angle, landmarks and \
                  mask IoU are medians."
            .to_owned(),
        columns: vec![
            words("Truth"),
            number("n", 0),
            number("Acc", 3),
            interval(report.interval.title()),
            number("in 5\u{b0}", 3),
            number("angle \u{b0}", 2),
            number("landm. %", 2),
            number("mask IoU", 3),
        ],
        rows: report.rows.iter().map(truth_cells).collect(),
    }
}

fn truth_cells(row: &MetricRow) -> Vec<Option<String>> {
    let truth = row.truth.as_ref();
    let value = |read: fn(&TruthSummary) -> Option<f64>| truth.and_then(read);
    vec![
        Some(row.metric.title().to_owned()),
        Some(count(truth.map_or(0, |truth| truth.n))),
        fixed(value(|truth| truth.acc), 3),
        bounds(truth.and_then(|truth| truth.acc_ci95)),
        fixed(value(|truth| truth.angle_le_5deg), 3),
        fixed(value(|truth| truth.angle_median_deg), 2),
        fixed(value(|truth| truth.tre_median_pct), 2),
        fixed(value(|truth| truth.mask_iou_median), 3),
    ]
}

/// Distance from alignments by hand; `None` where people made none.
pub(super) fn by_hand(report: &Report) -> Option<Table> {
    let found: Vec<(&MetricRow, &ManualAlignmentErrors)> = report
        .rows
        .iter()
        .filter_map(|row| Some((row, row.by_hand.as_ref()?)))
        .collect();
    let cells = |(row, by_hand): &(&MetricRow, &ManualAlignmentErrors)| {
        vec![
            Some(row.metric.title().to_owned()),
            Some(count(by_hand.n)),
            fixed(by_hand.angle_le_5deg, 3),
            fixed(by_hand.angle_median_deg, 2),
            fixed(by_hand.angle_p95_deg, 2),
            fixed(by_hand.shift_median_pct, 2),
            fixed(by_hand.shift_p95_pct, 2),
            fixed(by_hand.scale_median_pct, 2),
            fixed(by_hand.scale_p95_pct, 2),
        ]
    };
    (!found.is_empty()).then(|| Table {
        caption: "Against people's alignments by hand, on the n pairs that have one: share turned by at most 5 degrees; \
                  turn, shift in percent of the relief's longer side and difference in scale, each as median and 95th \
                  percentile."
            .to_owned(),
        columns: vec![
            words("By hand"),
            number("n", 0),
            number("in 5\u{b0}", 3),
            number("angle \u{b0}", 2),
            number("95 %", 2),
            number("shift %", 2),
            number("95 %", 2),
            number("scale %", 2),
            number("95 %", 2),
        ],
        rows: found.iter().map(cells).collect(),
    })
}

/// The comparisons as a table without their words; `None` when there are none.
pub(super) fn comparisons(report: &Report) -> Option<Table> {
    let test = report.comparisons.first()?.test;
    let cells = |found: &Comparison| {
        vec![
            Some(title(found)),
            Some(basis(found.basis).to_owned()),
            Some(count(found.n)),
            Some(count(found.a_only)),
            Some(count(found.b_only)),
            found.p.map(p_value),
            found.p_holm.map(p_value),
        ]
    };
    Some(Table {
        caption: format!(
            "Metrics on the same pairs ({test}; Holm's correction over the comparisons of one basis)."
        ),
        columns: vec![
            words("Comparison"),
            words("by"),
            number("n", 0),
            number("first only", 0),
            number("second only", 0),
            words("p"),
            words("Holm"),
        ],
        rows: report.comparisons.iter().map(cells).collect(),
    })
}

/// The same with what follows from each comparison.
pub(super) fn comparisons_in_words(report: &Report) -> Option<Table> {
    let mut table = comparisons(report)?;
    table.columns.push(words("In words"));
    for (row, found) in table.rows.iter_mut().zip(&report.comparisons) {
        row.push(Some(found.words.clone()));
    }
    Some(table)
}

/// The two metrics of a comparison.
pub(super) fn title(comparison: &Comparison) -> String {
    format!("{} v. {}", comparison.a.title(), comparison.b.title())
}

/// What a comparison counts by.
pub(super) const fn basis(basis: Basis) -> &'static str {
    match basis {
        Basis::Verdicts => "verdicts",
        Basis::Truth => "truth",
    }
}

/// A p of three decimals, or that it is smaller.
pub(super) fn p_value(p: f64) -> String {
    if p < 0.0005 {
        "<0.001".to_owned()
    } else {
        format!("{p:.3}")
    }
}

/// How far the pairs are, in one line: `24 pairs: 22 done, 2 failed`.
pub(super) fn headline(report: &Report) -> String {
    let progress = report.progress;
    let rest = [
        (progress.failed, "failed"),
        (progress.pending, "not finished"),
    ]
    .into_iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, what)| format!(", {n} {what}"));
    let noun = if report.pairs == 1 { "pair" } else { "pairs" };
    let mut line = format!("{} {noun}: {} done", report.pairs, progress.done);
    line.extend(rest);
    line
}

/// A cell that counts.
pub(super) fn count(n: u64) -> String {
    n.to_string()
}

/// A cell with so many decimals.
pub(super) fn fixed(value: Option<f64>, decimals: usize) -> Option<String> {
    value.map(|value| format!("{value:.decimals$}"))
}

/// A cell with an interval, three decimals.
pub(super) fn bounds(bounds: Option<[f64; 2]>) -> Option<String> {
    bounds.map(|[low, high]| format!("{low:.3}-{high:.3}"))
}
