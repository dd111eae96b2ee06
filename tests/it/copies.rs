//! `copy` through the real binary, between files and schemas of a PostgreSQL server: it writes only into a target without
//! a catalog, and a copy that is interrupted leaves nothing. `MOCBAN_TRIALS` sets the number of kills.

use std::path::Path;
use std::process::Stdio;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::check::done;
use crate::cli::{Call, binary, call, empty, mocban};
use crate::made_once::copy_folder;
use crate::postgres_server::url;
use crate::test_size::trials;

/// Pairs of a list without files, more than a copy reads at once.
const PAIRS: u64 = 1500;

/// Returns the address of a schema of its own, if there is a server.
fn schema() -> Option<String> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let (process, next) = (std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
    Some(format!(
        "{}&options=-c%20search_path%3Dcopy{process}_{next}",
        url()?
    ))
}

/// Calls a command on the catalog of a folder or an address.
fn on(root: &Path, place: &str, args: &[&str]) -> Call {
    let project = if place.contains("://") {
        ["-C", ".", "--catalog", place]
    } else {
        ["-C", place, "--catalog", ""]
    };
    mocban(root, &[&project, args].concat())
}

/// Adds pairs without files to a project.
fn import(root: &Path, place: &str, prefix: &str, pairs: u64) {
    let rows = (0..pairs).map(|n| format!("{prefix}{n},a{n}.stl,a{n}.png\n"));
    let list = format!("id,mesh,print\n{}", rows.collect::<String>());
    let file = root.join(format!("{prefix}.csv"));
    std::fs::write(&file, list).expect("written");
    let file = file.to_str().expect("UTF-8");
    on(root, place, &["-q", "import", "--allow-missing", file]).expect(0);
}

fn copy(root: &Path, from: &str, to: &str) -> Call {
    mocban(root, &["copy", "--json", from, to])
}

/// Returns what people see of a catalog. The depth maps and masks are not copied, so a report ends with code 3.
fn seen(root: &Path, place: &str) -> [String; 3] {
    [
        &["report", "--format", "json"] as &[&str],
        &["verdict", "log", "--json"],
        &["status", "--json"],
    ]
    .map(|args| {
        let call = on(root, place, args);
        assert!([0, 3].contains(&call.code), "{args:?}: {}", call.err);
        call.out
    })
}

#[test]
fn a_finished_copy_is_compared_and_never_written_to() {
    let dir = empty();
    let root = dir.path();
    done(root);
    on(root, "p", &["retire", "upright-0000"]).expect(0);
    let mut copies = vec![("p".to_owned(), "file".to_owned())];
    if let (Some(first), Some(second)) = (schema(), schema()) {
        copies.push(("p".to_owned(), first.clone()));
        copies.push((first.clone(), "of-server".to_owned()));
        copies.push((first, second));
    }
    for (from, to) in &copies {
        let made = copy(root, from, to).expect(0);
        // The files of the demo lie in the folder of the original.
        let warns = made
            .err
            .contains("input files that were looked at are missing");
        assert_eq!(warns, !to.contains(':'), "{}", made.err);
        let made = made.json();
        assert_eq!(made["existed"], false);
        let status = on(root, to, &["status", "--json"]).expect(0).json();
        assert_eq!(status["retired"], 1);
        let again = copy(root, from, to).expect(0);
        assert_eq!(again.json()["existed"], true);
        assert_eq!(again.json()["tables"], made["tables"]);
        assert!(again.err.contains("nothing was written"), "{}", again.err);
    }
    // People use the copies, and the original goes on too.
    for (_, to) in &copies {
        let verdict = ["verdict", "set", "upright-0001", "fail"];
        on(root, to, &[&verdict[..], &["--reviewer", "minh"]].concat()).expect(0);
        on(root, to, &["retire", "--undo", "upright-0000"]).expect(0);
    }
    import(root, "p", "later", 2);
    for (from, to) in &copies {
        let before = seen(root, to);
        let refused = copy(root, from, to).expect(2);
        let says = "is a finished copy of this catalog, but the table";
        assert!(refused.err.contains(says), "{}", refused.err);
        assert!(seen(root, to) == before, "{from} {to}");
    }
    // The catalog of another project is refused too.
    import(root, "other", "other", 1);
    for (_, to) in &copies {
        let refused = copy(root, "other", to).expect(2);
        assert!(refused.err.contains("holds another catalog"));
    }
}

