//! Roles of a catalog in PostgreSQL: what each may do, what the database refuses, and ten reviewers at the same time.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::{Value, json};
use sqlx::{AssertSqlSafe, Connection as _, PgConnection, Row as _};

use crate::check::below;
use crate::cli::{Call, binary, call, empty, mocban};
use crate::page::{Page, answer};
use crate::postgres_server::Server;
use crate::resume::project;

/// The code of PostgreSQL for a missing right, also by row-level security.
const NOT_PERMITTED: &str = "42501";
/// The code with which the schema refuses a change of an append-only table.
const APPEND_ONLY: &str = "23000";

/// A project whose catalog is on a server.
struct Lab {
    dir: tempfile::TempDir,
    server: Server,
}

impl Lab {
    /// Returns `None` if no server is installed.
    fn new(pairs: &str) -> Option<Self> {
        let server = Server::start()?;
        let dir = empty();
        project(dir.path(), "lab", pairs);
        mocban(dir.path(), &["copy", "lab", server.url()]).expect(0);
        std::fs::remove_file(dir.path().join("lab/catalog.sqlite")).expect("removed");
        Some(Self { dir, server })
    }

    /// Returns a project that has been run, whose catalog has roles and a user of each role.
    fn with_roles(pairs: &str) -> Option<Self> {
        let lab = Self::new(pairs)?;
        lab.call("mocban", &["run"]).expect(0);
        lab.call("mocban", &["db", "init", "--roles"]).expect(0);
        for (user, role) in [
            ("chief", "owner"),
            ("grid", "worker"),
            ("lan", "reviewer"),
            ("mai", "reviewer"),
            ("guest", "viewer"),
        ] {
            lab.add_user(user, role);
        }
        Some(lab)
    }

    fn add_user(&self, user: &str, role: &str) {
        let sql = format!("CREATE ROLE {user} LOGIN IN ROLE mocban_{role}");
        self.sql("mocban", &sql).expect("a new user");
    }

    fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Returns the address for a user of the database.
    fn url(&self, user: &str) -> String {
        self.server.url().replace("mocban@", &format!("{user}@"))
    }

    fn command(&self, user: &str, args: &[&str]) -> Command {
        let mut command = binary();
        command.current_dir(self.path());
        command.args(["-C", "lab", "--catalog", &self.url(user)]);
        command.args(args);
        command
    }

    /// Calls a command on the project as a user of the database.
    fn call(&self, user: &str, args: &[&str]) -> Call {
        call(&mut self.command(user, args))
    }

    /// Asserts that a command is refused in one sentence with a text, and with exit code 2.
    #[track_caller]
    fn assert_refused(&self, user: &str, args: &[&str], text: &str) {
        let refused = self.call(user, args).expect(2);
        let lines = refused.err.lines();
        let errors: Vec<_> = lines.filter(|line| line.starts_with("error:")).collect();
        assert_eq!(errors.len(), 1, "{}", refused.err);
        assert!(errors[0].contains(text), "{text}: {}", refused.err);
    }

    /// Runs SQL statements as a user. Returns the rows as text, or the code of the error.
    fn sql(&self, user: &str, sql: &str) -> Result<Vec<Vec<String>>, String> {
        let options = "&options=-c%20search_path%3Dmocban";
        let url = format!("{}{options}", self.url(user));
        let runtime = tokio::runtime::Runtime::new().expect("a runtime");
        runtime.block_on(async {
            let mut conn = PgConnection::connect(&url).await.expect("a connection");
            let rows = sqlx::raw_sql(AssertSqlSafe(sql.to_owned())).fetch_all(&mut conn);
            let rows = rows.await.map_err(|error| code(&error))?;
            let text = |row: &sqlx::postgres::PgRow| {
                let columns = 0..row.len();
                let column = |index| row.try_get_unchecked::<Option<String>, _>(index);
                columns
                    .map(|index| column(index).expect("text").unwrap_or_default())
                    .collect()
            };
            Ok(rows.iter().map(text).collect())
        })
    }

