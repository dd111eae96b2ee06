//! Files of a list that do not exist.

use std::fmt::Display;
use std::fs::Metadata;
use std::path::{Path, PathBuf};

use super::exit::Refusal;
use super::files::listed;
use super::input_paths::{FoundFile, SimilarFiles, is_windows_path, look_for};
use super::unusable_files::FileSearches;
use mocban_core::domain::{first_names, sanitize};
use mocban_store::Project;

/// Maximum number of missing files that `--json` lists.
const MAX_MISSING: usize = 1000;

/// Longest path in a message, in characters.
pub(crate) const MAX_PATH_CHARS: usize = 300;

/// Maximum number of files with similar names that a message names; the others are counted.
const MAX_SIMILAR: usize = 3;

/// Ends the message of a missing file whose path is one of Windows.
const WINDOWS_HINT: &str = "; it is a path of a Windows computer: write paths relative to the list";

/// Ends the message of a missing file whose path is on several lines.
const LINE_BREAK_HINT: &str = "; its path has a line break: write the cell on one line";

/// Ends the message of a missing file whose path has a tab.
const TAB_HINT: &str = "; its path has a tab: remove it";

/// Ends the message of a path that leads to a folder.
const IS_FOLDER: &str = "is a folder, not a file";

/// Replaces the path of a row's file by its path on disk, and returns the file. Counts files that cannot be inputs.
///
/// # Errors
/// Returns a message about a file that does not exist or cannot be read, at a row with a label and a number.
pub(crate) fn locate_file(
    (label, line): (&str, usize),
    kind: &str,
    path: &mut PathBuf,
    name: &dyn Display,
    project: &Project,
    searches: &mut FileSearches,
) -> Result<FoundFile, String> {
    let problem = match look_for(path, project) {
        Ok(Some(file)) if file.meta.as_ref().is_some_and(Metadata::is_dir) => IS_FOLDER.to_owned(),
        Ok(Some(file)) => {
            searches.unusable.add(&file);
            return Ok(file);
        }
        Ok(None) if path.is_symlink() => "is a link to a file that does not exist".to_owned(),
        Ok(None) if has_scheme(path, "file://") => {
            "does not exist; write its path without file://".to_owned()
        }
        Ok(None) if has_scheme(path, "://") => {
            "is a web address; download the file and write the path of the copy".to_owned()
        }
        Ok(None) => format!(
            "does not exist{}",
            missing_hint(path, &mut searches.similar)
        ),
        Err(error) => format!("cannot be read: {error}"),
    };
    let path = sanitize(&path.to_string_lossy(), MAX_PATH_CHARS);
    Err(format!("{label} {line}: {kind} {path} of {name} {problem}"))
}

/// Returns the place of a file, which may be below a named root.
pub(crate) fn place_of(path: &Path, project: &Project) -> PathBuf {
    match path.to_str() {
        Some(stored) if project.is_below_root(stored) => project.input_path(stored),
        _ => path.to_owned(),
    }
}

/// Returns whether a path of a list is an address. The folder of the list may stand before it, and a path has no `//`.
fn has_scheme(path: &Path, scheme: &str) -> bool {
    path.to_string_lossy().contains(scheme)
}

/// Returns what may be wrong with the path of a missing file, or nothing.
fn missing_hint(path: &Path, searches: &mut SimilarFiles) -> String {
    let windows = || is_windows_path(path).then_some(WINDOWS_HINT);
    if let Some(hint) = blank_hint(path).or_else(windows) {
        return hint.to_owned();
    }
    let similar = searches.find(path);
    let similar: Vec<String> = similar
        .iter()
        .map(|path| sanitize(path, MAX_PATH_CHARS))
        .collect();
    match similar.as_slice() {
        [] => String::new(),
        paths => format!("; there is {}", first_names(paths, MAX_SIMILAR)),
    }
}

