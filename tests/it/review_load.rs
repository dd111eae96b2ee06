//! The review server under load: many open connections, slow clients, a signal in the middle of a request, and large
//! prints.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;

use mocban::store::Project;
use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, kill_process, prlimit};

use crate::cli::{call, mocban};
use crate::memory::enlarge;
use crate::page::{NO_CHECKS, Page, answer, open_review, read_project, review};
use crate::resume::{pairs, project, run};
use crate::test_size::trials;
use crate::waiting::{LONGEST, PATIENT};

/// Makes the server wait for ten minutes for its last responses.
const UNHURRIED: (&str, &str) = ("MOCBAN_SHUTDOWN_FACTOR", "300");

/// Opens the page of the reviewer `lan` on a copy of the shared project, on a server with other time limits.
fn open_with(limits: &[(&str, &str)]) -> (tempfile::TempDir, Project, Page) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let mut command = review(&project, "lan");
    command.args(NO_CHECKS).envs(limits.iter().copied());
    let page = Page::of(&mut command).with_session();
    (dir, project, page)
}

/// Sets the maximum number of open files of a process.
fn limit_files(pid: Pid, files: u64) {
    let limit = Rlimit {
        current: Some(files),
        maximum: getrlimit(Resource::Nofile).maximum,
    };
    prlimit(Some(pid), Resource::Nofile, limit).expect("a lower limit");
}

/// Requests are served although the connections stay open for hours.
#[test]
fn half_open_and_slow_connections_do_not_delay_other_requests() {
    let (_dir, _project, page) = open_with(&[PATIENT]);
    limit_files(page.pid(), 256);
    let mut open = Vec::new();
    for i in 0..400 {
        let mut stream = TcpStream::connect(page.address()).expect("connected");
        let sent = ["", "GET / HTTP/1.1\r\nhost: "][i % 2];
        stream.write_all(sent.as_bytes()).expect("sent");
        open.push(stream);
        if i % 80 == 79 {
            // Sends one more byte on each connection. Fails on those that the server has closed.
            for stream in &mut open {
                let _ = stream.write_all(b"a");
            }
            assert_eq!(page.get("/api/queue").status, 200, "{i} connections");
        }
    }
}

/// Sends the head of an answer and waits until the server asks for the body.
pub(crate) fn begun_answer(page: &Page, body: &str) -> TcpStream {
    let headers = page.headers().into_iter();
    let headers = headers.map(|(name, value)| format!("{name}: {value}"));
    let lines = [
        format!("POST {}/api/answer HTTP/1.1", page.session),
        "expect: 100-continue".to_owned(),
        format!("content-length: {}", body.len()),
    ];
    let lines: Vec<String> = lines.into_iter().chain(headers).collect();
    let head = format!("{}\r\n\r\n", lines.join("\r\n"));
    let mut stream = TcpStream::connect(page.address()).expect("connected");
    stream.write_all(head.as_bytes()).expect("sent");
    let mut reply = [0; 25];
    stream.read_exact(&mut reply).expect("a reply");
    assert_eq!(&reply, b"HTTP/1.1 100 Continue\r\n\r\n");
    stream
}

/// Sends Ctrl-C and waits until the server accepts no further connections.
fn interrupt(page: &Page) {
    kill_process(page.pid(), Signal::INT).expect("sent");
    while let Ok(stream) = TcpStream::connect(page.address()) {
        drop(stream);
        std::thread::yield_now();
    }
}

