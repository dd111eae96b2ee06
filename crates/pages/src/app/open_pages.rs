//! The reviews and blocks that are open. Each belongs to one catalog: if the project is made anew, it is opened again.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use axum::Router;

use super::projects::OpenProject;
use mocban_core::locked;

/// Project, reviewer or block, and what the pages show.
pub(super) type PagesId = [String; 3];

/// The pages of reviews or of blocks.
#[derive(Debug)]
pub(super) struct OpenPages {
    /// Most that stay open.
    limit: usize,
    kept: Mutex<BTreeMap<PagesId, KeptPages>>,
}

#[derive(Debug)]
struct KeptPages {
    project: Arc<OpenProject>,
    pages: Router,
    /// Order of the last use.
    used: u64,
}

impl OpenPages {
    pub(super) fn new(limit: usize) -> Self {
        Self {
            limit,
            kept: Mutex::default(),
        }
    }

    /// Returns the pages that are open for this catalog.
    pub(super) fn get(&self, id: &PagesId, project: &Arc<OpenProject>) -> Option<Router> {
        let mut kept = locked(&self.kept);
        let now = next_use(&kept);
        let pages = kept.get_mut(id)?;
        if !Arc::ptr_eq(&pages.project, project) {
            return None;
        }
        pages.used = now;
        Some(pages.pages.clone())
    }

    /// Closes pages, so that they are opened again with what the catalog has now.
    pub(super) fn close(&self, id: &PagesId) {
        locked(&self.kept).remove(id);
    }

    /// Keeps pages, unless they were opened meanwhile, and returns the kept pages. If there are too many, closes the least
    /// recently used.
    pub(super) fn keep(&self, id: PagesId, project: &Arc<OpenProject>, pages: Router) -> Router {
        let mut kept = locked(&self.kept);
        let used = next_use(&kept);
        let same = kept.get(&id);
        let same = same.filter(|same| Arc::ptr_eq(&same.project, project));
        let pages = same.map_or(pages, |same| same.pages.clone());
        if kept.len() >= self.limit && !kept.contains_key(&id) {
            let oldest = kept.iter().min_by_key(|(_, one)| one.used);
            if let Some(oldest) = oldest.map(|(id, _)| id.clone()) {
                kept.remove(&oldest);
            }
        }
        let opened = KeptPages {
            project: Arc::clone(project),
            pages: pages.clone(),
            used,
        };
        kept.insert(id, opened);
        pages
    }
}

fn next_use(kept: &BTreeMap<PagesId, KeptPages>) -> u64 {
    kept.values()
        .map(|one| one.used + 1)
        .max()
        .unwrap_or_default()
}