    /// Asserts that the database refuses statements of a user with an error code.
    #[track_caller]
    fn assert_database_refuses(&self, user: &str, sql: &str, code: &str) {
        assert_eq!(self.sql(user, sql), Err(code.to_owned()), "{user}: {sql}");
    }

    /// Asserts that a check finds nothing, and that the counters equal a recount.
    fn assert_whole(&self) {
        let checked = self.call("guest", &["check"]).expect(0);
        assert!(checked.out.contains("no problems found"), "{}", checked.out);
        let differences = self.sql(
            "guest",
            "WITH counted AS (
                SELECT stage, status, coalesce(fingerprint, 0) AS fingerprint, count(*) AS n FROM job GROUP BY 1, 2, 3),
            kept AS (SELECT stage, status, fingerprint, n FROM counter WHERE n <> 0)
            (TABLE counted EXCEPT TABLE kept) UNION ALL (TABLE kept EXCEPT TABLE counted)",
        );
        assert_eq!(differences, Ok(Vec::new()));
    }

    /// Opens the review page of a user of the database.
    fn review(&self, user: &str, args: &[&str]) -> Page {
        let review = ["--json", "review", "--no-open", "--reviewer", user];
        Page::of(self.command(user, &review).args(args)).with_session()
    }
}

/// Returns the code of an error of the server.
fn code(error: &sqlx::Error) -> String {
    let error = error.as_database_error().expect("an error of the server");
    error.code().expect("a code").into_owned()
}

#[test]
fn roles_are_the_same_after_a_second_call_and_after_the_printed_sql() {
    let Some(lab) = Lab::new("2") else { return };
    let rights = || {
        let rights = "
            SELECT relname::text, relowner::regrole::text, relacl::text, relrowsecurity::text FROM pg_class
            WHERE relnamespace = 'mocban'::regnamespace AND relkind IN ('r', 'v')
            UNION ALL SELECT attrelid::regclass::text || attname, '', attacl::text, '' FROM pg_attribute WHERE attacl IS NOT NULL
                AND attrelid::regclass::text NOT LIKE 'pg_%'
            UNION ALL SELECT tablename || policyname, roles::text, cmd, concat(qual, with_check) FROM pg_policies
            UNION ALL SELECT 'member', roleid::regrole::text, member::regrole::text, '' FROM pg_auth_members ORDER BY 1, 2, 3";
        lab.sql("mocban", rights).expect("rights")
    };
    let without = rights();
    let first = lab.call("mocban", &["--json", "db", "init", "--roles"]);
    let first = first.expect(0).json();
    assert_eq!(first, json!({"schema": 1, "created": false, "roles": true}));
    let with_roles = rights();
    assert_ne!(without, with_roles);
    lab.call("mocban", &["db", "init", "--roles"]).expect(0);
    assert_eq!(rights(), with_roles);

    // The printed SQL needs no server, and gives another catalog of the server the same rights.
    let nowhere = "postgres://mocban@db.example/lab";
    let printed = ["db", "init", "--roles", "--print-sql"];
    let sql = mocban(
        lab.path(),
        &[&printed[..], &["--catalog", nowhere]].concat(),
    );
    let sql = sql.expect(0).out;
    assert_eq!(mocban(lab.path(), &printed).expect(0).out, sql);
    lab.sql("mocban", &sql).expect("valid SQL");
    assert_eq!(rights(), with_roles);

    // A catalog is created with its roles; an owner who may not create roles may renew the rights.
    lab.sql("mocban", "CREATE DATABASE second")
        .expect("a database");
    lab.add_user("chief", "owner");
    lab.call("chief", &["db", "init", "--roles"]).expect(0);
    assert_eq!(rights().len(), with_roles.len() + 1);
    let second = lab.server.url().replace("/postgres?", "/second?");
    let created = mocban(
        lab.path(),
        &["--catalog", &second, "--json", "db", "init", "--roles"],
    );
    assert_eq!(created.expect(0).json()["created"], true);
    let guest = second.replace("mocban@", "chief@");
    mocban(
        lab.path(),
        &["-C", "lab", "--catalog", &guest, "status", "--json"],
    )
    .expect(0);
}

