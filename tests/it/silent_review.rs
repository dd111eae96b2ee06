//! Answers of the review page while the catalog or the page's own server does not reply, or is gone.

use std::collections::BTreeSet;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;

use rustix::process::{Signal, kill_process};
use serde_json::{Value, json};

use crate::browser::Browser;
use crate::cli::mocban;
use crate::lab::Lab;
use crate::own_port::own_port;
use crate::page::{Page, answer, read_project, review};
use crate::review_browser::{PLAIN, current_verdicts, enter, judge, ready, saved, shown};
use crate::review_load::begun_answer;
use crate::silent_server::Suspended;
use crate::waiting::PATIENT;

/// Starts a page on a server with other time limits, and sends an answer after the server no longer replies. Calls `then`
/// while the answer waits.
fn with_waiting_answer(limits: (&str, &str), then: impl FnOnce(&mut Page, TcpStream)) {
    let Some(lab) = Lab::new("2") else {
        return;
    };
    lab.call("mocban", "run").expect(0);
    let words = "--json review --no-open --reviewer lan --attention-checks 0 --duplicates 0";
    let mut command = lab.command("mocban", words);
    let mut page = Page::of(command.envs([limits])).with_session();
    let body = answer("e1", &page.queue()[0], "pass").to_string();
    let _suspended = Suspended::of_lab(&lab);
    let mut stream = begun_answer(&page, &body);
    stream.write_all(body.as_bytes()).expect("sent");
    then(&mut page, stream);
}

/// Returns a response up to the end of its JSON, or of the connection.
fn reply(stream: TcpStream) -> String {
    let mut bytes = Vec::new();
    // A reset is an end too.
    let _ = BufReader::new(stream).read_until(b'}', &mut bytes);
    String::from_utf8(bytes).expect("UTF-8")
}

/// The answer and its statements would be waited for for hours.
#[test]
fn a_signal_ends_a_review_whose_server_does_not_reply() {
    for signals in [1, 2] {
        with_waiting_answer(PATIENT, |page, stream| {
            for _ in 0..signals {
                kill_process(page.pid(), Signal::INT).expect("sent");
            }
            assert_eq!(page.exit_code(), Some(0), "{signals}");
            assert!(!reply(stream).starts_with("HTTP/1.1 200"));
        });
    }
}

#[test]
fn an_answer_is_given_up_if_the_server_does_not_reply() {
    with_waiting_answer(("MOCBAN_TIME_SCALE", "20"), |_, stream| {
        let reply = reply(stream);
        assert!(reply.starts_with("HTTP/1.1 503"), "{reply}");
        assert!(reply.contains("has not confirmed this in time"), "{reply}");
    });
}

#[test]
fn an_answer_without_a_reply_is_sent_again() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let mut command = review(&project, "lan");
    // The page gives a request up after 3 s, in which a busy machine stores an answer.
    let page = Page::of(command.args(PLAIN).env("MOCBAN_TIME_SCALE", "5"));
    let tab = enter(&browser, &page, [1024, 768]);
    tab.wait("document.body.dataset.prefetched === document.body.dataset.shown");
    // The server accepts connections, but does not reply.
    kill_process(page.pid(), Signal::STOP).expect("suspended");
    tab.key("KeyP");
    tab.wait("document.getElementById('alert').textContent.startsWith('No connection to mocban')");
    kill_process(page.pid(), Signal::CONT).expect("continued");
    saved(&tab);
    let log = mocban(project.dir(), &["--json", "verdict", "log"]).expect(0);
    let acts = log.out.lines().map(|line| {
        let event: Value = serde_json::from_str(line).expect("JSON");
        event["act"].to_string()
    });
    assert_eq!(acts.collect::<BTreeSet<_>>().len(), 1, "{}", log.out);
}

