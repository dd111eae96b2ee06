//! Finds out with few lookups whether input files are missing, as after their folder has moved, or were changed.

use std::time::{Duration, Instant};

use serde::Serialize;

use crate::error::ProjectResult;
use mocban_catalog::{Catalog, InputVersion, KnownBlock, PairSelection};
use mocban_core::domain::{ArtifactRef, PairId, one_line};
use mocban_store::{InputError, Project, stat_input};

/// Largest number of pairs whose files are inspected. They are spread over the project.
const MAX_PAIRS: u64 = 300;
/// Largest number of blocks whose files are inspected.
const MAX_BLOCKS: usize = 50;
/// Time after which no further file is inspected, as on a slow network drive.
const INSPECTION_TIME: Duration = Duration::from_secs(4);
/// Longest wait for the inspection. A disk may hang.
const MAX_TIME: Duration = Duration::from_secs(5);

/// Input files that were read before and are no longer at their places.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MissingInputs {
    /// Number of missing files among the inspected ones.
    pub missing: usize,
    /// Number of files that were inspected.
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
    /// Number of changed files among the inspected ones.
    pub changed: usize,
    /// Number of files that were inspected.
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

/// Missing and changed files among the sampled inputs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InputInspection {
    /// Number of files that were inspected. 0 if none was read before, the disk hangs, or inputs may be in an object store.
    pub looked_at: usize,
    /// Files that are missing.
    pub missing: Option<MissingInputs>,
    /// Files that were changed.
    pub changed: Option<ChangedInputs>,
}

/// Inspects the files of some pairs and blocks of a project, like [`inspect`], and returns the missing ones.
pub async fn missing(
    project: &Project,
    catalog: &Catalog,
    pairs: u64,
) -> ProjectResult<Option<MissingInputs>> {
    Ok(inspect(project, catalog, pairs).await?.missing)
}

/// Inspects the files of some pairs and blocks of a project. `pairs` counts the retired pairs too, because they have ids,
/// but their files are not inspected. Finds nothing if inputs may be in an object store, or if the disk hangs. If the disk
/// is slow, inspects fewer files.
pub async fn inspect(
    project: &Project,
    catalog: &Catalog,
    pairs: u64,
) -> ProjectResult<InputInspection> {
    if project.has_remote_inputs() {
        return Ok(InputInspection::default());
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
    for (path, read) in blocks.flat_map(block_files) {
        add(path, read);
    }
    // The files of pairs that were cut from a block are artifacts.
    files.retain(|(path, _)| ArtifactRef::at_path(path).is_none());
    let project = project.clone();
    let until = Instant::now() + INSPECTION_TIME;
    let inspection = tokio::task::spawn_blocking(move || among(&project, &files, until));
    let inspected = tokio::time::timeout(MAX_TIME, inspection).await;
    Ok(inspected.ok().and_then(Result::ok).unwrap_or_default())
}

/// Returns the paths of the files of a block, each with its version when it was read.
fn block_files(block: KnownBlock) -> Vec<(String, Option<InputVersion>)> {
    let KnownBlock {
        attributes, inputs, ..
    } = block;
    let mut files = vec![
        (attributes.mesh_path, inputs.mesh),
        (attributes.page_path, inputs.page),
    ];
    files.extend(attributes.labels_path.map(|path| (path, inputs.labels)));
    files
}

/// Inspects files until a time, each with what was stored about it when it was read.
fn among(project: &Project, files: &[(String, String)], until: Instant) -> InputInspection {
    let mut looked_at = 0;
    let (mut missing, mut changed) = (Vec::new(), Vec::new());
    for (path, read) in files {
        if Instant::now() >= until {
            break;
        }
        looked_at += 1;
        match stat_input(&project.input(path)) {
            Err(InputError::NotThere(_)) => missing.push(path),
            // A file without a stat has a new path since an import; `other_files` counts it.
            Ok(now) if !read.is_empty() && size(&now) != size(read) => {
                changed.push(path);
            }
            Ok(_) | Err(_) => {}
        }
    }
    let shown = |path: &str| project.input(path).path().display().to_string();
    InputInspection {
        looked_at,
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
    use std::time::{Duration, Instant};

    use super::{InputInspection, among, block_files};
    use mocban_catalog::{BlockAttributes, BlockInputVersions, InputVersion, KnownBlock};
    use mocban_core::domain::{BlockId, BlockName, ContentHash};
    use mocban_store::{Project, stat_input};

    #[test]
    fn the_labels_of_a_block_are_inspected_like_its_scan_and_page() {
        let read = |stat: &str| {
            Some(InputVersion {
                hash: ContentHash::of(b""),
                stat: stat.to_owned(),
            })
        };
        let block = KnownBlock {
            block: BlockId(1),
            attributes: BlockAttributes {
                name: BlockName::new("b").expect("an id"),
                mesh_path: "b.stl".to_owned(),
                page_path: "b.png".to_owned(),
                labels_path: Some("b.json".to_owned()),
                unit: None,
                side: None,
                meta: None,
            },
            inputs: BlockInputVersions {
                mesh: read("1"),
                page: None,
                labels: read("2"),
            },
        };
        let expected = [("b.stl", read("1")), ("b.png", None), ("b.json", read("2"))];
        assert_eq!(
            block_files(block),
            expected.map(|(path, read)| (path.to_owned(), read))
        );
    }

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
        let later = Instant::now() + Duration::from_hours(1);
        let none = InputInspection::default();
        let sound = InputInspection {
            looked_at: 3,
            ..none.clone()
        };
        assert_eq!(among(&project, &files, later), sound);
        // Another file with the same size, as in a copy of the folder.
        std::fs::write(dir.path().join("new.stl"), "y").expect("written");
        std::fs::rename(dir.path().join("new.stl"), dir.path().join("a.stl")).expect("moved");
        assert_eq!(among(&project, &files, later), sound);
        std::fs::write(dir.path().join("b.stl"), "longer").expect("written");
        std::fs::remove_file(dir.path().join("c.stl")).expect("removed");
        let InputInspection {
            missing, changed, ..
        } = among(&project, &files, later);
        let (missing, changed) = (missing.expect("one"), changed.expect("one"));
        assert_eq!((missing.missing, missing.looked_at), (1, 3));
        assert!(missing.first.ends_with("c.stl"), "{missing}");
        assert_eq!((changed.changed, changed.looked_at), (1, 3));
        assert!(changed.first.ends_with("b.stl"), "{changed}");
        let mut unread = files.clone();
        unread[1].1.clear();
        assert_eq!(among(&project, &unread, later).changed, None);
        assert_eq!(among(&project, &files, Instant::now()), none, "it is over");
    }
}