#[test]
fn a_user_who_may_not_create_roles_is_told_what_to_ask_for() {
    let Some(lab) = Lab::new("2") else { return };
    lab.sql(
        "mocban",
        "CREATE ROLE \"hà\" LOGIN; GRANT CREATE ON DATABASE postgres TO \"hà\";
        CREATE ROLE maker LOGIN CREATEROLE",
    )
    .expect("users");
    let init = ["db", "init", "--roles"];
    for text in ["--print-sql", "ALTER ROLE \"hà\" CREATEROLE"] {
        lab.assert_refused("h%C3%A0", &init, text);
    }
    // May create roles, but not give away the tables of another user: nothing is left behind.
    lab.assert_refused("maker", &init, "more rights");
    let left = lab.sql(
        "mocban",
        "SELECT rolname::text FROM pg_roles WHERE rolname LIKE 'mocban_%'",
    );
    assert_eq!(left, Ok(Vec::new()));
    let refused = mocban(lab.path(), &["db", "init"]).expect(2);
    assert!(refused.err.contains("--catalog"), "{}", refused.err);
    let refused = mocban(lab.path(), &["db", "init", "--print-sql"]).expect(2);
    assert!(refused.err.contains("--roles"), "{}", refused.err);
    // Without being a superuser, the owner of a database can create its catalog and the roles.
    lab.sql("mocban", "CREATE DATABASE own OWNER maker")
        .expect("a database");
    let own = lab.url("maker").replace("/postgres?", "/own?");
    for _ in 0..2 {
        mocban(lab.path(), &[&init[..], &["--catalog", &own]].concat()).expect(0);
    }
    lab.sql("mocban", "CREATE ROLE chief LOGIN IN ROLE mocban_owner")
        .expect("a new user");
    let chief = own.replace("maker@", "chief@");
    mocban(lab.path(), &[&init[..], &["--catalog", &chief]].concat()).expect(0);
    for url in [&own, &chief] {
        let import = [
            "-C",
            "own",
            "--catalog",
            url,
            "import",
            "lab/data/manifest.csv",
        ];
        mocban(lab.path(), &import).expect(0);
    }
}