#[test]
fn at_most_three_answers_wait_for_a_lost_server() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let port = own_port().to_string();
    let on_port = [&PLAIN[..], &["--port", &port]].concat();
    let mut page = Page::start(&project, "lan", &on_port);
    let tab = enter(&browser, &page, [1024, 768]);
    judge(&tab, "KeyP");
    saved(&tab);
    tab.wait("document.body.dataset.prefetched === document.body.dataset.shown");
    page.kill();
    for waiting in 1..=3 {
        let before = shown(&tab);
        tab.key("KeyP");
        tab.wait(&format!("document.body.dataset.shown !== '{before}'"));
        tab.wait(&format!(
            "document.getElementById('saved').textContent === '{waiting} not saved'"
        ));
    }
    let blocked = shown(&tab);
    tab.key("KeyP");
    tab.wait("document.getElementById('alert').textContent.startsWith('3 answers are not saved')");
    assert_eq!(shown(&tab), blocked);
    let next = Page::start(&project, "lan", &on_port);
    let _other = enter(&browser, &next, [1024, 768]);
    saved(&tab);
    assert_eq!(current_verdicts(&project, "lan").len(), 4);
    assert_eq!(tab.eval("document.getElementById('alert').hidden"), true);
}

#[test]
fn the_end_says_how_many_answers_are_not_saved() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let port = own_port().to_string();
    let few = ["--metric", "density", "--sample", "3", "--port", &port];
    let few = [&PLAIN[..], &few].concat();
    let mut page = Page::start(&project, "lan", &few);
    let tab = enter(&browser, &page, [1024, 768]);
    judge(&tab, "KeyP");
    saved(&tab);
    tab.wait("document.body.dataset.prefetched === document.body.dataset.shown");
    page.kill();
    judge(&tab, "KeyP");
    tab.wait("document.body.dataset.prefetched === document.body.dataset.shown");
    tab.key("KeyP");
    let head = |text: &str| {
        tab.wait(&format!(
            "document.getElementById('pair').textContent.startsWith('{text}')"
        ));
    };
    head("All images are reviewed, but 2 not saved yet");
    tab.before_scripts(LOG_FETCHES);
    let next = Page::start(&project, "lan", &few);
    let _other = enter(&browser, &next, [1024, 768]);
    head("All images are reviewed. Thank you.");
    assert_eq!(current_verdicts(&project, "lan").len(), 3);
    // An answer that is stored while the queue is read would be missing in both.
    let fetches = tab.eval("window.fetches.slice(0, 3)");
    assert_eq!(
        fetches,
        json!([
            "api/queue has replied",
            "api/answer",
            "api/answer has replied"
        ])
    );
}

/// Script that lists the requests and replies of a page that concern the reviewer's answers.
const LOG_FETCHES: &str = "
    window.fetches = [];
    const plain = window.fetch;
    window.fetch = async (path, options) => {
        if (path === 'api/answer') window.fetches.push(path);
        const response = await plain(path, options);
        if (['api/answer', 'api/queue'].includes(path)) window.fetches.push(`${path} has replied`);
        return response;
    };";

/// A page that is read again shows its item although its answer cannot be stored.
#[test]
fn a_page_with_an_answer_that_cannot_be_stored_is_shown() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::start(&project, "lan", &PLAIN);
    let tab = enter(&browser, &page, [1024, 768]);
    tab.before_scripts(REFUSE_ANSWERS);
    tab.eval(LEAVE_AN_ANSWER);
    tab.reload();
    ready(&tab);
    tab.wait("document.getElementById('saved').textContent === '1 not saved'");
    assert!(current_verdicts(&project, "lan").is_empty());
}

/// Script that leaves an answer to the first item as one that is not saved yet.
const LEAVE_AN_ANSWER: &str = "fetch('api/queue').then((reply) => reply.json()).then(({ items }) => {
    const body = { event: crypto.randomUUID(), item: items[0].id, verdict: 'pass', reason: null, note: null };
    sessionStorage.setItem('mocban-pending:lan', JSON.stringify([{ path: 'api/answer', body }]));
})";

/// Script with which every answer fails at the server.
const REFUSE_ANSWERS: &str = "
    const plain = window.fetch;
    window.fetch = async (path, options) =>
        path === 'api/answer' ? new Response('{}', { status: 503 }) : plain(path, options);";
