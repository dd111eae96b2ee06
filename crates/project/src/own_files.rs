//! Files that a project needs, over which no output is written.

use std::path::{Path, PathBuf};

use crate::empty_import::EMPTY_IMPORT_FILE;
use crate::error::ProjectResult;
use crate::exit::Refusal;
use crate::files::{HEAD_BYTES, beginning, is_backup};
use crate::script_checksum;
use mocban_catalog::Catalog;
use mocban_store::{CATALOG_FILE, Project, SETTINGS_FILE};

/// File of the lists of pairs that were saved in the app, in the project folder.
pub const VIEWS_FILE: &str = "saved-views.json";

/// Refuses to write over a catalog, a backup, or another file that a project needs, or into its folder of results.
pub fn refuse_project_file(path: &Path) -> Result<(), Refusal> {
    let is_copy = || is_backup(path).unwrap_or(false).then_some("is a backup");
    let Some(reason) = project_role(path).or_else(is_copy) else {
        return Ok(());
    };
    let shown = path.display();
    Err(Refusal::Usage(format!(
        "{shown} {reason}; name another file for the output"
    )))
}

/// Bytes of an earlier report by which it is recognized. No report is longer.
const MAX_REPORT_BYTES: usize = 64 << 20;
/// Bytes of an earlier script that are compared with its checksum. No script is longer.
const MAX_SCRIPT_BYTES: usize = 16 << 20;

/// Refuses to write over a file that is not empty and that `is_ours` does not recognize by its first bytes. `what` is the
/// output, such as `a log file of this program`. Anything but a regular file is left to the function that writes.
pub fn refuse_foreign_file(
    path: &Path,
    what: &str,
    is_ours: impl FnOnce(&[u8]) -> bool,
) -> Result<(), Refusal> {
    earlier_output(path, what, HEAD_BYTES, is_ours).map(drop)
}

/// Refuses to write a report over a file like [`refuse_foreign_file`], but passes the whole file to `is_report`: a report may
/// name the program at its end. Refuses a report, too, if `is_changed` finds by its checksum that somebody changed it, or, of
/// a report without a checksum, if `is_continued` finds that somebody added text at its end.
pub(crate) fn refuse_foreign_report(
    path: &Path,
    is_report: impl FnOnce(&[u8]) -> bool,
    is_changed: impl FnOnce(&[u8]) -> Option<bool>,
    is_continued: impl FnOnce(&[u8]) -> bool,
) -> Result<(), Refusal> {
    let what = "a report of this program";
    let Some(earlier) = earlier_output(path, what, MAX_REPORT_BYTES, is_report)? else {
        return Ok(());
    };
    match is_changed(&earlier) {
        Some(true) => Err(changed_output(path, "a report")),
        None if is_continued(&earlier) => Err(Refusal::Usage(format!(
            "{} is a report to which somebody added text; choose another name, or remove it if you do not need it",
            path.display()
        ))),
        Some(false) | None => Ok(()),
    }
}

/// Refuses to write a script over a file like [`refuse_foreign_file`], and over a script that somebody changed.
pub fn refuse_foreign_script(
    path: &Path,
    what: &str,
    is_ours: impl FnOnce(&[u8]) -> bool,
) -> Result<(), Refusal> {
    match earlier_output(path, what, MAX_SCRIPT_BYTES, is_ours)? {
        Some(earlier) if script_checksum::is_changed(&earlier) => Err(changed_output(path, what)),
        Some(_) | None => Ok(()),
    }
}

/// Refuses an output of this program, such as `a report`, that somebody changed.
pub(crate) fn changed_output(path: &Path, what: &str) -> Refusal {
    Refusal::Usage(format!(
        "{} is {what} that somebody changed after it was written; choose another name, or remove it if you do not need it",
        path.display()
    ))
}

/// Returns the first bytes of an earlier output, up to `most`, or `None` if there is nothing to write over. Refuses a file that
/// is not recognized by them.
fn earlier_output(
    path: &Path,
    what: &str,
    most: usize,
    is_ours: impl FnOnce(&[u8]) -> bool,
) -> Result<Option<Vec<u8>>, Refusal> {
    let is_free = path
        .metadata()
        .map_or(true, |meta| !meta.is_file() || meta.len() == 0);
    if is_free {
        return Ok(None);
    }
    // A file that cannot be read may be anything.
    let earlier = beginning(path, most).filter(|earlier| is_ours(earlier));
    earlier.map(Some).ok_or_else(|| {
        Refusal::Usage(format!(
            "{} exists and is not {what}; choose another name, or remove it if you do not need it",
            path.display()
        ))
    })
}

