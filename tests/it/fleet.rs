//! Several processes on a catalog in PostgreSQL: the results are those of one process on a file, also when the server and
//! the processes crash. `MOCBAN_KILLS` and `MOCBAN_KILLED_PAIRS` set the numbers of crashes and pairs.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, SystemTime};

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::cli::{Call, binary, call, empty, mocban};
use crate::made_once::{copy_folder, copy_of};
use crate::postgres_server::Server;
use crate::resume::project;
use crate::test_size::size_from_env;
use crate::uninterrupted::files;
use crate::waiting::{PATIENT_CONNECT, pause, until, wait_until};

/// Shortens leases to five seconds.
pub(crate) const TIME_SCALE: (&str, &str) = ("MOCBAN_TIME_SCALE", "10");

/// Lets the server note when a heartbeat comes, and when a worker is found dead.
const NOTE_WORKERS: &str = "
    CREATE TABLE public.noted (worker bigint, died boolean, at timestamptz DEFAULT clock_timestamp());
    CREATE FUNCTION public.note() RETURNS trigger LANGUAGE plpgsql AS
        'BEGIN INSERT INTO public.noted VALUES (new.id, new.died > old.died); RETURN null; END';
    CREATE TRIGGER note AFTER UPDATE ON mocban.worker FOR EACH ROW EXECUTE FUNCTION public.note();";
/// Ends that, because `check` names a trigger of another program.
const NOTE_NO_MORE: &str = "DROP TRIGGER note ON mocban.worker";

/// A project in a file that has been run and exported, and the same pairs in PostgreSQL, not run yet.
pub(crate) struct Fleet {
    dir: tempfile::TempDir,
    server: Server,
}

impl Fleet {
    /// Returns `None` if no server is installed.
    pub(crate) fn new(pairs: &str) -> Option<Self> {
        let server = Server::start()?;
        let dir = empty();
        copy_of(&format!("a fleet of {pairs}"), dir.path(), |dir| {
            let fresh = project(dir, "file", pairs);
            copy_folder(fresh.dir(), &dir.join("shared"));
            mocban(dir, &["-C", "file", "run"]).expect(0);
            mocban(dir, &["-C", "file", "export", "-o", "file-export"]).expect(0);
        });
        mocban(dir.path(), &["copy", "shared", server.url()]).expect(0);
        std::fs::remove_file(dir.path().join("shared/catalog.sqlite")).expect("removed");
        Some(Self { dir, server })
    }

    fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Calls a command on the shared project.
    pub(crate) fn shared(&self, args: &[&str]) -> Call {
        let mut command = binary();
        command.current_dir(self.path()).envs([PATIENT_CONNECT]);
        command.args(["-C", "shared", "--catalog", self.server.url()]);
        call(command.args(args))
    }

    pub(crate) fn worker(&self) -> Child {
        self.worker_with(&[TIME_SCALE])
    }

    pub(crate) fn worker_with(&self, variables: &[(&str, &str)]) -> Child {
        let mut command = binary();
        command
            .current_dir(self.path())
            .envs(variables.iter().copied());
        command.args(["-C", "shared", "--catalog", self.server.url()]);
        let command = command.args(["worker", "-j", "1"]);
        let errors = File::options()
            .create(true)
            .append(true)
            .open(self.worker_errors());
        let worker = command
            .stdout(Stdio::null())
            .stderr(errors.expect("a file"))
            .spawn();
        worker.expect("the binary starts")
    }

    /// The file to which all workers write their errors.
    fn worker_errors(&self) -> PathBuf {
        self.path().join("workers.txt")
    }

    /// Waits until a worker ends, and requires that it ends without an error.
    fn assert_success(&self, mut worker: Child) {
        let code = worker.wait().expect("an exit code");
        let errors = || std::fs::read_to_string(self.worker_errors()).unwrap_or_default();
        assert!(code.success(), "{code}: {}", errors());
    }

    /// Starts a worker, and waits until the server knows it. A crash of the server before that ends a worker.
    fn registered_worker(&self) -> Child {
        let mut worker = self.worker();
        let pid = i64::from(worker.id());
        let is_known = || {
            self.on_server(async |conn| {
                let exists = "SELECT EXISTS (SELECT 1 FROM mocban.worker WHERE pid = $1)";
                let exists = sqlx::query_scalar::<_, bool>(exists).bind(pid);
                exists.fetch_one(conn).await
            })
        };
        while !is_known() && worker.try_wait().expect("a state").is_none() {
            pause();
        }
        worker
    }

