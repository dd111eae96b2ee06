//! What the database refuses to users with a role, by statements as in `psql`, and the rights to all tables.

use crate::lab::{APPEND_ONLY, Lab, NO_SUCH_ROW, NOT_PERMITTED};

/// Statements that a reviewer may not run, besides verdicts under another name.
const FORBIDDEN: [&str; 31] = [
    "INSERT INTO review_act (id, reviewer) VALUES (99, 'lan')",
    "INSERT INTO review_act (reviewer) VALUES ('mai')",
    "UPDATE review_act SET reviewer = 'lan'",
    "DELETE FROM review_act",
    "INSERT INTO verdict (id, act, pair, metric, result_hash, verdict, reviewer, at)
        SELECT 99, 99, pair, metric, result_hash, verdict, reviewer, at FROM verdict LIMIT 1",
    "UPDATE verdict SET verdict = 'fail'",
    "UPDATE verdict SET verdict = 'fail' WHERE false",
    "DELETE FROM verdict",
    "TRUNCATE verdict CASCADE",
    "DELETE FROM verdict_undo",
    "DELETE FROM attention_check_answer",
    "UPDATE manual_alignment SET note = ''",
    "INSERT INTO verdict_undo VALUES (4711, 'mai', 1)",
    "INSERT INTO attention_check_undo VALUES (4711, 'mai', 1)",
    "INSERT INTO manual_alignment_undo VALUES (4711, 'mai', 1)",
    "UPDATE checksum SET value = 0",
    "DELETE FROM checksum",
    "INSERT INTO checksum VALUES (0, 1000, 0)",
    "INSERT INTO checksum VALUES (2, 1000, 0)",
    "UPDATE metric_result SET pair = 1",
    "UPDATE pair SET mesh_path = ''",
    "UPDATE job SET status = 0",
    "UPDATE counter_part SET n = 0",
    "UPDATE review_key SET id = 1",
    "SELECT setval('verdict_id_seq', 1)",
    "DROP TRIGGER verdict_append_only ON verdict",
    "ALTER TABLE verdict DISABLE ROW LEVEL SECURITY",
    "CREATE TABLE mine ()",
    "CREATE OR REPLACE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS 'BEGIN RETURN NULL; END'",
    "SET ROLE mocban_owner",
    "SET session_replication_role = replica",
];

/// Returns the statement that stores a verdict of a new action.
pub(crate) fn new_verdict(reviewer: &str) -> String {
    format!(
        "WITH begun AS (INSERT INTO review_act (reviewer) VALUES ('{reviewer}') RETURNING id)
        INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, at)
        SELECT id, 1, 'density', decode(repeat('00', 32), 'hex'), 'pass', '{reviewer}', 1 FROM begun"
    )
}

/// Returns the statement that adds a verdict to an action.
pub(crate) fn verdict(act: &str, reviewer: &str) -> String {
    format!(
        "INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, at)
        VALUES ({act}, 1, 'density', decode(repeat('00', 32), 'hex'), 'pass', '{reviewer}', 1)"
    )
}

/// Returns a catalog with verdicts of `lan`, and the number of their action.
fn with_verdicts() -> Option<(Lab, String)> {
    let lab = Lab::with_roles("2")?;
    let set = "verdict set upright-0000 pass --reviewer lan";
    lab.call("lan", set).expect(0);
    let acts = lab.sql("guest", "SELECT DISTINCT act::text FROM verdict");
    let act = acts.expect("acts").concat().concat();
    Some((lab, act))
}

#[test]
fn a_reviewer_adds_only_the_own_verdicts_and_changes_none() {
    let Some((lab, act)) = with_verdicts() else {
        return;
    };
    for sql in FORBIDDEN {
        lab.assert_database_refuses("lan", sql, NOT_PERMITTED);
    }
    let as_group = format!("SET ROLE mocban_reviewer; {}", new_verdict("mai"));
    let answer = "INSERT INTO attention_check_answer (event, pair, metric, result_hash, kind, attention_check, seen, verdict, reviewer, at)
        SELECT 'e', pair, metric, result_hash, 'turned', '{}', result_hash, 'pass', 'mai', 1 FROM verdict LIMIT 1";
    let alignment = "INSERT INTO manual_alignment (event, pair, mesh_hash, print_hash, depth_hash, seen, print_from_depth,
            print_from_mesh, iou, dice, reviewer, at)
        SELECT 'e', pair, result_hash, result_hash, result_hash, result_hash, '{}', '{}', 1, 1, 'mai', 1 FROM verdict LIMIT 1";
    for sql in [
        &*new_verdict("mai"),
        &new_verdict("lan "),
        &as_group,
        answer,
        alignment,
    ] {
        lab.assert_database_refuses("lan", sql, NOT_PERMITTED);
        // The same statements with the own name are valid.
        if !sql.contains("lan ") {
            let own = format!("BEGIN; {}; ROLLBACK", sql.replace("'mai'", "'lan'"));
            lab.sql("lan", &own).expect("the own name");
        }
    }
    // Neither takes the number of a later action, nor joins an action of another reviewer, undoes it or stores its checksum.
    for (sql, code) in [
        (verdict("1000000", "mai"), NO_SUCH_ROW),
        (verdict(&act, "mai"), NO_SUCH_ROW),
        (
            format!("INSERT INTO verdict_undo VALUES ({act}, 'mai', 1)"),
            NO_SUCH_ROW,
        ),
        (
            format!("INSERT INTO verdict_undo VALUES ({act}, 'lan', 1)"),
            NOT_PERMITTED,
        ),
        (
            format!("INSERT INTO checksum VALUES (2, {act}, 1)"),
            NOT_PERMITTED,
        ),
        (
            format!("INSERT INTO checksum VALUES (3, {act}, 1)"),
            NOT_PERMITTED,
        ),
    ] {
        lab.assert_database_refuses("mai", &sql, code);
    }
    lab.assert_whole();
}

