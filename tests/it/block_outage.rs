//! A server that breaks the connection of a run while a failure of a block is stored.

use sqlx::{Connection as _, PgConnection};

use crate::blocks::write_blocks;
use crate::cli::{empty, mocban};
use crate::postgres_server::Server;

/// Breaks the connection that stores the first failure, before its commit. A sequence also counts what is rolled back.
const BREAK_ONCE: &str = "
    CREATE SEQUENCE public.failures;
    CREATE FUNCTION public.break_once() RETURNS trigger LANGUAGE plpgsql AS 'BEGIN
        IF nextval(''public.failures'') = 1 THEN PERFORM pg_terminate_backend(pg_backend_pid()); END IF;
        RETURN null; END';
    CREATE TRIGGER break_once AFTER INSERT ON mocban.block_failure
        FOR EACH ROW EXECUTE FUNCTION public.break_once();";

#[test]
fn a_failure_of_a_block_is_stored_over_a_new_connection() {
    let Some(server) = Server::start() else {
        return;
    };
    let dir = empty();
    write_blocks(dir.path(), &["b1"]);
    let at = ["-C", "project", "--catalog", server.url()];
    let call = |args: &[&str]| mocban(dir.path(), &[&at[..], args].concat());
    call(&["import", "blocks.csv"]).expect(0);
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let connected = runtime.block_on(PgConnection::connect(server.url()));
    let mut conn = connected.expect("a connection");
    let prepared = sqlx::raw_sql(BREAK_ONCE).execute(&mut conn);
    runtime.block_on(prepared).expect("a trigger");
    let run = call(&["run", "--json"]).expect(3).json();
    assert_eq!(run["blocks"]["failed"], 1, "{run}");
    let attempts = sqlx::query_scalar("SELECT last_value FROM public.failures");
    let attempts = runtime.block_on(attempts.fetch_one(&mut conn));
    let attempts: i64 = attempts.expect("a number");
    assert_eq!(attempts, 2, "the connection did not break");
    let status = call(&["status", "--json"]).expect(0).json();
    assert_eq!(status["blocks"]["jobs"]["quarantined"], 1, "{status}");
    assert_eq!(status["blocks"]["jobs"]["leased"], 0, "{status}");
}
