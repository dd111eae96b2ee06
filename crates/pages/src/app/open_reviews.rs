//! The reviews that are open. Each belongs to one catalog: if the project is made anew, it is opened again.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::Router;

use super::projects::OpenProject;

/// Most reviews that stay open.
const MAX_REVIEWS: usize = 32;

/// Project, reviewer, and what the review shows.
type ReviewId = [String; 3];

/// The pages of reviews, by project, reviewer and what they show.
#[derive(Debug, Default)]
pub(super) struct OpenReviews(Mutex<BTreeMap<ReviewId, KeptReview>>);

#[derive(Debug)]
struct KeptReview {
    project: Arc<OpenProject>,
    pages: Router,
    /// Order of the last use.
    used: u64,
}

impl OpenReviews {
    /// Returns the pages of a review of this catalog.
    pub(super) fn get(&self, id: &ReviewId, project: &Arc<OpenProject>) -> Option<Router> {
        let mut kept = self.lock();
        let now = next_use(&kept);
        let review = kept.get_mut(id)?;
        if !Arc::ptr_eq(&review.project, project) {
            return None;
        }
        review.used = now;
        Some(review.pages.clone())
    }

    /// Keeps the pages of a review, unless it was opened meanwhile, and returns the kept pages. The review that was
    /// not used for longest is closed if there are too many.
    pub(super) fn keep(&self, id: ReviewId, project: &Arc<OpenProject>, pages: Router) -> Router {
        let mut kept = self.lock();
        let used = next_use(&kept);
        let same = kept.get(&id);
        let same = same.filter(|review| Arc::ptr_eq(&review.project, project));
        let pages = same.map_or(pages, |review| review.pages.clone());
        if kept.len() >= MAX_REVIEWS && !kept.contains_key(&id) {
            let oldest = kept.iter().min_by_key(|(_, review)| review.used);
            if let Some(oldest) = oldest.map(|(id, _)| id.clone()) {
                kept.remove(&oldest);
            }
        }
        let review = KeptReview {
            project: Arc::clone(project),
            pages: pages.clone(),
            used,
        };
        kept.insert(id, review);
        pages
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<ReviewId, KeptReview>> {
        // Each change leaves the map whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn next_use(kept: &BTreeMap<ReviewId, KeptReview>) -> u64 {
    kept.values()
        .map(|review| review.used + 1)
        .max()
        .unwrap_or_default()
}
