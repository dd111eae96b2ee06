//! The list of workers with their metrics.

use std::time::Duration;

use super::{World, observed, register};
use crate::db::conn::Conn;
use crate::db::query::query_scalar;
use crate::{WorkerRecord, WorkerState};
use mocban_core::domain::{ComputeTimes, Stage, WorkerId, WorkerMetrics};

fn metrics(done: u64) -> WorkerMetrics {
    WorkerMetrics {
        version: "0.1.0".to_owned(),
        done,
        stages: [(Stage::Fit, ComputeTimes { count: done, ms: 7 })].into(),
        ..WorkerMetrics::default()
    }
}

/// Returns a worker as listed, or `None` if it is not listed.
async fn listed(world: &World, worker: WorkerId) -> Option<WorkerRecord> {
    let workers = world.catalog.workers(0).await.expect("a read");
    workers.into_iter().find(|record| record.id == worker)
}

#[tokio::test]
async fn a_heartbeat_stores_metrics_and_one_without_keeps_them() {
    let world = World::new(2).await;
    let me = world.worker;
    let before = listed(&world, me).await.expect("the worker");
    assert_eq!((before.metrics, before.leased), (None, 0));
    world.claim(2).await;
    let beat = world.catalog.heartbeat(me, 50, 0, Some(&metrics(3))).await;
    assert!(beat.expect("an answer"));
    let beat = world.catalog.heartbeat(me, 60, 0, None).await;
    assert!(beat.expect("an answer"));
    let stored = listed(&world, me).await.expect("the worker");
    assert_eq!(stored.metrics, Some(metrics(3)));
    assert_eq!((stored.heartbeat, stored.leased), (60, 2));
    assert_eq!((stored.host.as_str(), stored.pid), ("here", 1));
}

#[tokio::test]
async fn a_refused_heartbeat_stores_no_metrics() {
    let world = World::new(1).await;
    let me = world.worker;
    let late = metrics(3);
    let beat = world.catalog.heartbeat(me, 50, 1_000_000, Some(&late));
    assert!(!beat.await.expect("an answer"));
    let stored = listed(&world, me).await.expect("the worker");
    assert_eq!(stored.metrics, None);
}

#[tokio::test]
async fn the_state_of_a_worker_follows_from_its_row() {
    let world = World::new(1).await;
    let me = world.worker;
    let stopping = WorkerMetrics {
        stopping: true,
        ..metrics(1)
    };
    let catalog = &world.catalog;
    let beat = |metrics| async move { catalog.heartbeat(me, 50, 0, Some(&metrics)).await };
    beat(metrics(1)).await.expect("an answer");
    let state = async |now| listed(&world, me).await.map(|worker| worker.state(now));
    assert_eq!(state(60_050).await, Some(WorkerState::Alive));
    assert_eq!(state(60_051).await, Some(WorkerState::Gone));
    beat(stopping).await.expect("an answer");
    assert_eq!(state(60).await, Some(WorkerState::Stopping));
    let ended = catalog.end_worker(me, 70, Some(&metrics(2))).await;
    ended.expect("ended");
    assert_eq!(state(90_000).await, Some(WorkerState::Ended));
    let stored = listed(&world, me).await.expect("the worker");
    assert_eq!(stored.metrics, Some(metrics(2)));
}

#[tokio::test]
async fn workers_before_a_time_and_workers_that_ended_without_metrics_are_not_listed() {
    let world = World::new(1).await;
    let other = register(&world.catalog).await;
    let beat = world.catalog.heartbeat(world.worker, 50, 0, None).await;
    assert!(beat.expect("an answer"));
    let since = async |time| {
        let workers = world.catalog.workers(time).await.expect("a read");
        let ids = workers.into_iter().map(|worker| worker.id);
        ids.collect::<Vec<_>>()
    };
    assert_eq!(since(0).await, [world.worker, other]);
    assert_eq!(since(1).await, [world.worker]);
    let ended = world.catalog.end_worker(world.worker, 60, None).await;
    ended.expect("ended");
    assert_eq!(since(0).await, [other]);
}

#[tokio::test]
async fn the_worker_that_registered_last_is_known_also_after_its_end() {
    let world = World::new(1).await;
    let last = async || {
        let last = world.catalog.last_worker().await.expect("a read");
        last.map(|worker| (worker.id, worker.ended))
    };
    assert_eq!(last().await, Some((world.worker, None)));
    let other = register(&world.catalog).await;
    assert_eq!(last().await, Some((other, None)));
    let ended = world.catalog.end_worker(other, 60, None).await;
    ended.expect("ended");
    assert_eq!(last().await, Some((other, Some(60))));
}

