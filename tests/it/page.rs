//! Starts the review server as a user does, and sends raw HTTP requests.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use mocban::store::Project;
use serde_json::{Value, json};

use crate::cli::{binary, call, mocban};
use crate::made_once::copy_of;
use crate::resume::{project, run};
use crate::waiting::{LONGEST, pause};

/// Number of pairs of the shared project, with up to four results each.
const PAIRS: &str = "15";

/// Copies a project in which every pair has results. All tests copy the same project.
pub(crate) fn read_project(dir: &tempfile::TempDir) -> Project {
    project_with_results(dir.path())
}

fn project_with_results(dir: &Path) -> Project {
    copy_of("a project with results", dir, |dir| {
        call(&mut run(&project(dir, "p", PAIRS), &[])).expect(0);
    });
    Project::open(&dir.join("p")).expect("a project")
}

/// Copies the project of [`read_project`] with the pair `broken` of `more.csv`, which failed. The settings are the usual ones,
/// with which all pairs have run again.
pub(crate) fn project_with_failure(dir: &Path) -> Project {
    copy_of("a project with a failed pair", dir, |dir| {
        let project = project_with_results(dir);
        std::fs::write(project.dir().join("broken.stl"), "solid x").expect("written");
        let list = "id,mesh,print,block\nbroken,broken.stl,data/prints/upright-0001.jpg,b 01\n";
        std::fs::write(project.dir().join("more.csv"), list).expect("written");
        mocban(project.dir(), &["import", "more.csv"]).expect(0);
        mocban(project.dir(), &["run"]).expect(3);
    });
    Project::open(&dir.join("p")).expect("a project")
}

/// Options for a queue without planted faults and duplicates.
pub(crate) const NO_CHECKS: [&str; 4] = ["--attention-checks", "0", "--duplicates", "0"];

/// Opens the page of the reviewer `lan` on a copy of the shared project.
pub(crate) fn open_review(args: &[&str]) -> (tempfile::TempDir, Project, Page) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::open(&project, "lan", args);
    (dir, project, page)
}

/// An HTTP response.
#[derive(Debug)]
pub(crate) struct Reply {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

impl Reply {
    /// Parses the body as JSON.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("JSON")
    }

    /// Returns the value of a header.
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let lines = self.head.lines().filter_map(|line| line.split_once(": "));
        let mut named = lines.filter(|(found, _)| found.eq_ignore_ascii_case(name));
        named.next().map(|(_, value)| value)
    }
}

/// A server, and the secrets of its page.
pub(crate) struct Page {
    child: Child,
    site: Site,
}

/// Address and secrets of a server.
#[derive(Clone)]
pub(crate) struct Site {
    /// The start URL.
    pub(crate) url: String,
    /// Host name and port.
    pub(crate) host: String,
    /// Path below which the pages of the session are.
    pub(crate) session: String,
    pub(crate) cookie: String,
    pub(crate) csrf_token: String,
}

impl std::ops::Deref for Page {
    type Target = Site;

    fn deref(&self) -> &Site {
        &self.site
    }
}

impl Page {
    /// Starts the server of a reviewer without a session.
    pub(crate) fn start(project: &Project, reviewer: &str, args: &[&str]) -> Self {
        Self::of(review(project, reviewer).args(args))
    }

    /// Starts the server of a command that prints its address as JSON.
    pub(crate) fn of(command: &mut Command) -> Self {
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the binary starts");
        let mut line = String::new();
        let out = child.stdout.take().expect("a pipe");
        BufReader::new(out).read_line(&mut line).expect("a line");
        let message: Value = serde_json::from_str(&line).expect("JSON on stdout");
        let url = message["url"].as_str().expect("an address").to_owned();
        let site = Site::closed(&url);
        Self { child, site }
    }

    /// Starts the server and opens a session as a browser does.
    pub(crate) fn open(project: &Project, reviewer: &str, args: &[&str]) -> Self {
        Self::start(project, reviewer, args).with_session()
    }

    /// Opens a session as a browser does, and reads the CSRF token of a review.
    pub(crate) fn with_session(self) -> Self {
        let mut page = self;
        page.site.enter();
        page.site.read_csrf_token();
        page
    }

    /// Opens a session as a browser does.
    pub(crate) fn entered(self) -> Self {
        let mut page = self;
        page.site.enter();
        page
    }

    /// Returns the process id of the server.
    pub(crate) fn pid(&self) -> rustix::process::Pid {
        rustix::process::Pid::from_child(&self.child)
    }

    /// Waits for the server to end and returns its exit code. Fails if the server does not end.
    pub(crate) fn exit_code(&mut self) -> Option<i32> {
        let deadline = Instant::now() + LONGEST;
        loop {
            if let Some(ended) = self.child.try_wait().expect("its state") {
                return ended.code();
            }
            assert!(Instant::now() < deadline, "the server does not end");
            pause();
        }
    }

    /// Kills the server as by `kill -9`.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("killed");
        self.child.wait().expect("dead");
    }
}

impl Site {
    /// Returns the server of a start URL, without a session.
    pub(crate) fn closed(url: &str) -> Self {
        let host = url["http://".len()..].split('/').next().expect("a host");
        Self {
            host: host.to_owned(),
            url: url.to_owned(),
            session: String::new(),
            cookie: String::new(),
            csrf_token: String::new(),
        }
    }

