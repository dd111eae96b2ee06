//! The context of a command: the project, its settings and the output streams.

use std::ffi::OsString;
use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::Serialize;
use serde_json::json;

use super::exit::{ExitCode, Refusal};
use super::global::Global;
use super::output;
use super::screen::{Palette, Screen, Tone};
use super::table::count;
use mocban_catalog::{Catalog, SetApart};
use mocban_config::{BaseLayer, ConfigError, Loaded, Sources, load};
use mocban_core::domain::{UnixMillis, has_password, is_hidden};
use mocban_runner as runner;
use mocban_store::{CATALOG_FILE, Project, ProjectStorage, SETTINGS_FILE, StorageOptions};

/// Longer lines of warnings and errors are cut. A line still has room for the longest possible path (4,096 bytes).
const MAX_LINE_CHARS: usize = 6000;

/// Longest time for looking at the roots of inputs before a run.
const ROOT_CHECK: Duration = Duration::from_secs(5);

/// The global flags and the state derived from them.
#[derive(Debug, Clone)]
pub(super) struct Context {
    pub(super) global: Global,
    pub(super) screen: Screen,
    /// Colours of stdout.
    pub(super) stdout: Palette,
    /// Colours of stderr.
    pub(super) stderr: Palette,
    program: String,
    /// The settings, once they were loaded without an error.
    settings: OnceLock<Loaded>,
}

impl Context {
    /// Builds the context from the flags and the name by which the program was called.
    pub(super) fn new(global: Global, program: Option<&OsString>) -> Self {
        Self {
            screen: Screen::new(),
            stdout: Palette::choose(global.color, std::io::stdout().is_terminal()),
            stderr: Palette::choose(global.color, std::io::stderr().is_terminal()),
            program: program_name(program),
            global,
            settings: OnceLock::new(),
        }
    }

    /// Returns the same context for another project directory.
    pub(super) fn at(&self, dir: &Path) -> Self {
        let mut context = self.with_settings_unread();
        context.global.directory = Some(dir.to_owned());
        context
    }

    /// Returns a copy without `--config` and `--set`, for use after their settings were saved in the project's file.
    pub(super) fn without_setting_flags(&self) -> Self {
        let mut context = self.with_settings_unread();
        context.global.config = None;
        context.global.set.clear();
        context
    }