/// Rows that a reviewer's login can store, but the program does not: without a checksum, with a wrong one, and with values
/// that cannot be read.
#[test]
fn rows_that_a_reviewer_forges_are_set_apart_and_stop_nobody() {
    let Some((lab, act)) = with_verdicts() else {
        return;
    };
    let report = |user| lab.call(user, "--json report").expect(0).json();
    let sound = report("guest");
    let wrong =
        "INSERT INTO checksum (record, row, value, previous) SELECT 2, max(id), 7, 1 FROM verdict";
    let answer = "INSERT INTO attention_check_answer (event, pair, metric, result_hash, kind, attention_check, seen, verdict, reviewer, at)
        SELECT 'e', pair, metric, result_hash, 'turned', '[]', result_hash, 'pass', 'mai', 1 FROM verdict LIMIT 1";
    for sql in [&*new_verdict("mai"), &new_verdict("mai"), wrong, answer] {
        lab.sql("mai", sql).expect("the own rows");
    }
    // A later verdict of another reviewer is not affected.
    let set = "verdict set upright-0001 fail --reason angle --reviewer lan";
    lab.call("lan", set).expect(0);
    for words in ["report", "verdict log", "agreement", "export -o x"] {
        let call = lab.call("guest", words).expect(0);
        assert!(
            call.err.contains("set apart and not counted"),
            "{}",
            call.err
        );
    }
    let log = lab.call("guest", "verdict log").expect(0).out;
    assert!(
        log.contains("reviewer=\"mai\"") && !log.contains("lan  mai"),
        "{log}"
    );
    let found = lab.call("guest", "check").expect(12);
    for text in [
        "has no checksum",
        "differs from its checksum",
        "the owner of the catalog can",
    ] {
        assert!(found.out.contains(text), "{text}: {}", found.out);
    }
    assert_eq!(
        found.next(),
        Vec::<String>::new(),
        "a viewer cannot repair it"
    );
    lab.call("grid", "check --repair").expect(12);
    let repaired = lab.call("chief", "check --repair").expect(0);
    assert!(
        repaired.out.contains("3 damaged rows set apart"),
        "{}",
        repaired.out
    );
    let checked = lab.call("guest", "check").expect(0);
    assert!(checked.out.contains("set apart earlier"), "{}", checked.out);
    let now = report("guest");
    assert_eq!(now["set_apart"]["count"], 3);
    assert_eq!(now["rows"][0]["judged"], 2);
    assert_eq!(sound["rows"][0]["judged"], 1);
    // The owner decides to count a verdict after all.
    let set = "verdict set upright-0000 pass --metric density --reviewer mai";
    lab.call("chief", set).expect(0);
    let log = lab.call("guest", "--json verdict log").expect(0).out;
    let counted = |line: &&str| line.starts_with("{\"id\"") && line.contains("\"mai\"");
    assert_eq!(log.lines().filter(counted).count(), 1, "{act}: {log}");
}

#[test]
fn nobody_changes_verdicts_and_a_viewer_or_worker_undoes_none() {
    let Some((lab, act)) = with_verdicts() else {
        return;
    };
    let undo = format!("INSERT INTO verdict_undo VALUES ({act}, 'lan', 1)");
    let changes = [
        "UPDATE verdict SET verdict = 'fail'",
        "DELETE FROM verdict",
        "TRUNCATE verdict_undo",
    ];
    for user in ["guest", "grid"] {
        for sql in changes.into_iter().chain([&*undo, "CREATE TABLE mine ()"]) {
            lab.assert_database_refuses(user, sql, NOT_PERMITTED);
        }
    }
    for sql in [&*new_verdict("guest"), "UPDATE job SET status = 0"] {
        lab.assert_database_refuses("guest", sql, NOT_PERMITTED);
    }
    // A policy hides the checksums of verdicts from updates.
    let changed = lab.sql(
        "grid",
        "UPDATE checksum SET value = 0 WHERE record > 1 RETURNING 'changed'",
    );
    assert_eq!(changed, Ok(Vec::new()));
    for user in ["chief", "mocban"] {
        for sql in changes {
            lab.assert_database_refuses(user, sql, APPEND_ONLY);
        }
    }
    lab.assert_whole();
}

/// Every table has an owner, can be read by viewers, and can be written only as listed here.
#[test]
fn every_table_has_the_listed_rights() {
    let Some(lab) = Lab::new("2") else { return };
    lab.call("mocban", "db init --roles").expect(0);
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