    /// Opens a session as a browser does.
    fn enter(&mut self) {
        let reply = self.get_path(self.start_path());
        self.keep_session(reply);
    }

    /// Opens the session of an invitation, as its button does.
    fn press_begin(&mut self) {
        let headers = [
            ("host", self.host.clone()),
            ("origin", format!("http://{}", self.host)),
        ];
        let reply = send(self.address(), "POST", self.start_path(), &headers, b"");
        self.keep_session(reply.expect("a reply"));
    }

    fn keep_session(&mut self, reply: Reply) {
        let cookie = reply.header("set-cookie").expect("a cookie");
        let cookie = cookie.split(';').next().expect("a value").to_owned();
        let html = String::from_utf8(reply.body).expect("UTF-8");
        let session = html.split("data-session=\"").nth(1).expect("a session");
        let session = session.split("/\"").next().expect("a path").to_owned();
        (self.cookie, self.session) = (cookie, session);
    }

    /// Opens the session of an invitation, and reads the CSRF token of the review.
    pub(crate) fn enter_as_guest(&mut self) {
        self.press_begin();
        self.read_csrf_token();
    }

    fn read_csrf_token(&mut self) {
        let boot = self.get("/api/config").json();
        let token = boot["csrf_token"].as_str().expect("a token");
        token.clone_into(&mut self.csrf_token);
    }

    /// Returns the socket address.
    pub(crate) fn address(&self) -> SocketAddr {
        self.host.parse().expect("an address")
    }

    /// Returns the headers of a write request of the page.
    pub(crate) fn headers(&self) -> Vec<(&'static str, String)> {
        vec![
            ("host", self.host.clone()),
            ("cookie", self.cookie.clone()),
            ("origin", format!("http://{}", self.host)),
            ("content-type", "application/json".to_owned()),
            ("x-csrf-token", self.csrf_token.clone()),
        ]
    }

    /// Returns path and query of the start URL.
    pub(crate) fn start_path(&self) -> &str {
        &self.url["http://".len() + self.host.len()..]
    }

    /// Requests a page of the session.
    pub(crate) fn get(&self, page: &str) -> Reply {
        self.get_path(&format!("{}{page}", self.session))
    }

    /// Requests a path with the cookie of the session.
    pub(crate) fn get_path(&self, path: &str) -> Reply {
        let headers = [("host", self.host.clone()), ("cookie", self.cookie.clone())];
        send(self.address(), "GET", path, &headers, b"").expect("a reply")
    }

    /// Sends a write request of the page; fails if the server is gone.
    pub(crate) fn post(&self, page: &str, body: &Value) -> std::io::Result<Reply> {
        let body = body.to_string();
        send(
            self.address(),
            "POST",
            &format!("{}{page}", self.session),
            &self.headers(),
            body.as_bytes(),
        )
    }

    /// Returns the items in order.
    pub(crate) fn queue(&self) -> Vec<Value> {
        let queue = self.get("/api/queue").json();
        queue["items"].as_array().expect("items").clone()
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // Fails if the server was killed before.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the command of a reviewer's page.
pub(crate) fn review(project: &Project, reviewer: &str) -> Command {
    let mut command = binary();
    command.arg("-C").arg(project.dir());
    command.args(["--json", "review", "--no-open", "--reviewer", reviewer]);
    command
}

/// Returns an answer as the page sends it.
pub(crate) fn answer(event: &str, item: &Value, verdict: &str) -> Value {
    json!({
        "event": event, "item": item["id"], "verdict": verdict, "reason": null, "note": null,
        "angle_read_deg": null, "shown_ms": 1200,
    })
}

/// Sends a request with only the given headers and reads the whole response.
pub(crate) fn send(
    to: SocketAddr,
    method: &str,
    path: &str,
    headers: &[(&str, String)],
    body: &[u8],
) -> std::io::Result<Reply> {
    let mut lines = vec![format!("{method} {path} HTTP/1.1")];
    lines.push("connection: close".to_owned());
    lines.extend(
        headers
            .iter()
            .map(|(name, value)| format!("{name}: {value}")),
    );
    if method == "POST" {
        lines.push(format!("content-length: {}", body.len()));
    }
    let mut stream = TcpStream::connect(to)?;
    stream.set_read_timeout(Some(LONGEST))?;
    stream.write_all(format!("{}\r\n\r\n", lines.join("\r\n")).as_bytes())?;
    // A server that rejects the headers may close before the body is sent.
    let _ = stream.write_all(body);
    let mut bytes = Vec::new();
    // The connection may then be reset after a complete response.
    let _ = stream.read_to_end(&mut bytes);
    parse(bytes).ok_or_else(|| std::io::ErrorKind::UnexpectedEof.into())
}

/// Parses a response; `None` if it is not complete.
fn parse(mut bytes: Vec<u8>) -> Option<Reply> {
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n")?;
    let body = bytes.split_off(end + 4);
    let head = String::from_utf8(bytes).ok()?;
    let reply = Reply {
        status: head.split(' ').nth(1)?.parse().ok()?,
        head,
        body,
    };
    let wanted = reply.header("content-length").unwrap_or("0");
    (reply.body.len() == wanted.parse::<usize>().ok()?).then_some(reply)
}
