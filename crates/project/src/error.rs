//! The error of the functions of this crate: its code, and its text, which says what was seen and what to do.

use std::error::Error;
use std::fmt;
use std::path::{Path, PathBuf};

use crate::exit::Refusal;
use mocban_core::domain::{ErrorCode, Explained, FREE_SPACE};
use mocban_system::platform;

/// Result of a function of this crate.
pub type ProjectResult<T> = Result<T, ProjectError>;

/// Why a function failed, and what it was doing.
#[derive(Debug)]
pub struct ProjectError {
    error: Box<dyn Explained>,
    /// What the function was doing, the innermost last.
    contexts: Vec<String>,
    /// The project that the error is about, if it is not that of the function.
    project: Option<PathBuf>,
}

impl<E: Explained> From<E> for ProjectError {
    fn from(error: E) -> Self {
        Self {
            error: Box::new(error),
            contexts: Vec::new(),
            project: None,
        }
    }
}

/// Most files that a command needs open at the same time, rounded up.
const FILES_NEEDED: u64 = 64;

impl ProjectError {
    /// Makes the error of a failure that nobody could foresee.
    pub fn unexpected(text: impl Into<String>) -> Self {
        Refusal::Unexpected(text.into()).into()
    }

    /// Adds what failed, in front of the text of the error.
    #[must_use]
    pub fn context(mut self, what: impl Into<String>) -> Self {
        self.contexts.insert(0, what.into());
        self
    }

    /// Names the project folder that the error is about.
    #[must_use]
    pub fn of_project(mut self, dir: impl Into<PathBuf>) -> Self {
        self.project = Some(dir.into());
        self
    }

    /// Returns the code.
    pub fn code(&self) -> ErrorCode {
        match self.error.code() {
            ErrorCode::Unexpected | ErrorCode::NotWritable if self.is_out_of_files() => {
                ErrorCode::TooManyFiles
            }
            ErrorCode::Unexpected => {
                let mut codes = self.system_errors().map(Explained::code);
                codes
                    .find(|code| *code != ErrorCode::Unexpected)
                    .unwrap_or(ErrorCode::Unexpected)
            }
            code => code,
        }
    }

    /// Returns one sentence that says what was seen and what to do. `project` is the folder of the project.
    pub fn text(&self, project: &Path) -> String {
        if self.is_out_of_files() {
            return format!(
                "this process may open only {} files at a time; raise the limit with `ulimit -n 256` and try again",
                platform::max_open_files()
            );
        }
        let project = self.project.as_deref().unwrap_or(project);
        let advice = self.error.advice(project);
        without_error_numbers(&advice.unwrap_or_else(|| {
            let mut codes = self.system_errors().map(Explained::code);
            if codes.any(|code| code == ErrorCode::DiskFull) {
                format!("{self}; {FREE_SPACE}")
            } else {
                self.to_string()
            }
        }))
    }

    /// Returns the causes, from the error itself to the root.
    fn chain(&self) -> impl Iterator<Item = &(dyn Error + 'static)> {
        let mut next: Option<&(dyn Error + 'static)> = Some(&*self.error);
        std::iter::from_fn(move || {
            let error = next?;
            next = error.source();
            Some(error)
        })
    }

    fn system_errors(&self) -> impl Iterator<Item = &std::io::Error> {
        self.chain().filter_map(|cause| cause.downcast_ref())
    }

    /// Returns whether the limit of open files is reached. `SQLite` does not say why it cannot open a file. In that case, a
    /// limit below `FILES_NEEDED` counts as the reason.
    fn is_out_of_files(&self) -> bool {
        self.system_errors().any(platform::is_out_of_files)
            || self.error.code() == ErrorCode::NotWritable
                && platform::max_open_files() < FILES_NEEDED
    }
}

/// Joins what failed and the causes. A cause that the text already quotes is left out.
impl fmt::Display for ProjectError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let contexts = self.contexts.iter().cloned();
        let mut text = String::new();
        for part in contexts.chain(self.chain().map(ToString::to_string)) {
            if text.is_empty() {
                text = part;
            } else if !text.contains(&part) {
                text = format!("{text}: {part}");
            }
        }
        f.write_str(&text)
    }
}