    fn with_settings_unread(&self) -> Self {
        Self {
            settings: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Returns the project's directory, which need not exist.
    pub(super) fn dir(&self) -> PathBuf {
        let dir = self.global.directory.clone();
        dir.unwrap_or_else(|| PathBuf::from("."))
    }

    /// Writes a line to stderr, unless `-q` is given.
    pub(super) fn info(&self, text: &str) {
        if !self.global.quiet {
            self.screen.line(&indented(text));
        }
    }

    /// Writes a warning to stderr, also with `-q`.
    pub(super) fn warn(&self, text: &str) {
        let label = self.stderr.paint(Tone::Warn, "warning:");
        self.screen.line(&format!("{label} {}", indented(text)));
    }

    /// Writes an error message to stderr, as text or, with `--json`, as a JSON object.
    pub(super) fn error(&self, text: &str, code: ExitCode) {
        if self.global.json {
            let object = json!({"message_type": "exit_error", "code": code as u8, "message": text});
            self.screen.json_line(&object);
        } else {
            let label = self.stderr.paint(Tone::Bad, "error:");
            self.screen.line(&format!("{label} {}", indented(text)));
        }
    }

    /// Suggests the next command for this project on stderr. The text can be copied into a shell.
    pub(super) fn next(&self, tail: &str) {
        self.next_command(&self.command(tail));
    }

    /// Suggests the next command as given.
    pub(super) fn next_command(&self, command: &str) {
        if !self.global.json {
            let label = self.stderr.paint(Tone::Faint, "next:");
            self.info(&format!("{label} {command}"));
        }
    }

    /// Writes a result to stdout: as text, or as a JSON document with `--json`.
    pub(super) fn print(
        &self,
        value: &impl Serialize,
        text: impl FnOnce() -> String,
    ) -> anyhow::Result<()> {
        if self.global.json {
            output::print_json(value)
        } else {
            Ok(output::print(&text())?)
        }
    }

    /// Writes a JSON document to stdout with `--json`.
    pub(super) fn print_json(&self, value: &impl Serialize) -> anyhow::Result<()> {
        if self.global.json {
            output::print_json(value)?;
        }
        Ok(())
    }

    /// Opens the project and its catalog for reading; works during a run.
    pub(super) async fn open_read_only(&self) -> anyhow::Result<(Project, Catalog)> {
        let (project, url) = self.project()?;
        let catalog = match url {
            Some(url) => Catalog::connect_read_only(&url).await?,
            None => Catalog::open_read_only(&project.catalog_path()).await?,
        };
        Ok((project, catalog))
    }

    /// Opens the project and its catalog for reading and writing.
    pub(super) async fn open(&self) -> anyhow::Result<(Project, Catalog)> {
        let (project, url) = self.project()?;
        let catalog = match url {
            Some(url) => Catalog::connect(&url, false).await?,
            None => Catalog::open(&project.catalog_path()).await?,
        };
        Ok((project, catalog))
    }

    /// Returns the project, and the URL of its catalog if that is in PostgreSQL.
    fn project(&self) -> anyhow::Result<(Project, Option<String>)> {
        let (storage, url) = self.data_locations()?;
        let project = match url {
            Some(_) => Project::open_directory(&self.dir())?,
            None => Project::open(&self.dir())?,
        };
        Ok((project.with_storage(storage), url))
    }

    /// Opens the project and its catalog for a run, and asks the object stores of the settings whether they answer. Warns
    /// about roots of inputs that are not there.
    pub(super) async fn open_for_run(&self) -> anyhow::Result<(Project, Catalog)> {
        let (project, catalog) = self.open().await?;
        if project.storage().is_none() {
            return Ok((project, catalog));
        }
        let checked = project.clone();
        let check = move || checked.storage().map_or(Ok(()), ProjectStorage::check);
        if let Err(error) = tokio::task::spawn_blocking(check).await? {
            catalog.close().await;
            return Err(error.into());
        }
        let checked = project.clone();
        let find = move || {
            checked
                .storage()
                .map_or_else(Vec::new, ProjectStorage::unusable_roots)
        };
        // The run needs a root only if one of its pairs does. A disk may hang.
        let found = tokio::time::timeout(ROOT_CHECK, tokio::task::spawn_blocking(find)).await;
        for root in found.into_iter().flatten().flatten() {
            self.warn(&root.to_string());
        }
        Ok((project, catalog))
    }

    /// Returns the named roots with the object store, and the URL of the catalog if that is in PostgreSQL.
    ///
    /// # Errors
    /// Returns an error under the conditions of [`Self::catalog_url`], or if a setting of the storage is invalid.
    pub(super) fn data_locations(
        &self,
    ) -> anyhow::Result<(Option<ProjectStorage>, Option<String>)> {
        let settings = self.settings();
        if let Err(error) = &settings
            && self.may_name_places(error)
        {
            return settings.map(|_| (None, None));
        }
        let storage = Self::storage(settings.as_ref().ok())?;
        Ok((storage, self.catalog_of(settings)?))
    }

    /// Returns the named roots and the object store of the settings. Sends no request. Returns `None` if the settings
    /// name none, or are invalid.
    fn storage(settings: Option<&Loaded>) -> anyhow::Result<Option<ProjectStorage>> {
        let Some(settings) = settings.map(|settings| &settings.config.storage) else {
            return Ok(None);
        };
        let options = StorageOptions {
            artifacts: settings.artifacts.clone(),
            roots: settings.roots.clone(),
            cache: settings.cache.clone(),
            cache_bytes: settings.cache_gb.saturating_mul(1_000_000_000),
        };
        Ok(ProjectStorage::open(&options)?)
    }

    /// Returns the URL of the catalog in PostgreSQL, or `None` if the catalog is a file in the project.
    ///
    /// # Errors
    /// Returns an error if the URL on the command line has a password, or if the settings are invalid and may name a
    /// catalog elsewhere, or no catalog file shows where the catalog is.
    pub(super) fn catalog_url(&self) -> anyhow::Result<Option<String>> {
        self.catalog_of(self.settings())
    }

    fn catalog_of(&self, settings: anyhow::Result<Loaded>) -> anyhow::Result<Option<String>> {
        if let Some(url) = &self.global.catalog {
            refuse_password(url)?;
            return Ok(Some(url.clone()).filter(|url| !url.is_empty()));
        }
        match settings {
            Ok(settings) => {
                let url = settings.config.storage.catalog;
                Ok(Some(url).filter(|url| !url.is_empty()))
            }
            // Commands that need no settings work with invalid ones, but not with a file that cannot be read.
            Err(error)
                if self.dir().join(CATALOG_FILE).exists() && !self.may_name_places(&error) =>
            {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Returns the settings in effect for this project. The file is read once, so that all parts of a command have the
    /// same settings.
    pub(super) fn settings(&self) -> anyhow::Result<Loaded> {
        if let Some(settings) = self.settings.get() {
            return Ok(settings.clone());
        }
        let settings = self.load_settings()?;
        Ok(self.settings.get_or_init(|| settings).clone())
    }

    fn load_settings(&self) -> anyhow::Result<Loaded> {
        Ok(load(&self.sources())?)
    }

    fn sources(&self) -> Sources {
        let base = match &self.global.config {
            Some(name) => name
                .parse()
                .map_or_else(|_: String| BaseLayer::File(name.into()), BaseLayer::Preset),
            None => BaseLayer::Project(self.dir().join(SETTINGS_FILE)),
        };
        let env = std::env::vars_os()
            .filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)))
            .collect();
        let sets = self.global.set.clone();
        Sources { base, env, sets }
    }

    /// Returns whether invalid settings may name a catalog or artifacts elsewhere. Then a command must not use the files in
    /// the project's folder instead.
    fn may_name_places(&self, error: &anyhow::Error) -> bool {
        is_unread(error) || self.sources().may_set("storage")
    }

    /// Warns about results that were computed with other settings or files than the current ones. Does nothing if the
    /// settings are invalid.
    pub(super) async fn warn_about_stale(&self, catalog: &Catalog) -> anyhow::Result<()> {
        let Ok(settings) = self.settings() else {
            return Ok(());
        };
        let fingerprints = runner::fingerprints(&settings.config.stages);
        let stale = catalog.count_stale(&fingerprints).await?;
        if stale > 0 {
            let pairs = count(stale, "pair");
            let verb = if stale == 1 { "is" } else { "are" };
            self.warn(&format!(
                "{pairs} {verb} stale: computed with other settings or files than the current ones; `run` updates them"
            ));
        }
        Ok(())
    }

    /// Warns about damaged rows that the output does not include.
    pub(super) fn warn_about_set_apart(&self, found: &SetApart) {
        if let Some(sentence) = found.sentence() {
            self.warn(&sentence);
        }
    }

    /// Returns a command for this project with the same settings. The text can be copied into a shell.
    pub(super) fn command(&self, tail: &str) -> String {
        let mut words = vec![self.program.clone()];
        if let Some(dir) = &self.global.directory {
            words.extend(["-C".to_owned(), shell_quoted(&dir.to_string_lossy())]);
        }
        if let Some(config) = &self.global.config {
            words.extend(["--config".to_owned(), shell_quoted(config)]);
        }
        if let Some(url) = &self.global.catalog {
            words.extend(["--catalog".to_owned(), shell_quoted(url)]);
        }
        for set in &self.global.set {
            words.extend(["--set".to_owned(), shell_quoted(set)]);
        }
        words.push(tail.to_owned());
        words.join(" ")
    }

    /// Returns a command that needs no project.
    pub(super) fn program_with(&self, tail: &str) -> String {
        format!("{} {tail}", self.program)
    }
}

/// Returns the settings of the file in a project folder, without those of the environment and of flags.
///
/// # Errors
/// Returns an error if the file cannot be read, or has an invalid setting.
pub(super) fn settings_of(dir: &Path) -> Result<Loaded, ConfigError> {
    load(&Sources {
        base: BaseLayer::Project(dir.join(SETTINGS_FILE)),
        ..Sources::default()
    })
}

/// Returns whether the settings could not be read.
fn is_unread(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(ConfigError::Read { .. }))
}

/// Refuses an address of PostgreSQL with a password, which other users of the machine could read.
pub(super) fn refuse_password(url: &str) -> Result<(), Refusal> {
    if has_password(url) {
        let text = "other users of this machine can read a password on the command line; put it into ~/.pgpass or PGPASSWORD";
        return Err(Refusal::Usage(text.to_owned()));
    }
    Ok(())
}

/// Returns the current time; no other clock reaches the catalog.
pub(super) fn now() -> UnixMillis {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_millis() as UnixMillis)
}