#[test]
fn a_copy_onto_itself_is_refused_by_any_spelling() {
    let dir = empty();
    let root = dir.path();
    import(root, "p", "a", 1);
    std::os::unix::fs::symlink("p", root.join("link")).expect("a link");
    let file = root.join("p").to_str().expect("UTF-8").to_owned();
    let mut spellings = vec![("p".to_owned(), file), ("./p/../p".into(), "link".into())];
    if let Some(server) = schema() {
        copy(root, "p", &server).expect(0);
        let (_, parameters) = server.split_once('?').expect("parameters");
        let other = format!("postgres:///postgres?user=mocban&{parameters}");
        spellings.push((server.clone(), server.clone()));
        spellings.push((server, other));
    }
    for (from, to) in spellings {
        let refused = copy(root, &from, &to).expect(2);
        let says = "is the catalog to copy itself";
        assert!(refused.err.contains(says), "{from} {to}: {}", refused.err);
    }
}

#[test]
fn a_folder_whose_settings_name_a_server_is_no_place_of_a_copy() {
    let dir = empty();
    let root = dir.path();
    import(root, "p", "a", 1);
    std::fs::create_dir(root.join("q")).expect("a folder");
    let settings = "storage.catalog = \"postgres://me@db.example/lab\"\n";
    std::fs::write(root.join("q/mocban.toml"), settings).expect("written");
    for (from, to) in [("p", "q"), ("q", "r")] {
        let refused = copy(root, from, to).expect(2);
        assert!(refused.err.contains("db.example/lab"), "{}", refused.err);
    }
    assert!(!root.join("q/catalog.sqlite").exists() && !root.join("r").exists());
}

#[test]
fn a_password_in_the_address_of_a_copy_is_not_repeated() {
    let dir = empty();
    import(dir.path(), "p", "a", 1);
    let address = "postgres://me:se-cret@db.example/lab";
    for (from, to) in [("p", address), (address, "q")] {
        let refused = copy(dir.path(), from, to).expect(2);
        assert!(refused.err.contains(".pgpass"), "{}", refused.err);
        assert!(!refused.err.contains("se-cret"), "{}", refused.err);
    }
}

