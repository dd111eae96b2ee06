//! Query plans of frequent statements: by primary key or partial index, without table scans or sorts.

use sqlx::{AssertSqlSafe, Row as _};

use super::tests::{CatalogPlace, World};
use crate::audit::audited_pairs;
use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::jobs::job_counts;
use crate::jobs::requeue;
use crate::jobs::retired;
use crate::jobs::staleness;
use crate::jobs::workers;
use crate::lease_recovery;
use crate::queue::checkpoint;
use crate::queue::claim;
use crate::queue::lease;
use crate::queue::pair_job::PairJob;
use crate::records::ground_truth;
use crate::records::ignored_profiles;
use crate::records::manual_alignments;
use crate::records::pair_lookups;
use crate::records::pair_results;
use crate::records::pair_work;
use crate::records::result_pages;
use crate::records::stage_results;
use crate::records::status;
use crate::records::verdicts;
use crate::records::{listed_names, pair_list};

/// Returns the lines of the query plan.
async fn plan(sql: impl Into<Sql>) -> Vec<String> {
    let sql = sql.into().sqlite;
    let world = World::at(CatalogPlace::in_new_file(), 0).await;
    let Conn::Sqlite(mut conn) = world.place.conn().await else {
        panic!("the place is a file");
    };
    let rows = sqlx::query(AssertSqlSafe(format!("EXPLAIN QUERY PLAN {sql}")))
        .fetch_all(&mut *conn)
        .await
        .expect("a plan");
    rows.iter()
        .map(|row| row.try_get("detail").expect("a line"))
        .collect()
}

#[tokio::test]
async fn a_claim_scans_the_ready_index_in_order() {
    let plan = plan(claim::CLAIM.of::<PairJob>()).await;
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
            // All leased jobs, to see whether one of them is exclusive.
            "job USING INDEX job_leased",
        ],
    );
}

