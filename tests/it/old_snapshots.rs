//! What the database refuses to a reviewer whose transaction sees an old state of the catalog, before another reviewer
//! judged. Policies read that state; constraints do not.

use crate::lab::{Lab, NO_SUCH_ROW, NOT_PERMITTED};
use crate::roles_in_sql::{new_verdict, verdict};

#[test]
fn a_reviewer_with_an_old_snapshot_undoes_nothing_of_another() {
    let Some(lab) = Lab::with_roles("2") else {
        return;
    };
    let mut mai = lab.session("mai");
    let begin = "BEGIN ISOLATION LEVEL REPEATABLE READ; SELECT count(*)::text FROM verdict";
    assert_eq!(mai.sql(begin), Ok(vec![vec!["0".to_owned()]]));
    let set = "verdict set upright-0000 pass --reviewer lan";
    lab.call("lan", set).expect(0);
    let act = lab.sql("guest", "SELECT min(act)::text FROM verdict");
    let act = &act.expect("an action")[0][0];

    let undo = |table: &str, by: &str| format!("INSERT INTO {table} VALUES ({act}, '{by}', 1)");
    let mut tries = vec![
        (verdict(act, "mai"), NO_SUCH_ROW),
        (verdict(act, "lan"), NOT_PERMITTED),
        (
            format!("INSERT INTO review_act (id, reviewer) VALUES ({act}, 'mai')"),
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
    ];
    for table in [
        "verdict_undo",
        "attention_check_undo",
        "manual_alignment_undo",
    ] {
        tries.push((undo(table, "mai"), NO_SUCH_ROW));
        tries.push((undo(table, "lan"), NOT_PERMITTED));
    }
    for (sql, code) in tries {
        mai.sql("SAVEPOINT before").expect("a savepoint");
        assert_eq!(mai.sql(&sql), Err(code.to_owned()), "{sql}");
        mai.sql("ROLLBACK TO before").expect("rolled back");
    }
    // The own action begins with another number than that of the other reviewer, which the snapshot lacks.
    mai.sql(&new_verdict("mai")).expect("the own name");
    mai.sql("ROLLBACK").expect("rolled back");
    lab.assert_whole();
    let log = lab.call("guest", "--json verdict log").expect(0).out;
    assert!(
        log.contains("\"undone_at\":null") && !log.contains("mai"),
        "{log}"
    );
}
