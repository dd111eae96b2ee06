//! Ten reviewers at the same time, each on a review page and with a login of PostgreSQL, while workers run. `MOCBAN_TRIALS`
//! sets how often each answers.

use std::collections::BTreeMap;
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::{Value, json};

use crate::lab::Lab;
use crate::page::{Page, answer};
use crate::test_size::trials;

/// Names of the reviewers. The first four also undo answers.
const REVIEWERS: [&str; 10] = [
    "an", "binh", "chi", "dung", "em", "giang", "hanh", "khoa", "lam", "minh",
];
/// Number of reviewers who undo answers.
const UNDOING: usize = 4;
/// Items of each reviewer, which are answered once in each trial.
const ITEMS: usize = 12;

/// What a reviewer's page acknowledged: each event, and whether it was undone.
type Acknowledged = BTreeMap<String, bool>;

/// Returns the event of an answer of a reviewer.
fn event(reviewer: usize, answer: usize) -> String {
    format!("{}-{answer}", REVIEWERS[reviewer])
}

fn undo(page: &Page, event: &str) -> u16 {
    let reply = page.post("/api/undo", &json!({"event": event}));
    reply.expect("a reply").status
}

/// Stores a manual alignment of an item.
fn align(page: &Page, event: &str, item: &Value) {
    let id = item["id"].as_str().expect("an id");
    let start = page.get(&format!("/api/alignment/{id}")).json();
    let map = &start["view_from_depth"];
    let body = json!({"event": event, "item": id, "view_from_depth": map, "note": null});
    let reply = page.post("/api/align", &body).expect("a reply");
    let text = String::from_utf8_lossy(&reply.body);
    assert_eq!(reply.status, 200, "{text}; {start}");
}

/// Aligns the first item manually, and undoes it in the case of the first reviewers. Returns the queue.
fn begin(page: &Page, number: usize) -> Vec<Value> {
    let queue = page.queue();
    assert!(queue.len() >= ITEMS, "{} items", queue.len());
    let event = format!("{}-align", REVIEWERS[number]);
    align(page, &event, &queue[0]);
    if number < UNDOING {
        assert_eq!(undo(page, &event), 200);
    }
    queue
}

/// Answers the first items of a reviewer's page, in each trial again. The first reviewers undo every third of their answers, and each tries to
/// undo an answer of the next of them.
fn judge(page: &Page, number: usize, queue: &[Value]) -> Acknowledged {
    let mut acknowledged = Acknowledged::new();
    for at in 0..ITEMS * trials(1) {
        let item = &queue[at % ITEMS];
        let verdict = ["pass", "fail", "unsure"][(at + number) % 3];
        let body = answer(&event(number, at), item, verdict);
        let reply = page.post("/api/answer", &body).expect("a reply");
        let text = String::from_utf8_lossy(&reply.body);
        assert_eq!(reply.status, 200, "{text}");
        acknowledged.insert(event(number, at), false);
        if number < UNDOING && at % 3 == 2 {
            assert_eq!(undo(page, &event(number, at - 1)), 200);
            acknowledged.insert(event(number, at - 1), true);
            assert_eq!(undo(page, &event((number + 1) % UNDOING, at - 2)), 404);
        }
    }
    acknowledged
}

/// Calls a function for each page at the same time.
fn for_each_page<T: Send>(pages: &[Page; 10], each: impl Fn(&Page, usize) -> T + Sync) -> Vec<T> {
    std::thread::scope(|scope| {
        let each = &each;
        let pages = pages.iter().enumerate();
        let threads = pages.map(|(number, page)| scope.spawn(move || each(page, number)));
        let threads: Vec<_> = threads.collect();
        let ended = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
        ended.map(|ended| ended.expect("no panic")).collect()
    })
}

/// Plans all pairs again and aligns them with two workers, until `stop` is set. Returns how often.
fn run_until(lab: &Lab, stop: &AtomicBool) -> u32 {
    let mut runs = 0;
    while !stop.load(Ordering::Acquire) {
        lab.call("grid", "plan --rerun all").expect(0);
        let workers = [(); 2].map(|()| {
            let mut worker = lab.command("grid", "worker -j 1");
            worker.stdout(Stdio::null()).stderr(Stdio::null()).spawn()
        });
        for worker in workers {
            let ended = worker.expect("a worker").wait();
            assert!(ended.expect("an exit code").success());
        }
        runs += 1;
    }
    runs
}

#[test]
fn ten_reviewers_and_workers_at_the_same_time_lose_nothing() {
    let Some(lab) = Lab::with_roles("16") else {
        return;
    };
    for reviewer in REVIEWERS {
        lab.add_user(reviewer, "reviewer");
    }
    let options = "--attention-checks 20 --duplicates 10";
    let pages = REVIEWERS.map(|reviewer| lab.review(reviewer, options));
    let queues = for_each_page(&pages, begin);
    let stop = AtomicBool::new(false);
    let acknowledged = std::thread::scope(|scope| {
        let runs = scope.spawn(|| run_until(&lab, &stop));
        let judged = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            for_each_page(&pages, |page, number| judge(page, number, &queues[number]))
        }));
        stop.store(true, Ordering::Release);
        assert!(runs.join().expect("no panic") > 0);
        judged.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    for number in 0..UNDOING {
        let of_another = event((number + 1) % UNDOING, 0);
        assert_eq!(undo(&pages[number], &of_another), 404);
    }
    drop(pages);
    assert_nothing_is_lost(&lab, &acknowledged);
    lab.assert_whole();
}

fn assert_nothing_is_lost(lab: &Lab, acknowledged: &[Acknowledged]) {
    let stored = lab.sql(
        "guest",
        "SELECT DISTINCT event, v.reviewer, CASE WHEN u.at IS NULL THEN '' ELSE 'undone' END
            FROM verdict AS v LEFT JOIN verdict_undo AS u ON u.act = v.act
        UNION ALL SELECT event, a.reviewer, CASE WHEN u.at IS NULL THEN '' ELSE 'undone' END
            FROM attention_check_answer AS a LEFT JOIN attention_check_undo AS u ON u.answer = a.id",
    );
    let stored: BTreeMap<_, _> = stored
        .expect("rows")
        .into_iter()
        .map(|row| (row[0].clone(), (row[1].clone(), row[2] == "undone")))
        .collect();
    let wanted: BTreeMap<_, _> = acknowledged
        .iter()
        .zip(REVIEWERS)
        .flat_map(|(events, reviewer)| {
            let of_reviewer = move |(event, undone): (&String, &bool)| {
                (event.clone(), (reviewer.to_owned(), *undone))
            };
            events.iter().map(of_reviewer)
        })
        .collect();
    assert_eq!(stored, wanted);
    let answers = ITEMS * trials(1);
    assert_eq!(stored.len(), REVIEWERS.len() * answers);
    let undone = stored.values().filter(|(_, undone)| *undone).count();
    assert_eq!(undone, UNDOING * answers / 3);
    let shared_acts = lab.sql(
        "guest",
        "SELECT act::text FROM verdict GROUP BY act HAVING count(DISTINCT event) <> 1 OR count(DISTINCT reviewer) <> 1",
    );
    assert_eq!(shared_acts, Ok(Vec::new()));
    let count = |sql| lab.sql("guest", sql).expect("a number")[0][0].clone();
    assert_ne!(
        count("SELECT count(*)::text FROM attention_check_answer"),
        "0"
    );
    assert_eq!(count("SELECT count(*)::text FROM manual_alignment"), "10");
    assert_eq!(
        count("SELECT count(*)::text FROM manual_alignment_undo"),
        "4"
    );
}