/// Returns what a path is to a project, such as `is a file of a project`, or `None` if no project needs it. The path need
/// not exist.
pub(crate) fn project_role(path: &Path) -> Option<&'static str> {
    let real = real_path(path);
    let name = real.file_name().unwrap_or_default().to_string_lossy();
    // Copies such as `catalog.sqlite.bak` are not files of the project.
    let rest = name.strip_prefix(CATALOG_FILE);
    let is_catalog = rest.is_some_and(|rest| ["", "-wal", "-shm", "-journal"].contains(&rest));
    let is_known = is_catalog
        || [
            SETTINGS_FILE,
            EMPTY_IMPORT_FILE,
            VIEWS_FILE,
            "run.lock",
            "run.members",
        ]
        .contains(&&*name);
    // The parent of a bare file name is empty.
    let folder = Path::new(".").join(real.parent().unwrap_or(&real));
    if is_known && is_project(&folder) {
        Some("is a file of a project")
    } else if is_among_results(&real) {
        Some("belongs to the results of a project")
    } else {
        None
    }
}

/// Returns the absolute path of a file that need not exist, without links.
fn real_path(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let found = absolute.ancestors().find_map(|folder| {
        let below = absolute.strip_prefix(folder).ok()?;
        let real = folder.canonicalize().ok()?;
        // Joining an empty path would add a separator.
        Some(if below == Path::new("") {
            real
        } else {
            real.join(below)
        })
    });
    found.unwrap_or(absolute)
}

/// Returns whether a path is the folder of results of a project, or inside it.
fn is_among_results(real: &Path) -> bool {
    real.ancestors().any(|folder| {
        let project = folder.parent().map(Project::at);
        project
            .is_some_and(|project| project.artifacts_dir() == folder && is_project(project.dir()))
    })
}

/// Returns whether a folder has a catalog, or settings, which may name a catalog on a server.
pub(crate) fn is_project(folder: &Path) -> bool {
    [CATALOG_FILE, SETTINGS_FILE]
        .iter()
        .any(|name| folder.join(name).exists())
}

/// Refuses to write over a file of a project, or over an input of its pairs and blocks.
pub(crate) async fn refuse_used_file(
    path: &Path,
    project: &Project,
    catalog: &Catalog,
) -> ProjectResult<()> {
    refuse_project_file(path)?;
    // A file that does not exist is not an input.
    let Ok(real) = path.canonicalize() else {
        return Ok(());
    };
    // Two inputs may have the same file name in different folders, and an input may be a link.
    let is_target = |stored: &String| {
        let input = project.input_path(stored);
        input == real || input.canonicalize().is_ok_and(|input| input == real)
    };
    let inputs = catalog.inputs_named([path, &real].map(file_name)).await?;
    let Some((pair, _)) = inputs.into_iter().find(|(_, stored)| is_target(stored)) else {
        return Ok(());
    };
    let shown = path.display();
    Err(Refusal::Usage(format!(
        "{shown} is an input of {pair}; name another file for the output"
    ))
    .into())
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::{HEAD_BYTES, refuse_foreign_file, refuse_foreign_report};

    #[test]
    fn only_a_file_that_is_recognized_is_replaced() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("a.txt");
        let is_ours = |bytes: &[u8]| bytes == b"ours";
        let check = || refuse_foreign_file(&path, "a report of this program", is_ours);
        check().expect("no file");
        for (content, is_replaced) in [("", true), ("ours", true), ("theirs", false)] {
            std::fs::write(&path, content).expect("written");
            assert_eq!(check().is_ok(), is_replaced, "{content}");
        }
        let refused = check().expect_err("another file").to_string();
        let reason = "a.txt exists and is not a report of this program; choose another name";
        assert!(refused.contains(reason), "{refused}");
    }

    #[test]
    fn only_a_report_is_recognized_by_more_than_its_first_bytes() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("a.txt");
        let end = b"ours";
        let content = [vec![b' '; HEAD_BYTES], end.to_vec()].concat();
        std::fs::write(&path, content).expect("written");
        let is_ours = |bytes: &[u8]| bytes.ends_with(end);
        for (checksum, is_continued, said) in [
            (None, false, None),
            (None, true, Some("somebody added text")),
            (Some(false), true, None),
            (Some(true), false, Some("somebody changed")),
        ] {
            let checked = refuse_foreign_report(&path, is_ours, |_| checksum, |_| is_continued);
            let refused = checked.err().map(|refused| refused.to_string());
            let is_right = match (&refused, said) {
                (Some(refused), Some(said)) => refused.contains(said),
                (refused, said) => refused.is_none() && said.is_none(),
            };
            assert!(is_right, "{refused:?} {said:?}");
        }
        std::fs::write(&path, "").expect("written");
        assert!(refuse_foreign_report(&path, is_ours, |_| Some(true), |_| true).is_ok());
        std::fs::write(&path, [vec![b' '; HEAD_BYTES], end.to_vec()].concat()).expect("written");
        assert!(refuse_foreign_file(&path, "a log", is_ours).is_err());
    }
}
