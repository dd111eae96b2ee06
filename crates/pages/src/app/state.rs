//! What the handlers of the app share.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::Router;

use super::failure::{AppFailure, AppResult};
use super::projects::{OpenProject, find};
use super::tasks::AppTasks;
use super::thumb_cache::ThumbCache;
use crate::local_server::WorkThread;
use crate::review::Language;

/// Options of the app.
#[derive(Debug, Clone)]
pub struct AppOptions {
    /// A project, or a folder of projects.
    pub folder: PathBuf,
    /// Language of the pages; `None` for that of the browser.
    pub language: Option<Language>,
    /// The program, which runs are started with.
    pub program: PathBuf,
}

/// State of the app.
#[derive(Debug)]
pub(super) struct AppState {
    pub(super) options: AppOptions,
    /// The language that the user has chosen on a page.
    language: Mutex<Option<Language>>,
    /// The projects that are open, by name.
    projects: tokio::sync::Mutex<BTreeMap<String, Arc<OpenProject>>>,
    /// The reviews that are open, by project, reviewer and what they show.
    pub(super) reviews: tokio::sync::Mutex<BTreeMap<[String; 3], Router>>,
    /// Exports, checks and backups.
    pub(super) tasks: AppTasks,
    pub(super) thumbs: ThumbCache,
    /// Draws pictures.
    pub(super) work: WorkThread,
}

impl AppState {
    pub(super) fn new(options: AppOptions) -> Self {
        Self {
            language: Mutex::new(options.language),
            options,
            projects: tokio::sync::Mutex::default(),
            reviews: tokio::sync::Mutex::default(),
            tasks: AppTasks::default(),
            thumbs: ThumbCache::default(),
            work: WorkThread::default(),
        }
    }

    /// Returns the language that the user or the command has chosen.
    pub(super) fn language(&self) -> Option<Language> {
        *self.lock_language()
    }

    /// Changes the language of all pages.
    pub(super) fn set_language(&self, language: Language) {
        *self.lock_language() = Some(language);
    }

    fn lock_language(&self) -> MutexGuard<'_, Option<Language>> {
        // Each change is a single assignment.
        self.language.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns an open project by its name. Only projects of the folder have names, so no address leads elsewhere.
    pub(super) async fn open(&self, key: &str) -> AppResult<Arc<OpenProject>> {
        let mut projects = self.projects.lock().await;
        if let Some(open) = projects.get(key).filter(|open| open.is_current()) {
            return Ok(Arc::clone(open));
        }
        let folder = self.options.folder.clone();
        let found = tokio::task::spawn_blocking(move || find(&folder)).await;
        let mut found = found.unwrap_or_default().into_iter();
        let Some(found) = found.find(|found| found.key == key) else {
            projects.remove(key);
            return Err(AppFailure::not_found());
        };
        let open = OpenProject::open(found).await?;
        projects.insert(key.to_owned(), Arc::clone(&open));
        Ok(open)
    }
}
