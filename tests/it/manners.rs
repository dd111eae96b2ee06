//! Messages about missing files, existing files, long lists and interrupted commands.

use std::process::{Command, Stdio};

use crate::cli::{binary, empty, mocban};

#[test]
fn missing_file_is_a_usage_error() {
    let dir = empty();
    for args in [
        &["import", "nothere.csv"][..],
        &["import", "--meshes", "nothere", "--prints", "nothere"],
    ] {
        let refused = mocban(dir.path(), args).expect(2);
        assert!(refused.err.contains("nothere"), "{}", refused.err);
    }
    let left = std::fs::read_dir(dir.path()).expect("readable").count();
    assert_eq!(left, 0, "nothing is created");
    std::fs::write(
        dir.path().join("pairs.csv"),
        "id,mesh,print\na,a.stl,a.png\n",
    )
    .expect("written");
    let truth = ["import", "pairs.csv", "--truth", "nothere.jsonl"];
    mocban(dir.path(), &truth).expect(2);
    mocban(dir.path(), &["import", "pairs.csv", "--allow-missing"]).expect(0);
    mocban(dir.path(), &["verdict", "import", "nothere.csv"]).expect(2);
}

#[test]
fn status_lists_every_failed_pair_on_request() {
    let dir = empty();
    let rows = (0..5).map(|i| format!("p{i},p{i}.stl,p{i}.png\n"));
    let list = format!("id,mesh,print\n{}", rows.collect::<String>());
    std::fs::write(dir.path().join("pairs.csv"), list).expect("written");
    mocban(dir.path(), &["import", "pairs.csv", "--allow-missing"]).expect(0);
    mocban(dir.path(), &["run"]).expect(3);
    let short = mocban(dir.path(), &["status"]).expect(0).out;
    assert!(
        short.contains("and 2 more") && short.contains("`status --failed` lists all"),
        "{short}"
    );
    assert!(!short.contains("p4"), "{short}");
    let all = mocban(dir.path(), &["status", "--failed"]).expect(0).out;
    assert!((0..5).all(|i| all.contains(&format!("p{i}.stl"))), "{all}");
    assert!(!all.contains("more"), "{all}");
    let told = mocban(dir.path(), &["--json", "status", "--failed"])
        .expect(0)
        .json();
    let ids: Vec<&str> = told["failures"]
        .as_array()
        .expect("failures")
        .iter()
        .filter_map(|failed| failed["id"].as_str())
        .collect();
    assert_eq!(ids, ["p0", "p1", "p2", "p3", "p4"]);
}

#[test]
fn demo_in_the_directory_of_another_demo_suggests_how_to_continue_it() {
    let dir = empty();
    let demo = |tier: &str| {
        mocban(
            dir.path(),
            &["demo", "d", "--pairs", "1", "--no-run", "--tier", tier],
        )
    };
    demo("upright").expect(0);
    let refused = demo("pose").expect(2);
    assert!(
        refused.err.contains("`mocban -C d run` continues it"),
        "{}",
        refused.err
    );
}

#[test]
fn demo_stopped_while_writing_its_files_reports_that() {
    let dir = empty();
    let mut child = binary()
        .current_dir(dir.path())
        .args(["demo", "d", "--pairs", "1000000"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let staging = format!("d/.data.{}-0.mocban-partial", child.id());
    let meshes = dir.path().join(staging).join("new/meshes");
    let has_started = || std::fs::read_dir(&meshes).is_ok_and(|mut files| files.next().is_some());
    crate::waiting::until(&mut child, has_started);
    let pid = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &pid]).status();
    assert!(sent.expect("kill starts").success());
    let output = child.wait_with_output().expect("it ends");
    let err = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(
        err.contains("stopped while the files were being written"),
        "{err}"
    );
    let left = std::fs::read_dir(dir.path().join("d")).expect("a folder");
    assert_eq!(left.count(), 0);
}
