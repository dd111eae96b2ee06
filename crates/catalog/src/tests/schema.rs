//! The CHECK constraints of the schema agree with the enums.

use crate::db::query::query;

use super::World;
use mocban_core::domain::{
    FailureClass, JobStatus, LengthUnit, Reason, ReviewOrder, ThresholdMetric, Verdict,
};

/// The CHECK constraints allow exactly the names of the enums.
#[tokio::test]
async fn check_constraints_and_enums_agree() {
    let world = World::new(1).await;
    let mut conn = world.place.conn().await;
    let mut accepts = async |sql: &'static str, value: &str| {
        query("BEGIN").execute(&mut conn).await.expect("begun");
        let act = query("INSERT INTO review_act (id, reviewer) VALUES (1, 'me')");
        act.execute(&mut conn).await.expect("stored");
        let outcome = query(sql).bind(value).execute(&mut conn).await;
        query("ROLLBACK")
            .execute(&mut conn)
            .await
            .expect("rolled back");
        outcome.is_ok()
    };
    let verdict = "INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, at)
        VALUES (1, 1, 'density', unhex('0000000000000000000000000000000000000000000000000000000000000000'), ?1, 'me', 1)";
    let reason =
        "INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, reason, at)
        VALUES (1, 1, 'density', unhex('0000000000000000000000000000000000000000000000000000000000000000'), 'fail', 'me', ?1, 1)";
    let metric = "INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, at)
        VALUES (1, 1, ?1, unhex('0000000000000000000000000000000000000000000000000000000000000000'), 'fail', 'me', 1)";
    let answered_metric = "INSERT INTO attention_check_answer
        (event, pair, metric, result_hash, kind, attention_check, seen, verdict, reviewer, at)
        VALUES ('1', 1, ?1, unhex('0000000000000000000000000000000000000000000000000000000000000000'), 'mirrored', '{}', unhex('0000000000000000000000000000000000000000000000000000000000000000'), 'fail', 'me', 1)";
    let scored_metric = "INSERT INTO metric_result (pair, metric, result_hash) VALUES
        (1, ?1, unhex('0000000000000000000000000000000000000000000000000000000000000000'))";
    let queue =
        "INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, at, review_order)
        VALUES (1, 1, 'density', unhex('0000000000000000000000000000000000000000000000000000000000000000'), 'fail', 'me', 1, ?1)";
    let class = "INSERT INTO failure (pair, stage, class, message, at) VALUES (1, 0, ?1, '', 1)";
    let unit = "UPDATE pair SET unit = ?1";
    let metrics = ThresholdMetric::ALL.map(ThresholdMetric::name);
    for (sql, names) in [
        (verdict, Verdict::ALL.map(Verdict::name).to_vec()),
        (reason, Reason::ALL.map(Reason::name).to_vec()),
        (metric, metrics.to_vec()),
        (answered_metric, metrics.to_vec()),
        (scored_metric, metrics.to_vec()),
        (queue, ReviewOrder::ALL.map(ReviewOrder::name).to_vec()),
        (class, FailureClass::ALL.map(FailureClass::name).to_vec()),
        (unit, LengthUnit::ALL.map(LengthUnit::name).to_vec()),
    ] {
        for name in names {
            assert!(accepts(sql, name).await, "{name} is refused");
        }
        assert!(!accepts(sql, "other").await, "{sql} takes anything");
    }
}

/// Each status is allowed only with the columns that belong to it.
#[tokio::test]
async fn an_inconsistent_job_row_is_rejected() {
    let world = World::new(1).await;
    let mut conn = world.place.conn().await;
    for status in 0..=5 {
        for bits in 0..16 {
            let stage = if bits & 1 == 0 { 2_i64 } else { 4 };
            let [worker, deadline, run_at] =
                [2, 4, 8].map(|bit| (bits & bit != 0).then_some(1_i64));
            query("BEGIN").execute(&mut conn).await.expect("begun");
            let outcome = query(
                "UPDATE job SET status = ?1, stage = ?2, worker = ?3, deadline = ?4, run_at = ?5",
            )
            .bind(status)
            .bind(stage)
            .bind(worker)
            .bind(deadline)
            .bind(run_at)
            .execute(&mut conn)
            .await;
            query("ROLLBACK")
                .execute(&mut conn)
                .await
                .expect("rolled back");
            let is = JobStatus::from_code(status);
            let allowed = is.is_some_and(|is| {
                (is == JobStatus::Done) == (stage == 4)
                    && (is == JobStatus::Leased) == worker.is_some()
                    && (is == JobStatus::Leased) == deadline.is_some()
                    && (is == JobStatus::Backoff) == run_at.is_some()
            });
            assert_eq!(outcome.is_ok(), allowed, "status {status}, bits {bits:04b}");
        }
    }
}