    /// Calls a function with a connection to the server.
    pub(crate) fn on_server<T>(
        &self,
        work: impl AsyncFnOnce(&mut sqlx::PgConnection) -> sqlx::Result<T>,
    ) -> T {
        let runtime = tokio::runtime::Runtime::new().expect("a runtime");
        runtime.block_on(async {
            let conn = <sqlx::PgConnection as sqlx::Connection>::connect(self.server.url()).await;
            work(&mut conn.expect("a connection"))
                .await
                .expect("valid SQL")
        })
    }

    /// Runs SQL statements on the server.
    fn sql(&self, text: &str) {
        let text = sqlx::AssertSqlSafe(text.to_owned());
        self.on_server(async |conn| sqlx::raw_sql(text).execute(conn).await);
    }

    /// Waits until at least one pair is done, and more are leased. Asserts that the workers are at work.
    pub(crate) fn wait_for_work(&self, workers: &mut [Child]) {
        loop {
            let status = self.shared(&["status", "--json"]).expect(0).json();
            let is_working = |worker: &mut Child| worker.try_wait().expect("a state").is_none();
            assert!(
                workers.iter_mut().all(is_working),
                "a worker ended: {status}"
            );
            let jobs = &status["jobs"];
            if jobs["done"].as_u64() > Some(0) && jobs["leased"].as_u64() > Some(0) {
                return;
            }
            pause();
        }
    }

    /// Asserts that the shared project is whole, without leases and quarantined pairs, and that its export and report are
    /// those of the project in a file.
    pub(crate) fn assert_same(&self) {
        let status = self.shared(&["status", "--json"]).expect(0).json();
        assert_eq!(status["jobs"]["leased"], 0, "{status}");
        assert_eq!(status["jobs"]["quarantined"], 0, "{status}");
        self.shared(&["check"]).expect(0);
        self.shared(&["export", "-o", "shared-export"]).expect(0);
        let [one, other] =
            ["file-export", "shared-export"].map(|name| files(&self.path().join(name)));
        assert_eq!(
            one.keys().collect::<Vec<_>>(),
            other.keys().collect::<Vec<_>>()
        );
        for (path, bytes) in &one {
            assert!(other[path] == *bytes, "{} differs", path.display());
        }
        let report = mocban(self.path(), &["-C", "file", "report"]).expect(0);
        assert_eq!(self.shared(&["report"]).expect(0).out, report.out);
    }
}

#[test]
fn workers_on_postgres_give_the_results_of_one_run_on_a_file() {
    let Some(fleet) = Fleet::new("30") else {
        return;
    };
    fleet.shared(&["plan"]).expect(0);
    let workers = [(); 3].map(|()| fleet.worker());
    for worker in workers {
        fleet.assert_success(worker);
    }
    fleet.assert_same();
    // Back to a file, with the verdicts.
    fleet
        .shared(&[
            "verdict",
            "set",
            "upright-0000",
            "pass",
            "--reviewer",
            "lan",
        ])
        .expect(0);
    mocban(fleet.path(), &["copy", fleet.server.url(), "back"]).expect(0);
    let log = |project: &[&str]| {
        let args = [project, &["verdict", "log", "--json"]].concat();
        mocban(fleet.path(), &args).expect(0).out
    };
    let shared = ["-C", "shared", "--catalog", fleet.server.url()];
    assert_eq!(log(&["-C", "back"]), log(&shared));
    fleet.shared(&["backup", "all.sqlite"]).expect(0);
    mocban(fleet.path(), &["restore", "all.sqlite", "restored"]).expect(0);
    assert_eq!(log(&["-C", "restored"]), log(&shared));
}

#[test]
fn crashes_of_the_server_and_of_workers_lose_nothing() {
    let (kills, pairs) = (
        size_from_env("MOCBAN_KILLS", 6),
        size_from_env("MOCBAN_KILLED_PAIRS", 40),
    );
    let Some(fleet) = Fleet::new(&pairs.to_string()) else {
        return;
    };
    fleet.shared(&["plan"]).expect(0);
    let mut dice = ChaCha8Rng::seed_from_u64(24);
    let mut workers = [(); 3].map(|()| fleet.registered_worker());
    let mut crashes_at_work = 0;
    for kill in 0..kills {
        // The crash must come at a random moment, so the test waits for a time and not for an event.
        std::thread::sleep(Duration::from_millis(dice.random_range(50..500)));
        let mut is_working = |worker: &mut Child| worker.try_wait().expect("a state").is_none();
        crashes_at_work += u32::from(workers.iter_mut().any(&mut is_working));
        if kill % 2 == 0 {
            fleet.server.stop_at_once();
            fleet.server.start_again();
        } else {
            let victim = dice.random_range(0..workers.len());
            // It may have ended.
            let _ = workers[victim].kill();
            workers[victim].wait().expect("an exit code");
            workers[victim] = fleet.registered_worker();
        }
    }
    assert!(
        crashes_at_work > 0,
        "every worker had ended before the first crash"
    );
    for worker in workers {
        fleet.assert_success(worker);
    }
    fleet.assert_same();
}

