//! The review server under random `kill -9`. No acknowledged verdict is lost or stored twice. `MOCBAN_REVIEW_KILLS`
//! sets the number of kills.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc;
use std::time::Duration;

use mocban::store::Project;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::cli::mocban;
use crate::page::{NO_CHECKS, Page, Site, answer, read_project};
use crate::test_size::size_from_env;

/// The requests of a reviewer and their outcomes.
#[derive(Default)]
struct RequestLog {
    /// Acknowledged events by id: the verdict, or `None` if it was undone.
    acknowledged: BTreeMap<String, Option<&'static str>>,
    /// The request that was in flight when the server died; it is sent again.
    open: Option<(&'static str, Value)>,
    acts: u32,
}

impl RequestLog {
    /// Answers random items until the server is gone. Sometimes undoes the last answer. Sends a message after each
    /// acknowledged answer.
    fn review(
        &mut self,
        site: &Site,
        queue: &[Value],
        rng: &mut ChaCha8Rng,
        acknowledged: &mpsc::Sender<()>,
    ) {
        if let Some((path, body)) = self.open.take()
            && !self.send(site, path, body)
        {
            return;
        }
        loop {
            self.acts += 1;
            let event = format!("e{}", self.acts);
            let item = &queue[rng.random_range(0..queue.len())];
            let verdict = if rng.random_bool(0.2) { "fail" } else { "pass" };
            if !self.send(site, "/api/answer", answer(&event, item, verdict)) {
                return;
            }
            // The receiver is gone if the server is about to be killed.
            let _ = acknowledged.send(());
            if rng.random_bool(0.1) && !self.send(site, "/api/undo", json!({ "event": event })) {
                return;
            }
        }
    }

    /// Sends a request; returns whether it was acknowledged.
    fn send(&mut self, site: &Site, path: &'static str, body: Value) -> bool {
        let Ok(reply) = site.post(path, &body) else {
            self.open = Some((path, body));
            return false;
        };
        let output = String::from_utf8_lossy(&reply.body);
        assert_eq!(reply.status, 200, "{output}");
        let event = body["event"].as_str().expect("a number").to_owned();
        let verdict = match body["verdict"].as_str() {
            Some("fail") => Some("fail"),
            Some(_) => Some("pass"),
            None => None,
        };
        self.acknowledged.insert(event, verdict);
        true
    }
}

/// Returns the verdict of each event in the log, or `None` if undone. Fails if an event is stored twice for a metric.
fn stored(project: &Project) -> BTreeMap<String, Option<String>> {
    let output = mocban(project.dir(), &["--json", "verdict", "log"]).expect(0);
    let mut rows = BTreeSet::new();
    let mut acts = BTreeMap::new();
    for line in output.out.lines() {
        let event: Value = serde_json::from_str(line).expect("JSON");
        let number = event["event"].as_str().expect("a number").to_owned();
        let row = format!("{number} {}", event["metric"]);
        assert!(rows.insert(row), "{number} is doubled");
        let verdict = event["verdict"].as_str().map(str::to_owned);
        acts.insert(number, verdict.filter(|_| event["undone_at"].is_null()));
    }
    acts
}

#[test]
fn no_acknowledged_verdict_is_lost_or_doubled() {
    let kills = size_from_env("MOCBAN_REVIEW_KILLS", 15);
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut log = RequestLog::default();
    for _ in 0..kills {
        let mut page = Page::open(&project, "lan", &NO_CHECKS);
        let queue = page.queue();
        let answers = rng.random_range(1..=6);
        let moment = Duration::from_micros(rng.random_range(0..8000));
        let (acknowledged, answered) = mpsc::channel();
        std::thread::scope(|scope| {
            let reviewing = scope.spawn({
                let (site, queue, log) = (Site::clone(&page), &queue, &mut log);
                let mut rng = ChaCha8Rng::seed_from_u64(rng.random());
                move || log.review(&site, queue, &mut rng, &acknowledged)
            });
            for () in answered.iter().take(answers) {}
            // The kill comes at a random time after the last awaited answer, so there is no event to wait for.
            let (_sender, never) = mpsc::channel::<()>();
            let _ = never.recv_timeout(moment);
            page.kill();
            reviewing.join().expect("the reviewer");
        });
    }
    // The request in flight at the last kill is sent again.
    let page = Page::open(&project, "lan", &[]);
    if let Some((path, body)) = log.open.take() {
        assert!(log.send(&page, path, body));
    }
    let found = stored(&project);
    for (event, verdict) in &log.acknowledged {
        assert_eq!(found[event].as_deref(), *verdict, "{event}");
    }
    assert_eq!(found.len(), log.acknowledged.len());
    let acts = found.len();
    assert!(acts > kills, "{acts} acts with {kills} kills are too few");
    mocban(project.dir(), &["check"]).expect(0);
    eprintln!("{acts} acts with {kills} kills");
}
