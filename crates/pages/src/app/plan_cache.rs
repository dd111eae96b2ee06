//! The plan of the folders that were looked at last: it is kept while their files and the choices stay.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use mocban_core::domain::ContentHash;
use mocban_project::ProjectResult;
use mocban_project::files::list_below;
use mocban_project::import_pairs::PairSource;
use mocban_project::import_plan::ImportPlan;

/// Number of pairs that are kept with a plan.
pub(super) const KEPT_PAIRS: u64 = 10_000;

/// The last plan.
#[derive(Debug, Default)]
pub(super) struct PlanCache(Mutex<Option<KeptPlan>>);

#[derive(Debug)]
struct KeptPlan {
    key: ContentHash,
    plan: Arc<ImportPlan>,
}

impl PlanCache {
    /// Returns the plan of a source with choices, as text. Plans again if a file came or went; lists are always read again.
    ///
    /// # Errors
    /// Returns an error if the folders cannot be listed, or the plan has one.
    pub(super) fn plan(
        &self,
        source: PairSource,
        choices: &str,
        plan: impl FnOnce(PairSource) -> ProjectResult<ImportPlan>,
    ) -> ProjectResult<Arc<ImportPlan>> {
        let key = match &source {
            PairSource::List { .. } => None,
            PairSource::Folders { meshes, prints, .. } => Some(key([meshes, prints], choices)?),
        };
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = kept.as_ref().filter(|kept| Some(kept.key) == key) {
            return Ok(Arc::clone(&kept.plan));
        }
        *kept = None;
        let plan = Arc::new(plan(source)?);
        *kept = key.map(|key| KeptPlan {
            key,
            plan: Arc::clone(&plan),
        });
        Ok(plan)
    }
}

/// Returns a hash of the names of all files in two folders, and of the choices.
fn key(folders: [&Path; 2], choices: &str) -> ProjectResult<ContentHash> {
    let mut names = choices.as_bytes().to_vec();
    for folder in folders {
        for file in list_below(folder)? {
            names.push(0);
            names.extend_from_slice(file.as_os_str().as_encoded_bytes());
        }
        names.push(0);
    }
    Ok(ContentHash::of(&names))
}

#[cfg(test)]
mod tests {
    use super::PlanCache;
    use mocban_project::import_pairs::PairSource;
    use mocban_project::import_plan::plan_import;
    use mocban_project::location::Location;
    use mocban_project::pair_choices::PairChoices;

    #[test]
    fn folders_are_planned_again_only_if_a_file_or_a_choice_changed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let write = |name: &str| std::fs::write(dir.path().join(name), "x").expect("written");
        for name in ["1.stl", "1.png", "2.stl"] {
            write(name);
        }
        let cache = PlanCache::default();
        let plans = std::cell::Cell::new(0);
        let look = |choices: &str| {
            let source = PairSource::Folders {
                meshes: dir.path().to_owned(),
                prints: dir.path().to_owned(),
                unit: None,
            };
            let plan = cache.plan(source, choices, |source| {
                plans.set(plans.get() + 1);
                let location = Location::new(dir.path().join("project"));
                plan_import(source, &PairChoices::default(), &location, &(0..9))
            });
            (plan.expect("a plan").pairs, plans.get())
        };
        assert_eq!([look("a"), look("a")], [(1, 1), (1, 1)]);
        write("2.png");
        assert_eq!([look("a"), look("a")], [(2, 2), (2, 2)]);
        assert_eq!([look("b"), look("b")], [(2, 3), (2, 3)]);
        std::fs::remove_file(dir.path().join("1.stl")).expect("removed");
        assert_eq!(look("b"), (1, 4));
    }
}