#[test]
fn viewers_look_reviewers_judge_workers_run_and_owners_do_everything() {
    let Some(lab) = Lab::with_roles("4") else {
        return;
    };
    for user in ["guest", "lan", "grid", "chief"] {
        for args in [
            &["status"][..],
            &["report"],
            &["show", "upright-0000"],
            &["verdict", "log"],
            &["check"],
            &["agreement"],
            &["export", "-o", user],
        ] {
            lab.call(user, args).expect(0);
        }
    }
    let set = |reviewer| {
        [
            "verdict",
            "set",
            "upright-0001",
            "pass",
            "--reviewer",
            reviewer,
        ]
    };
    let grant = "ask the administrator for `GRANT mocban_reviewer TO guest`";
    lab.assert_refused("guest", &["review", "--reviewer", "guest"], grant);
    lab.assert_refused("guest", &set("guest"), grant);
    lab.assert_refused("guest", &["verdict", "undo"], grant);
    for user in ["guest", "lan"] {
        for args in [&["run"][..], &["plan"], &["worker"]] {
            lab.assert_refused(user, args, "more rights");
        }
        lab.assert_refused(user, &["import", "lab/data/manifest.csv"], "more rights");
    }

    lab.call("lan", &set("lan")).expect(0);
    lab.assert_refused("lan", &set("mai"), "give `--reviewer lan`");
    lab.assert_refused(
        "lan",
        &["review", "--reviewer", "mai"],
        "give `--reviewer lan`",
    );
    lab.call("mai", &set("mai")).expect(0);
    // The newest verdict is that of mai.
    let undone = lab
        .call("lan", &["--json", "verdict", "undo"])
        .expect(0)
        .json();
    assert_eq!(undone["undone"][0]["reviewer"], "lan");
    lab.assert_refused(
        "lan",
        &["verdict", "undo", "--reviewer", "mai"],
        "only under the name lan",
    );

    std::fs::write(
        lab.path().join("verdicts.csv"),
        "pair,verdict,reviewer\nupright-0002,fail,nga\nupright-0003,pass,lan\n",
    )
    .expect("written");
    lab.assert_refused("lan", &["verdict", "import", "verdicts.csv"], "not nga");
    for user in ["grid", "chief"] {
        lab.call(user, &["verdict", "import", "verdicts.csv"])
            .expect(0);
    }
    lab.assert_refused("grid", &["verdict", "undo"], "not judge or undo");
    lab.assert_refused(
        "grid",
        &["review", "--reviewer", "grid"],
        "not judge or undo",
    );
    lab.call("chief", &["verdict", "undo", "--reviewer", "nga"])
        .expect(0);

    let truth = [
        "import",
        "lab/data/manifest.csv",
        "--truth",
        "lab/data/truth.jsonl",
    ];
    lab.call("grid", &truth).expect(0);
    lab.call("grid", &["plan", "--rerun", "all"]).expect(0);
    lab.call("grid", &["worker"]).expect(0);
    lab.call("grid", &["retry"]).expect(4);
    lab.call("grid", &["run", "--rerun", "all"]).expect(0);
    lab.call("grid", &["db", "init"]).expect(0);
    for user in ["grid", "chief"] {
        let artifacts = lab.path().join("lab/artifacts");
        let (damaged, _) = below(&artifacts).remove(0);
        std::fs::remove_file(artifacts.join(damaged)).expect("removed");
        lab.assert_refused("lan", &["check", "--repair"], "more rights");
        lab.call(user, &["check", "--repair"]).expect(0);
        lab.call("grid", &["run"]).expect(0);
    }
    lab.call("guest", &["backup", "all.sqlite"]).expect(0);
    lab.assert_whole();
}

#[test]
fn failed_pairs_are_stored_and_retried_by_a_worker() {
    let Some(lab) = Lab::new("2") else { return };
    lab.call("mocban", &["db", "init", "--roles"]).expect(0);
    lab.add_user("grid", "worker");
    lab.add_user("guest", "viewer");
    std::fs::write(lab.path().join("lab/flat.stl"), "solid\nendsolid\n").expect("written");
    std::fs::write(
        lab.path().join("lab/more.csv"),
        "id,mesh,print\nflat,flat.stl,data/manifest.csv\n",
    )
    .expect("written");
    lab.call("grid", &["import", "lab/more.csv"]).expect(0);
    lab.call("grid", &["run"]).expect(3);
    lab.assert_refused("guest", &["retry"], "more rights");
    lab.call("grid", &["retry"]).expect(0);
    lab.call("grid", &["run"]).expect(3);
    lab.assert_whole();
}

