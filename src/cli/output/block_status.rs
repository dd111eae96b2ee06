//! The blocks of a project in `status` and after `run`: how many are done, and why the others failed.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::screen::{Palette, Tone};
use super::table::{columns, count};
use mocban_catalog::{BlockState, Catalog};
use mocban_core::domain::{JobStatus, one_line};
use mocban_project::ProjectResult;

/// Number of failed blocks that are named, unless all are requested.
const NAME_LIMIT: usize = 5;

/// The blocks of a project.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockStatus {
    states: Vec<BlockState>,
    name_limit: usize,
}

impl BlockStatus {
    /// Reads the blocks, to name all failed ones or the first few.
    pub(crate) async fn read(catalog: &Catalog, all: bool) -> ProjectResult<Self> {
        Ok(Self {
            states: catalog.block_states().await?,
            name_limit: if all { usize::MAX } else { NAME_LIMIT },
        })
    }

    /// Returns whether the project has no blocks.
    pub(crate) const fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    fn number(&self, statuses: &[JobStatus]) -> u64 {
        let found = self.states.iter();
        found
            .filter(|state| statuses.contains(&state.status))
            .count() as u64
    }

    /// Returns the number of blocks that a run would work on.
    pub(crate) fn waiting(&self) -> u64 {
        self.number(&[JobStatus::Ready, JobStatus::Backoff])
    }

    /// Returns the number of blocks that a process works on or left.
    pub(crate) fn leased(&self) -> u64 {
        self.number(&[JobStatus::Leased])
    }

    /// Returns the failed blocks.
    fn failed(&self) -> impl Iterator<Item = &BlockState> {
        let states = self.states.iter();
        states.filter(|state| state.status == JobStatus::Quarantined)
    }

    /// Returns the name of the first failed block.
    pub(crate) fn first_failed(&self) -> Option<String> {
        let first = self.failed().next()?;
        Some(first.attributes.name.to_string())
    }

    /// Returns the counts, and the failures with their sentences.
    pub(crate) fn json(&self) -> Value {
        let sum = |number: fn(&BlockState) -> u64| self.states.iter().map(number).sum::<u64>();
        let jobs = JobStatus::ALL.map(|status| (status.name().to_owned(), self.number(&[status])));
        let failures = self.failed().filter_map(|state| {
            let failed = state.failure.as_ref()?;
            Some(json!({
                "block": state.attributes.name, "stage": failed.stage, "class": failed.failure.class,
                "error": failed.failure.message,
            }))
        });
        json!({
            "total": self.states.len(),
            "jobs": jobs.into_iter().map(|(name, n)| (name, n.into())).collect::<serde_json::Map<_, Value>>(),
            "characters": sum(|state| state.characters),
            "left_out": sum(|state| state.left_out),
            "retired": sum(|state| state.retired),
            "low_confidence": sum(|state| state.low_confidence),
            "failures": failures.collect::<Value>(),
        })
    }

    /// Returns `12 blocks · 9 done · 1 running · 1 failed · 2345 characters`. If no process works on the project,
    /// leased blocks are interrupted.
    pub(crate) fn line(&self, is_running: bool, palette: Palette) -> String {
        let leased = self.leased();
        let characters: u64 = self.states.iter().map(|state| state.characters).sum();
        let mut parts = vec![count(self.states.len() as u64, "block")];
        let (word, tone) = if is_running {
            ("running", Tone::Strong)
        } else {
            ("interrupted", Tone::Warn)
        };
        for (number, word, tone) in [
            (self.number(&[JobStatus::Done]), "done", Tone::Good),
            (self.number(&[JobStatus::Quarantined]), "failed", Tone::Bad),
            (leased, word, tone),
            (self.waiting(), "waiting", Tone::Warn),
        ] {
            if number > 0 {
                parts.push(palette.paint(tone, format!("{number} {word}")));
            }
        }
        if characters > 0 {
            parts.push(count(characters, "character"));
        }
        parts.join(" · ")
    }

    /// Returns a line for each named failed block, with its sentence.
    pub(crate) fn failures_text(&self) -> String {
        let failed = self.failed();
        let rows = failed.take(self.name_limit).filter_map(|state| {
            let failed = state.failure.as_ref()?;
            Some(vec![
                format!("  {}", state.attributes.name),
                format!("at {}", failed.stage),
                one_line(&failed.failure.message).into_owned(),
            ])
        });
        let mut text = columns(rows, "<<<");
        let more = self.failed().count().saturating_sub(self.name_limit);
        if more > 0 {
            // Formatting into memory does not fail.
            let _ = writeln!(text, "  and {more} more; `status --failed` lists all");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::BlockStatus;
    use crate::cli::output::screen::Palette;
    use mocban_catalog::{BlockAttributes, BlockState, StoredFailure};
    use mocban_core::domain::{BlockStage, Failure, FailureClass, JobStatus};

    fn state(name: &str, status: JobStatus) -> BlockState {
        let failure = StoredFailure {
            stage: BlockStage::Align,
            failure: Failure::new(
                FailureClass::NoSolution,
                "p.png: the page is of another block",
            ),
            at: 0,
        };
        BlockState {
            attributes: BlockAttributes {
                name: name.parse().expect("a valid id"),
                mesh_path: "m.stl".to_owned(),
                page_path: "p.png".to_owned(),
                labels_path: None,
                unit: None,
                side: None,
            },
            status,
            next_stage: None,
            attempts: 0,
            crashes: 0,
            failure: (status == JobStatus::Quarantined).then_some(failure),
            control_points: None,
            characters: 100,
            left_out: 1,
            retired: 0,
            low_confidence: 2,
        }
    }

    #[test]
    fn blocks_are_counted_and_refusals_named() {
        let blocks = BlockStatus {
            states: vec![
                state("a", JobStatus::Done),
                state("b", JobStatus::Quarantined),
                state("c", JobStatus::Leased),
            ],
            name_limit: 5,
        };
        let line = blocks.line(true, Palette::PLAIN);
        assert_eq!(
            line,
            "3 blocks · 1 done · 1 failed · 1 running · 300 characters"
        );
        assert!(blocks.line(false, Palette::PLAIN).contains("1 interrupted"));
        let text = blocks.failures_text();
        assert_eq!(text, "  b  at align  p.png: the page is of another block\n");
        let json = blocks.json();
        assert_eq!(json["jobs"]["done"], 1);
        assert_eq!(json["failures"][0]["stage"], "align");
    }
}
