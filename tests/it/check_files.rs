//! `check` with result files that are all missing, cannot be read, or whose place something else takes.

use std::path::Path;

use serde_json::json;

use mocban::domain::Stage;

use crate::check::{artifact, at, done, exported, kinds};

/// A disk that is not mounted looks like an empty folder.
#[test]
fn a_repair_changes_no_result_while_most_files_are_missing_unless_that_is_accepted() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let (artifacts, away) = (project.artifacts_dir(), dir.path().join("away"));
    let before = at(&project, &["status", "--json"]).expect(0).out;
    let unknown = artifacts.join("tmp/4711-0");
    std::fs::rename(&artifacts, &away).expect("moved");
    std::fs::create_dir_all(artifacts.join("tmp")).expect("a folder");
    std::fs::write(&unknown, "half").expect("written");
    for args in [&["check"][..], &["check", "--repair"]] {
        let kept = at(&project, args).expect(12);
        assert!(kept.out.contains("no result file is there"), "{}", kept.out);
        assert!(kept.next()[0].ends_with("--repair --accept-missing"));
        assert!(unknown.exists(), "nothing is removed either");
    }
    let kept = at(&project, &["check", "--repair", "--json"])
        .expect(12)
        .json();
    assert_eq!(kept["repaired"]["withheld"], true);
    assert_eq!(kept["repaired"]["requeued"], 0);
    assert_eq!(at(&project, &["status", "--json"]).expect(0).out, before);
    std::fs::remove_dir_all(&artifacts).expect("removed");
    std::fs::rename(&away, &artifacts).expect("mounted");
    at(&project, &["check", "--repair"]).expect(0);
    std::fs::remove_dir_all(&artifacts).expect("removed");
    at(&project, &["check", "--accept-missing"]).expect(2);
    let repaired = at(&project, &["check", "--repair", "--accept-missing"]).expect(0);
    assert!(
        repaired.out.contains("2 pairs will run again"),
        "{}",
        repaired.out
    );
}

#[cfg(unix)]
#[test]
fn artifacts_that_cannot_be_read_end_a_check_once_and_change_nothing() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let before = at(&project, &["status", "--json"]).expect(0).out;
    let (artifacts, away) = (project.artifacts_dir(), dir.path().join("away"));
    std::fs::rename(&artifacts, &away).expect("moved");
    let file = || std::fs::write(&artifacts, "no folder");
    let link = || std::os::unix::fs::symlink(dir.path().join("unmounted"), &artifacts);
    let cases: [(&dyn Fn() -> std::io::Result<()>, &str); 2] = [
        (&file, "is a file, where this program keeps a folder"),
        (&link, "a link to a folder that is not there"),
    ];
    for (block, reason) in cases {
        block().expect("made");
        for args in [
            &["check"][..],
            &["check", "--repair"],
            &["check", "--repair", "--accept-missing"],
            &["check", "--collect=1"],
            &["export", "-o", "out"],
        ] {
            let refused = at(&project, args).expect(1);
            assert_eq!(refused.err.matches(reason).count(), 1, "{}", refused.err);
        }
        std::fs::remove_file(&artifacts).expect("removed");
    }
    assert_eq!(at(&project, &["status", "--json"]).expect(0).out, before);
    std::fs::rename(&away, &artifacts).expect("mounted");
    at(&project, &["check"]).expect(0);
}

/// A folder that somebody made, a pipe, and a file where a folder belongs.
#[cfg(unix)]
#[test]
fn what_is_in_the_place_of_an_artifact_is_named_and_concerns_its_pair_alone() {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let before = exported(&project, "before");
    let blocked = artifact(&project, 0, Stage::Depth, "depth.png");
    std::fs::remove_file(&blocked).expect("removed");
    let make_pipe = |path: &Path| mknodat(CWD, path, FileType::Fifo, Mode::RUSR, 0);
    make_pipe(&blocked).expect("a pipe");
    let found = at(&project, &["check", "--json"]).expect(12).json();
    assert_eq!(kinds(&found), ["file_unreadable".to_owned()].into());
    std::fs::remove_file(&blocked).expect("removed");
    std::fs::create_dir_all(blocked.join("mine")).expect("a folder");
    let text = format!("{} is a directory, where", blocked.display());
    for args in [&["check"][..], &["check", "--repair"]] {
        let found = at(&project, args).expect(12);
        assert!(found.out.contains(&text), "{}", found.out);
        assert!(found.next().is_empty(), "{}", found.err);
    }
    let ended = at(&project, &["run", "--rerun", "all"]).expect(3);
    assert_eq!(ended.err.matches(&text).count(), 1, "{}", ended.err);
    let status = at(&project, &["status", "--json"]).expect(0).json();
    assert_eq!(status["jobs"]["done"], 1, "{status}");
    assert_eq!(status["jobs"]["quarantined"], 1, "{status}");
    std::fs::remove_dir_all(&blocked).expect("moved away");
    at(&project, &["retry"]).expect(0);
    at(&project, &["run"]).expect(0);
    at(&project, &["check"]).expect(0);
    assert!(exported(&project, "after") == before, "another export");
}

#[test]
fn copies_under_other_ids_and_changed_inputs_are_named() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let data = project.dir().join("data");
    let list = std::fs::read_to_string(data.join("manifest.csv")).expect("a list");
    let mut lines = list.lines();
    let header = lines.next().expect("a header");
    let row: Vec<&str> = lines.next().expect("a pair").split(',').collect();
    let [known, mesh, print, ref others @ ..] = row[..] else {
        unreachable!("a list has an id, a mesh and a print");
    };
    let file = |path: &str| {
        let extension = Path::new(path).extension().expect("an extension");
        format!("copy.{}", extension.display())
    };
    let copied = [mesh, print].map(|path| {
        let to = file(path);
        std::fs::copy(data.join(path), data.join(&to)).expect("copied");
        to
    });
    let files = ["copy", copied[0].as_str(), copied[1].as_str()];
    let row = [&files[..], others].concat().join(",");
    let rows = format!("{header}\n{row}\n");
    std::fs::write(data.join("copies.csv"), rows).expect("written");
    let copies = data.join("copies.csv").display().to_string();
    at(&project, &["import", &copies]).expect(0);
    let status = || at(&project, &["status", "--json"]).expect(0).json();
    assert_eq!(status()["same_contents"], json!(null), "nothing was read");
    at(&project, &["run"]).expect(0);
    let same = json!({"pairs": {"id": "copy", "known": known, "count": 1}});
    assert_eq!(status()["same_contents"], same);
    let check = at(&project, &["check", "--json"]).expect(0).json();
    assert_eq!(check["same_contents"], same);
    let text = at(&project, &["check"]).expect(0).out;
    let sentence = "pairs with the same mesh and print as an earlier one: 1, first copy, as ";
    assert!(text.contains(sentence), "{text}");

    // Bytes after the end of an image are no part of it.
    let print = data.join(&copied[1]);
    let mut bytes = std::fs::read(&print).expect("a file");
    bytes.push(0);
    std::fs::write(&print, bytes).expect("written");
    let changed = status();
    assert_eq!(changed["changed_inputs"]["changed"], 1);
    let first = changed["changed_inputs"]["first"].as_str();
    assert!(
        first.is_some_and(|first| first.ends_with(&copied[1])),
        "{changed}"
    );
    let next = at(&project, &["status"]).expect(0).next();
    assert!(next[0].ends_with(" run"), "{next:?}");
    at(&project, &["run"]).expect(0);
    let read = status();
    assert_eq!(read["changed_inputs"], json!(null));
    assert_eq!(read["same_contents"], json!(null));
}
