//! The review page's server under random `kill -9`: no acknowledged verdict is lost, none is doubled.
//! `MOCBAN_REVIEW_KILLS` says how often.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc;
use std::time::Duration;

use mocban::store::Project;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::cli::mocban;
use crate::page::{Page, Site, answer, read_project};
use crate::test_size::size_from_env;

/// What a reviewer did, in order, and how far it got.
#[derive(Default)]
struct Diary {
    /// Acts that were acknowledged, by number: the verdict, or `None` where it was taken back.
    acknowledged: BTreeMap<String, Option<&'static str>>,
    /// The act that was under way when the server died, to be sent again.
    open: Option<(&'static str, Value)>,
    acts: u32,
}

impl Diary {
    /// Reads card after card until the server is gone; now and then takes the last answer back.
    fn read(&mut self, site: &Site, deck: &[Value], dice: &mut ChaCha8Rng) {
        if let Some((path, body)) = self.open.take()
            && !self.send(site, path, body)
        {
            return;
        }
        loop {
            self.acts += 1;
            let event = format!("e{}", self.acts);
            let item = &deck[dice.random_range(0..deck.len())];
            let verdict = if dice.random_bool(0.2) {
                "fail"
            } else {
                "pass"
            };
            if !self.send(site, "/api/answer", answer(&event, item, verdict)) {
                return;
            }
            if dice.random_bool(0.1) && !self.send(site, "/api/undo", json!({ "event": event })) {
                return;
            }
        }
    }

    /// Sends an act; says whether it was acknowledged.
    fn send(&mut self, site: &Site, path: &'static str, body: Value) -> bool {
        let Ok(reply) = site.post(path, &body) else {
            self.open = Some((path, body));
            return false;
        };
        let told = String::from_utf8_lossy(&reply.body);
        assert_eq!(reply.status, 200, "{told}");
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

/// Every act in the log: its verdict, or `None` where it was taken back, and that it is there once a metric.
fn stored(project: &Project) -> BTreeMap<String, Option<String>> {
    let told = mocban(project.dir(), &["--json", "verdict", "log"]).expect(0);
    let mut rows = BTreeSet::new();
    let mut acts = BTreeMap::new();
    for line in told.out.lines() {
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
    let mut dice = ChaCha8Rng::seed_from_u64(7);
    let mut diary = Diary::default();
    for _ in 0..kills {
        let mut page = Page::open(
            &project,
            "lan",
            &["--attention-checks", "0", "--duplicates", "0"],
        );
        let deck = page.deck();
        let moment = Duration::from_micros(dice.random_range(0..60_000));
        let (shot, died) = mpsc::channel::<()>();
        std::thread::scope(|scope| {
            let reading = scope.spawn({
                let (site, deck, diary) = (Site::clone(&page), &deck, &mut diary);
                let mut dice = ChaCha8Rng::seed_from_u64(dice.random());
                move || diary.read(&site, deck, &mut dice)
            });
            // The moment of the shot is what is tested: there is no event to wait for.
            let _ = died.recv_timeout(moment);
            page.kill();
            drop(shot);
            reading.join().expect("the reviewer");
        });
    }
    // What was under way at the last shot is sent once more.
    let page = Page::open(&project, "lan", &[]);
    if let Some((path, body)) = diary.open.take() {
        assert!(diary.send(&page, path, body));
    }
    let found = stored(&project);
    for (event, verdict) in &diary.acknowledged {
        assert_eq!(found[event].as_deref(), *verdict, "{event}");
    }
    assert_eq!(found.len(), diary.acknowledged.len());
    let acts = found.len();
    assert!(acts > kills, "{acts} acts under {kills} kills are no test");
    mocban(project.dir(), &["check"]).expect(0);
    eprintln!("{acts} acts under {kills} kills");
}
