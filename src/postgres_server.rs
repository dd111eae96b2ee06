//! A PostgreSQL server for tests. It listens on a socket in a temporary directory and ends with this process.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

/// Folders where packages install the server, besides `PATH`. The newest version first.
const FOLDERS: [&str; 7] = [
    "/usr/lib/postgresql/18/bin",
    "/usr/lib/postgresql/17/bin",
    "/usr/lib/postgresql/16/bin",
    "/usr/lib/postgresql/15/bin",
    "/opt/homebrew/opt/postgresql/bin",
    "/usr/local/opt/postgresql/bin",
    "/usr/pgsql/bin",
];

/// Creates a database cluster in the folder `$1` with the programs in `$2`, starts the server, prints a line, and ends
/// when its standard input ends. The server refuses to run as root, so `$3` may hold a command that changes the user.
const SCRIPT: &str = r#"
cd "$1" || exit 1
$3 "$2/initdb" -D "$1/data" -U mocban -A trust --no-sync --locale=C -E UTF8 >"$1/log" 2>&1 || exit 1
$3 "$2/postgres" -D "$1/data" -k "$1" -c listen_addresses= -c fsync=off -c max_connections=200 >>"$1/log" 2>&1 &
server=$!
until "$2/pg_isready" -q -h "$1" -U mocban -d postgres; do
    kill -0 $server 2>/dev/null || exit 1
done
echo ready
cat >/dev/null
kill -QUIT $server
wait $server
rm -rf "$1"
"#;

/// Starts the server, unless `MOCBAN_TEST_POSTGRES` names one. Returns the URL of a database, to which parameters can be
/// added with `&`. Returns `None`, and prints why once, if no server is installed.
pub(crate) fn url() -> Option<&'static str> {
    static URL: OnceLock<Option<String>> = OnceLock::new();
    let found = URL.get_or_init(|| match std::env::var("MOCBAN_TEST_POSTGRES") {
        Ok(url) => Some(url),
        Err(_) => start(),
    });
    found.as_deref()
}

fn start() -> Option<String> {
    let Some(programs) = programs() else {
        // Written directly, because the test harness hides what a passing test prints.
        let text = "skipped: no PostgreSQL server (initdb) found, so the catalog is tested on SQLite only\n";
        let _ = std::io::stderr().write_all(text.as_bytes());
        return None;
    };
    let dir = tempfile::Builder::new().prefix("mocban-pg-").tempdir();
    let dir = dir.expect("a temporary directory").keep();
    let mut user = "";
    if rustix::process::geteuid().is_root() {
        let nobody = Some(65534);
        std::os::unix::fs::chown(&dir, nobody, nobody).expect("root may change the owner");
        user = "setpriv --reuid=65534 --regid=65534 --clear-groups";
    }
    let mut script = Command::new("sh")
        .args(["-c", SCRIPT, "sh"])
        .args([&dir, &programs])
        .arg(user)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("a shell");
    let mut line = String::new();
    let output = script.stdout.take().expect("a pipe");
    let read = BufReader::new(output).read_line(&mut line);
    let log = || std::fs::read_to_string(dir.join("log")).unwrap_or_default();
    assert!(
        read.is_ok() && line == "ready\n",
        "PostgreSQL did not start: {}",
        log()
    );
    // The input stays open until this process ends.
    std::mem::forget(script.stdin.take());
    Some(format!(
        "postgres://mocban@localhost/postgres?host={}",
        dir.display()
    ))
}

fn programs() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).collect::<Vec<_>>();
    let folders = folders.iter().map(PathBuf::as_path);
    let mut folders = folders.chain(FOLDERS.map(Path::new));
    let has_all = |dir: &&Path| {
        ["initdb", "postgres", "pg_isready"]
            .iter()
            .all(|name| dir.join(name).is_file())
    };
    folders.find(has_all).map(Path::to_owned)
}