/// Returns what to do about a missing file whose path has a line break or a tab, or nothing. A file may have such a name.
fn blank_hint(path: &Path) -> Option<&'static str> {
    let path = path.to_string_lossy();
    if path.contains(['\n', '\r']) {
        return Some(LINE_BREAK_HINT);
    }
    path.contains('\t').then_some(TAB_HINT)
}

/// Files of a list that do not exist.
#[derive(Debug, Default)]
pub struct MissingFiles {
    /// Messages of the first thousand files.
    pub lines: Vec<String>,
    /// Number of all missing files.
    pub count: usize,
}

impl MissingFiles {
    /// Adds the message of a file. Only the first hint of each kind is kept.
    pub fn add(&mut self, mut line: String) {
        self.count += 1;
        for hint in [WINDOWS_HINT, LINE_BREAK_HINT, TAB_HINT] {
            if let Some(end) = line.strip_suffix(hint).map(str::len)
                && self.lines.iter().any(|line| line.ends_with(hint))
            {
                line.truncate(end);
            }
        }
        if self.lines.len() < MAX_MISSING {
            self.lines.push(line);
        }
    }

    /// Returns a line for each of the first missing files.
    fn listed(&self) -> String {
        const MAX_SHOWN: usize = 10;
        listed(&self.lines, self.count, MAX_SHOWN)
    }

    /// Adds the missing files of the other rows to the reason why a list is refused, unless these may be missing.
    pub(crate) fn added_to(&self, refused: &Refusal, may_be_missing: bool) -> Refusal {
        let missing = if may_be_missing {
            String::new()
        } else {
            self.listed()
        };
        Refusal::Usage(format!("{refused}{missing}"))
    }

    /// Returns why a list with missing files is refused.
    pub fn refusal(&self) -> Refusal {
        let shown = self.listed();
        let missing = if self.lines.iter().any(|line| line.ends_with(IS_FOLDER)) {
            "missing or a folder"
        } else {
            "missing"
        };
        Refusal::Usage(format!(
            "{} {missing}, nothing was imported:{shown}\ncorrect the paths, or use --allow-missing if the files are added \
             before the run",
            match self.count {
                1 => "1 file is".to_owned(),
                files => format!("{files} files are"),
            },
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::{IS_FOLDER, LINE_BREAK_HINT, MissingFiles, WINDOWS_HINT};

    #[test]
    fn one_file_and_several_are_named_with_what_is_in_their_place() {
        let mut files = MissingFiles::default();
        for (end, one) in [
            ("does not exist", "1 file is missing, nothing was imported:"),
            (
                IS_FOLDER,
                "1 file is missing or a folder, nothing was imported:",
            ),
        ] {
            let mut missing = MissingFiles::default();
            missing.add(format!("line 2: 1.stl {end}"));
            files.add(format!("line 2: 1.stl {end}"));
            let text = missing.refusal().to_string();
            assert!(text.starts_with(one), "{text}");
        }
        let several = "2 files are missing or a folder, nothing was imported:";
        let text = files.refusal().to_string();
        assert!(text.starts_with(several), "{text}");
    }

    #[test]
    fn each_hint_is_given_once() {
        let mut missing = MissingFiles::default();
        for (line, hint) in [
            ("line 2: C:\\1.stl does not exist", WINDOWS_HINT),
            ("line 3: 1 .stl does not exist", LINE_BREAK_HINT),
            ("line 4: C:\\2.stl does not exist", WINDOWS_HINT),
            ("line 5: 2 .stl does not exist", LINE_BREAK_HINT),
        ] {
            missing.add(format!("{line}{hint}"));
        }
        missing.add("line 6: 3.stl does not exist".to_owned());
        let text = missing.refusal().to_string();
        for hint in [WINDOWS_HINT, LINE_BREAK_HINT] {
            assert_eq!(text.matches(hint).count(), 1, "{text}");
        }
        assert!(text.contains("C:\\2.stl does not exist\n"), "{text}");
        assert!(text.contains("2 .stl does not exist\n"), "{text}");
    }
}
