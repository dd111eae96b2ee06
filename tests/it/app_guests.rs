//! What guests of the app get: the link in the code of their invitation, and the same results as other guests.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::app::text;
use crate::app_invitations::{invite, open, start_entered};
use crate::cli::mocban;
use crate::page::answer;
use crate::qr_decoder::decoded;

#[test]
fn the_code_of_an_invitation_has_its_link() {
    let (_dir, page) = start_entered();
    let sent = invite(&page, "lan");
    let shown = text(&page.get("/p/p/review"));
    let codes = shown.split("<svg class=\"qr\"").skip(1);
    let codes: Vec<String> = codes.map(decoded).collect();
    assert_eq!(codes, sent);
    assert!(codes[0].starts_with("http://127.0.0.1:"), "{codes:?}");
}

#[test]
fn guests_with_the_same_choices_judge_the_same_pairs() {
    let (dir, page) = start_entered();
    for name in ["lan", "minh"] {
        let sent = invite(&page, name);
        let guest = open(sent.last().expect("a link"));
        for (number, item) in guest.queue().iter().enumerate() {
            let event = format!("{name}-{number}");
            let reply = guest.post("/api/answer", &answer(&event, item, "pass"));
            assert_eq!(reply.expect("a reply").status, 200);
        }
    }
    let log = mocban(&dir.path().join("p"), &["--json", "verdict", "log"]).expect(0);
    let mut judged: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for line in log.out.lines() {
        let verdict: Value = serde_json::from_str(line).expect("JSON");
        let [reviewer, pair] = ["reviewer", "pair"].map(|name| {
            let value = verdict[name].as_str();
            value.expect("a name").to_owned()
        });
        judged.entry(reviewer).or_default().insert(pair);
    }
    let [lan, minh] = ["lan", "minh"].map(|name| judged.get(name));
    assert_eq!(lan, minh);
    // The sample of the invitation; planted errors are in a log of their own.
    assert_eq!(lan.map(BTreeSet::len), Some(3), "{judged:?}");
}