/// Starts a copy from `p`.
fn start(root: &Path, to: &str) -> std::process::Child {
    let mut command = binary();
    command.current_dir(root).args(["copy", "p", to]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().expect("the binary starts")
}

#[test]
fn a_killed_copy_leaves_no_catalog_and_can_be_made_again() {
    let dir = empty();
    let root = dir.path();
    import(root, "p", "a", PAIRS);
    let mut dice = ChaCha8Rng::seed_from_u64(47);
    let times = [Some("whole".to_owned()), schema()].map(|to| {
        let begun = Instant::now();
        copy(root, "p", &to?).expect(0);
        Some(begun.elapsed().as_millis() as u64)
    });
    for trial in 0..trials(3) {
        let targets = [Some(format!("q{trial}")), schema()];
        for (to, time) in targets.into_iter().zip(times) {
            let (Some(to), Some(time)) = (to, time) else {
                continue;
            };
            let mut child = start(root, &to);
            // The kill must come at a random moment, so the test waits for a time and not for an event.
            std::thread::sleep(Duration::from_millis(dice.random_range(0..=time)));
            // It may have ended.
            let _ = child.kill();
            child.wait().expect("an exit code");
            let found = on(root, &to, &["status", "--json"]);
            match found.code {
                0 => assert_eq!(found.json()["pairs"], PAIRS, "half a copy in {to}"),
                10 => {}
                _ => assert!(found.err.contains("there is no "), "{}", found.err),
            }
            let again = copy(root, "p", &to).expect(0);
            // The server may still store a copy whose process was killed in its last moment.
            assert!(found.code != 0 || again.json()["existed"] == true);
            let status = on(root, &to, &["status", "--json"]).expect(0);
            assert_eq!(status.json()["pairs"], PAIRS);
        }
        let left = crate::backup::files(&root.join(format!("q{trial}")));
        assert_eq!(left, ["catalog.sqlite"]);
    }
}

#[test]
fn copies_at_the_same_time_make_one_whole_copy() {
    let dir = empty();
    let root = dir.path();
    import(root, "p", "a", PAIRS);
    for to in [Some("q".to_owned()), schema()].into_iter().flatten() {
        let mut copies = [(); 3].map(|()| start(root, &to));
        for copy in &mut copies {
            assert!(copy.wait().expect("an exit code").success());
        }
        assert_eq!(copy(root, "p", &to).expect(0).json()["existed"], true);
    }
    assert_eq!(crate::backup::files(&root.join("q")), ["catalog.sqlite"]);
}

/// Each import adds 50 pairs at once.
#[test]
fn a_copy_of_a_catalog_that_changes_has_the_state_of_one_moment() {
    let dir = empty();
    let root = dir.path();
    import(root, "p", "first", 1000);
    for (round, to) in [Some("q".to_owned()), schema()]
        .into_iter()
        .flatten()
        .enumerate()
    {
        let mut copying = start(root, &to);
        for list in 0..5 {
            import(root, "p", &format!("r{round}l{list}p"), 50);
        }
        assert!(copying.wait().expect("an exit code").success());
        let status = on(root, &to, &["status", "--json"]).expect(0).json();
        let pairs = status["pairs"].as_u64().expect("a number");
        assert!(pairs >= 1000 && pairs.is_multiple_of(50), "{pairs}");
        on(root, &to, &["check"]).expect(0);
    }
}

/// A backup of a catalog on a server, restored: no command on it reaches the server.
#[test]
fn a_restored_project_is_local() {
    let dir = empty();
    let root = dir.path();
    done(root);
    let server = schema().inspect(|server| {
        copy(root, "p", server).expect(0);
    });
    let server = server.as_deref().unwrap_or("postgres://me@db.invalid/lab");
    let is_there = url().is_some();
    let settings = format!(
        "# lab\n[depth]\nlongest_px = 96\n[storage] # ours\ncatalog = '{server}'\nartifacts = 's3://mocban-no-bucket/x'\ncache_gb = 7\n"
    );
    std::fs::write(root.join("p/mocban.toml"), &settings).expect("written");
    let backup = ["-C", "p", "--set", "storage.artifacts=", "backup", "b"];
    let file = ["--catalog", ""];
    let file: &[&str] = if is_there { &[] } else { &file };
    mocban(root, &[file, &backup[..]].concat()).expect(0);
    let log = |place: &str| on(root, place, &["verdict", "log", "--json"]).expect(0).out;
    let before = is_there.then(|| log(server));

    // A variable or flag would lead the next commands to another catalog.
    for (arguments, variable) in [
        (&[] as &[&str], Some(("MOCBAN_STORAGE__CATALOG", server))),
        (&[], Some(("MOCBAN_STORAGE_ARTIFACTS", "s3://lab/x"))),
        (&["--catalog", server], None),
        (&["--set", "storage.artifacts=s3://lab/x"], None),
    ] {
        let mut command = binary();
        command.current_dir(root).envs(variable).args(arguments);
        let refused = call(command.args(["restore", "b", "q"])).expect(2);
        assert!(refused.err.contains("would work there"), "{}", refused.err);
        assert!(!root.join("q").exists());
    }
    std::fs::create_dir(root.join("taken")).expect("a folder");
    std::fs::write(root.join("taken/mocban.toml"), &settings).expect("written");
    let refused = mocban(root, &["restore", "b", "taken"]).expect(2);
    assert!(
        refused
            .err
            .contains("taken/mocban.toml sets storage.catalog")
    );
    assert_eq!(crate::backup::files(&root.join("taken")), ["mocban.toml"]);

    copy_folder(&root.join("p/data"), &root.join("q/data"));
    let told = mocban(root, &["restore", "b", "q", "--json"]).expect(0);
    let removed = &told.json()["settings_removed"];
    let expected = serde_json::json!(["storage.catalog", "storage.artifacts"]);
    assert_eq!(removed, &expected);
    assert!(
        told.err.contains("commented out storage.catalog"),
        "{}",
        told.err
    );
    let restored = std::fs::read_to_string(root.join("q/mocban.toml")).expect("settings");
    let kept: Vec<_> = settings
        .lines()
        .filter(|line| !line.contains("://"))
        .collect();
    let found: Vec<_> = restored
        .lines()
        .filter(|line| !line.contains("://"))
        .collect();
    let without_reason = |line: &&&str| kept.contains(*line);
    assert_eq!(found.iter().filter(without_reason).count(), kept.len());
    for line in restored.lines().filter(|line| line.contains("://")) {
        assert!(line.starts_with('#'), "{line}");
    }
    let verdict = ["verdict", "set", "upright-0001", "fail", "--reviewer", "x"];
    mocban(root, &[&["-C", "q"], &verdict[..]].concat()).expect(0);
    let repair = ["-C", "q", "check", "--repair", "--accept-missing"];
    mocban(root, &repair).expect(0);
    mocban(root, &["-C", "q", "status"]).expect(0);
    assert_eq!(is_there.then(|| log(server)), before);
    assert!(log("q").contains("\"x\""));
}

/// The file in the folder is not what the settings name.
#[test]
fn invalid_settings_that_may_name_a_server_do_not_lead_to_the_file() {
    let dir = empty();
    let root = dir.path();
    import(root, "p", "a", 1);
    let log = || mocban(root, &["-C", "p", "verdict", "log"]);
    let write = |text: &str| std::fs::write(root.join("p/mocban.toml"), text).expect("written");
    write("[depht]\nlongest_px = 96\n# storage\n");
    log().expect(0);
    for form in [
        "[storage]\ncatalog = 'postgres://me@db.example/lab'",
        "\"stor\\u0061ge\" = { catalog = 'postgres://me@db.example/lab' }",
    ] {
        write(&format!("{form}\n[depht]\nlongest_px = 96\n"));
        let refused = log().expect(2);
        assert!(refused.err.contains("depht"), "{}", refused.err);
    }
}
