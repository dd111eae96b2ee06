//! A project directory that is renamed during a run: the run stops, and nothing is created at the old path.

use std::path::Path;
use std::process::{Child, Stdio};

use mocban::store::Project;

use crate::check::at;
use crate::cli::call;
use crate::resume::{copy, results, run};
use crate::uninterrupted::Comparison;

/// Starts a run that waits at a failpoint, and returns it when it waits.
pub(crate) fn held(project: &Project, failpoint: &str, hold: &Path) -> Child {
    let mut child = run(project, &["-j", "1"])
        .env("MOCBAN_HOLD_AT", failpoint)
        .env("MOCBAN_HOLD_FILE", hold)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    crate::waiting::until(&mut child, || hold.exists());
    child
}

#[test]
fn a_run_stops_when_its_project_is_renamed() {
    let comparison = Comparison::new("3");
    let dir = comparison.dir.path();
    let expected = results(comparison.expected.project());
    for (index, failpoint) in ["fit:computed", "depth:written", "register:synced"]
        .into_iter()
        .enumerate()
    {
        for is_replaced in [false, true] {
            let name = format!("{index}-{is_replaced}");
            let [old, new, hold] =
                ["old", "new", "hold"].map(|part| dir.join(format!("{name}-{part}")));
            let project = copy(&comparison.fresh, &old);
            let child = held(&project, failpoint, &hold);
            std::fs::rename(&old, &new).expect("renamed");
            if is_replaced {
                std::fs::create_dir(&old).expect("another folder");
            }
            std::fs::remove_file(&hold).expect("released");
            let output = child.wait_with_output().expect("a child");
            let err = String::from_utf8(output.stderr).expect("UTF-8");
            assert_eq!(output.status.code(), Some(1), "{failpoint}: {err}");
            let wanted = format!("{} was renamed, moved or removed", old.display());
            assert!(err.contains(&wanted), "{failpoint}: {err}");
            assert_eq!(old.exists(), is_replaced, "{failpoint}");
            if is_replaced {
                let entries = std::fs::read_dir(&old).expect("a folder");
                assert_eq!(entries.count(), 0, "{failpoint}");
            }
            // No pair failed; the next run completes the project at its new path.
            let moved = Project::open(&new).expect("a project");
            call(&mut run(&moved, &[])).expect(0);
            at(&moved, &["check"]).expect(0);
            assert_eq!(results(&moved), expected);
        }
    }
}
