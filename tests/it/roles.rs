//! Roles of a catalog in PostgreSQL: how they are created, and which commands each may use.

use serde_json::json;

use crate::check::below;
use crate::cli::mocban;
use crate::lab::Lab;

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
    let first = lab.call("mocban", "--json db init --roles");
    let first = first.expect(0).json();
    assert_eq!(first, json!({"schema": 1, "created": false, "roles": true}));
    let with_roles = rights();
    assert_ne!(without, with_roles);
    lab.call("mocban", "db init --roles").expect(0);
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
    lab.call("chief", "db init --roles").expect(0);
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
        lab.assert_refused("h%C3%A0", "db init --roles", text);
    }
    // May create roles, but not give away the tables of another user: nothing is left behind.
    lab.assert_refused("maker", "db init --roles", "more rights");
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
fn every_role_may_look() {
    let Some(lab) = Lab::with_roles("4") else {
        return;
    };
    for user in ["guest", "lan", "grid", "chief"] {
        for words in [
            "status",
            "report",
            "show upright-0000",
            "verdict log",
            "check",
            "agreement",
            "status --hosts",
        ] {
            lab.call(user, words).expect(0);
        }
        lab.call(user, &format!("export -o {user}")).expect(0);
        lab.call(user, &format!("backup {user}.sqlite")).expect(0);
    }
    for user in ["guest", "lan"] {
        for words in ["run", "plan", "worker", "import lab/data/manifest.csv"] {
            lab.assert_refused(user, words, "more rights");
        }
    }
    lab.assert_whole();
}

#[test]
fn reviewers_judge_under_their_own_names_and_viewers_do_not() {
    let Some(lab) = Lab::with_roles("4") else {
        return;
    };
    let grant = "ask the administrator for `GRANT mocban_reviewer TO guest`";
    for words in [
        "review --reviewer guest",
        "verdict set upright-0001 pass --reviewer guest",
        "verdict undo",
    ] {
        lab.assert_refused("guest", words, grant);
    }
    for words in [
        "review --reviewer mai",
        "verdict set upright-0001 pass --reviewer mai",
        "verdict undo --reviewer mai",
    ] {
        lab.assert_refused(
            "lan",
            words,
            "under the name lan, not mai; give `--reviewer lan`",
        );
    }
    for user in ["lan", "mai"] {
        let set = format!("verdict set upright-0001 pass --reviewer {user}");
        lab.call(user, &set).expect(0);
    }
    // The newest verdict is that of mai.
    let undone = lab.call("lan", "--json verdict undo").expect(0).json();
    assert_eq!(undone["undone"][0]["reviewer"], "lan");
    lab.assert_whole();
}

#[test]
fn workers_and_owners_import_the_verdicts_of_others() {
    let Some(lab) = Lab::with_roles("4") else {
        return;
    };
    let verdicts = "pair,verdict,reviewer\nupright-0002,fail,nga\nupright-0003,pass,lan\n";
    std::fs::write(lab.path().join("verdicts.csv"), verdicts).expect("written");
    lab.assert_refused(
        "guest",
        "verdict import verdicts.csv",
        "GRANT mocban_reviewer",
    );
    lab.assert_refused("lan", "verdict import verdicts.csv", "not nga");
    let own = "pair,verdict,reviewer\nupright-0001,pass,lan\n";
    std::fs::write(lab.path().join("own.csv"), own).expect("written");
    lab.call("lan", "verdict import own.csv").expect(0);
    let import = |user| {
        let imported = lab.call(user, "--json verdict import verdicts.csv");
        imported.expect(0).json()["recorded"].as_u64()
    };
    assert_eq!(import("grid"), Some(2));
    lab.call("chief", "verdict undo --reviewer nga").expect(0);
    assert_eq!(import("chief"), Some(1));
    for words in ["verdict undo", "review --reviewer grid"] {
        lab.assert_refused("grid", words, "not judge or undo");
    }
    lab.call("chief", "verdict undo --reviewer nga").expect(0);
    lab.assert_whole();
}

#[test]
fn workers_import_run_and_repair() {
    let Some(lab) = Lab::with_roles("4") else {
        return;
    };
    for words in [
        "import lab/data/manifest.csv --truth lab/data/truth.jsonl",
        "plan --rerun all",
        "worker",
        "run --rerun all",
        "db init",
    ] {
        lab.call("grid", words).expect(0);
    }
    for user in ["grid", "chief"] {
        let artifacts = lab.path().join("lab/artifacts");
        let (damaged, _) = below(&artifacts).remove(0);
        std::fs::remove_file(artifacts.join(damaged)).expect("removed");
        lab.assert_refused("lan", "check --repair", "more rights");
        lab.call(user, "check --repair").expect(0);
        lab.call("grid", "run").expect(0);
    }
    lab.assert_whole();
}

#[test]
fn failed_pairs_are_stored_and_retried_by_a_worker() {
    let Some(lab) = Lab::new("2") else { return };
    lab.call("mocban", "db init --roles").expect(0);
    lab.add_user("grid", "worker");
    lab.add_user("guest", "viewer");
    std::fs::write(lab.path().join("lab/flat.stl"), "solid\nendsolid\n").expect("written");
    std::fs::write(
        lab.path().join("lab/more.csv"),
        "id,mesh,print\nflat,flat.stl,data/manifest.csv\n",
    )
    .expect("written");
    lab.call("grid", "import lab/more.csv").expect(0);
    lab.call("grid", "run").expect(3);
    lab.assert_refused("guest", "retry", "more rights");
    lab.call("grid", "retry").expect(0);
    lab.call("grid", "run").expect(3);
    lab.assert_whole();
}