/// The server waits for the answer, but not for the headers of other connections.
#[test]
fn a_signal_ends_the_server_despite_open_connections_and_stores_answers_in_flight() {
    let (_dir, project, mut page) = open_with(&[PATIENT, UNHURRIED]);
    let body = answer("e1", &page.queue()[0], "pass").to_string();
    let mut open = Vec::new();
    for sent in ["", "GET / HTTP/1.1\r\n"] {
        let mut stream = TcpStream::connect(page.address()).expect("connected");
        stream.write_all(sent.as_bytes()).expect("sent");
        open.push(stream);
    }
    let mut stream = begun_answer(&page, &body);
    stream.set_read_timeout(Some(LONGEST)).expect("a limit");
    interrupt(&page);
    stream.write_all(body.as_bytes()).expect("sent");
    let mut reply = String::new();
    let read = stream.read_to_string(&mut reply);
    assert!(reply.starts_with("HTTP/1.1 200"), "{read:?} {reply}");
    assert_eq!(page.exit_code(), Some(0));
    let log = mocban(project.dir(), &["verdict", "log"]).expect(0);
    assert!(log.out.contains("pass"), "{}", log.out);
}

#[test]
fn a_signal_ends_the_server_although_a_request_never_ends() {
    let (_dir, project, mut page) = open_with(&[PATIENT]);
    let body = answer("e1", &page.queue()[0], "pass").to_string();
    let mut stream = begun_answer(&page, &body);
    stream.write_all(&body.as_bytes()[..9]).expect("sent");
    interrupt(&page);
    assert_eq!(page.exit_code(), Some(0));
    let mut reply = Vec::new();
    let ended = stream.read_to_end(&mut reply);
    let is_reset = ended.is_err_and(|error| error.kind() == ErrorKind::ConnectionReset);
    assert!(reply.is_empty(), "not acknowledged; reset: {is_reset}");
    let log = mocban(project.dir(), &["verdict", "log"]).expect(0);
    assert_eq!(log.out, "");
}

/// Returns the peak memory of a process in MiB.
pub(crate) fn peak_mib(pid: Pid) -> u64 {
    let path = format!("/proc/{}/status", pid.as_raw_nonzero());
    let status = std::fs::read_to_string(path).expect("a running process");
    let mut lines = status.lines();
    let kib = lines.find_map(|line| line.strip_prefix("VmHWM:")?.strip_suffix("kB"));
    kib.expect("a peak").trim().parse::<u64>().expect("KiB") >> 10
}

/// Each decoded print has 29 MiB.
#[test]
fn memory_does_not_grow_with_the_number_of_items_shown() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "large", "3");
    for pair in pairs(&project) {
        let print = project.input_path(&pair.results.attributes.print_path);
        enlarge(&print, 5_000_000);
    }
    call(&mut run(&project, &["-j", "1"])).expect(0);
    let page = Page::open(&project, "lan", &NO_CHECKS);
    let queue = page.queue();
    assert!(queue.len() >= 6, "{} items", queue.len());
    // Requests at the same time, as a page sends them.
    std::thread::scope(|scope| {
        for item in &queue {
            let id = item["id"].as_str().expect("an id");
            let (site, path) = (&page, format!("/image/{id}/print"));
            scope.spawn(move || assert_eq!(site.get(&path).status, 200));
        }
    });
    let peak = peak_mib(page.pid());
    assert!(peak < 160, "{peak} MiB");
}

/// Eight clients at once. Most requests are answered from memory; in each trial, each client also reads a scan, draws an
/// image, and reads the queue, for which errors are planted in depth maps.
#[test]
fn memory_does_not_grow_with_the_number_of_requests() {
    let (_dir, _project, page) = open_review(&[]);
    let queue = page.queue();
    let ids = queue.iter().map(|item| item["id"].as_str().expect("an id"));
    let ids: Vec<&str> = ids.collect();
    let (site, ids, trials) = (&*page, &*ids, trials(8));
    std::thread::scope(|scope| {
        for client in 0..8 {
            scope.spawn(move || {
                let get = |path: &str| assert_eq!(site.get(path).status, 200, "{path}");
                for trial in 0..trials {
                    let id = ids[(5 * client + trial) % ids.len()];
                    get(&format!("/scan/{id}"));
                    get(&format!("/image/{id}/depth-frame-relief"));
                    get("/api/queue");
                    for i in 0..40 {
                        get(&format!("/image/{}/print", ids[i % ids.len()]));
                    }
                }
            });
        }
    });
    let peak = peak_mib(page.pid());
    assert!(peak < 232, "{peak} MiB");
}
