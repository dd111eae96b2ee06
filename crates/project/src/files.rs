//! Files and directories named on the command line.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{ErrorKind, Read as _};
use std::path::Path;

use super::exit::Refusal;
use super::input_paths::in_existing_form;
use crate::error::{ProjectError, ProjectResult, WithContext as _};
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{ErrorCode, FileKind, ONLY_ZEROS, are_zeros, pointer_of, sanitize};
use mocban_lists::workbook::{is_workbook, read_sheet};
use mocban_store::{create_folders, open_regular, read_file_or_pipe, read_up_to, write_atomic};

/// Longest list that is read, in bytes.
const MAX_LIST_BYTES: u64 = 512 << 20;

/// Reads a list that is named on the command line, from a file or a pipe.
pub fn read(path: &Path) -> Result<Vec<u8>, Refusal> {
    let bytes = read_file_or_pipe(&in_existing_form(path), MAX_LIST_BYTES)
        .map_err(|error| refusal(path, &error, "there is no file", "cannot read"))?;
    if FileKind::of(&bytes[..bytes.len().min(HEAD_BYTES)]) == FileKind::LfsPointer {
        let text = format!("{} {}", path.display(), pointer_of("file"));
        return Err(Refusal::Usage(text));
    }
    if are_zeros(&bytes) {
        let text = format!("{} {ONLY_ZEROS}", path.display());
        return Err(Refusal::Usage(text));
    }
    if let Some(document) = locked_document(path) {
        let text = format!(
            "{} is the lock file of an open document; name the document {document} instead",
            path.display()
        );
        return Err(Refusal::Usage(text));
    }
    Ok(bytes)
}

/// Returns the name of the document whose lock file this is. Office programs write such a file beside an open document; Excel
/// leaves out the first letters of some names.
fn locked_document(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let of_libre_office = || name.strip_prefix(".~lock.")?.strip_suffix('#');
    let document = name.strip_prefix("~$").or_else(of_libre_office)?;
    Some(document.to_owned())
}

/// Reads a list from the standard input, like [`read`].
pub fn read_stdin() -> Result<Vec<u8>, Refusal> {
    read_up_to(std::io::stdin().lock(), MAX_LIST_BYTES)
        .map_err(|error| Refusal::Usage(format!("cannot read the standard input: {error}")))
}

/// A list that was read.
#[derive(Debug)]
pub struct ListFile {
    /// Its text; of a workbook, the table of a sheet as CSV.
    pub bytes: Vec<u8>,
    /// Says which sheet was read if there are others.
    pub warning: Option<String>,
}

/// Reads a list that is named on the command line. Of a workbook, reads the sheet that is named, or else the first one.
pub fn read_list(path: &Path, sheet: Option<&str>) -> Result<ListFile, Refusal> {
    let bytes = read(path)?;
    let shown = path.display();
    if is_workbook(&bytes) {
        let table = read_sheet(&bytes, sheet)
            .map_err(|error| Refusal::Usage(format!("{shown}: {error}")))?;
        return Ok(ListFile {
            bytes: table.csv,
            warning: table.warning.map(|warning| format!("{shown}: {warning}")),
        });
    }
    if is_html(&bytes) {
        let text = format!(
            "{shown} is an HTML table; save it as XLSX or as \"CSV UTF-8\" in the spreadsheet program"
        );
        return Err(Refusal::Usage(text));
    }
    match sheet {
        None => Ok(ListFile {
            bytes,
            warning: None,
        }),
        Some(sheet) => {
            let sheet = quoted(sheet);
            let text = format!("{shown} is not an XLSX workbook, so it has no sheet {sheet}");
            Err(Refusal::Usage(text))
        }
    }
}

/// Lists fields that are not read, with the first line of each: `angle (line 2), who (line 3)`.
pub(crate) fn fields_with_lines(first_lines: &BTreeMap<String, usize>) -> String {
    let fields = first_lines.iter().map(|(field, line)| {
        let name = if field.trim().is_empty() {
            "one without a name".to_owned()
        } else {
            sanitize(field, 100)
        };
        format!("{name} (line {line})")
    });
    fields.collect::<Vec<_>>().join(", ")
}

/// Returns the first `max` of `count` lines, indented, and how many more there are.
pub(crate) fn listed(lines: &[String], count: usize, max: usize) -> String {
    let shown = &lines[..lines.len().min(max)];
    let shown_lines: Vec<String> = shown.iter().map(|line| format!("\n  {line}")).collect();
    let more = match count - shown.len() {
        0 => String::new(),
        more => format!("\n  and {more} more"),
    };
    shown_lines.concat() + &more
}

