//! Plans of the statements of group commits in PostgreSQL: rows of large tables are found by an index, whatever the
//! statistics say. Only in the module `tests_on_postgres`.

use sqlx::AssertSqlSafe;

use super::World;
use crate::db::conn::Conn;
use crate::queue::{claim, server_checkpoint};

/// Tables with a row or more for each pair.
const LARGE: [&str; 5] = ["job", "pair", "stage_result", "metric_result", "attempt"];

#[tokio::test]
async fn claims_and_checkpoints_read_no_large_table() {
    // The planner would choose to read such a small table whole.
    let world = World::new(3).await;
    let Conn::Postgres(mut conn) = world.place.conn().await else {
        return;
    };
    let claims = claim::server_texts();
    let exclusive = claim::exclusive_server_texts();
    let texts = claims.into_iter().chain(server_checkpoint::texts());
    for (number, text) in texts.enumerate() {
        let prepare = AssertSqlSafe(format!("PREPARE statement{number} AS {text}"));
        sqlx::raw_sql(prepare)
            .execute(&mut *conn)
            .await
            .expect("a statement");
        let parameters =
            "SELECT cardinality(parameter_types) FROM pg_prepared_statements WHERE name = $1";
        let parameters: i32 = sqlx::query_scalar(parameters)
            .bind(format!("statement{number}"))
            .fetch_one(&mut *conn)
            .await
            .expect("its parameters");
        let nulls = vec!["NULL"; parameters as usize].join(", ");
        let explain = format!("EXPLAIN EXECUTE statement{number} ({nulls})");
        let plan: Vec<String> = sqlx::query_scalar(AssertSqlSafe(explain))
            .fetch_all(&mut *conn)
            .await
            .expect("a plan");
        for table in LARGE {
            let reads_all = |line: &&String| line.contains(&format!("Seq Scan on {table} "));
            assert_eq!(plan.iter().find(reads_all), None, "{text}\n{plan:#?}");
        }
        // It contains an entry for each lease that ended while a snapshot was held.
        let by_lease = plan.iter().filter(|line| line.contains("job_leased"));
        let permitted = usize::from(exclusive.contains(&text));
        assert!(by_lease.count() <= permitted, "{text}\n{plan:#?}");
    }
}
