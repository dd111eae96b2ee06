//! A catalog in PostgreSQL behind the connection pooler `PgBouncer`.

use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use sqlx::postgres::PgConnectOptions;
use sqlx::{ConnectOptions as _, Row as _};

use crate::cli::{Call, binary, call, empty, mocban};
use crate::made_once::copy_folder;
use crate::postgres_server::{Server, other_user};
use crate::resume::project;
use crate::skipped::say_skipped;
use crate::waiting::wait_until;

/// A running pooler, which ends with this value.
struct Pooler {
    process: Child,
    url: String,
}

impl Pooler {
    /// Starts a pooler with a mode in the folder of a server.
    fn start(program: &Path, server: &Server, mode: &str) -> Self {
        let folder = server.folder();
        let settings = folder.join("pooler.ini");
        let socket = folder.display();
        let text = format!(
            "[databases]\npostgres = host={socket} user=mocban\n[pgbouncer]\nlisten_addr =\nunix_socket_dir = {socket}\n\
             listen_port = 6432\nauth_type = any\npool_mode = {mode}\n"
        );
        std::fs::write(&settings, text).expect("written");
        // The pooler refuses to run as root.
        let user = other_user(folder);
        let mut words = user.split_whitespace().chain(program.to_str());
        let mut command = Command::new(words.next().expect("a program"));
        command.args(words).arg(&settings);
        let command = command.stdout(Stdio::null()).stderr(Stdio::null());
        let process = command.spawn().expect("the pooler starts");
        wait_until("the pooler starts", || {
            UnixStream::connect(folder.join(".s.PGSQL.6432")).is_ok()
        });
        let url = server.url().replace("localhost/", "localhost:6432/");
        Self { process, url }
    }

    fn call(&self, dir: &Path, args: &[&str]) -> Call {
        let mut command = binary();
        command.current_dir(dir);
        call(
            command
                .args(["-C", "shared", "--catalog", &self.url])
                .args(args),
        )
    }
}

/// Returns settings of the program that other clients of a pooler would get.
fn left_settings(url: &str) -> Vec<String> {
    const LEFT: &str = "SELECT name FROM pg_settings WHERE source = 'session'
        AND name IN ('default_transaction_read_only', 'enable_seqscan', 'jit', 'plan_cache_mode', 'search_path')";
    let options: PgConnectOptions = url.parse().expect("a URL");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        // The pooler refuses this parameter.
        let mut conn = options
            .extra_float_digits(None)
            .connect()
            .await
            .expect("a connection");
        let rows = sqlx::raw_sql(LEFT)
            .fetch_all(&mut conn)
            .await
            .expect("rows");
        rows.iter().map(|row| row.get(0)).collect()
    })
}

impl Drop for Pooler {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Returns the pooler's program, or prints that there is none.
fn program() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(["/usr/sbin".into()]);
    let mut files = folders.map(|folder| folder.join("pgbouncer"));
    let found = files.find(|file| file.is_file());
    if found.is_none() {
        say_skipped("pgbouncer is not installed, so no test uses a connection pooler");
    }
    found
}

#[test]
fn a_pooler_by_session_works_and_one_by_transaction_is_refused_in_one_sentence() {
    let (Some(program), Some(server)) = (program(), Server::start()) else {
        return;
    };
    let dir = empty();
    let file = project(dir.path(), "file", "4");
    copy_folder(file.dir(), &dir.path().join("shared"));
    std::fs::remove_file(dir.path().join("shared/catalog.sqlite")).expect("removed");

    let pooler = Pooler::start(&program, &server, "session");
    mocban(dir.path(), &["copy", "file", &pooler.url]).expect(0);
    mocban(dir.path(), &["-C", "file", "run"]).expect(0);
    let report = mocban(dir.path(), &["-C", "file", "report"]).expect(0).out;
    pooler.call(dir.path(), &["plan"]).expect(0);
    let worker = || pooler.call(dir.path(), &["worker", "-j", "1"]).expect(0);
    std::thread::scope(|scope| [(); 2].map(|()| scope.spawn(worker)).map(drop));
    let pooled = pooler.call(dir.path(), &["report"]).expect(0).out;
    assert_eq!(pooled, report);
    drop(pooler);

    let pooler = Pooler::start(&program, &server, "transaction");
    for command in [&["status"][..], &["worker"], &["run"], &["plan"]] {
        let refused = pooler.call(dir.path(), command).expect(2);
        assert!(
            refused.err.contains("pools by transaction") && refused.err.contains("pool_mode"),
            "{}",
            refused.err
        );
        assert_eq!(refused.err.trim_end().lines().count(), 1, "{}", refused.err);
        assert!(left_settings(&pooler.url).is_empty(), "{command:?}");
    }
}