/// Statements as in `psql`, and how the database refuses them.
#[test]
fn the_database_refuses_other_names_and_every_change_of_verdicts() {
    let Some(lab) = Lab::with_roles("2") else {
        return;
    };
    let hash = "decode(repeat('00', 32), 'hex')";
    let verdict = |act: &str, reviewer: &str| {
        format!(
            "INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, at)
            VALUES ({act}, 1, 'density', {hash}, 'pass', '{reviewer}', 1)"
        )
    };
    let next = "(SELECT coalesce(max(id), 0) + 1 FROM verdict)";
    lab.call(
        "lan",
        &[
            "verdict",
            "set",
            "upright-0000",
            "pass",
            "--reviewer",
            "lan",
        ],
    )
    .expect(0);
    let lan = lab
        .sql("guest", "SELECT CAST(min(act) AS text) FROM verdict")
        .expect("an act")[0][0]
        .clone();
    let not_permitted = [
        verdict(next, "mai"),
        verdict(next, "lan "),
        verdict("1000000", "lan"),
        format!("SET ROLE mocban_reviewer; {}", verdict(next, "mai")),
        "INSERT INTO verdict (id, act, pair, metric, result_hash, verdict, reviewer, at) SELECT 99, 99, pair, metric, result_hash, verdict, reviewer, at FROM verdict LIMIT 1".to_owned(),
        "UPDATE verdict SET verdict = 'fail'".to_owned(),
        "UPDATE verdict SET verdict = 'fail' WHERE false".to_owned(),
        "DELETE FROM verdict".to_owned(),
        "TRUNCATE verdict CASCADE".to_owned(),
        "DELETE FROM verdict_undo".to_owned(),
        "DELETE FROM attention_check_answer".to_owned(),
        "UPDATE manual_alignment SET note = ''".to_owned(),
        "INSERT INTO verdict_undo VALUES (4711, 1)".to_owned(),
        "UPDATE checksum SET value = 0".to_owned(),
        "DELETE FROM checksum".to_owned(),
        "INSERT INTO checksum VALUES (0, 1000, 0)".to_owned(),
        "INSERT INTO checksum VALUES (2, 1000, 0)".to_owned(),
        "UPDATE metric_result SET ssim = 1".to_owned(),
        "UPDATE pair SET mesh_path = ''".to_owned(),
        "UPDATE job SET status = 0".to_owned(),
        "UPDATE counter_part SET n = 0".to_owned(),
        "UPDATE review_key SET id = 1".to_owned(),
        "SELECT setval('verdict_id_seq', 1)".to_owned(),
        "DROP TRIGGER verdict_append_only ON verdict".to_owned(),
        "ALTER TABLE verdict DISABLE ROW LEVEL SECURITY".to_owned(),
        "CREATE TABLE mine ()".to_owned(),
        "CREATE OR REPLACE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS 'BEGIN RETURN NULL; END'".to_owned(),
        "SET ROLE mocban_owner".to_owned(),
        "SET session_replication_role = replica".to_owned(),
    ];
    for sql in &not_permitted {
        lab.assert_database_refuses("lan", sql, NOT_PERMITTED);
    }
    // Neither joins the action of another reviewer, nor undoes it, nor prepares its checksum.
    lab.assert_database_refuses("mai", &verdict(&lan, "mai"), NOT_PERMITTED);
    let undo = format!("INSERT INTO verdict_undo VALUES ({lan}, 1)");
    lab.assert_database_refuses("mai", &undo, NOT_PERMITTED);
    let checksum = format!("INSERT INTO checksum VALUES (3, {lan}, 1)");
    lab.assert_database_refuses("mai", &checksum, NOT_PERMITTED);
    for sql in [&undo, &verdict(next, "guest")] {
        lab.assert_database_refuses("guest", sql, NOT_PERMITTED);
    }
    for sql in [
        "UPDATE verdict SET verdict = 'fail'",
        "DELETE FROM verdict",
        "UPDATE checksum SET value = 0 WHERE record = 9; CREATE TABLE mine ()",
        &undo,
    ] {
        lab.assert_database_refuses("grid", sql, NOT_PERMITTED);
    }
    // Updates no row of the checksums of verdicts, because a policy hides them.
    let changed = lab.sql(
        "grid",
        "UPDATE checksum SET value = 0 WHERE record = 2 RETURNING 'changed'",
    );
    assert_eq!(changed, Ok(Vec::new()));
    for user in ["chief", "mocban"] {
        for sql in [
            "UPDATE verdict SET verdict = 'fail'",
            "DELETE FROM verdict",
            "TRUNCATE verdict_undo",
        ] {
            lab.assert_database_refuses(user, sql, APPEND_ONLY);
        }
    }
    lab.assert_whole();
    // A row that was not stored by the program is found.
    lab.sql("mai", &verdict(next, "mai")).expect("the own name");
    let checked = lab.call("guest", &["check"]).expect(12);
    assert!(checked.out.contains("has no checksum"), "{}", checked.out);
}

