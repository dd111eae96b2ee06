//! The hot statements go through a primary key or a partial index: no scan of a table, no sort.

use sqlx::{AssertSqlSafe, Row as _};

use super::World;
use crate::catalog::{
    audit, checkpoint, claim, connect, fail, mend, query, requeue, rescue, results, status, upkeep,
    verdicts,
};

/// Lines of the query plan.
async fn plan(sql: &str) -> Vec<String> {
    let world = World::new(0).await;
    let path = world.dir.path().join("catalog.sqlite");
    let mut conn = connect::writer(&path, false).await.expect("a connection");
    let rows = sqlx::query(AssertSqlSafe(format!("EXPLAIN QUERY PLAN {sql}")))
        .fetch_all(&mut conn)
        .await
        .expect("a plan");
    rows.iter()
        .map(|row| row.try_get("detail").expect("a line"))
        .collect()
}

#[tokio::test]
async fn a_claim_walks_the_ready_index_in_its_order() {
    let plan = plan(claim::CLAIM).await;
    assert!(
        plan.iter().any(|line| line.contains("INDEX job_ready")),
        "{plan:?}"
    );
    assert!(
        !plan.iter().any(|line| line.contains("TEMP B-TREE")),
        "{plan:?}"
    );
    assert_only(
        &plan,
        &[
            "job USING INDEX job_ready",
            "job USING COVERING INDEX job_ready",
        ],
    );
}

#[tokio::test]
async fn fenced_writes_find_their_jobs_by_key() {
    for sql in [
        checkpoint::STEP,
        fail::FAIL,
        claim::RELEASE,
        requeue::SEND_BACK,
        mend::PUT_BACK,
    ] {
        let plan = plan(sql).await;
        assert!(
            plan.iter()
                .any(|line| line.starts_with("SEARCH job USING INTEGER PRIMARY KEY")),
            "{plan:?}"
        );
        assert_only(&plan, &["item VIRTUAL TABLE"]);
    }
}

#[tokio::test]
async fn rescue_and_holders_use_the_index_of_leases() {
    for sql in [
        rescue::RESCUE,
        rescue::LEFT_BY,
        rescue::OVERDUE,
        rescue::HOLDERS,
        rescue::VICTIMS,
    ] {
        let plan = plan(sql).await;
        assert!(
            plan.iter().any(|line| line.contains("INDEX job_leased")),
            "{plan:?}"
        );
        let small = ["VIRTUAL TABLE", "INDEX job_leased"];
        assert_only(&plan, &small);
    }
}

#[tokio::test]
async fn due_pairs_come_from_the_index_of_back_offs() {
    let plan = plan(upkeep::DUE).await;
    assert!(
        plan.iter().any(|line| line.contains("INDEX job_backoff")),
        "{plan:?}"
    );
    assert_only(&plan, &["INDEX job_backoff"]);
}

#[tokio::test]
async fn doubtful_pairs_come_from_their_index() {
    let plan = plan(status::DOUBTFUL).await;
    assert_only(&plan, &["m USING INDEX metric_doubtful"]);
    assert!(plan[0].contains("INDEX metric_doubtful"), "{plan:?}");
}

#[tokio::test]
async fn pages_and_their_parts_are_searched_by_key() {
    for sql in [query::PAGE, audit::PAGE] {
        let page = plan(sql).await;
        assert_only(&page, &[]);
    }
    for sql in [
        results::STAGE_RESULTS,
        audit::RESULTS,
        results::METRIC_HASHES,
        verdicts::COUNTED,
    ] {
        let plan = plan(sql).await;
        assert_only(&plan, &["VIRTUAL TABLE"]);
    }
}

/// Whether every scan of the plan is one of those allowed.
fn assert_only(plan: &[String], allowed: &[&str]) {
    for line in plan.iter().filter(|line| line.starts_with("SCAN")) {
        assert!(
            allowed.iter().any(|part| line.contains(part)),
            "{line:?} in {plan:?}"
        );
    }
}
