//! Lists failed pairs by class, with the first few names of each class, and failed blocks. Used by `run` and `status`.

use serde_json::{Value, json};

use super::block_status::BlockStatus;
use super::table::columns;
use mocban_catalog::{Catalog, FailedPair, StoredFailure};
use mocban_core::domain::FailureClass;
use mocban_project::ProjectResult;

/// Maximum number of failed pairs that are read, unless all are requested.
const READ_LIMIT: usize = 200;
/// Maximum number of failed pairs that are named per class, unless all are requested.
const NAME_LIMIT: usize = 3;
const NO_LIMIT: usize = i64::MAX as usize;

/// Returns whether a failure of a class may not occur again with the same files and settings.
pub(crate) const fn may_succeed_unchanged(class: FailureClass) -> bool {
    match class {
        FailureClass::Io | FailureClass::Resource | FailureClass::Bug => true,
        FailureClass::BadInput | FailureClass::NoSolution => false,
    }
}

/// The failed pairs of a project.
#[derive(Debug, Clone, Default)]
pub(crate) struct Failures {
    counts: Vec<(FailureClass, u64)>,
    pairs: Vec<FailedPair>,
    names_per_class: usize,
    /// The blocks of the project.
    pub(crate) blocks: BlockStatus,
}

impl Failures {
    /// Reads the failures, to name all of them or a few of each class.
    pub(crate) async fn read(catalog: &Catalog, all: bool) -> ProjectResult<Self> {
        let (limit, names_per_class) = if all {
            (NO_LIMIT, NO_LIMIT)
        } else {
            (READ_LIMIT, NAME_LIMIT)
        };
        let mut counts = catalog.failure_counts().await?;
        counts.sort_by_key(|(class, number)| (std::cmp::Reverse(*number), *class));
        let pairs = match counts.as_slice() {
            [] => Vec::new(),
            _ => catalog.failures(limit).await?,
        };
        Ok(Self {
            counts,
            pairs,
            names_per_class,
            blocks: BlockStatus::read(catalog, all).await?,
        })
    }

    /// Returns whether a failed pair may succeed with the same files and settings. A run finds changed ones itself.
    pub(crate) fn may_succeed_unchanged(&self) -> bool {
        let mut classes = self.counts.iter().map(|(class, _)| *class);
        classes.any(may_succeed_unchanged)
    }

    /// Returns the first failed pair.
    pub(crate) fn first(&self) -> Option<&FailedPair> {
        self.pairs.first()
    }

    /// Returns the failed pairs with stage, class and message.
    pub(crate) fn json(&self) -> Value {
        let pairs = self.pairs.iter().map(|pair| {
            let StoredFailure { stage, failure, .. } = &pair.failure;
            json!({"id": pair.name, "stage": stage, "class": failure.class, "error": failure.message})
        });
        pairs.collect()
    }

    /// Formats one line per named pair, the most frequent class first.
    pub(crate) fn text(&self) -> String {
        let counts = self.counts.iter();
        let rows = counts.flat_map(|(class, number)| self.class_rows(*class, *number));
        columns(rows, "<<<<")
    }

    fn class_rows(&self, class: FailureClass, number: u64) -> Vec<Vec<String>> {
        let mut head = format!("  {class} {number}");
        let mut rows = Vec::new();
        let pairs = self.pairs.iter();
        let of_class = pairs.filter(|pair| pair.failure.failure.class == class);
        for pair in of_class.take(self.names_per_class) {
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
}

#[cfg(test)]
mod tests {
    use super::Failures;
    use mocban_catalog::{FailedPair, StoredFailure};
    use mocban_core::domain::{Failure, FailureClass, JobStatus, Stage};

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
            names_per_class: super::NAME_LIMIT,
            blocks: super::BlockStatus::default(),
            counts: vec![(FailureClass::Io, 9), (FailureClass::BadInput, 1)],
            pairs: vec![
                failed("a", FailureClass::BadInput),
                failed("b", FailureClass::Io),
                failed("c", FailureClass::Io),
            ],
        };
        let text = failures.text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "  io 9         b           at fit  b.stl: reason");
        let more = "               and 7 more          `status --failed` lists all";
        assert_eq!(lines[2], more);
        assert_eq!(lines[3], "  bad_input 1  a           at fit  a.stl: reason");
    }
}
