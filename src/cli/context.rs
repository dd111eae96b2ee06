//! What every command starts from: the project, its settings and the streams.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::catalog::Catalog;
use crate::config::{Loaded, Preset, Sources, Start, load};
use crate::domain::UnixMillis;
use crate::runner;
use crate::store::{Project, SETTINGS_FILE, StoreError};

use super::args::Global;
use super::output::Output;
use super::progress::Screen;
use super::table::count;

/// The global flags and what follows from them.
#[derive(Debug, Clone)]
pub(super) struct Context {
    pub(super) global: Global,
    pub(super) screen: Screen,
    pub(super) output: Output,
    program: String,
}

impl Context {
    /// From the flags and the name the program was called by.
    pub(super) fn new(global: Global, program: Option<&OsString>) -> Self {
        let screen = Screen::new();
        Self {
            output: Output::new(&global, screen.clone()),
            screen,
            program: program_name(program),
            global,
        }
    }

    /// The same in another project directory.
    pub(super) fn at(&self, dir: &Path) -> Self {
        let mut context = self.clone();
        context.global.directory = Some(dir.to_owned());
        context
    }

    /// The same without flags that change settings, for a project that has them in its own file now.
    pub(super) fn with_own_settings(&self) -> Self {
        let mut context = self.clone();
        context.global.config = None;
        context.global.set.clear();
        context
    }

    /// The project's directory, which may not be there.
    pub(super) fn dir(&self) -> PathBuf {
        self.global
            .directory
            .clone()
            .unwrap_or_else(|| PathBuf::from("."))
    }

    /// The project.
    ///
    /// # Errors
    /// When there is none.
    pub(super) fn project(&self) -> Result<Project, StoreError> {
        Project::open(&self.dir())
    }

    /// The project and its catalog, to read; works while a run goes on.
    ///
    /// # Errors
    /// When there is no project, or the catalog cannot be opened.
    pub(super) async fn reader(&self) -> anyhow::Result<(Project, Catalog)> {
        let project = self.project()?;
        let catalog = Catalog::open_read_only(&project.catalog_path()).await?;
        Ok((project, catalog))
    }

    /// The project and its catalog, to read and write.
    ///
    /// # Errors
    /// When there is no project, or the catalog cannot be opened.
    pub(super) async fn writer(&self) -> anyhow::Result<(Project, Catalog)> {
        let project = self.project()?;
        let catalog = Catalog::open(&project.catalog_path()).await?;
        Ok((project, catalog))
    }

    /// The settings in force for this project.
    ///
    /// # Errors
    /// When one of them is wrong.
    pub(super) fn settings(&self) -> anyhow::Result<Loaded> {
        Ok(load(&Sources {
            start: self.start(),
            env: std::env::vars_os()
                .filter_map(|(name, value)| {
                    Some((name.into_string().ok()?, value.into_string().ok()?))
                })
                .collect(),
            sets: self.global.set.clone(),
        })?)
    }

    /// Warns of results that were made with other settings or files than those of now. Settings that cannot be read
    /// are for others to tell.
    ///
    /// # Errors
    /// When the catalog refuses.
    pub(super) async fn warn_of_stale(&self, catalog: &Catalog) -> anyhow::Result<()> {
        let Ok(settings) = self.settings() else {
            return Ok(());
        };
        let recipes = runner::recipes(&settings.config.stages);
        let stale = catalog.stale(&recipes).await?;
        if stale > 0 {
            let pairs = count(stale, "pair");
            let verb = if stale == 1 { "is" } else { "are" };
            self.output.warn(&format!(
                "{pairs} {verb} stale: made with other settings or files than those of now; `run` brings them up to date"
            ));
        }
        Ok(())
    }

    fn start(&self) -> Start {
        match &self.global.config {
            Some(name) => match Preset::named(name) {
                Some(preset) => Start::Preset(preset),
                None => Start::File(PathBuf::from(name)),
            },
            None => Start::Project(self.dir().join(SETTINGS_FILE)),
        }
    }

    /// A command for this project with the same settings, ready to be copied into a shell.
    pub(super) fn command(&self, tail: &str) -> String {
        let mut words = vec![self.program.clone()];
        if let Some(dir) = &self.global.directory {
            words.extend(["-C".to_owned(), quoted(&dir.to_string_lossy())]);
        }
        if let Some(config) = &self.global.config {
            words.extend(["--config".to_owned(), quoted(config)]);
        }
        for set in &self.global.set {
            words.extend(["--set".to_owned(), quoted(set)]);
        }
        words.push(tail.to_owned());
        words.join(" ")
    }

    /// A command outside any project.
    pub(super) fn program_with(&self, tail: &str) -> String {
        format!("{} {tail}", self.program)
    }
}

/// The time now; the only clock that reaches the catalog.
pub(super) fn now() -> UnixMillis {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_millis() as UnixMillis)
}

/// The path the program was called by, or its bare name where the shell found it by itself.
fn program_name(called: Option<&OsString>) -> String {
    let called = called.map(|name| name.to_string_lossy().into_owned());
    match called {
        Some(path) if path.contains('/') => quoted(&path),
        Some(_) | None => "mocban".to_owned(),
    }
}

/// A word as a POSIX shell takes it.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn words_a_shell_would_split_are_quoted() {
        assert_eq!(quoted("demo/a-b"), "demo/a-b");
        assert_eq!(quoted("my scans"), "'my scans'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
