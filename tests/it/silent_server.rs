//! A worker whose server keeps the connections but does not reply, as when a network drops all packets.

use std::process::Child;
use std::time::{Duration, Instant};

use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};

use crate::fleet::{Fleet, TIME_SCALE};
use crate::lab::Lab;
use crate::waiting::PATIENT;

/// The process that accepts connections.
const FIRST: &str = "SELECT split_part(pg_read_file('postmaster.pid'), chr(10), 1)::integer";
/// The processes that serve other connections.
const OTHERS: &str = "
    SELECT pid FROM pg_stat_activity WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()";

/// Processes of a server that were suspended. They go on when it is dropped.
pub(crate) struct Suspended(Vec<Pid>);

impl Suspended {
    /// Suspends the process that accepts connections, and then the processes that serve the workers.
    fn server(fleet: &Fleet) -> Self {
        let mut suspended = Self(Vec::new());
        fleet.on_server(async |conn| {
            suspended.add(sqlx::query_scalar(FIRST).fetch_one(&mut *conn).await?);
            for pid in sqlx::query_scalar(OTHERS).fetch_all(conn).await? {
                suspended.add(pid);
            }
            Ok(())
        });
        assert!(suspended.0.len() > 1, "no worker is connected");
        suspended
    }

    /// Suspends the same processes of the server of a [`Lab`].
    pub(crate) fn of_lab(lab: &Lab) -> Self {
        let mut session = lab.session("mocban");
        let mut suspended = Self(Vec::new());
        for sql in [FIRST, OTHERS] {
            for row in session.sql(sql).expect("rows") {
                suspended.add(row[0].parse().expect("a number"));
            }
        }
        assert!(suspended.0.len() > 1, "no page is connected");
        suspended
    }

    fn add(&mut self, pid: i32) {
        let pid = Pid::from_raw(pid).expect("a process");
        match kill_process(pid, Signal::STOP) {
            // It has ended.
            Err(Errno::SRCH) => {}
            sent => {
                sent.expect("suspended");
                self.0.push(pid);
            }
        }
    }
}

impl Drop for Suspended {
    fn drop(&mut self) {
        for pid in &self.0 {
            // A process that has ended needs no signal.
            let _ = kill_process(*pid, Signal::CONT);
        }
    }
}

fn interrupt(worker: &Child) {
    kill_process(Pid::from_child(worker), Signal::INT).expect("sent");
}

/// A statement may take hours here, and each of many connections 10 s. A stop request does not wait for them.
#[test]
fn a_stop_request_does_not_wait_for_a_server_that_does_not_reply() {
    /// Longer than a busy machine needs, and shorter than one statement.
    const LONGEST: Duration = Duration::from_mins(5);
    let Some(fleet) = Fleet::new("30") else {
        return;
    };
    fleet.shared(&["plan"]).expect(0);
    let mut workers = [(); 2].map(|()| fleet.worker_with(&[TIME_SCALE, PATIENT]));
    fleet.wait_for_work(&mut workers);
    let suspended = Suspended::server(&fleet);
    let asked = Instant::now();
    let [once, twice] = &workers;
    interrupt(once);
    interrupt(twice);
    interrupt(twice);
    for mut worker in workers {
        let code = worker.wait().expect("an exit code");
        assert!(!code.success(), "{code}");
    }
    assert!(asked.elapsed() < LONGEST, "{:?}", asked.elapsed());
    drop(suspended);
    assert!(fleet.worker().wait().expect("an exit code").success());
    fleet.assert_same();
}
