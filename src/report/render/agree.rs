//! The agreement of readers for a terminal of 80 columns.

use super::table::{Table, bounds, count, fixed, interval, number, words};
use super::text::{aligned, wrapped};
use crate::report::agree::{Agree, ReaderRecord, TwoReaders};
use crate::report::agreement::ENOUGH;
use crate::report::rate::Rate;

/// The agreement as aligned tables; ends with a line end.
pub fn agree_text(found: &Agree) -> String {
    if found.readers.is_empty() {
        return "Nobody has read a result yet.\n".to_owned();
    }
    let mut blocks = Vec::new();
    if found.two_readers.is_empty() {
        blocks.push(wrapped(
            "",
            "No two readers have read the same result yet, so there is no agreement to tell.",
        ));
    } else {
        blocks.extend([agreement(found), failures(found)].map(|table| shown(&table)));
    }
    blocks.push(shown(&readers(found)));
    blocks.push(format!("Conflicts waiting: {}\n", found.conflicts));
    blocks.join("\n")
}

fn shown(table: &Table) -> String {
    aligned(table) + &wrapped("", &table.caption)
}

fn names(two: &TwoReaders) -> String {
    format!("{}, {}", two.a, two.b)
}

fn agreement(found: &Agree) -> Table {
    let cells = |two: &TwoReaders| {
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
             failures are rare, however well readers agree; AC1 does not."
        ),
        columns: vec![
            words("Readers"),
            number("n", 0),
            number("agreement", 3),
            interval("95% Wilson"),
            number("kappa", 3),
            number("AC1", 3),
            words(""),
        ],
        rows: found.two_readers.iter().map(cells).collect(),
    }
}

fn failures(found: &Agree) -> Table {
    let cells = |two: &TwoReaders| {
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
        rows: found.two_readers.iter().map(cells).collect(),
    }
}

fn readers(found: &Agree) -> Table {
    let cells = |reader: &ReaderRecord| {
        vec![
            Some(reader.reader.clone()),
            Some(count(reader.read)),
            out_of(&reader.repeats),
            bounds(reader.repeats.ci95),
            out_of(&reader.caught),
            bounds(reader.caught.ci95),
        ]
    };
    let mut rows: Vec<_> = found.readers.iter().map(cells).collect();
    if found.readers.len() > 1 {
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
            words("Reader"),
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
    use crate::report::{Agree, Rate, ReaderRecord, TwoReaders};

    fn two_readers(pass: u64, contradicting: u64) -> Agree {
        let mut crosstab = Crosstab::default();
        (0..pass).for_each(|_| crosstab.add(Verdict::Pass, Verdict::Pass));
        for i in 0..contradicting {
            let both = [Verdict::Pass, Verdict::Fail];
            crosstab.add(both[usize::from(i > 0)], both[usize::from(i == 0)]);
        }
        let reader = |name: &str, caught| ReaderRecord {
            reader: name.to_owned(),
            read: pass + contradicting,
            caught,
            ..ReaderRecord::default()
        };
        Agree {
            schema: 1,
            conflicts: contradicting,
            two_readers: vec![TwoReaders {
                a: "lan".to_owned(),
                b: "minh".to_owned(),
                agreement: crosstab.finish(),
            }],
            readers: vec![
                reader("lan", Rate::new(19, 20)),
                reader("minh", Rate::default()),
            ],
            caught: Rate::new(19, 20),
        }
    }

    const GOLDEN: &str = "\
Readers      n  agreement  95% Wilson    kappa    AC1
lan, minh  587      0.995  0.985-0.998  -0.002  0.995
";

    #[test]
    fn rare_failures_are_told_four_ways() {
        let text = agree_text(&two_readers(584, 3));
        assert!(text.starts_with(GOLDEN), "{text}");
        for part in [
            "Failures   by anyone  by both  unsure\nlan, minh          3        0       0\n",
            "lan      587  -        -           19 of 20  0.764-0.991\n",
            "minh     587  -        -           -         -\n",
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
        let text = agree_text(&two_readers(28, 1));
        let line = "lan, minh  29      0.966  0.828-0.994      -    -  too few to tell\n";
        assert!(text.contains(line), "{text}");
    }

    #[test]
    fn one_reader_agrees_with_nobody() {
        let mut found = two_readers(3, 0);
        found.two_readers.clear();
        assert!(agree_text(&found).starts_with("No two readers have read the same result"));
        found.readers.clear();
        assert_eq!(agree_text(&found), "Nobody has read a result yet.\n");
    }
}
