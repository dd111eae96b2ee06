//! Files and directories named on the command line.

use std::fs::File;
use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use crate::error::{ProjectError, ProjectResult, WithContext as _};

use super::exit::Refusal;
use mocban_catalog::Catalog;
use mocban_core::domain::{ErrorCode, sanitize};
use mocban_store::{
    CATALOG_FILE, Project, SETTINGS_FILE, open_regular, read_file_or_pipe, write_atomic,
};

/// Longest list that is read, in bytes.
const MAX_LIST_BYTES: u64 = 512 << 20;

/// Reads a list that is named on the command line, from a file or a pipe.
pub fn read(path: &Path) -> Result<Vec<u8>, Refusal> {
    read_file_or_pipe(path, MAX_LIST_BYTES)
        .map_err(|error| refusal(path, &error, "there is no file", "cannot read"))
}

/// Returns the metadata of a file or folder, or `None` if it does not exist.
pub fn metadata(path: &Path) -> std::io::Result<Option<std::fs::Metadata>> {
    match std::fs::metadata(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        found => found.map(Some),
    }
}

/// Longest small file, in bytes.
const MAX_SMALL: u64 = 1 << 20;

/// Reads a small file, such as settings. Returns `None` if it does not exist.
pub fn small(path: &Path) -> ProjectResult<Option<Vec<u8>>> {
    let shown = path.display();
    let failed = || format!("cannot read {shown}");
    // A link to a missing file exists, and cannot be read.
    if let Err(error) = path.symlink_metadata()
        && error.kind() == std::io::ErrorKind::NotFound
    {
        return Ok(None);
    }
    let (file, _) = open_regular(path)?;
    let mut bytes = Vec::new();
    file.take(MAX_SMALL + 1)
        .read_to_end(&mut bytes)
        .with_context(failed)?;
    if bytes.len() as u64 > MAX_SMALL {
        return Err(ProjectError::unexpected(format!(
            "{shown} is longer than 1 MiB"
        )));
    }
    Ok(Some(bytes))
}

/// Refuses to write into a folder that does not exist.
pub fn refuse_missing_folder(path: &Path) -> Result<(), Refusal> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    match folder.filter(|folder| matches!(metadata(folder), Ok(None))) {
        None => Ok(()),
        Some(folder) => Err(Refusal::Usage(format!(
            "{} cannot be written, because there is no folder {}; create it first",
            path.display(),
            folder.display()
        ))),
    }
}

/// Refuses to write over a catalog, a backup, or another file that a project needs, or into a missing folder.
pub fn refuse_project_file(path: &Path) -> Result<(), Refusal> {
    refuse_missing_folder(path)?;
    let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let name = real.file_name().unwrap_or_default().to_string_lossy();
    let is_known = name.starts_with(CATALOG_FILE)
        || [SETTINGS_FILE, "run.lock", "run.members"].contains(&&*name);
    // The parent of a bare file name is empty.
    let folder = Path::new(".").join(real.parent().unwrap_or(&real));
    let reason = if is_known && folder.join(CATALOG_FILE).exists() {
        "is a file of a project"
    } else if is_backup(&real).unwrap_or(false) {
        "is a backup"
    } else {
        return Ok(());
    };
    let shown = path.display();
    Err(Refusal::Usage(format!(
        "{shown} {reason}; name another file for the output"
    )))
}