/// Every table has an owner, can be read by viewers, and can be written only as listed here.
#[test]
fn every_table_has_the_listed_rights() {
    let Some(lab) = Lab::new("2") else { return };
    lab.call("mocban", &["db", "init", "--roles"]).expect(0);
    let rights = lab.sql(
        "mocban",
        "SELECT c.relname::text, string_agg(format('%s %s', r.role, p.action), ', ' ORDER BY r.role, p.action)
        FROM pg_class AS c
            CROSS JOIN unnest(ARRAY['reviewer', 'viewer', 'worker']) AS r (role)
            CROSS JOIN unnest(ARRAY['SELECT', 'INSERT', 'UPDATE', 'DELETE', 'TRUNCATE', 'REFERENCES', 'TRIGGER']) AS p (action)
        WHERE c.relnamespace = 'mocban'::regnamespace AND c.relkind IN ('r', 'v') AND c.relowner = 'mocban_owner'::regrole
            AND CASE WHEN p.action IN ('DELETE', 'TRUNCATE', 'TRIGGER')
                THEN has_table_privilege('mocban_' || r.role, c.oid, p.action)
                ELSE has_any_column_privilege('mocban_' || r.role, c.oid, p.action) END
        GROUP BY c.relname ORDER BY c.relname",
    );
    let rights = rights.expect("rights").into_iter();
    let lines: Vec<_> = rights
        .map(|row| format!("{}: {}", row[0], row[1]))
        .collect();
    insta::assert_snapshot!("rights_of_roles", lines.join("\n"));
    let tables = "SELECT count(*)::text FROM pg_class WHERE relnamespace = 'mocban'::regnamespace AND relkind IN ('r', 'v')";
    let tables = lab.sql("mocban", tables).expect("a number");
    assert_eq!(tables[0][0], lines.len().to_string());
}

/// Names of the reviewers. The first four also undo answers.
const REVIEWERS: [&str; 10] = [
    "an", "binh", "chi", "dung", "em", "giang", "hanh", "khoa", "lam", "minh",
];
/// Number of reviewers who undo answers.
const UNDOING: usize = 4;
/// Answers of each reviewer.
const ANSWERS: usize = 12;

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
    assert!(queue.len() >= ANSWERS, "{} items", queue.len());
    let event = format!("{}-align", REVIEWERS[number]);
    align(page, &event, &queue[0]);
    if number < UNDOING {
        assert_eq!(undo(page, &event), 200);
    }
    queue
}

/// Answers the first items of a reviewer's page. The first reviewers undo every third of their answers, and each tries to
/// undo an answer of the next of them.
fn judge(page: &Page, number: usize, queue: &[Value]) -> Acknowledged {
    let mut acknowledged = Acknowledged::new();
    for (at, item) in queue.iter().take(ANSWERS).enumerate() {
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
        lab.call("grid", &["plan", "--rerun", "all"]).expect(0);
        let workers = [(); 2].map(|()| {
            let mut worker = lab.command("grid", &["worker", "-j", "1"]);
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
    let rates = ["--attention-checks", "20", "--duplicates", "10"];
    let pages = REVIEWERS.map(|reviewer| lab.review(reviewer, &rates));
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
        "SELECT DISTINCT event, reviewer, CASE WHEN u.at IS NULL THEN '' ELSE 'undone' END
            FROM verdict AS v LEFT JOIN verdict_undo AS u ON u.act = v.act
        UNION ALL SELECT event, reviewer, CASE WHEN u.at IS NULL THEN '' ELSE 'undone' END
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
    assert_eq!(stored.len(), REVIEWERS.len() * ANSWERS);
    let undone = stored.values().filter(|(_, undone)| *undone).count();
    assert_eq!(undone, UNDOING * ANSWERS / 3);
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
