//! PostgreSQL servers for tests. Each listens on a socket in a temporary directory and ends with this process.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, Once, OnceLock};

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

/// Creates the files of a database cluster in the folder `$1` with the programs in `$2`, and prints a line. Removes the
/// folder when its standard input ends. The programs refuse to run as root, so `$3` may hold a command that changes the
/// user. The user `guarded` needs a password.
const CLUSTER_SCRIPT: &str = r#"
cd "$1" || exit 1
$3 "$2/initdb" -D "$1/data" -U mocban -A trust --no-sync --locale=C -E UTF8 >"$1/log" 2>&1 || exit 1
printf 'local all guarded scram-sha-256\nlocal all all trust\nhost all all 127.0.0.1/32 trust\n' | $3 tee "$1/data/pg_hba.conf" >/dev/null
echo ready
read -r _
rm -rf "$1"
"#;

/// Copies the cluster of the folder `$5` to the folder `$1`, and starts the server with the programs in `$2`. Then stops
/// it at once, as in a crash, for each line `stop`, and starts it for each line `start`. Prints a line after each. Ends, and
/// removes the folder, when its standard input ends. `$3` is that of [`CLUSTER_SCRIPT`]. `$4` may hold more options of the
/// server. Nothing is synced to the disk: the server crashes, but the computer does not.
const SCRIPT: &str = r#"
cd "$1" || exit 1
start() {
    $3 "$2/postgres" -D "$1/data" -k "$1" -c listen_addresses= -c max_connections=200 -c fsync=off $4 >>"$1/log" 2>&1 &
    server=$!
    until "$2/pg_isready" -q -h "$1" -U mocban -d postgres; do
        kill -0 $server 2>/dev/null || exit 1
        sleep 0.02
    done
    echo ready
}
$3 cp -R "$5/data" "$1/data" || exit 1
start "$1" "$2" "$3" "$4"
while read -r command; do
    case $command in
        stop) kill -QUIT $server; wait $server; echo ready ;;
        start) start "$1" "$2" "$3" "$4" ;;
    esac
done
kill -QUIT $server
wait $server
rm -rf "$1"
"#;

/// The port in the name of a server's socket, unless it listens on a port of its own.
const DEFAULT_PORT: u16 = 5432;

/// Standard input and output of a script. The script ends with this process, so nobody waits for it.
type ScriptPipes = (ChildStdin, BufReader<ChildStdout>);

/// A running server.
#[derive(Debug)]
pub(crate) struct Server {
    /// Address of its database, to which parameters can be added with `&`.
    url: String,
    commands: Mutex<ScriptPipes>,
}

/// Returns the address of a server that all tests of this process share, unless `MOCBAN_TEST_POSTGRES` names one.
#[allow(dead_code, reason = "not every test binary shares a server")]
pub(crate) fn url() -> Option<&'static str> {
    static SHARED: OnceLock<Option<Server>> = OnceLock::new();
    static GIVEN: OnceLock<Option<String>> = OnceLock::new();
    let given = GIVEN.get_or_init(|| std::env::var("MOCBAN_TEST_POSTGRES").ok());
    if let Some(url) = given {
        return Some(url);
    }
    SHARED.get_or_init(Server::start).as_ref().map(Server::url)
}

impl Server {
    /// Starts a server. Returns `None`, and prints why once, if none is installed.
    pub(crate) fn start() -> Option<Self> {
        Self::start_with(DEFAULT_PORT, "", |_| {})
    }

    /// Starts a server at a port with more options, after `prepare` has written files to its folder.
    pub(crate) fn start_with(
        port: u16,
        options: &str,
        prepare: impl FnOnce(&Path),
    ) -> Option<Self> {
        static SKIPPED: Once = Once::new();
        let Some(programs) = programs() else {
            // Written directly, because the test harness hides what a passing test prints.
            let text = "skipped: no PostgreSQL server (initdb) is installed, so catalogs are tested in files only\n";
            SKIPPED.call_once(|| drop(std::io::stderr().write_all(text.as_bytes())));
            return None;
        };
        let cluster = cluster(&programs);
        let dir = new_folder();
        prepare(&dir);
        let user = other_user(&dir);
        let mut script = Command::new("sh");
        script.args(["-c", SCRIPT, "sh"]).args([&dir, &programs]);
        script.args([user, options]).arg(cluster);
        script.env("PGPORT", port.to_string());
        let place = match port {
            DEFAULT_PORT => String::new(),
            port => format!(":{port}"),
        };
        let server = Self {
            url: format!(
                "postgres://mocban@localhost{place}/postgres?host={}",
                dir.display()
            ),
            commands: Mutex::new(started(&mut script)),
        };
        assert!(
            server.is_ready(),
            "PostgreSQL did not start: see {}",
            dir.display()
        );
        Some(server)
    }

