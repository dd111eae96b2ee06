//! Lists failed pairs by class, with the first few names of each class. Used by `run` and `status`.

use super::table::columns;
use mocban_core::domain::FailureClass;
use mocban_project::failures::Failures;

/// Maximum number of failed pairs that are named per class, unless all are requested.
const NAME_LIMIT: usize = 3;

/// Formats one line per named pair, the most frequent class first.
pub(crate) fn failures_text(failures: &Failures, all: bool) -> String {
    let limit = if all { usize::MAX } else { NAME_LIMIT };
    let counts = failures.counts.iter();
    let rows = counts.flat_map(|(class, number)| class_rows(failures, *class, *number, limit));
    columns(rows, "<<<<")
}

fn class_rows(
    failures: &Failures,
    class: FailureClass,
    number: u64,
    limit: usize,
) -> Vec<Vec<String>> {
    let mut head = format!("  {class} {number}");
    let mut rows = Vec::new();
    let pairs = failures.pairs.iter();
    let of_class = pairs.filter(|pair| pair.failure.failure.class == class);
    for pair in of_class.take(limit) {
        rows.push(vec![
            std::mem::take(&mut head),
            pair.name.to_string(),
            format!("at {}", pair.failure.stage),
            pair.failure.failure.message.clone(),
        ]);
    }
    let more = number.saturating_sub(rows.len() as u64);
    if more > 0 {
        let hint = "`status --failed` lists all".to_owned();
        rows.push(vec![head, format!("and {more} more"), String::new(), hint]);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::failures_text;
    use mocban_catalog::{FailedPair, StoredFailure};
    use mocban_core::domain::{Failure, FailureClass, JobStatus, Stage};
    use mocban_project::block_status::BlockStatus;
    use mocban_project::failures::Failures;

    fn failed(name: &str, class: FailureClass) -> FailedPair {
        FailedPair {
            name: name.parse().expect("valid id"),
            status: JobStatus::Quarantined,
            failure: StoredFailure {
                stage: Stage::Fit,
                failure: Failure::new(class, format!("{name}.stl: reason")),
                at: 0,
            },
        }
    }

    #[test]
    fn most_frequent_class_comes_first_and_unnamed_pairs_are_counted() {
        let failures = Failures {
            blocks: BlockStatus::default(),
            counts: vec![(FailureClass::Io, 9), (FailureClass::BadInput, 1)],
            pairs: vec![
                failed("a", FailureClass::BadInput),
                failed("b", FailureClass::Io),
                failed("c", FailureClass::Io),
            ],
        };
        let text = failures_text(&failures, false);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "  io 9         b           at fit  b.stl: reason");
        let more = "               and 7 more          `status --failed` lists all";
        assert_eq!(lines[2], more);
        assert_eq!(lines[3], "  bad_input 1  a           at fit  a.stl: reason");
    }
}