/// Indents the lines after the first, so that a line break in the name of a file cannot imitate another message. Cuts
/// lines that are longer than `MAX_LINE_CHARS`.
fn indented(text: &str) -> String {
    let shown = |line: &str| match line.char_indices().nth(MAX_LINE_CHARS) {
        Some((end, _)) => format!("{}...", &line[..end]),
        None => line.to_owned(),
    };
    let indented = |line: &str| {
        shown(&if line.starts_with(' ') {
            line.to_owned()
        } else {
            format!("  {line}")
        })
    };
    let (first, rest) = text.split_once('\n').unwrap_or((text, ""));
    let lines = std::iter::once(shown(first)).chain(rest.lines().map(indented));
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns the path by which the program was called, or `mocban` if the shell found it through `PATH`.
fn program_name(called: Option<&OsString>) -> String {
    let called = called.map(|name| name.to_string_lossy().into_owned());
    match called {
        Some(path) if path.contains('/') => shell_quoted(&path),
        Some(_) | None => "mocban".to_owned(),
    }
}

/// Quotes a word for a POSIX shell if it needs quotes. A word with characters that a terminal does not show is quoted
/// as `$'..'`, and each byte of such a character is escaped.
pub(super) fn shell_quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else if word.contains(is_hidden) {
        let quoted = word.chars().map(|c| match c {
            '\'' | '\\' => format!("\\{c}"),
            _ if is_hidden(c) => {
                let hidden = c.to_string();
                // Three octal digits end the escape, whatever follows.
                let bytes = hidden.bytes().map(|byte| format!("\\{byte:03o}"));
                bytes.collect::<Vec<_>>().concat()
            }
            _ => c.to_string(),
        });
        format!("$'{}'", quoted.collect::<String>())
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::{indented, shell_quoted};

    #[test]
    fn a_message_cannot_imitate_the_next_line() {
        assert_eq!(indented("a\nnext: b\n  c"), "a\n  next: b\n  c");
        assert_eq!(indented("a"), "a");
        assert_eq!(indented(&"a".repeat(7000)).len(), super::MAX_LINE_CHARS + 3);
    }

    #[test]
    fn words_that_a_shell_would_split_are_quoted() {
        assert_eq!(shell_quoted("demo/a-b"), "demo/a-b");
        assert_eq!(shell_quoted("my scans"), "'my scans'");
        assert_eq!(shell_quoted("it's"), r"'it'\''s'");
        assert_eq!(shell_quoted(""), "''");
        assert_eq!(shell_quoted("a\n'\u{1b}5\\"), r"$'a\012\'\0335\\'");
    }
}
