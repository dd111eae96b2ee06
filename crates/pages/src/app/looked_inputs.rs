//! Keeps for a while which inputs of a project are at their places.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::failure::{AppFailure, AppResult};
use super::projects::OpenProject;
use crate::on_thread::read_on_thread;
use mocban_core::domain::UnixMillis;
use mocban_core::locked;
use mocban_project::input_places::InputPlaces;

/// How long a page that reloads itself shows what was found. A press of the button looks again.
const MAX_AGE: Duration = Duration::from_secs(10);

/// What was found last, by the folder of the project.
#[derive(Debug, Default)]
pub(super) struct LookedInputs(Mutex<BTreeMap<PathBuf, LastLook>>);

/// What was found for a press of the button.
#[derive(Debug, Clone)]
struct LastLook {
    pressed: UnixMillis,
    ended: Instant,
    places: Arc<InputPlaces>,
}

impl LookedInputs {
    /// Looks at the inputs of a project, unless that was just done for the same press of the button.
    pub(super) async fn look(
        &self,
        open: &OpenProject,
        pressed: UnixMillis,
    ) -> AppResult<Arc<InputPlaces>> {
        if let Some(places) = self.kept(&open.dir, pressed, Instant::now()) {
            return Ok(places);
        }
        let (project, catalog) = (open.project.clone(), open.catalog.clone());
        let found = read_on_thread(async move || InputPlaces::of_project(&project, &catalog).await);
        let found = found.await;
        let places = found.map_err(|error| AppFailure::of(error, &open.dir))?;
        let places = Arc::new(places);
        self.keep(&open.dir, pressed, Instant::now(), Arc::clone(&places));
        Ok(places)
    }

    fn kept(&self, dir: &Path, pressed: UnixMillis, now: Instant) -> Option<Arc<InputPlaces>> {
        let last = locked(&self.0).get(dir).cloned()?;
        let is_new = last.pressed == pressed && now.duration_since(last.ended) < MAX_AGE;
        is_new.then_some(last.places)
    }

    fn keep(&self, dir: &Path, pressed: UnixMillis, ended: Instant, places: Arc<InputPlaces>) {
        let look = LastLook {
            pressed,
            ended,
            places,
        };
        locked(&self.0).insert(dir.to_owned(), look);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;
    use std::time::Instant;

    use super::{LookedInputs, MAX_AGE};

    #[test]
    fn files_are_looked_at_again_for_each_press_and_after_a_while() {
        let (looked, dir, now) = (LookedInputs::default(), Path::new("p"), Instant::now());
        looked.keep(dir, 7, now, Arc::default());
        let is_kept = |dir, pressed, now| looked.kept(dir, pressed, now).is_some();
        assert!(is_kept(dir, 7, now));
        assert!(!is_kept(dir, 8, now) && !is_kept(Path::new("q"), 7, now));
        assert!(!is_kept(dir, 7, now + MAX_AGE));
    }
}
