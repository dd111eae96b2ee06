//! Catalogs and backups to whose schema another program added something, such as a trigger that changes verdicts.

use mocban::store::Project;

use crate::check::{at, done, sql};
use crate::cli::mocban;

/// Changes a verdict whenever a worker registers, a pair is imported or a verdict is stored. Its name is one of sqlx.
const TRIGGERS: &str = "
CREATE TRIGGER _sqlx_migrations AFTER INSERT ON worker BEGIN DELETE FROM truth; END;
CREATE TRIGGER evil AFTER UPDATE ON pair BEGIN DELETE FROM truth; END;";

#[test]
fn a_catalog_with_a_foreign_trigger_is_read_but_not_written_to() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    sql(&project, TRIGGERS);
    let before = std::fs::read(project.catalog_path()).expect("read");
    let set = "verdict set upright-0001 pass --reviewer lan";
    for words in [
        "run",
        set,
        "verdict undo",
        "import data/manifest.csv",
        "retry",
        "plan",
        "check --repair",
    ] {
        let words: Vec<_> = words.split(' ').collect();
        let refused = at(&project, &words).expect(12);
        for text in [
            "trigger evil does not belong",
            "trigger _sqlx_migrations",
            "catalog.sqlite",
        ] {
            assert!(refused.err.contains(text), "{words:?}: {}", refused.err);
        }
    }
    assert!(std::fs::read(project.catalog_path()).expect("read") == before);
    for words in [&["status"][..], &["report"], &["verdict", "log"]] {
        at(&project, words).expect(0);
    }
    let found = at(&project, &["check"]).expect(12).out;
    assert!(found.contains("trigger evil does not belong"), "{found}");
}

#[test]
fn a_backup_with_a_foreign_trigger_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let backup = dir.path().join("b.sqlite");
    at(&project, &["backup", backup.to_str().expect("UTF-8")]).expect(0);
    let restore = |to: &str| mocban(dir.path(), &["restore", "b.sqlite", to, "--inputs", "p"]);
    restore("sound").expect(0);
    let copy = dir.path().join("q");
    std::fs::create_dir(&copy).expect("a folder");
    std::fs::rename(&backup, copy.join("catalog.sqlite")).expect("moved");
    let foreign = Project::open(&copy).expect("a project");
    sql(&foreign, TRIGGERS);
    std::fs::rename(foreign.catalog_path(), &backup).expect("moved");
    let refused = restore("new").expect(12);
    for text in ["trigger evil does not belong", "b.sqlite"] {
        assert!(refused.err.contains(text), "{}", refused.err);
    }
    assert!(!dir.path().join("new").exists());
}