/// In PostgreSQL: a process changes counters of its own in each time interval.
#[tokio::test]
async fn heartbeats_add_up_the_counters_of_earlier_slots() {
    const LEFT: &str = "SELECT slot FROM counter_part WHERE slot > 0";
    let world = World::new(5).await;
    let Conn::Postgres(mut conn) = world.place.conn().await else {
        return;
    };
    let mut rows = async |sql: &'static str| {
        let rows = sqlx::raw_sql(sql).fetch_all(&mut *conn).await;
        rows.expect("rows").len()
    };
    world.claim(2).await;
    let counted = world.catalog.counters().await.expect("counters");
    // As if the claim had been half a minute ago.
    let earlier = "UPDATE counter_part SET slot = slot - 3 * 256 WHERE slot > 0 RETURNING slot";
    assert_ne!(rows(earlier).await, 0);
    // Another process changes one of these rows.
    rows("BEGIN").await;
    rows("SELECT 1 FROM counter_part WHERE slot > 0 LIMIT 1 FOR UPDATE").await;
    let beat = world.catalog.heartbeat(world.worker, 50, 0, None).await;
    assert!(beat.expect("an answer"));
    assert_eq!(rows(LEFT).await, 1);
    assert_eq!(world.catalog.counters().await.expect("counters"), counted);
    rows("COMMIT").await;
    let beat = world.catalog.heartbeat(world.worker, 50, 0, None).await;
    assert!(beat.expect("an answer"));
    assert_eq!(rows(LEFT).await, 0);
    assert_eq!(world.catalog.counters().await.expect("counters"), counted);

    world.claim(2).await;
    // As if all processes had ended two minutes ago.
    let earlier = "UPDATE counter_part SET slot = slot - 12 * 256 WHERE slot > 0 RETURNING slot";
    assert_ne!(rows(earlier).await, 0);
    let beat = world.catalog.heartbeat(world.worker, 60, 0, None).await;
    assert!(beat.expect("an answer"));
    assert_ne!(rows(LEFT).await, 0);
    let another = world.place.open().await.expect("another process");
    let beat = another.heartbeat(world.worker, 60, 0, None).await;
    assert!(beat.expect("an answer"));
    assert_eq!(rows(LEFT).await, 0);
    let recount = world.catalog.recount().await.expect("a recount");
    assert_eq!(world.catalog.counters().await.expect("counters"), recount);
}

/// A server releases the lock when the connection is gone, and a new connection takes it again.
#[tokio::test]
async fn others_see_whether_a_worker_is_connected() {
    let world = World::new(1).await;
    let me = world.worker;
    world.claim(1).await;
    let other = world.place.open().await.expect("another process");
    let is_connected = async || {
        let holders = other.lease_holders().await.expect("a read");
        assert_eq!(holders.len(), 1);
        holders[0].is_connected
    };
    assert_eq!(is_connected().await, !other.is_shared());
    let unconnected = other.lease_holders().await.expect("a read");
    // The second call finds the lock held.
    for _ in 0..2 {
        world.catalog.keep_worker_lock(me).await.expect("the lock");
        assert!(is_connected().await);
    }
    if other.is_shared() {
        // It has connected since it was observed.
        let recovered = other.recover(observed(unconnected), 60).await;
        assert_eq!(recovered.expect("a recovery").ready, 0);
    }
    // The lock of another connection is no error, such as after a broken connection that the server still keeps.
    other.keep_worker_lock(me).await.expect("an answer");
    if other.is_shared() {
        let mut conn = other.read_conn().await.expect("a connection");
        let end = "SELECT count(pg_terminate_backend(pid)) FROM pg_locks
            WHERE locktype = 'advisory' AND objsubid = 2 AND database = (SELECT oid FROM pg_database WHERE datname = current_database())
                AND classid = CAST(hashtext(current_setting('search_path')) AS oid)";
        let ended: i64 = query_scalar(end).fetch_one(&mut conn).await.expect("ended");
        assert_eq!(ended, 1);
        drop(conn);
        let gone = async {
            while is_connected().await {
                tokio::task::yield_now().await;
            }
        };
        tokio::time::timeout(Duration::from_mins(10), gone)
            .await
            .expect("the server releases the lock");
        world
            .catalog
            .keep_worker_lock(me)
            .await
            .expect("a new connection");
        assert!(is_connected().await);
    }
    other.close().await;
}
