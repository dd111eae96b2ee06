//! The plans of pairs that were made last: each is kept while its files and the choices stay.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::{Arc, Mutex};

use mocban_core::domain::ContentHash;
use mocban_core::locked;
use mocban_project::ProjectResult;
use mocban_project::folder_files::list_below;
use mocban_project::import_pairs::PairSource;
use mocban_project::import_plan::ImportPlan;

/// Number of pairs that are kept with a plan.
pub(super) const KEPT_PAIRS: u64 = 10_000;
/// Number of plans that are kept.
const KEPT_PLANS: usize = 4;

/// The last plans, the newest first.
#[derive(Debug, Default)]
pub(super) struct PlanCache(Mutex<VecDeque<KeptPlan>>);

#[derive(Debug)]
struct KeptPlan {
    choices: String,
    /// Hash of the names of all files, if the source is two folders.
    names: Option<ContentHash>,
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
        let names = match &source {
            PairSource::List { .. } => Ok(None),
            PairSource::Folders { meshes, prints, .. } => names_hash([meshes, prints]).map(Some),
        };
        if let Ok(Some(names)) = &names
            && let Some(same) =
                self.find(|kept| kept.choices == choices && kept.names == Some(*names))
        {
            return Ok(same);
        }
        locked(&self.0).retain(|kept| kept.choices != choices);
        let names = names?;
        let plan = Arc::new(plan(source)?);
        let mut all = locked(&self.0);
        // Another request may have made the same plan meanwhile.
        all.retain(|kept| kept.choices != choices);
        all.truncate(KEPT_PLANS - 1);
        all.push_front(KeptPlan {
            choices: choices.to_owned(),
            names,
            plan: Arc::clone(&plan),
        });
        Ok(plan)
    }

    /// Returns the last plan for choices, without a look at the files. The page of these choices has it made again.
    pub(super) fn kept(&self, choices: &str) -> Option<Arc<ImportPlan>> {
        self.find(|kept| kept.choices == choices)
    }

    fn find(&self, is_wanted: impl Fn(&KeptPlan) -> bool) -> Option<Arc<ImportPlan>> {
        let all = locked(&self.0);
        let found = all.iter().find(|kept| is_wanted(kept));
        found.map(|kept| Arc::clone(&kept.plan))
    }
}

/// Returns a hash of the names of all files in two folders.
fn names_hash(folders: [&Path; 2]) -> ProjectResult<ContentHash> {
    let mut names = Vec::new();
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
        let pairs = |choices: &str| cache.kept(choices).map(|plan| plan.pairs);
        assert_eq!(pairs("b"), Some(2), "without a look at the files");
        assert_eq!(look("b"), (1, 4));
        for choices in ["c", "d", "e"] {
            look(choices);
        }
        assert_eq!(
            [pairs("a"), pairs("b"), pairs("e")],
            [None, Some(1), Some(1)]
        );
    }

    #[test]
    fn a_plan_that_two_requests_make_is_kept_once() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for name in ["1.stl", "1.png"] {
            std::fs::write(dir.path().join(name), "x").expect("written");
        }
        let source = || PairSource::Folders {
            meshes: dir.path().to_owned(),
            prints: dir.path().to_owned(),
            unit: None,
        };
        let made = |source| {
            let location = Location::new(dir.path().join("project"));
            plan_import(source, &PairChoices::default(), &location, &(0..9))
        };
        let cache = PlanCache::default();
        for choices in ["b", "c", "d"] {
            cache.plan(source(), choices, made).expect("a plan");
        }
        let twice = cache.plan(source(), "a", |asked| {
            cache.plan(source(), "a", made).expect("a plan");
            made(asked)
        });
        twice.expect("a plan");
        for choices in ["a", "b", "c", "d"] {
            assert!(cache.kept(choices).is_some(), "{choices}");
        }
    }
}