/// While the server is away for longer than a lease, no worker can send a heartbeat. None of them is dead.
#[test]
fn after_an_outage_longer_than_a_lease_no_worker_is_taken_for_dead() {
    /// Leases last 12.5 seconds: on a busy machine, a worker may need seconds to connect again.
    const LEASES: (&str, &str) = ("MOCBAN_TIME_SCALE", "4");
    const OUTAGE: Duration = Duration::from_secs(15);
    let Some(fleet) = Fleet::new("30") else {
        return;
    };
    fleet.shared(&["plan"]).expect(0);
    // A later heartbeat or stage would hide that a worker was marked, or a pair blamed.
    fleet.sql(NOTE_WORKERS);
    let mut workers = [(); 3].map(|()| fleet.worker_with(&[LEASES]));
    fleet.wait_for_work(&mut workers);
    fleet.server.stop_at_once();
    // Leases end by time alone, so there is no event to wait for.
    std::thread::sleep(OUTAGE);
    fleet.server.start_again();
    for worker in workers {
        fleet.assert_success(worker);
    }
    let count = "SELECT count(*) FROM public.noted WHERE died";
    let taken: i64 = fleet.on_server(async |conn| sqlx::query_scalar(count).fetch_one(conn).await);
    assert_eq!(taken, 0, "living workers were taken for dead");
    fleet.sql(NOTE_NO_MORE);
    fleet.assert_same();
}

/// A commit that waited for long may name files that were removed meanwhile as unreferenced.
#[test]
fn no_result_names_files_that_were_removed_while_its_commit_waited() {
    /// Commits wait for at most 10 seconds with this scale.
    const COMMITS: (&str, &str) = ("MOCBAN_COMMIT_TIME_SCALE", "180");
    const WAIT: Duration = Duration::from_millis(10_500);
    let Some(fleet) = Fleet::new("2") else { return };
    fleet.shared(&["plan"]).expect(0);
    let held = fleet.path().join("held");
    let file = held.to_str().expect("UTF-8");
    let hold = [
        COMMITS,
        ("MOCBAN_HOLD_AT", "depth:synced"),
        ("MOCBAN_HOLD_FILE", file),
    ];
    let mut worker = fleet.worker_with(&hold);
    until(&mut worker, || held.exists());
    // The time since the files were written is what matters, so there is no event to wait for.
    std::thread::sleep(WAIT);
    let artifacts = fleet.path().join("shared/artifacts");
    let old = SystemTime::now() - Duration::from_hours(2);
    for path in files(&artifacts)
        .keys()
        .filter(|path| !path.starts_with("tmp"))
    {
        let file = File::options().write(true).open(artifacts.join(path));
        file.expect("a file").set_modified(old).expect("changed");
    }
    let before = files(&artifacts).len();
    fleet.shared(&["check", "--collect=1"]);
    assert!(files(&artifacts).len() < before, "nothing was removed");
    std::fs::remove_file(&held).expect("removed");
    assert!(worker.wait().expect("an exit code").success());
    fleet.assert_same();
}

/// Waiting does not help if the server refuses the user from now on.
#[test]
fn a_worker_that_may_not_connect_again_says_why_and_ends() {
    let Some(fleet) = Fleet::new("4") else { return };
    fleet.shared(&["plan"]).expect(0);
    fleet.sql("CREATE ROLE grid LOGIN SUPERUSER");
    let url = fleet.server.url().replace("mocban@", "grid@");
    let mut command = binary();
    command.current_dir(fleet.path()).envs([TIME_SCALE]);
    command.args(["-C", "shared", "--catalog", &url, "worker", "-j", "1"]);
    // The worker must not end before it loses its right.
    let held = fleet.path().join("held");
    let hold = ("MOCBAN_HOLD_FILE", held.to_str().expect("UTF-8"));
    command.envs([("MOCBAN_HOLD_AT", "depth:synced"), hold]);
    let worker = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut worker = worker.expect("the binary starts");
    until(&mut worker, || held.exists());
    fleet.sql(
        "ALTER ROLE grid NOLOGIN;
        SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = 'grid';",
    );
    std::fs::remove_file(&held).expect("removed");
    let ended = worker.wait_with_output().expect("an exit code");
    let text = String::from_utf8_lossy(&ended.stderr);
    assert!(!ended.status.success(), "{text}");
    assert!(text.contains("not permitted to log in"), "{text}");
    fleet.assert_success(fleet.worker());
    fleet.assert_same();
}