#[tokio::test]
async fn fenced_writes_find_their_jobs_by_key() {
    for sql in [
        lease::ADVANCE.of::<PairJob>(),
        lease::FAIL.of::<PairJob>(),
        lease::RELEASE.of::<PairJob>(),
        requeue::REQUEUE.of::<PairJob>(),
        lease::SEND_BACK.of::<PairJob>(),
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
async fn recovery_and_holders_use_the_index_of_leases() {
    for sql in [
        lease_recovery::RECOVER.of::<PairJob>(),
        lease_recovery::ORPHANED.into(),
        lease_recovery::OVERDUE.of::<PairJob>(),
        lease_recovery::HOLDERS.into(),
        lease_recovery::AFFECTED.of::<PairJob>(),
    ] {
        let plan = plan(sql).await;
        assert!(
            plan.iter().any(|line| line.contains("INDEX job_leased")),
            "{plan:?}"
        );
        let small = [
            "VIRTUAL TABLE",
            "INDEX job_leased",
            "INDEX block_job_leased",
            // The leases that these indexes find.
            "SCAN lease",
        ];
        assert_only(&plan, &small);
    }
}

#[tokio::test]
async fn due_pairs_use_the_index_of_backoffs() {
    let plan = plan(claim::DUE.of::<PairJob>()).await;
    assert!(
        plan.iter().any(|line| line.contains("INDEX job_backoff")),
        "{plan:?}"
    );
    assert_only(&plan, &["INDEX job_backoff"]);
}

#[tokio::test]
async fn pairs_of_low_confidence_use_their_index() {
    let plan = plan(status::LOW_CONFIDENCE).await;
    assert_only(&plan, &["job USING COVERING INDEX job_low_confidence"]);
    assert!(plan[0].contains("INDEX job_low_confidence"), "{plan:?}");
}

#[tokio::test]
async fn stale_pairs_are_counted_by_counters_and_marks() {
    for sql in [
        staleness::COUNT_STALE,
        staleness::MARKED,
        staleness::CLEAR_DIRTY,
        status::OTHER_FILES,
    ] {
        let plan = plan(sql).await;
        let small = [
            "SCAN counter",
            "VIRTUAL TABLE",
            "INDEX job_dirty",
            "INDEX job_quarantined",
            "CONSTANT ROW",
        ];
        assert_only(&plan, &small);
    }
}

#[tokio::test]
async fn jobs_are_counted_by_ranges_of_their_key() {
    let ranges = plan(job_counts::COUNT_RANGE).await;
    let searched = "SEARCH job USING INTEGER PRIMARY KEY (rowid>? AND rowid<?)";
    assert!(ranges.iter().any(|line| line == searched), "{ranges:?}");
    assert_only(&ranges, &[]);
    assert_only(&plan(job_counts::NEXT_PAIR).await, &[]);
}

#[tokio::test]
async fn inspected_jobs_are_found_by_key() {
    let selection = plan(staleness::INSPECT).await;
    assert_only(&selection, &["VIRTUAL TABLE", "SCAN found"]);
}

#[tokio::test]
async fn members_of_a_group_are_paged_by_key() {
    assert_only(&plan(requeue::MEMBERS).await, &[]);
}

#[tokio::test]
async fn rows_written_by_a_checkpoint_are_found_by_key() {
    for sql in checkpoint::rows() {
        assert_only(&plan(sql).await, &["VIRTUAL TABLE"]);
    }
}

#[tokio::test]
async fn queries_of_inputs_and_counts_are_paged_or_small() {
    assert_only(&plan(pair_work::INPUTS).await, &[]);
    assert_only(
        &plan(workers::LEFT_ALL).await,
        &["INDEX job_", "CONSTANT ROW", "SCAN first"],
    );
    assert_only(
        &plan(pair_results::FAILED).await,
        &["INDEX job_quarantined"],
    );
    assert_only(
        &plan(pair_results::FAILED_BY_CLASS).await,
        &["INDEX job_quarantined"],
    );
}

#[tokio::test]
async fn pages_of_results_are_searched_by_key() {
    // The list of damaged rows to leave out.
    assert_only(
        &plan(pair_results::PAGE).await,
        &["json_each VIRTUAL TABLE"],
    );
    assert_only(&plan(audited_pairs::PAGE).await, &[]);
    for sql in [
        stage_results::STAGE_RESULTS,
        audited_pairs::RESULTS,
        stage_results::METRIC_HASHES,
        verdicts::COUNTED,
        ground_truth::PLACES,
        ground_truth::PLACES_OF_NAMES,
    ] {
        let plan = plan(sql).await;
        assert_only(&plan, &["VIRTUAL TABLE"]);
    }
}

#[tokio::test]
async fn ignored_profiles_are_searched_by_the_keys_of_results() {
    let plan = plan(ignored_profiles::PRINTS).await;
    let key = "SEARCH r USING INDEX sqlite_autoindex_stage_result_1 (pair=? AND stage=?)";
    assert!(plan.iter().any(|line| line == key), "{plan:?}");
}

#[tokio::test]
async fn the_log_of_one_pair_or_action_and_retired_pairs_read_no_others() {
    let left_out = "VIRTUAL TABLE";
    for (sql, key) in [
        (
            verdicts::LOG_OF_PAIR,
            "SEARCH v USING INDEX verdict_pair (pair=?)",
        ),
        (
            verdicts::LOG_OF_ACT,
            "SEARCH v USING INDEX verdict_act (act=?)",
        ),
        (
            manual_alignments::OF_NAMES,
            "SEARCH a USING INDEX manual_alignment_pair (pair=?)",
        ),
    ] {
        let plan = plan(sql).await;
        assert_only(&plan, &[left_out]);
        assert!(plan.iter().any(|line| line == key), "{key}: {plan:?}");
    }
    let plan = plan(retired::RETIRED).await;
    assert_only(&plan, &["SCAN r"]);
    let pairs = "SEARCH p USING INTEGER PRIMARY KEY (rowid=?)";
    assert!(plan.iter().any(|line| line == pairs), "{plan:?}");
}

#[tokio::test]
async fn lists_of_pairs_read_part_of_an_index_in_its_order() {
    for (name, sql) in pair_list::statements() {
        let plan = plan(sql).await;
        assert_only(&plan, &["SCAN c", "VIRTUAL TABLE"]);
        let sorts = plan.iter().any(|line| line.contains("TEMP B-TREE"));
        assert!(!sorts, "{name}: {plan:?}");
    }
    assert_only(&plan(listed_names::NAMES).await, &["VIRTUAL TABLE"]);
}

#[tokio::test]
async fn the_least_confident_results_are_those_of_the_newest_attempts() {
    let lines = plan(pair_lookups::LEAST_CONFIDENT).await;
    // The newest attempts, which the statement limits.
    assert_only(&lines, &["SCAN a"]);
    for part in [
        "SEARCH attempt USING INTEGER PRIMARY KEY (rowid>?)",
        "SEARCH j USING INTEGER PRIMARY KEY",
        "SEARCH m USING INDEX sqlite_autoindex_metric_result_1 (pair=? AND metric=?)",
    ] {
        assert!(
            lines.iter().any(|line| line.starts_with(part)),
            "{part}: {lines:?}"
        );
    }
    assert!(
        !lines.iter().any(|line| line == "SCAN attempt"),
        "{lines:?}"
    );
}

#[tokio::test]
async fn counts_of_verdicts_scan_an_index_of_verdicts() {
    let lines = plan(result_pages::JUDGED).await;
    assert_only(&lines, &["COVERING INDEX verdict_pair", "SCAN v"]);
    assert!(
        lines.iter().any(|line| line.contains("INDEX verdict_pair")),
        "{lines:?}"
    );
}

/// Asserts that the plan contains only allowed scans.
fn assert_only(plan: &[String], allowed: &[&str]) {
    for line in plan.iter().filter(|line| line.starts_with("SCAN")) {
        assert!(
            allowed.iter().any(|part| line.contains(part)),
            "{line:?} in {plan:?}"
        );
    }
}
