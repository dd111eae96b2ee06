//! The report for a terminal of 80 columns.

use super::table::{self, ColumnFormat, Table, TableColumn};
use super::{coverage_tables, scored};
use crate::report::model::{Comparison, FailureGroup, Report};
use crate::report::score_comparison::in_words;

/// Columns of the terminal.
const WIDTH: usize = 80;
/// Failed pairs named a class.
const NAMED: usize = 5;

/// The report as aligned text.
pub(super) fn render(report: &Report) -> String {
    let mut blocks = vec![format!("{}\n", table::headline(report))];
    for found in table::tables(report)
        .into_iter()
        .chain(coverage_tables::short(report))
    {
        blocks.push(aligned(&found) + &wrapped("", &found.caption));
    }
    if !report.anybody_read() && report.progress.done > 0 {
        blocks.push(wrapped(
            "",
            "Nobody has read these results yet, so there is no Acc.",
        ));
    }
    blocks.extend((!report.comparisons.is_empty()).then(|| comparisons(report)));
    if let Some(found) = scored::comparisons(report) {
        let said = in_words(&report.score_comparisons);
        let said = said.iter().map(|words| wrapped("", words));
        blocks.push(
            said.collect::<String>() + "\n" + &aligned(&found) + &wrapped("", &found.caption),
        );
    }
    blocks.extend((!report.warnings.is_empty()).then(|| warnings(report)));
    blocks.extend(report.failures.iter().map(failures));
    blocks.join("\n")
}

/// A table with its columns padded, words to the left and numbers to the right.
pub(super) fn aligned(table: &Table) -> String {
    let widths: Vec<usize> = (0..table.columns.len())
        .map(|i| {
            let cells = table
                .rows
                .iter()
                .map(|row| shown(row[i].as_ref()).chars().count());
            let head = table.columns[i].head.chars().count();
            cells.fold(head, usize::max)
        })
        .collect();
    let heads: Vec<&str> = table.columns.iter().map(|column| column.head).collect();
    let mut text = line(&heads, &table.columns, &widths);
    for row in &table.rows {
        let cells: Vec<&str> = row.iter().map(|cell| shown(cell.as_ref())).collect();
        text += &line(&cells, &table.columns, &widths);
    }
    text
}

fn shown(cell: Option<&String>) -> &str {
    cell.map_or("-", String::as_str)
}

fn line(cells: &[&str], columns: &[TableColumn], widths: &[usize]) -> String {
    let padded: Vec<String> = cells
        .iter()
        .zip(columns)
        .zip(widths)
        .map(|((cell, column), width)| match column.kind {
            ColumnFormat::Words | ColumnFormat::IntervalMethod => format!("{cell:<width$}"),
            ColumnFormat::Number(_) => format!("{cell:>width$}"),
        })
        .collect();
    format!("{}\n", padded.join("  ").trim_end())
}

fn comparisons(report: &Report) -> String {
    report.comparisons.iter().map(comparison).collect()
}

fn comparison(found: &Comparison) -> String {
    let (title, basis) = (table::title(found), table::basis(found.basis));
    let said = wrapped("", &format!("{title}, by {basis}: {}", found.words));
    let (Some(p), Some(p_holm)) = (found.p, found.p_holm) else {
        return said;
    };
    let (p, p_holm) = (table::p_value(p), table::p_value(p_holm));
    let (a_only, b_only, n) = (found.a_only, found.b_only, found.n);
    format!(
        "{said}    right for one only: {a_only} / {b_only} of {n}; exact McNemar p {p}, Holm {p_holm}\n"
    )
}

fn warnings(report: &Report) -> String {
    report
        .warnings
        .iter()
        .map(|warning| wrapped("! ", warning))
        .collect()
}

fn failures(group: &FailureGroup) -> String {
    let mut lines = vec![format!("Failed: {} {}\n", group.count, group.class)];
    let named = group.pairs.iter().take(NAMED);
    lines.extend(named.map(|pair| format!("  {}  {}: {}\n", pair.id, pair.stage, pair.error)));
    let more = group.count.saturating_sub(NAMED as u64);
    lines.extend((more > 0).then(|| format!("  and {more} more\n")));
    lines.concat()
}