/// The connection of a killed process is gone at once, so others need not wait for the end of its leases.
#[test]
fn pairs_of_a_killed_worker_are_taken_before_their_leases_end() {
    /// Delays the end of a killed worker's leases by an hour, if nobody has taken its pairs yet.
    const DELAY: &str = "UPDATE mocban.worker SET heartbeat = heartbeat + 3600000
        WHERE pid = $1 AND ended IS NULL AND died = 0";
    let Some(fleet) = Fleet::new("4") else { return };
    fleet.shared(&["plan"]).expect(0);
    let held = fleet.path().join("held");
    let file = held.to_str().expect("UTF-8");
    let hold = [
        ("MOCBAN_HOLD_AT", "fit:computed"),
        ("MOCBAN_HOLD_FILE", file),
    ];
    let mut victim = fleet.worker_with(&hold);
    until(&mut victim, || held.exists());
    let done = || fleet.shared(&["status", "--json"]).expect(0).json()["jobs"]["done"].clone();
    let mut other = fleet.worker_with(&[]);
    until(&mut other, || done() != 0);
    victim.kill().expect("killed");
    victim.wait().expect("an exit code");
    let pid = i64::from(victim.id());
    fleet.on_server(async |conn| sqlx::query(DELAY).bind(pid).execute(conn).await);
    wait_until("the pairs are done", || done() == 4);
    fleet.assert_success(other);
    fleet.assert_same();
}

#[test]
fn a_worker_with_other_settings_is_refused() {
    let Some(fleet) = Fleet::new("2") else { return };
    fleet.shared(&["plan"]).expect(0);
    let refused = fleet.shared(&["--set", "register.smoothing_px=1.3", "worker"]);
    let refused = refused.expect(2);
    let expected = "the last plan has other settings (register.smoothing_px: ";
    assert!(refused.err.contains(expected), "{}", refused.err);
}

#[test]
fn every_refusal_of_the_server_says_what_to_do() {
    let Some(fleet) = Fleet::new("2") else { return };
    let url = fleet.server.url();
    let at = |url: &str, args: &[&str]| {
        let mut command = binary();
        command.current_dir(fleet.path()).env_remove("PGPASSWORD");
        call(command.args(["-C", "shared", "--catalog", url]).args(args))
    };
    fleet.sql("CREATE ROLE guarded LOGIN PASSWORD 'secret'; CREATE ROLE viewer LOGIN;
        GRANT USAGE ON SCHEMA mocban TO viewer; GRANT SELECT ON ALL TABLES IN SCHEMA mocban TO viewer;");
    let mut cases = Vec::new();
    cases.push((
        at(&url.replace("mocban@", "guarded@"), &["status"]),
        "PGPASSWORD",
    ));
    cases.push((
        at(&url.replace("/postgres?", "/nowhere?"), &["status"]),
        "createdb",
    ));
    let host = url.split("host=").nth(1).expect("a socket");
    cases.push((
        at(&url.replace(host, "/nowhere"), &["status"]),
        "PostgreSQL runs",
    ));
    cases.push((
        at(
            &format!("{url}&options=-c%20search_path%3Dempty"),
            &["status"],
        ),
        "mocban import",
    ));
    cases.push((
        at("postgres://me:secret@localhost/lab", &["status"]),
        ".pgpass",
    ));
    cases.push((
        at("postgres://me@db.example/lab?sslmode=disable", &["status"]),
        "verify-full",
    ));
    cases.push((at("mysql://me@db.example/lab", &["status"]), "postgres"));
    let viewer = url.replace("mocban@", "viewer@");
    at(&viewer, &["status"]).expect(0);
    cases.push((at(&viewer, &["worker"]), "more rights"));
    fleet.sql("UPDATE mocban.catalog_version SET version = 9000");
    cases.push((at(url, &["status"]), "another version"));
    for (call, way_on) in cases {
        assert_ne!(call.code, 0);
        assert!(call.err.contains(way_on), "{way_on}: {}", call.err);
        assert_eq!(
            call.err
                .lines()
                .filter(|line| line.starts_with("error:"))
                .count(),
            1,
            "{}",
            call.err
        );
        assert!(!call.err.contains("secret"), "{}", call.err);
    }
}
