//! Finds out with few lookups whether input files are missing, as after their folder has moved, or were changed.

use std::collections::BTreeSet;
use std::fmt;
use std::path::MAIN_SEPARATOR;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::error::ProjectResult;
use crate::missing_folders::MissingFolders;
use mocban_catalog::{Catalog, InputVersion, KnownBlock, PairSelection};
use mocban_core::domain::{ArtifactRef, PairId, first_names, one_line};
use mocban_store::{InputError, Project, stat_input};

/// Largest number of pairs whose files are inspected. They are spread over the project.
const MAX_PAIRS: u64 = 300;
/// Largest number of blocks whose files are inspected.
const MAX_BLOCKS: usize = 50;
/// Time after which no further file is inspected, as on a slow network drive.
const INSPECTION_TIME: Duration = Duration::from_secs(4);
/// Longest wait for the inspection. A disk may hang.
const MAX_TIME: Duration = Duration::from_secs(5);
/// Largest number of missing folders that a sentence names.
const MAX_FOLDERS: usize = 3;
/// Ends of the message of a file that is missing.
const NOT_THERE: [&str; 2] = [" is not there", " is missing"];

/// Input files that were read before and are no longer at their places.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MissingInputs {
    /// Number of missing files among the inspected ones.
    pub missing: usize,
    /// Number of files that were inspected.
    pub looked_at: usize,
    /// Path of the first missing one.
    pub first: String,
    /// Number of pairs and blocks that they belong to.
    pub pairs: usize,
    /// Folders of missing files that are missing, too, each without those in it.
    pub folders: Vec<String>,
    /// Whether the first one is below a named root.
    #[serde(skip)]
    pub is_below_root: bool,
}

impl MissingInputs {
    /// Says what was found, without what to do.
    pub fn found(&self) -> String {
        let Self {
            missing,
            looked_at,
            first,
            pairs,
            folders,
            ..
        } = self;
        let found = format!(
            "{missing} of {looked_at} input files that were looked at are missing or have moved"
        );
        match folders.as_slice() {
            [] => format!("{found}, first {}", one_line(first)),
            [folder] => format!(
                "{found}, of {pairs} pairs or blocks, with the folder {}",
                one_line(folder)
            ),
            folders => {
                let folders: Vec<String> = folders
                    .iter()
                    .map(|folder| one_line(folder).to_string())
                    .collect();
                let names = first_names(&folders, MAX_FOLDERS);
                format!("{found}, of {pairs} pairs or blocks, with the folders {names}")
            }
        }
    }

    /// Returns whether a message is that of a missing file in one of the folders.
    pub fn explains(&self, message: &str) -> bool {
        let mut folders = self.folders.iter();
        NOT_THERE.iter().any(|end| message.ends_with(end))
            && folders.any(|folder| message.contains(&format!("{folder}{MAIN_SEPARATOR}")))
    }
}

impl fmt::Display for MissingInputs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = self.found();
        let advice = if self.is_below_root {
            "put them back, or write their new place below [storage.roots] in the settings"
        } else {
            "put them back, or import them from their new place (`import LIST --allow-changed-files`)"
        };
        write!(f, "{found}; `check --json` lists all; {advice}")
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

impl fmt::Display for ChangedInputs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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

/// Inspects files like [`missing`], after failures: files that a run did not find count too, if their folder is missing.
pub async fn missing_after_failures(
    project: &Project,
    catalog: &Catalog,
    pairs: u64,
) -> ProjectResult<Option<MissingInputs>> {
    let inspection = inspect_files(project, catalog, pairs, true).await?;
    Ok(inspection.missing)
}

/// Inspects the files of some pairs and blocks of a project. `pairs` counts the retired pairs too, because they have ids,
/// but their files are not inspected. Finds nothing if inputs may be in an object store, or if the disk hangs. If the disk
/// is slow, inspects fewer files.
pub async fn inspect(
    project: &Project,
    catalog: &Catalog,
    pairs: u64,
) -> ProjectResult<InputInspection> {
    inspect_files(project, catalog, pairs, false).await
}

