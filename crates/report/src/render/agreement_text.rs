//! The agreement of reviewers for a terminal of 80 columns.

use super::table::Table;
use super::text::{with_caption, wrapped};
use mocban_results::number_format::NumberStyle::Share;
use mocban_results::number_format::format_count;
use mocban_results::stats::{IntervalMethod, Rate};
use mocban_results::{MIN_RESULTS, ReviewerAgreement, ReviewerPair, ReviewerRecord};

/// Returns the agreement as aligned tables, with a newline at the end.
pub fn agreement_text(found: &ReviewerAgreement) -> String {
    let sentence = found.set_apart.sentence();
    let sentence = sentence.map(|text| wrapped("", &(text + ".")));
    if found.reviewers.is_empty() {
        let nobody = match found.retired {
            0 => "Nobody has judged a result yet.",
            _ => {
                "Nobody has judged a result of a pair that counts; verdicts on retired pairs are kept (`status --retired`)."
            }
        };
        return wrapped("", nobody) + &sentence.unwrap_or_default();
    }
    let mut blocks = Vec::new();
    if found.reviewer_pairs.is_empty() {
        let note = "No two reviewers have judged the same result yet, so there is no agreement between reviewers.";
        blocks.push(wrapped("", note));
    } else {
        blocks.push(with_caption(&agreement(found)));
        blocks.push(with_caption(&failures(found)));
    }
    blocks.push(with_caption(&reviewers(found)));
    let conflicts = format_count(found.conflicts);
    blocks.push(format!("Conflicts waiting: {conflicts}\n"));
    blocks.extend(sentence);
    blocks.join("\n")
}

fn agreement(found: &ReviewerAgreement) -> Table {
    let if_sufficient =
        |pair: &ReviewerPair, value: Option<f64>| value.filter(|_| pair.agreement.sufficient);
    Table::of(&found.reviewer_pairs)
        .text("Reviewers", |pair| format!("{}, {}", pair.a, pair.b))
        .count("n", |pair| pair.agreement.n)
        .share("agreement %", |pair| pair.agreement.agreement)
        .interval(IntervalMethod::Wilson.title(), Share, |pair| {
            pair.agreement.agreement_ci95
        })
        .score("kappa", |pair| if_sufficient(pair, pair.agreement.kappa))
        .score("AC1", |pair| if_sufficient(pair, pair.agreement.ac1))
        .text("", |pair| {
            if pair.agreement.sufficient {
                ""
            } else {
                "too few results"
            }
        })
        .caption("agreement", format!(
            "Over the n results that both passed or failed. One verdict on several metrics of a pair counts for each of \
             their results that differ. Kappa (Cohen) and AC1 (Gwet) need at least {MIN_RESULTS}. \
             Kappa falls to 0 when failures are rare, however well reviewers agree. AC1 does not."
        ))
}

fn failures(found: &ReviewerAgreement) -> Table {
    Table::of(&found.reviewer_pairs)
        .text("Failures", |pair| format!("{}, {}", pair.a, pair.b))
        .count("by any", |pair| pair.agreement.failed_by_any)
        .count("by both", |pair| pair.agreement.failed_by_both)
        .count("unsure", |pair| pair.agreement.unsure)
        .caption("agreement-failures",
            "Results that at least one of the two failed, and that both failed. Unsure: results that both judged and at \
             least one was unsure about.",
        )
}

fn reviewers(found: &ReviewerAgreement) -> Table {
    let mut records: Vec<&ReviewerRecord> = found.reviewers.iter().collect();
    let mut total = ReviewerRecord {
        reviewer: "all".to_owned(),
        ..ReviewerRecord::default()
    };
    total.attention_checks.all = found.attention_checks;
    if records.len() > 1 {
        records.push(&total);
    }
    let is_total = |record: &ReviewerRecord| std::ptr::eq(record, &raw const total);
    let interval = IntervalMethod::Wilson.title();
    Table::of(records.iter().copied())
        .text("Reviewer", |record| record.reviewer.clone())
        .count("judged", |record| {
            (!is_total(record)).then_some(record.judged)
        })
        .optional_text("duplicates", |record| out_of(&record.duplicates))
        .interval(interval, Share, |record| record.duplicates.ci95)
        .optional_text("detected", |record| out_of(&record.attention_checks.all))
        .interval(interval, Share, |record| record.attention_checks.all.ci95)
        .caption("reviewers",
            "Duplicates: results shown twice that got the same verdict twice. Detected: planted faults (attention \
             checks) that the reviewer failed. This shows how well they find such faults, and no others.",
        )
}

/// Returns a rate such as `19 of 20`, or `None` if its total is 0.
fn out_of(rate: &Rate) -> Option<String> {
    let [count, n] = [rate.count, rate.n].map(format_count);
    (rate.n > 0).then(|| format!("{count} of {n}"))
}

#[cfg(test)]
mod tests {
    use super::agreement_text;
    use crate::test_fixtures;

    #[test]
    fn no_line_is_wider_than_a_terminal() {
        let text = agreement_text(&test_fixtures::agreement(584, 3));
        let mut lines = text.lines();
        assert!(lines.all(|line| line.chars().count() <= 80), "{text}");
    }

    #[test]
    fn few_results_have_no_kappa() {
        let text = agreement_text(&test_fixtures::agreement(28, 1));
        let line = "lan, minh  29         96.6  82.8–99.4        -    -  too few results\n";
        assert!(text.contains(line), "{text}");
    }

    #[test]
    fn without_two_reviewers_there_is_no_agreement() {
        let mut found = test_fixtures::agreement(3, 0);
        found.reviewer_pairs.clear();
        assert!(agreement_text(&found).starts_with("No two reviewers have judged the same result"));
        found.reviewers.clear();
        let nobody = "Nobody has judged a result yet.\n";
        assert_eq!(agreement_text(&found), nobody);
        found.retired = 2;
        let text = agreement_text(&found);
        assert!(
            text.starts_with(
                "Nobody has judged a result of a pair that counts; verdicts on retired"
            ),
            "{text}"
        );
    }
}