/// Returns whether a file begins like HTML, which some programs save as a file of Excel.
fn is_html(bytes: &[u8]) -> bool {
    let head = bytes[..bytes.len().min(1024)].to_ascii_lowercase();
    let has = |tag: &str| head.windows(tag.len()).any(|part| part == tag.as_bytes());
    head.trim_ascii_start().starts_with(b"<") && ["<html", "<table"].into_iter().any(has)
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

/// Bytes at the beginning of a file that show its kind.
pub(crate) const HEAD_BYTES: usize = 4096;

/// Returns the first bytes of a regular file, or `None` if it is empty or cannot be read.
pub fn head(path: &Path) -> Option<Vec<u8>> {
    beginning(path, HEAD_BYTES)
}

/// Returns the first bytes of a regular file like [`head`], up to `most`.
pub(crate) fn beginning(path: &Path, most: usize) -> Option<Vec<u8>> {
    let (file, _) = open_regular(path).ok()?;
    let mut bytes = Vec::new();
    file.take(most as u64).read_to_end(&mut bytes).ok()?;
    (!bytes.is_empty()).then_some(bytes)
}

/// Returns the kind of a regular file by its first bytes, or `None` if it is empty or cannot be read.
pub fn kind(path: &Path) -> Option<FileKind> {
    head(path).map(|head| FileKind::of(&head))
}

/// Creates the folder of a file that will be written.
pub fn create_parent(path: &Path) -> ProjectResult<()> {
    let parent = path.parent();
    match parent.filter(|folder| !folder.as_os_str().is_empty()) {
        None => Ok(()),
        Some(folder) => create_folders(folder).with_context(|| {
            let (shown, folder) = (path.display(), folder.display());
            format!("cannot write {shown}, because the folder {folder} cannot be created")
        }),
    }
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
/// complete. Creates the folder of the file.
pub fn write_output(path: &Path, bytes: &[u8], is_complete: bool) -> ProjectResult<()> {
    let shown = path.display();
    let failed = || format!("cannot write {shown}");
    if !is_complete && metadata(path).with_context(failed)?.is_some() {
        let text = format!(
            "the earlier {shown} was kept, because the new one lacks what the warnings say; put the files back, or add --allow-missing to replace it"
        );
        return Err(Refusal::Incomplete(text).into());
    }
    if path.is_dir() {
        let text = format!("\"{shown}\" is a folder; name a file in it for the output");
        return Err(Refusal::Usage(text).into());
    }
    create_parent(path)?;
    write_atomic(path, bytes).with_context(failed)
}

/// Refuses a file with the extension of another format than PNG for a picture, which is always one.
pub fn require_png(output: Option<&Path>) -> Result<(), Refusal> {
    let extension = output.and_then(Path::extension).unwrap_or_default();
    if extension.is_empty() || extension.eq_ignore_ascii_case("png") {
        return Ok(());
    }
    let text = format!(
        "the picture cannot be written as {}; name a file that ends in .png",
        extension.display()
    );
    Err(Refusal::Usage(text))
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

/// Returns whether a file holds JSON Lines. If its extension is unknown, the first character decides.
pub fn is_jsonl(file: &Path, bytes: &[u8]) -> bool {
    let extension = file.extension().and_then(|extension| extension.to_str());
    match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("jsonl" | "ndjson" | "json") => true,
        Some("csv" | "tsv") => false,
        Some(_) | None => {
            let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            matches!(text.trim_ascii_start(), [b'{' | b'[', ..])
        }
    }
}

/// Number of refused lines that are listed.
pub(crate) const MAX_SHOWN: usize = 20;

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

    /// Refuses the file with all its refused lines, of which the first are listed; `outcome` says that nothing was changed.
    /// Returns `None` if no line is refused.
    pub fn all_in_file(mut lines: Vec<Self>, file: &Path, outcome: &str) -> Option<Refusal> {
        lines.sort_by_key(|refused| refused.line);
        let (first, others) = lines.split_first()?;
        if others.is_empty() {
            return Some(first.in_file(file, outcome));
        }
        let shown = lines.iter().take(MAX_SHOWN).map(Self::to_string);
        let shown = listed(&shown.collect::<Vec<_>>(), lines.len(), MAX_SHOWN);
        let (file, count) = (file.display(), lines.len());
        let text = format!("{file}: {count} lines are refused; {outcome}:{shown}");
        Some(Refusal::Usage(text))
    }

    /// Refuses the file; `outcome` says that nothing was changed.
    pub fn in_file(&self, file: &Path, outcome: &str) -> Refusal {
        Refusal::Usage(format!("{}: {self}; {outcome}", file.display()))
    }
}

/// Refuses a path that does not exist (`missing`) or cannot be used (`failed`).
pub(crate) fn refusal(path: &Path, error: &std::io::Error, missing: &str, failed: &str) -> Refusal {
    let shown = path.display();
    Refusal::Usage(match error.kind() {
        ErrorKind::NotFound => format!("{missing} {shown}"),
        _ => format!("{failed} {shown}: {error}"),
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{is_jsonl, read_list, require_png, write_output};

    #[test]
    fn lock_files_of_office_programs_are_named() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for name in ["~$list.xlsx", ".~lock.list.xlsx#"] {
            let path = dir.path().join(name);
            std::fs::write(&path, b"\x05Admin  ").expect("written");
            let refused = read_list(&path, None).expect_err("a lock file").to_string();
            let end = "is the lock file of an open document; name the document list.xlsx instead";
            assert!(refused.ends_with(end), "{refused}");
        }
    }

    #[test]
    fn a_folder_and_other_formats_than_png_are_no_outputs_of_pictures() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let refused = write_output(dir.path(), b"text", true)
            .expect_err("a folder")
            .to_string();
        assert!(
            refused.ends_with("\" is a folder; name a file in it for the output"),
            "{refused}"
        );
        for (name, is_refused) in [("a.jpg", true), ("a.PNG", false), ("a", false)] {
            assert_eq!(
                require_png(Some(Path::new(name))).is_err(),
                is_refused,
                "{name}"
            );
        }
        require_png(None).expect("the usual place");
    }

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
        assert!(is_jsonl(Path::new("a.txt"), b" [{\"id\":1}]"));
        assert!(!is_jsonl(Path::new("a.txt"), b"id,mesh,print"));
    }
}