impl Error for ProjectError {}

/// Adds what failed to the error of a result.
pub trait WithContext<T> {
    /// Adds what failed, in front of the text of the error.
    fn with_context(self, what: impl FnOnce() -> String) -> ProjectResult<T>;
}

impl<T, E: Into<ProjectError>> WithContext<T> for Result<T, E> {
    fn with_context(self, what: impl FnOnce() -> String) -> ProjectResult<T> {
        self.map_err(|error| error.into().context(what()))
    }
}

/// Returns the sentence that explains an error, such as one of the catalog, without its context.
pub fn explanation<E: Explained>(error: &E, project: &Path) -> String {
    let advice = error.advice(project);
    without_error_numbers(&advice.unwrap_or_else(|| error.to_string()))
}

/// Removes the numbers that the standard library adds to the system's messages, such as `(os error 2)`.
pub fn without_error_numbers(text: &str) -> String {
    const START: &str = " (os error ";
    let mut parts = text.split(START);
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let rest = part.trim_start_matches(|c: char| c.is_ascii_digit());
        match rest.strip_prefix(')') {
            Some(rest) if rest.len() + 1 < part.len() => plain += rest,
            _ => plain.extend([START, part]),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::{ProjectError, Refusal, without_error_numbers};
    use mocban_catalog::CatalogError;
    use mocban_core::domain::ErrorCode;
    use mocban_export::ExportError;

    #[test]
    fn refusal_keeps_its_code_under_context() {
        let error = ProjectError::from(Refusal::NothingSelected("no pair".to_owned()));
        let error = error.context("run");
        assert_eq!(error.code(), ErrorCode::NothingSelected);
        assert_eq!(error.to_string(), "run: no pair");
    }

    #[test]
    fn numbers_of_system_errors_are_not_shown() {
        for (text, plain) in [
            (
                "a: No such file (os error 2); b (os error 13)",
                "a: No such file; b",
            ),
            (
                "a (os error ) and b (os error x",
                "a (os error ) and b (os error x",
            ),
            ("a", "a"),
        ] {
            assert_eq!(without_error_numbers(text), plain);
        }
    }

    #[test]
    fn quoted_cause_is_not_repeated() {
        let error = ProjectError::from(std::io::Error::other("disk on fire"));
        let error = error.context("a.png: disk on fire");
        assert_eq!(error.to_string(), "a.png: disk on fire");
    }

    #[cfg(unix)]
    #[test]
    fn full_disk_or_quota_is_explained() {
        use rustix::io::Errno;
        for code in [Errno::NOSPC, Errno::DQUOT, Errno::IO] {
            let io = std::io::Error::from_raw_os_error(code.raw_os_error());
            let error = ProjectError::from(io).context("a.png");
            let text = error.text(std::path::Path::new("p"));
            assert!(text.starts_with("a.png: "), "{text}");
            let says_safe = text.ends_with("everything stored so far is safe");
            assert_eq!(says_safe, code != Errno::IO, "{text}");
            assert_eq!(says_safe, error.code() == ErrorCode::DiskFull);
        }
    }

    #[test]
    fn wrapped_catalog_error_has_its_code_and_advice() {
        let error = CatalogError::Corrupt("stage 9 is unknown".into());
        let plain = error.to_string();
        let error = ProjectError::from(ExportError::Catalog(error)).context("export");
        assert_eq!(error.code(), ErrorCode::Damaged);
        assert_eq!(error.to_string(), format!("export: {plain}"));
        let dir = tempfile::tempdir().expect("a temporary directory");
        let text = error.text(dir.path());
        assert!(text.starts_with("the catalog contains"), "{text}");
        std::fs::write(dir.path().join("catalog.sqlite"), "").expect("written");
        let other = tempfile::tempdir().expect("a temporary directory");
        let text = error.of_project(dir.path()).text(other.path());
        assert!(
            text.contains("catalog.sqlite contains") && text.contains("`check`"),
            "{text}"
        );
    }
}
