//! Finds out with few lookups whether input files are missing, as after their folder has moved, or were changed.

use std::time::Duration;

use serde::Serialize;

use crate::error::ProjectResult;
use mocban_catalog::{Catalog, InputVersion, PairSelection};
use mocban_core::domain::{ArtifactRef, PairId, one_line};
use mocban_store::{InputError, Project, stat_input};

/// Largest number of pairs whose files are looked at. They are spread over the project.
const MAX_PAIRS: u64 = 1000;
/// Largest number of blocks whose files are looked at.
const MAX_BLOCKS: usize = 50;
/// Longest time for looking at the files. A disk may hang.
const MAX_TIME: Duration = Duration::from_secs(5);

/// Input files that were read before and are no longer at their places.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MissingInputs {
    /// Number of missing files among the files that were looked at.
    pub missing: usize,
    /// Number of files that were looked at.
    pub looked_at: usize,
    /// Path of the first missing one.
    pub first: String,
}

impl std::fmt::Display for MissingInputs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            missing,
            looked_at,
            first,
        } = self;
        write!(
            f,
            "{missing} of {looked_at} input files that were looked at are missing or have moved, first {}; `check --json` lists all",
            one_line(first)
        )
    }
}

/// Input files whose size has changed since they were read. Times are not compared: a copy of a folder has other ones.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ChangedInputs {
    /// Number of changed files among the files that were looked at.
    pub changed: usize,
    /// Number of files that were looked at.
    pub looked_at: usize,
    /// Path of the first changed one.
    pub first: String,
}

impl std::fmt::Display for ChangedInputs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            changed,
            looked_at,
            first,
        } = self;
        write!(
            f,
            "{changed} of {looked_at} input files that were looked at have another size than when they were read, first {}; `run` reads them",
            one_line(first)
        )
    }
}

/// What a look at input files found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InputsLook {
    /// Files that are missing.
    pub missing: Option<MissingInputs>,
    /// Files that were changed.
    pub changed: Option<ChangedInputs>,
}

/// Looks at the files of some pairs and blocks of a project, like [`look`], and returns the missing ones.
pub async fn find(
    project: &Project,
    catalog: &Catalog,
    pairs: u64,
) -> ProjectResult<Option<MissingInputs>> {
    Ok(look(project, catalog, pairs).await?.missing)
}

/// Looks at the files of some pairs and blocks of a project. `pairs` counts the retired pairs too, because they have ids,
/// but their files are not looked at. Finds nothing if inputs may be in an object store, or if the disk does not answer in
/// time.
pub async fn look(project: &Project, catalog: &Catalog, pairs: u64) -> ProjectResult<InputsLook> {
    if project.has_remote_inputs() {
        return Ok(InputsLook::default());
    }
    let sampled = pairs.min(MAX_PAIRS);
    // The ids of pairs are almost without gaps.
    let ids = (0..sampled).map(|k| PairId((k * pairs / sampled + 1) as i64));
    let ids = PairSelection::of(&ids.collect::<Vec<_>>());
    let mut known = catalog
        .known_inputs(None, MAX_PAIRS as usize, Some(&ids))
        .await?;
    let retired = catalog.retired_among(&ids).await?;
    known.retain(|known| !retired.contains(&known.pair));
    let mut files = Vec::new();
    let mut add = |path: String, read: Option<InputVersion>| {
        // A file that was not there is the reason of a failure, which is said elsewhere.
        files.extend(
            read.filter(|read| !read.is_gone())
                .map(|read| (path, read.stat)),
        );
    };
    for known in known {
        add(known.mesh_path, known.mesh);
        add(known.print_path, known.print);
    }
    let blocks = catalog.known_blocks().await?.into_iter().take(MAX_BLOCKS);
    for block in blocks {
        add(block.attributes.mesh_path, block.inputs.mesh);
        add(block.attributes.page_path, block.inputs.page);
    }
    // The files of pairs that were cut from a block are artifacts.
    files.retain(|(path, _)| ArtifactRef::at_path(path).is_none());
    let project = project.clone();
    let look = tokio::task::spawn_blocking(move || among(&project, &files));
    let looked = tokio::time::timeout(MAX_TIME, look).await;
    Ok(looked.ok().and_then(Result::ok).unwrap_or_default())
}

/// Looks at files, each with what was stored about it when it was read.
fn among(project: &Project, files: &[(String, String)]) -> InputsLook {
    let looked_at = files.len();
    let (mut missing, mut changed) = (Vec::new(), Vec::new());
    for (path, read) in files {
        match stat_input(&project.input(path)) {
            Err(InputError::NotThere(_)) => missing.push(path),
            // An import has changed the path of a file without a stat, which is said elsewhere.
            Ok(now) if !read.is_empty() && size(&now) != size(read) => {
                changed.push(path);
            }
            Ok(_) | Err(_) => {}
        }
    }
    let shown = |path: &str| project.input(path).path().display().to_string();
    InputsLook {
        missing: missing.first().map(|first| MissingInputs {
            missing: missing.len(),
            looked_at,
            first: shown(first),
        }),
        changed: changed.first().map(|first| ChangedInputs {
            changed: changed.len(),
            looked_at,
            first: shown(first),
        }),
    }
}

/// Returns the size in what is stored about a file, before its modification time.
fn size(stat: &str) -> &str {
    stat.split_once(':').map_or(stat, |(size, _)| size)
}

#[cfg(test)]
mod tests {
    use super::{InputsLook, among};
    use mocban_store::{Project, stat_input};

    #[test]
    fn changed_and_missing_files_are_counted_and_copies_are_not() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(dir.path());
        let files = ["a.stl", "b.stl", "c.stl"].map(|name| {
            let path = dir.path().join(name);
            std::fs::write(&path, "x").expect("written");
            let stored = path.display().to_string();
            let stat = stat_input(&project.input(&stored)).expect("a file");
            (stored, stat)
        });
        assert_eq!(among(&project, &files), InputsLook::default());
        // Another file with the same size, as in a copy of the folder.
        std::fs::write(dir.path().join("new.stl"), "y").expect("written");
        std::fs::rename(dir.path().join("new.stl"), dir.path().join("a.stl")).expect("moved");
        assert_eq!(among(&project, &files), InputsLook::default());
        std::fs::write(dir.path().join("b.stl"), "longer").expect("written");
        std::fs::remove_file(dir.path().join("c.stl")).expect("removed");
        let InputsLook { missing, changed } = among(&project, &files);
        let (missing, changed) = (missing.expect("one"), changed.expect("one"));
        assert_eq!((missing.missing, missing.looked_at), (1, 3));
        assert!(missing.first.ends_with("c.stl"), "{missing}");
        assert_eq!((changed.changed, changed.looked_at), (1, 3));
        assert!(changed.first.ends_with("b.stl"), "{changed}");
        let mut unread = files.clone();
        unread[1].1.clear();
        assert_eq!(among(&project, &unread).changed, None);
    }
}