/// Refuses to write over a file of a project, or over a mesh, a print or a true mask of its pairs.
pub async fn refuse_used_file(
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

/// Returns whether a file is an SQLite database with the catalog's application id (bytes 68 to 71).
pub fn is_backup(file: &Path) -> std::io::Result<bool> {
    if !std::fs::metadata(file)?.is_file() {
        return Ok(false);
    }
    let mut head = [0; 72];
    match File::open(file).and_then(|mut file| file.read_exact(&mut head)) {
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        read => {
            read.map(|()| head.starts_with(b"SQLite format 3\0") && head[68..].starts_with(b"mocb"))
        }
    }
}

/// Writes an output that may be incomplete. An incomplete output does not replace an earlier file, which may be
/// complete.
pub fn write_output(path: &Path, bytes: &[u8], is_complete: bool) -> ProjectResult<()> {
    let shown = path.display();
    let failed = || format!("cannot write {shown}");
    if !is_complete && metadata(path).with_context(failed)?.is_some() {
        let text = format!(
            "the earlier {shown} was kept, because the new one lacks what the warnings say; put the files back, or add --allow-missing to replace it"
        );
        return Err(Refusal::Incomplete(text).into());
    }
    write_atomic(path, bytes).with_context(failed)
}

/// Adds what to do if an output could not be written to its place in the project because no other was named.
pub fn or_elsewhere(written: ProjectResult<()>, named: Option<&Path>) -> ProjectResult<()> {
    match written {
        Err(error) if named.is_none() && error.code() != ErrorCode::Incomplete => {
            Err(error.context("name a file elsewhere with -o"))
        }
        written => written,
    }
}

/// Lists the files of a directory, without its subdirectories and links to directories.
pub fn list(dir: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let refuse = |error: std::io::Error| match error.kind() {
        ErrorKind::NotADirectory => Refusal::Usage(format!("{} is not a directory", dir.display())),
        _ => refusal(dir, &error, "there is no directory", "cannot list"),
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(refuse)? {
        let entry = entry.map_err(refuse)?;
        let path = entry.path();
        // The listing has the type already; only a link must be followed.
        let is_dir = match entry.file_type() {
            Ok(kind) if !kind.is_symlink() => kind.is_dir(),
            _ => path.is_dir(),
        };
        if !is_dir {
            files.push(path);
        }
    }
    Ok(files)
}

/// Returns whether a file holds JSON Lines. If its extension is unknown, the first character decides.
pub fn is_jsonl(file: &Path, bytes: &[u8]) -> bool {
    let extension = file.extension().and_then(|extension| extension.to_str());
    match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("jsonl" | "ndjson" | "json") => true,
        Some("csv" | "tsv") => false,
        Some(_) | None => {
            let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            text.trim_ascii_start().starts_with(b"{")
        }
    }
}

/// What is wrong with a line of a file that is refused as a whole.
#[derive(Debug, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct RefusedLine {
    line: usize,
    reason: String,
}

impl RefusedLine {
    /// Names a line and what is wrong with it.
    pub fn new(line: usize, reason: &str) -> Self {
        Self {
            line,
            reason: sanitize(reason, 300),
        }
    }

    /// Refuses the file; `outcome` says that nothing was changed.
    pub fn in_file(&self, file: &Path, outcome: &str) -> Refusal {
        Refusal::Usage(format!("{}: {self}; {outcome}", file.display()))
    }
}

/// Refuses a path that does not exist (`missing`) or cannot be used (`failed`).
fn refusal(path: &Path, error: &std::io::Error, missing: &str, failed: &str) -> Refusal {
    let shown = path.display();
    Refusal::Usage(match error.kind() {
        ErrorKind::NotFound => format!("{missing} {shown}"),
        _ => format!("{failed} {shown}: {error}"),
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{is_jsonl, write_output};

    #[test]
    fn an_incomplete_file_replaces_none() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("sheet.png");
        let content = || std::fs::read(&path).expect("a file");
        write_output(&path, b"incomplete", false).expect("a new file");
        write_output(&path, b"complete", true).expect("replaced");
        let refused = write_output(&path, b"incomplete", false).expect_err("kept");
        assert!(refused.to_string().contains("was kept"), "{refused}");
        assert_eq!(content(), b"complete");
    }

    #[test]
    fn format_follows_from_the_extension_then_from_the_content() {
        assert!(is_jsonl(Path::new("a.jsonl"), b""));
        assert!(!is_jsonl(Path::new("a.csv"), b"{"));
        assert!(is_jsonl(Path::new("a"), b"\xef\xbb\xbf {\"id\":1}"));
        assert!(!is_jsonl(Path::new("a.txt"), b"id,mesh,print"));
    }
}
