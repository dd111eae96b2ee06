//! Finds out which inputs are at their places: those of all pairs and blocks, as far as a limited time allows.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::blocking::blocking_within;
use crate::error::ProjectResult;
use crate::input_finder::finder_in;
use crate::missing_inputs::{INSPECTION_TIME, MAX_TIME};
use crate::wanted_inputs::{WantedInput, first_counted_inputs, first_wanted_inputs};
use mocban_catalog::Catalog;
use mocban_store::Project;

/// Number of pairs, about, whose files are looked at.
const MAX_PAIRS: usize = 100_000;
/// Most missing files that are named.
const MAX_NAMED: usize = 3;

/// Which inputs are at their places.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InputPlaces {
    /// Number of files that the first pairs and all blocks have.
    pub known: usize,
    /// Whether further pairs may have files.
    pub has_more: bool,
    /// Number of files that were looked at: not those in object stores, nor those after the time was over.
    pub looked_at: usize,
    /// Number of files among them that are not there.
    pub missing: usize,
    /// Number of missing files whose place is in the folder of the project.
    pub missing_inside: usize,
    /// The first missing files. The path of a file in the folder of the project is relative to it.
    pub first: Vec<String>,
}

impl InputPlaces {
    /// Looks at the files of a project that are not of retired pairs alone.
    pub async fn of_project(project: &Project, catalog: &Catalog) -> ProjectResult<Self> {
        let (inputs, has_more) = first_counted_inputs(catalog, MAX_PAIRS).await?;
        Ok(Self::of_inputs(project, inputs, has_more, None).await)
    }

    /// Looks at all files of a catalog where a restored project would read them: also in a folder, if one is chosen.
    pub(crate) async fn of_backup(
        project: &Project,
        catalog: &Catalog,
        folder: Option<&Path>,
    ) -> ProjectResult<Self> {
        let (inputs, has_more) = first_wanted_inputs(catalog, MAX_PAIRS).await?;
        Ok(Self::of_inputs(project, inputs, has_more, folder.map(Path::to_owned)).await)
    }

    /// Returns whether every file was looked at.
    pub const fn is_of_all(&self) -> bool {
        self.looked_at == self.known && !self.has_more
    }

    async fn of_inputs(
        project: &Project,
        inputs: Vec<WantedInput>,
        has_more: bool,
        folder: Option<PathBuf>,
    ) -> Self {
        let known = inputs.len();
        let (project, until) = (project.clone(), Instant::now() + INSPECTION_TIME);
        let look = move || looked_at(&project, &inputs, folder.as_deref(), until);
        let places = blocking_within(MAX_TIME, look).await.unwrap_or_default();
        Self {
            known,
            has_more,
            ..places
        }
    }
}

/// Looks at files until a time, also in a folder.
fn looked_at(
    project: &Project,
    inputs: &[WantedInput],
    folder: Option<&Path>,
    until: Instant,
) -> InputPlaces {
    let mut finder = folder.map(|folder| finder_in(project, folder, &()));
    let mut places = InputPlaces {
        known: inputs.len(),
        ..InputPlaces::default()
    };
    for WantedInput { stored, .. } in inputs {
        if Instant::now() >= until {
            break;
        }
        let input = project.input(stored);
        if input.is_remote() {
            continue;
        }
        let is_there = match &mut finder {
            Some(find) => matches!(find(stored), Ok(Some(_))),
            None => input.exists(),
        };
        if !is_there && is_below_unknown_root(project, stored) {
            continue;
        }
        places.looked_at += 1;
        if is_there {
            continue;
        }
        let is_inside = Path::new(stored).is_relative() && !project.is_below_root(stored);
        places.missing += 1;
        places.missing_inside += usize::from(is_inside);
        if places.first.len() < MAX_NAMED {
            let shown = if is_inside {
                stored.clone()
            } else {
                input.path().display().to_string()
            };
            places.first.push(shown);
        }
    }
    places
}

/// Returns whether a path may be relative to a root of settings that are not known, as those of a backup.
fn is_below_unknown_root(project: &Project, stored: &str) -> bool {
    let first = stored.split('/').next().unwrap_or_default();
    project.storage().is_none() && Path::new(stored).is_relative() && first.contains(':')
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::{InputPlaces, MAX_NAMED, looked_at};
    use crate::wanted_inputs::WantedInput;
    use mocban_store::Project;

    #[test]
    fn files_are_counted_by_what_was_found_out_about_them() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(&dir.path().join("p"));
        let outside = |name: &str| dir.path().join(name).display().to_string();
        std::fs::create_dir(project.dir()).expect("a folder");
        for file in [project.dir().join("1.stl"), dir.path().join("2.stl")] {
            std::fs::write(file, "scan").expect("written");
        }
        let stored = [
            "1.stl".to_owned(),
            outside("2.stl"),
            "scans/3.stl".to_owned(),
            outside("4.stl"),
            "disk:5.stl".to_owned(),
        ];
        let inputs = stored.each_ref().map(|stored| WantedInput::unread(stored));
        let later = Instant::now() + Duration::from_hours(1);
        let places = looked_at(&project, &inputs, None, later);
        let expected = InputPlaces {
            known: 5,
            has_more: false,
            looked_at: 4,
            missing: 2,
            missing_inside: 1,
            first: vec!["scans/3.stl".to_owned(), outside("4.stl")],
        };
        assert_eq!(places, expected);
        assert!(!places.is_of_all(), "a root is not known");
        assert!(looked_at(&project, &inputs[..4], None, later).is_of_all());
        let late = looked_at(&project, &inputs, None, Instant::now());
        assert_eq!((late.known, late.looked_at, late.missing), (5, 0, 0));
        let many: Vec<_> = (0..9)
            .map(|i| WantedInput::unread(&format!("{i}.ply")))
            .collect();
        let places = looked_at(&project, &many, None, later);
        assert_eq!((places.missing, places.first.len()), (9, MAX_NAMED));
    }

    #[test]
    fn files_in_a_chosen_folder_are_not_missing() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (project, folder) = (Project::at(&dir.path().join("p")), dir.path().join("f"));
        std::fs::create_dir(&folder).expect("a folder");
        std::fs::write(folder.join("1.stl"), "scan").expect("written");
        // A root of the settings is not known.
        let inputs = ["scans/1.stl", "scans/2.stl", "disk:3.stl"].map(WantedInput::unread);
        let later = Instant::now() + Duration::from_hours(1);
        let places = looked_at(&project, &inputs, Some(&folder), later);
        assert_eq!((places.looked_at, places.missing), (2, 1));
        assert_eq!(places.first, ["scans/2.stl"]);
    }
}