    /// Returns the address of its database.
    pub(crate) fn url(&self) -> &str {
        &self.url
    }

    /// Returns the folder of its socket and its files.
    #[allow(dead_code, reason = "not every test binary uses the folder")]
    pub(crate) fn folder(&self) -> &Path {
        let (_, folder) = self.url.split_once("?host=").expect("a folder");
        Path::new(folder)
    }

    /// Stops the server as in a crash.
    #[allow(dead_code, reason = "not every test binary stops the server")]
    pub(crate) fn stop_at_once(&self) {
        self.command("stop");
    }

    /// Starts the server again.
    #[allow(dead_code, reason = "not every test binary stops the server")]
    pub(crate) fn start_again(&self) {
        self.command("start");
    }

    fn command(&self, command: &str) {
        let mut commands = self.commands.lock().expect("no panic");
        writeln!(commands.0, "{command}").expect("the script reads");
        drop(commands);
        assert!(self.is_ready(), "PostgreSQL did not {command}");
    }

    /// Reads the script's answer.
    fn is_ready(&self) -> bool {
        is_ready(&mut self.commands.lock().expect("no panic"))
    }
}

/// Creates a temporary folder, which a script removes.
fn new_folder() -> PathBuf {
    let dir = tempfile::Builder::new().prefix("mocban-pg-").tempdir();
    dir.expect("a temporary directory").keep()
}

/// Starts a script that ends when its standard input does.
fn started(script: &mut Command) -> ScriptPipes {
    #[allow(clippy::zombie_processes, reason = "the script ends with this process")]
    let mut script = script
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("a shell");
    let input = script.stdin.take().expect("a pipe");
    let output = script.stdout.take().expect("a pipe");
    (input, BufReader::new(output))
}

/// Reads a script's answer.
fn is_ready((_, output): &mut ScriptPipes) -> bool {
    let mut line = String::new();
    output.read_line(&mut line).is_ok() && line == "ready\n"
}

/// Returns the folder with the files of a new cluster, which all servers of this process copy.
fn cluster(programs: &Path) -> &'static Path {
    static MADE: OnceLock<(PathBuf, ScriptPipes)> = OnceLock::new();
    let (dir, _) = MADE.get_or_init(|| {
        let dir = new_folder();
        let user = other_user(&dir);
        let mut script = Command::new("sh");
        script.args(["-c", CLUSTER_SCRIPT, "sh"]);
        script.args([dir.as_path(), programs]).arg(user);
        let mut pipes = started(&mut script);
        let is_made = is_ready(&mut pipes);
        assert!(is_made, "initdb failed: see {}", dir.display());
        (dir, pipes)
    });
    dir
}

/// Returns a command that changes the user if this process is root's, and gives the folder and its files to that user.
#[cfg(unix)]
pub(crate) fn other_user(dir: &Path) -> &'static str {
    if !rustix::process::geteuid().is_root() {
        return "";
    }
    let nobody = Some(65534);
    let files = std::fs::read_dir(dir).expect("a folder");
    let files = files.map(|file| file.expect("an entry").path());
    for path in files.chain([dir.to_owned()]) {
        std::os::unix::fs::chown(path, nobody, nobody).expect("root may change the owner");
    }
    "setpriv --reuid=65534 --regid=65534 --clear-groups"
}

#[cfg(not(unix))]
pub(crate) const fn other_user(_dir: &Path) -> &'static str {
    ""
}

/// Returns the folder of the server's programs. On Windows, the script would need a shell, so there is none.
fn programs() -> Option<PathBuf> {
    if cfg!(windows) {
        return None;
    }
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
