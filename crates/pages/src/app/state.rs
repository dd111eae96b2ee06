//! What the handlers of the app share.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use super::chosen_sets::ChosenSets;
use super::failed_runs::FailedRuns;
use super::failure::AppResult;
use super::invitations::Invitations;
use super::looked_inputs::LookedInputs;
use super::missing_names::no_project;
use super::open_pages::OpenPages;
use super::paper_method::PaperMethod;
use super::plan_cache::PlanCache;
use super::projects::{FoundProject, OpenProject, find};
use super::tasks::AppTasks;
use super::thumb_cache::ThumbCache;
use super::uploads::Uploads;
use super::zip_sizes::ZipSizes;
use crate::local_server::WorkThread;
use crate::review::{Language, PictureWork};
use mocban_core::locked;
use mocban_project::blocking::blocking;

/// Options of the app.
#[derive(Debug, Clone)]
pub struct AppOptions {
    /// A project, or a folder of projects.
    pub folder: PathBuf,
    /// Language of the pages; `None` for that of the browser.
    pub language: Option<Language>,
    /// The program, which runs are started with.
    pub program: PathBuf,
    /// Address of this computer at which invited reviewers reach the app; `None` for its address in its network.
    pub listen: Option<IpAddr>,
}

/// State of the app.
#[derive(Debug)]
pub(super) struct AppState {
    pub(super) options: AppOptions,
    /// The language that the user has chosen on a page.
    language: Mutex<Option<Language>>,
    /// The projects that are open, by name.
    projects: Mutex<BTreeMap<String, Arc<OpenProject>>>,
    /// Pairs that were chosen for reviews.
    pub(super) chosen: ChosenSets,
    /// The threads and the rendered images of all reviews, also of guests.
    pub(super) review_work: Arc<PictureWork>,
    /// The reviews that are open.
    pub(super) reviews: OpenPages,
    /// The reviewers who were invited.
    pub(super) invitations: Invitations,
    /// The blocks that are open, each with its picture and heights.
    pub(super) blocks: OpenPages,
    /// Draws the pictures of all blocks.
    pub(super) block_work: Arc<WorkThread>,
    /// Exports, checks, backups and restores.
    pub(super) tasks: AppTasks,
    /// Why runs that the app started failed.
    pub(super) failed_runs: FailedRuns,
    /// What was found when files were looked for.
    pub(super) looked_inputs: LookedInputs,
    pub(super) thumbs: ThumbCache,
    /// Pairs aligned by the method of the paper.
    pub(super) paper: PaperMethod,
    pub(super) zip_sizes: ZipSizes,
    /// What the last imports that were shown would store.
    pub(super) plans: PlanCache,
    /// Files that the browser sends.
    pub(super) uploads: Uploads,
    /// Draws pictures.
    pub(super) work: WorkThread,
    /// Draws pictures of files that are not imported yet, whose disk may be slow.
    pub(super) import_work: WorkThread,
}

impl AppState {
    pub(super) fn new(options: AppOptions) -> Self {
        Self {
            language: Mutex::new(options.language),
            invitations: Invitations::new(options.listen, &options.folder),
            uploads: Uploads::new(&options.folder),
            options,
            projects: Mutex::default(),
            chosen: ChosenSets::default(),
            review_work: Arc::new(PictureWork::for_many()),
            reviews: OpenPages::new(32),
            blocks: OpenPages::new(2),
            block_work: Arc::default(),
            tasks: AppTasks::default(),
            failed_runs: FailedRuns::default(),
            looked_inputs: LookedInputs::default(),
            thumbs: ThumbCache::default(),
            paper: PaperMethod::default(),
            zip_sizes: ZipSizes::default(),
            plans: PlanCache::default(),
            work: WorkThread::default(),
            import_work: WorkThread::default(),
        }
    }

    /// Returns the language that the user or the command has chosen.
    pub(super) fn language(&self) -> Option<Language> {
        *locked(&self.language)
    }

    /// Changes the language of all pages.
    pub(super) fn set_language(&self, language: Language) {
        *locked(&self.language) = Some(language);
    }

    /// Returns an open project by its name. Only projects of the folder have names, so no address leads elsewhere.
    pub(super) async fn open(&self, key: &str) -> AppResult<Arc<OpenProject>> {
        if let Some(open) = self.known(key) {
            return Ok(open);
        }
        let folder = self.options.folder.clone();
        let mut found = blocking(move || find(&folder)).await?.into_iter();
        let Some(found) = found.find(|found| found.key == key) else {
            locked(&self.projects).remove(key);
            return Err(no_project(key, &self.options.folder));
        };
        self.open_found(found).await
    }

    /// Returns an open project that was found in the folder.
    pub(super) async fn open_found(&self, found: FoundProject) -> AppResult<Arc<OpenProject>> {
        if let Some(open) = self.known(&found.key) {
            return Ok(open);
        }
        let key = found.key.clone();
        // Other projects do not wait for a server that does not answer.
        let open = OpenProject::open(found).await?;
        let mut projects = locked(&self.projects);
        let kept = projects.get(&key).filter(|kept| kept.is_same(&open));
        let kept = kept.cloned().unwrap_or(open);
        projects.insert(key, Arc::clone(&kept));
        Ok(kept)
    }

    /// Returns a project that is open already and still has the catalog that was opened.
    fn known(&self, key: &str) -> Option<Arc<OpenProject>> {
        let known = locked(&self.projects).get(key).cloned();
        known.filter(|open| open.is_current())
    }
}
