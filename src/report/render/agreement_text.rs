//! The agreement of reviewers for a terminal of 80 columns.

use super::table::{Table, bounds, count, fixed, interval, number, words};
use super::text::{aligned, wrapped};
use crate::report::agreement::ENOUGH;
use crate::report::rate::Rate;
use crate::report::reviewer_agreement::{ReviewerAgreement, ReviewerPair, ReviewerRecord};

/// The agreement as aligned tables; ends with a line end.
pub fn agree_text(found: &ReviewerAgreement) -> String {
    if found.reviewers.is_empty() {
        return "Nobody has read a result yet.\n".to_owned();
    }
    let mut blocks = Vec::new();
    if found.reviewer_pairs.is_empty() {
        blocks.push(wrapped(
            "",
            "No two reviewers have read the same result yet, so there is no agreement to tell.",
        ));
    } else {
        blocks.extend([agreement(found), failures(found)].map(|table| shown(&table)));
    }
    blocks.push(shown(&reviewers(found)));
    blocks.push(format!("Conflicts waiting: {}\n", found.conflicts));
    blocks.join("\n")
}

fn shown(table: &Table) -> String {
    aligned(table) + &wrapped("", &table.caption)
}

fn names(two: &ReviewerPair) -> String {
    format!("{}, {}", two.a, two.b)
}

fn agreement(found: &ReviewerAgreement) -> Table {
    let cells = |two: &ReviewerPair| {
        let agreement = &two.agreement;
        let is_enough = |value: Option<String>| value.filter(|_| agreement.enough);
        let few = (!agreement.enough).then(|| "too few to tell".to_owned());
        vec![
            Some(names(two)),
            Some(count(agreement.n)),
            fixed(agreement.agreement, 3),
            bounds(agreement.agreement_ci95),
            is_enough(fixed(agreement.kappa, 3)),
            is_enough(fixed(agreement.ac1, 3)),
            few.or_else(|| Some(String::new())),
        ]
    };
    Table {
        caption: format!(
            "Over the n results that both passed or failed; under {ENOUGH} they are too few. Kappa falls to 0 where \
             failures are rare, however well reviewers agree; AC1 does not."
        ),
        columns: vec![
            words("Reviewers"),
            number("n", 0),
            number("agreement", 3),
            interval("95% Wilson"),
            number("kappa", 3),
            number("AC1", 3),
            words(""),
        ],
        rows: found.reviewer_pairs.iter().map(cells).collect(),
    }
}

fn failures(found: &ReviewerAgreement) -> Table {
    let cells = |two: &ReviewerPair| {
        vec![
            Some(names(two)),
            Some(count(two.agreement.flagged)),
            Some(count(two.agreement.flagged_by_both)),
            Some(count(two.agreement.unsure)),
        ]
    };
    Table {
        caption: "Of the results that one failed at least, those that both failed; unsure are those that both read \
                  and one could not tell."
            .to_owned(),
        columns: vec![
            words("Failures"),
            number("by anyone", 0),
            number("by both", 0),
            number("unsure", 0),
        ],
        rows: found.reviewer_pairs.iter().map(cells).collect(),
    }
}

fn reviewers(found: &ReviewerAgreement) -> Table {
    let cells = |reviewer: &ReviewerRecord| {
        vec![
            Some(reviewer.reviewer.clone()),
            Some(count(reviewer.read)),
            out_of(&reviewer.repeats),
            bounds(reviewer.repeats.ci95),
            out_of(&reviewer.caught),
            bounds(reviewer.caught.ci95),
        ]
    };
    let mut rows: Vec<_> = found.reviewers.iter().map(cells).collect();
    if found.reviewers.len() > 1 {
        let caught = &found.caught;
        let (all, none) = (Some("all".to_owned()), None);
        rows.push(vec![
            all,
            none.clone(),
            none.clone(),
            none,
            out_of(caught),
            bounds(caught.ci95),
        ]);
    }
    Table {
        caption: "Repeats are results shown twice that got the same verdict twice; caught are the planted faults that \
                  were failed: it tells of such faults only."
            .to_owned(),
        columns: vec![
            words("Reviewer"),
            number("read", 0),
            words("repeats"),
            interval("95% Wilson"),
            words("caught"),
            interval("95% Wilson"),
        ],
        rows,
    }
}

/// `19 of 20`; `None` of nothing.
fn out_of(rate: &Rate) -> Option<String> {
    (rate.n > 0).then(|| format!("{} of {}", rate.count, rate.n))
}

#[cfg(test)]
mod tests {
    use super::agree_text;
    use crate::domain::Verdict;
    use crate::report::agreement::Crosstab;
    use crate::report::{Rate, ReviewerAgreement, ReviewerPair, ReviewerRecord};

    fn reviewer_pairs(pass: u64, contradicting: u64) -> ReviewerAgreement {
        let mut crosstab = Crosstab::default();
        (0..pass).for_each(|_| crosstab.add(Verdict::Pass, Verdict::Pass));
        for i in 0..contradicting {
            let both = [Verdict::Pass, Verdict::Fail];
            crosstab.add(both[usize::from(i > 0)], both[usize::from(i == 0)]);
        }
        let reviewer = |name: &str, caught| ReviewerRecord {
            reviewer: name.to_owned(),
            read: pass + contradicting,
            caught,
            ..ReviewerRecord::default()
        };
        ReviewerAgreement {
            schema: 1,
            conflicts: contradicting,
            reviewer_pairs: vec![ReviewerPair {
                a: "lan".to_owned(),
                b: "minh".to_owned(),
                agreement: crosstab.finish(),
            }],
            reviewers: vec![
                reviewer("lan", Rate::new(19, 20)),
                reviewer("minh", Rate::default()),
            ],
            caught: Rate::new(19, 20),
        }
    }

    const GOLDEN: &str = "\
Reviewers      n  agreement  95% Wilson    kappa    AC1
lan, minh  587      0.995  0.985-0.998  -0.002  0.995
";

    #[test]
    fn rare_failures_are_told_four_ways() {
        let text = agree_text(&reviewer_pairs(584, 3));
        assert!(text.starts_with(GOLDEN), "{text}");
        for part in [
            "Failures   by anyone  by both  unsure\nlan, minh          3        0       0\n",
            "lan       587  -        -           19 of 20  0.764-0.991\n",
            "minh      587  -        -           -         -\n",
            "Conflicts waiting: 3\n",
        ] {
            assert!(text.contains(part), "{part:?} is not in\n{text}");
        }
        assert!(
            text.lines().all(|line| line.chars().count() <= 80),
            "{text}"
        );
    }

    #[test]
    fn few_results_have_no_kappa_but_the_words() {
        let text = agree_text(&reviewer_pairs(28, 1));
        let line = "lan, minh  29      0.966  0.828-0.994      -    -  too few to tell\n";
        assert!(text.contains(line), "{text}");
    }

    #[test]
    fn one_reviewer_agrees_with_nobody() {
        let mut found = reviewer_pairs(3, 0);
        found.reviewer_pairs.clear();
        assert!(agree_text(&found).starts_with("No two reviewers have read the same result"));
        found.reviewers.clear();
        assert_eq!(agree_text(&found), "Nobody has read a result yet.\n");
    }
}
