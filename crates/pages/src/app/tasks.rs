//! Long work of the app itself, such as exports: one of a kind at a time for each project, and what became of it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use super::failure::{AppFailure, AppResult};
use super::projects::OpenProject;
use super::sentence::Sentence;
use crate::on_thread::on_thread;
use mocban_core::locked;
use mocban_project::location::Location;
use mocban_project::{ProjectError, ProjectResult};

/// A kind of long work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum TaskKind {
    Export,
    Check,
    Backup,
    Restore,
}

/// Lines that say what was done, each in English and Vietnamese.
pub(super) type TaskLines = Vec<[String; 2]>;

/// What a task has done.
#[derive(Debug, Clone)]
pub(super) struct FinishedTask {
    pub(super) lines: TaskLines,
    /// Whether the lines say that something is wrong.
    pub(super) is_warning: bool,
    /// Whether a check found that most files of results are missing, which a button then computes again.
    pub(super) lacks_most_files: bool,
}

impl FinishedTask {
    /// Returns what a task has done that checks no files of results.
    pub(super) fn new(lines: TaskLines, is_warning: bool) -> Self {
        Self {
            lines,
            is_warning,
            lacks_most_files: false,
        }
    }
}

/// What became of a task.
#[derive(Debug, Clone)]
pub(super) enum TaskState {
    Running,
    Done(FinishedTask),
    Failed(Sentence),
}

/// The tasks of all projects.
#[derive(Debug, Default)]
pub(super) struct AppTasks(Arc<Mutex<BTreeMap<(String, TaskKind), TaskState>>>);

impl AppTasks {
    /// Starts a task for a project.
    ///
    /// # Errors
    /// Refuses a second task of a kind.
    pub(super) fn start<F>(
        &self,
        kind: TaskKind,
        open: &OpenProject,
        work: impl FnOnce(Location) -> F + Send + 'static,
    ) -> AppResult<()>
    where
        F: Future<Output = ProjectResult<FinishedTask>>,
    {
        let (location, dir) = (open.location(), open.dir.clone());
        let explain = move |error: &ProjectError| Sentence::of_error(error, &dir);
        self.start_named(kind, &open.key, explain, move || work(location))
    }

    /// Starts a task for a project that need not exist yet, by its name. `explain` says why it failed.
    ///
    /// # Errors
    /// Refuses a second task of a kind.
    pub(super) fn start_named<F>(
        &self,
        kind: TaskKind,
        name: &str,
        explain: impl FnOnce(&ProjectError) -> Sentence + Send + 'static,
        work: impl FnOnce() -> F + Send + 'static,
    ) -> AppResult<()>
    where
        F: Future<Output = ProjectResult<FinishedTask>>,
    {
        let id = (name.to_owned(), kind);
        {
            let mut tasks = locked(&self.0);
            if matches!(tasks.get(&id), Some(TaskState::Running)) {
                return Err(AppFailure::refused(Sentence::new(
                    "this is already being done",
                    "việc này đang được làm",
                )));
            }
            tasks.insert(id.clone(), TaskState::Running);
        }
        let tasks = Self(Arc::clone(&self.0));
        tokio::spawn(async move {
            let state = match on_thread(work).await {
                Ok(done) => TaskState::Done(done),
                Err(error) => TaskState::Failed(explain(&error)),
            };
            locked(&tasks.0).insert(id, state);
        });
        Ok(())
    }

    /// Notes why a task of an earlier process failed, unless another one was started since. Returns the state of the task.
    pub(super) fn note_failure(&self, kind: TaskKind, name: &str, why: Sentence) -> TaskState {
        let mut tasks = locked(&self.0);
        let state = tasks.entry((name.to_owned(), kind));
        state.or_insert(TaskState::Failed(why)).clone()
    }

    /// Returns the state of the last task of a kind for the project with a name.
    pub(super) fn state(&self, kind: TaskKind, name: &str) -> Option<TaskState> {
        locked(&self.0).get(&(name.to_owned(), kind)).cloned()
    }
}
