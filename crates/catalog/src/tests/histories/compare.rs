//! Compares the catalog with the model, and compares its rows before and after refused writes.

use crate::db::query::query;

use super::super::state_machine::JobState;
use super::Game;

/// Tables that a refused write must not change, and statements that read them.
const TABLES: [(&str, &str); 8] = [
    ("job", "SELECT * FROM job"),
    ("stage_result", "SELECT * FROM stage_result"),
    ("metric_result", "SELECT * FROM metric_result"),
    ("attempt", "SELECT * FROM attempt"),
    ("failure", "SELECT * FROM failure"),
    ("verdict", "SELECT * FROM verdict"),
    ("counter", "SELECT * FROM counter"),
    ("pair", "SELECT * FROM pair"),
];

impl Game {
    /// Returns the rows of all `TABLES`, which a refused write must not change. Returns none if `allowed` is true.
    pub(super) async fn dump(&mut self, allowed: bool) -> Vec<String> {
        let mut lines = Vec::new();
        for (table, sql) in TABLES.iter().filter(|_| !allowed) {
            let rows = query(*sql);
            let rows = rows.fetch_all(&mut self.conn).await.expect("rows");
            lines.extend(rows.iter().map(|row| format!("{table} {row:?}")));
        }
        lines.sort();
        lines
    }

    /// Asserts that all jobs equal the model, no token decreased, the counters are right and no verdict was lost.
    pub(super) async fn agrees(&mut self) {
        let rows = query(
            "SELECT j.*, f.stage AS failed_at, f.fingerprint AS failed_with FROM job AS j
                LEFT JOIN failure AS f ON f.pair = j.pair ORDER BY j.pair",
        );
        let rows = rows.fetch_all(&mut self.conn).await.expect("a read");
        assert_eq!(rows.len(), self.model.jobs.len());
        for (row, (pair, job)) in rows.iter().zip(&self.model.jobs) {
            let (mut holder, mut when, mut run_at) = (None, None, None);
            match job.state {
                JobState::Leased {
                    worker, deadline, ..
                } => {
                    (holder, when) = (Some(worker.0), Some(deadline));
                }
                JobState::Backoff { run_at: at, .. } => run_at = Some(at),
                JobState::Ready { .. } | JobState::Done | JobState::Quarantined { .. } => {}
            }
            let number = |column: &str| row.get::<i64>(column).expect("a number");
            let stage = job.state.stage().map_or(4, |stage| stage.index() as i64);
            assert_eq!(
                (number("pair"), number("stage"), number("status")),
                (*pair, stage, job.state.status().code())
            );
            assert_eq!(
                (
                    number("token"),
                    number("attempt"),
                    number("crashes"),
                    number("exclusive")
                ),
                (
                    job.token,
                    i64::from(job.attempt),
                    i64::from(job.crashes),
                    i64::from(job.exclusive)
                ),
                "pair {pair}"
            );
            assert_eq!(
                ["worker", "deadline", "run_at"]
                    .map(|column| row.get::<Option<i64>>(column).expect("a column")),
                [holder, when, run_at],
                "pair {pair}"
            );
            let failed = job.failure.map(|(stage, then)| (stage, then.of(stage)));
            assert_eq!(
                ["failed_at", "failed_with"]
                    .map(|column| row.get::<Option<i64>>(column).expect("a column")),
                [
                    failed.map(|(stage, _)| stage.index() as i64),
                    failed.map(|(_, fingerprint)| fingerprint.0)
                ],
                "pair {pair}"
            );
            assert!(job.token >= self.tokens[*pair as usize]);
            self.tokens[*pair as usize] = job.token;
        }
        self.world.assert_counters().await;
        let log = self.world.catalog.verdict_log(None).await.expect("a log");
        let kept: Vec<_> = log.iter().map(|event| event.id).collect();
        assert_eq!(kept, self.verdicts);
    }
}
