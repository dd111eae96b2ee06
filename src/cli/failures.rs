//! Failed pairs as `run` and `status` list them: by class, the first few by name.

use serde_json::{Value, json};

use super::table::{Align, columns};
use crate::catalog::{Catalog, FailedPair, StoredFailure};
use crate::domain::FailureClass;

/// How many failed pairs are read, and how many of a class are named, unless all are asked for.
const READ: usize = 200;
const NAMED: usize = 3;
const ALL: usize = i64::MAX as usize;

/// The failed pairs of a project.
#[derive(Debug, Clone, Default)]
pub(super) struct Failures {
    counts: Vec<(FailureClass, u64)>,
    named: Vec<FailedPair>,
    /// Most that are named of a class.
    most: usize,
}

impl Failures {
    /// Reads them, to name a few of each class.
    ///
    /// # Errors
    /// When the catalog refuses.
    pub(super) async fn read(catalog: &Catalog) -> anyhow::Result<Self> {
        Self::up_to(catalog, READ, NAMED).await
    }

    /// Reads all of them, to name each.
    ///
    /// # Errors
    /// When the catalog refuses.
    pub(super) async fn read_all(catalog: &Catalog) -> anyhow::Result<Self> {
        Self::up_to(catalog, ALL, ALL).await
    }

    async fn up_to(catalog: &Catalog, read: usize, most: usize) -> anyhow::Result<Self> {
        let mut counts = catalog.failure_counts().await?;
        counts.sort_by_key(|(class, number)| (std::cmp::Reverse(*number), *class));
        let named = match counts.as_slice() {
            [] => Vec::new(),
            _ => catalog.failures(read).await?,
        };
        Ok(Self {
            counts,
            named,
            most,
        })
    }

    /// The first by name.
    pub(super) fn first(&self) -> Option<&FailedPair> {
        self.named.first()
    }

    /// Those that are named, each with stage, class and reason.
    pub(super) fn json(&self) -> Value {
        let named = self.named.iter().map(|pair| {
            let StoredFailure { stage, failure, .. } = &pair.failure;
            json!({"id": pair.name, "stage": stage, "class": failure.class, "error": failure.message})
        });
        named.collect()
    }

    /// One line a named pair, the most frequent class first.
    pub(super) fn text(&self) -> String {
        let rows: Vec<Vec<String>> = self
            .counts
            .iter()
            .flat_map(|(class, number)| self.class_rows(*class, *number))
            .collect();
        columns(&rows, &[Align::Left; 4])
    }

    fn class_rows(&self, class: FailureClass, number: u64) -> Vec<Vec<String>> {
        let mut head = format!("  {class} {number}");
        let mut rows = Vec::new();
        let of_class = |pair: &&FailedPair| pair.failure.failure.class == class;
        for pair in self.named.iter().filter(of_class).take(self.most) {
            rows.push(vec![
                std::mem::take(&mut head),
                pair.name.to_string(),
                format!("at {}", pair.failure.stage),
                pair.failure.failure.message.clone(),
            ]);
        }
        let more = number.saturating_sub(rows.len() as u64);
        if more > 0 {
            let all = "`status --failed` names all".to_owned();
            rows.push(vec![head, format!("and {more} more"), String::new(), all]);
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::Failures;
    use crate::catalog::{FailedPair, StoredFailure};
    use crate::domain::{Failure, FailureClass, JobStatus, Stage};

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
    fn most_frequent_class_comes_first_and_the_rest_is_counted() {
        let failures = Failures {
            most: super::NAMED,
            counts: vec![(FailureClass::Io, 9), (FailureClass::BadInput, 1)],
            named: vec![
                failed("a", FailureClass::BadInput),
                failed("b", FailureClass::Io),
                failed("c", FailureClass::Io),
            ],
        };
        let text = failures.text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "  io 9         b           at fit  b.stl: reason");
        let more = "               and 7 more          `status --failed` names all";
        assert_eq!(lines[2], more);
        assert_eq!(lines[3], "  bad_input 1  a           at fit  a.stl: reason");
    }
}