/// Words laid into lines, the first after `mark`, the others under it.
pub(super) fn wrapped(mark: &str, words: &str) -> String {
    let indent = " ".repeat(mark.chars().count());
    let (mut text, mut line) = (String::new(), mark.to_owned());
    let mut empty = true;
    for word in words.split_whitespace() {
        let longer = line.chars().count() + usize::from(!empty) + word.chars().count();
        if !empty && longer > WIDTH {
            text = text + &line + "\n";
            line.clone_from(&indent);
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(word);
        empty = false;
    }
    text + &line + "\n"
}

#[cfg(test)]
mod tests {
    use super::{render, wrapped};
    use crate::domain::{FailureClass, Verdict};
    use crate::report::{ReportAccumulator, TruthEvaluation, test_fixtures};

    const GOLDEN: &str = "\
4 pairs: 3 done, 1 failed

Method             n    Acc  95% Wilson    SSIM    IoU  IoU box   Dice
Non-luminous SSIM  3  0.500  0.095-0.905  0.810  0.750    0.900  0.857
Pixel density      3  0.500  0.095-0.905  0.810  0.750    0.900  0.857
Ensemble           3  0.500  0.095-0.905  0.810  0.750    0.900  0.857
Relief             3  0.500  0.095-0.905  0.810  0.750    0.900  0.857
Acc is the share passed of those passed or failed by reviewers (Non-luminous
SSIM 1 of 2, Pixel density 1 of 2, Ensemble 1 of 2, Relief 1 of 2); SSIM, IoU
and Dice are means over the n finished pairs, by pixel; IoU box is of bounding
boxes.

Verdicts           read  unread  passed  failed  unsure  stale
Non-luminous SSIM     2       1       1       1       0      0
Pixel density         2       1       1       1       0      0
Ensemble              2       1       1       1       0      0
Relief                2       1       1       1       0      0
Verdicts by result; stale ones have a verdict for an older result only.

Failed for       Non-luminous SSIM  Pixel density  Ensemble  Relief
no reason given                  1              1         1       1
Results that reviewers failed, by the reasons they gave; one may have several.

Truth              n    Acc  95% Wilson   in 5°  angle °  landm. %  mask IoU
Non-luminous SSIM  1  1.000  0.207-1.000  1.000     0.50      2.00     0.900
Pixel density      1  1.000  0.207-1.000  1.000     0.50      2.00     0.900
Ensemble           1  1.000  0.207-1.000  1.000     0.50      2.00     0.900
Relief             1  1.000  0.207-1.000  1.000     0.50      2.00     0.900
Against the true alignments. Acc here: angle within 5 degrees, landmarks within
5 % of the character's height, mask IoU with the true stroke tops at least 0.7.
Angle, landmarks and mask IoU are medians.
";

    fn report() -> crate::report::Report {
        let mut tally = ReportAccumulator::default();
        let none = TruthEvaluation::default();
        tally.add(&test_fixtures::done("a", 0.75, &[Verdict::Pass]), &none);
        tally.add(&test_fixtures::done("b", 0.75, &[Verdict::Fail]), &none);
        tally.add(
            &test_fixtures::done("c", 0.75, &[]),
            &test_fixtures::truth(0.5, 2.0, 0.9),
        );
        tally.add(
            &test_fixtures::failed("d", FailureClass::BadInput, "d.stl is empty"),
            &none,
        );
        tally.finish()
    }

    #[test]
    fn tables_are_aligned() {
        let text = render(&report());
        assert!(text.starts_with(GOLDEN), "{text}");
        assert!(
            text.contains("Failed: 1 bad_input\n  d  fit: d.stl is empty\n"),
            "{text}"
        );
        assert!(
            text.contains("! In no row, of 4 in all: 1 failed.\n"),
            "{text}"
        );
    }

    #[test]
    fn no_line_is_wider_than_a_terminal() {
        let text = render(&report());
        for line in text.lines() {
            assert!(line.chars().count() <= 80, "{line:?}");
        }
    }

    #[test]
    fn three_rules_stand_side_by_side_where_two_have_read() {
        let mut tally = ReportAccumulator::default();
        for (name, second) in [("a", Verdict::Pass), ("b", Verdict::Fail)] {
            let pair = test_fixtures::done(name, 0.75, &[Verdict::Pass, second]);
            tally.add(&pair, &TruthEvaluation::default());
        }
        let text = render(&tally.finish());
        let wanted = "\
Rules              twice  either  n  settled  n   both  n
Non-luminous SSIM      2   0.500  2    1.000  1  1.000  2
";
        assert!(text.contains(wanted), "{text}");
        assert!(!render(&report()).contains("Rules"));
    }

    #[test]
    fn an_unread_project_says_so() {
        let mut tally = ReportAccumulator::default();
        tally.add(
            &test_fixtures::done("a", 0.75, &[]),
            &TruthEvaluation::default(),
        );
        let text = render(&tally.finish());
        assert!(text.contains("Nobody has read these results yet"), "{text}");
        assert!(
            text.contains("Ensemble           1    -  -           0.810"),
            "{text}"
        );
    }

    #[test]
    fn wrapping_breaks_between_words_only() {
        let text = wrapped("! ", &"word ".repeat(40));
        assert!(text.lines().count() > 2);
        assert!(text.lines().skip(1).all(|line| line.starts_with("  word")));
        let long = "x".repeat(200);
        assert_eq!(wrapped("", &long), format!("{long}\n"));
    }
}