/// Inspects files like [`inspect`]. `with_gone` includes the files that the last run did not find.
async fn inspect_files(
    project: &Project,
    catalog: &Catalog,
    pairs: u64,
    with_gone: bool,
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
    let mut add = |owner: usize, path: String, read: Option<InputVersion>| {
        // A file that was not there is the reason of a failure, which is said elsewhere.
        let read = read.filter(|read| with_gone || !read.is_gone());
        files.extend(read.map(|read| SampledInput {
            owner,
            path,
            was_gone: read.is_gone(),
            stat: read.stat,
        }));
    };
    let pairs = known.len();
    for (owner, known) in known.into_iter().enumerate() {
        add(owner, known.mesh_path, known.mesh);
        add(owner, known.print_path, known.print);
    }
    let blocks = catalog.known_blocks().await?.into_iter().take(MAX_BLOCKS);
    for (owner, block) in (pairs..).zip(blocks) {
        for (path, read) in block_files(block) {
            add(owner, path, read);
        }
    }
    // The files of pairs that were cut from a block are artifacts.
    files.retain(|file| ArtifactRef::at_path(&file.path).is_none());
    let project = project.clone();
    let until = Instant::now() + INSPECTION_TIME;
    let inspection = tokio::task::spawn_blocking(move || among(&project, &files, until));
    let inspected = tokio::time::timeout(MAX_TIME, inspection).await;
    Ok(inspected.ok().and_then(Result::ok).unwrap_or_default())
}

/// A file that is inspected.
#[derive(Debug, Clone)]
struct SampledInput {
    /// Number of its pair or block.
    owner: usize,
    /// Path as stored.
    path: String,
    /// What was stored about it when it was read.
    stat: String,
    /// Whether the last run did not find it.
    was_gone: bool,
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

/// Inspects files until a time.
fn among(project: &Project, files: &[SampledInput], until: Instant) -> InputInspection {
    let mut looked_at = 0;
    let (mut missing, mut changed) = (Vec::new(), Vec::new());
    let mut folders = MissingFolders::default();
    for file in files {
        if Instant::now() >= until {
            break;
        }
        looked_at += 1;
        let input = project.input(&file.path);
        match stat_input(&input) {
            Err(InputError::NotThere(_)) => {
                let is_in_missing_folder = folders.add(input.path());
                if is_in_missing_folder || !file.was_gone {
                    missing.push(file);
                }
            }
            // A file without a stat has a new path since an import; `other_files` counts it.
            Ok(now)
                if !file.stat.is_empty() && !file.was_gone && size(&now) != size(&file.stat) =>
            {
                changed.push(file);
            }
            Ok(_) | Err(_) => {}
        }
    }
    let shown = |file: &SampledInput| project.input(&file.path).path().display().to_string();
    let owners: BTreeSet<usize> = missing.iter().map(|file| file.owner).collect();
    InputInspection {
        looked_at,
        missing: missing.first().map(|first| MissingInputs {
            missing: missing.len(),
            looked_at,
            first: shown(first),
            pairs: owners.len(),
            folders: folders.names(),
            is_below_root: project.is_below_root(&first.path),
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

    use super::{InputInspection, SampledInput, among, block_files};
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
            let path = path.display().to_string();
            let stat = stat_input(&project.input(&path)).expect("a file");
            SampledInput {
                owner: 0,
                path,
                stat,
                was_gone: false,
            }
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
        unread[1].stat.clear();
        assert_eq!(among(&project, &unread, later).changed, None);
        assert_eq!(among(&project, &files, Instant::now()), none, "it is over");
    }
    #[test]
    fn a_missing_folder_is_named_once() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(dir.path());
        let file = |owner, path: &str, was_gone| SampledInput {
            owner,
            path: dir.path().join(path).display().to_string(),
            stat: String::new(),
            was_gone,
        };
        let later = Instant::now() + Duration::from_hours(1);
        let find = |files: &[SampledInput]| among(&project, files, later).missing;
        let scans = [
            file(0, "scans/a/1.stl", false),
            file(1, "scans/b/2.stl", true),
        ];
        let found = find(&scans).expect("two files");
        let folder = dir.path().join("scans").display().to_string();
        let end = format!(", of 2 pairs or blocks, with the folder {folder}");
        assert!(found.found().ends_with(&end), "{found}");
        assert!(found.to_string().contains("--allow-changed-files"));
        assert!(found.explains(&format!("{} is not there", scans[1].path)));
        assert!(!found.explains("other/1.stl is not there"));
        let both = [scans[0].clone(), file(2, "prints/1.png", false)];
        let found = find(&both).expect("two files");
        assert_eq!(found.folders.len(), 2, "{found}");
        assert!(found.found().contains("with the folders "), "{found}");
        // A folder that is there is not named.
        let found = find(&[file(0, "1.stl", false)]).expect("a file");
        assert!(found.folders.is_empty() && found.found().contains(", first "));
        assert_eq!(find(&[file(0, "1.stl", true)]), None);
    }
}
