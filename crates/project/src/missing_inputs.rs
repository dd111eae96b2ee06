//! Finds out with few lookups whether input files are missing, as after their folder has moved, or were changed.

use std::collections::BTreeSet;
use std::fmt;
use std::path::MAIN_SEPARATOR;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::blocking::blocking_within;
use crate::error::ProjectResult;
use crate::import_command::ImportCommand;
use crate::missing_folders::MissingFolders;
use mocban_catalog::{Catalog, InputVersion, KnownBlock, PairSelection};
use mocban_core::domain::{ArtifactRef, NOT_THERE, PairId, first_names, one_line};
use mocban_store::{InputError, Project, stat_input};

/// Largest number of pairs whose files are inspected. They are spread over the project.
const MAX_PAIRS: u64 = 300;
/// Largest number of blocks whose files are inspected.
const MAX_BLOCKS: usize = 50;
/// Time after which no further file is inspected, as on a slow network drive.
pub(crate) const INSPECTION_TIME: Duration = Duration::from_secs(4);
/// Longest wait for the inspection. A disk may hang.
pub(crate) const MAX_TIME: Duration = Duration::from_secs(5);
/// Largest number of missing folders that a sentence names.
const MAX_FOLDERS: usize = 3;
/// Ends of the message of an input or an artifact that is missing.
const MISSING: [&str; 2] = [NOT_THERE, " is missing"];

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
    pub owners: usize,
    /// Folders of missing files that are missing, too, each without its own folders.
    pub folders: Vec<String>,
    /// Whether the first one is below a named root.
    #[serde(skip)]
    pub is_below_root: bool,
    /// Number of the pair or block of the first one among the inspected ones.
    #[serde(skip)]
    pub first_owner: usize,
    /// How the first one is imported again from another place.
    #[serde(skip)]
    pub command: ImportCommand,
}

impl MissingInputs {
    /// Says what was found, without what to do.
    pub fn found(&self) -> String {
        let Self {
            missing,
            looked_at,
            first,
            owners,
            folders,
            ..
        } = self;
        let found = format!(
            "{missing} of {looked_at} input files that were looked at are missing or have moved"
        );
        match folders.as_slice() {
            [] => format!("{found}, first {}", one_line(first)),
            [folder] => format!(
                "{found} (pairs or blocks: {owners}), and so is the folder {}",
                one_line(folder)
            ),
            folders => {
                let folders: Vec<String> = folders
                    .iter()
                    .map(|folder| one_line(folder).to_string())
                    .collect();
                let names = first_names(&folders, MAX_FOLDERS);
                format!("{found} (pairs or blocks: {owners}), and so are the folders {names}")
            }
        }
    }

    /// Returns whether a message of an export says that a file in one of the folders is missing.
    pub fn explains(&self, message: &str) -> bool {
        let mut folders = self.folders.iter();
        MISSING.iter().any(|end| message.ends_with(end))
            && folders.any(|folder| message.contains(&format!("{folder}{MAIN_SEPARATOR}")))
    }
}

impl fmt::Display for MissingInputs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = self.found();
        write!(f, "{found}; `check --json` lists all; ")?;
        if self.is_below_root {
            f.write_str(
                "put them back, or write their new place below [storage.roots] in the settings",
            )
        } else {
            let command = self.command;
            write!(
                f,
                "put them back, or import them from their new place (`{command}`)"
            )
        }
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

/// Inspects files like [`missing`], and counts the pairs of the project before.
pub(crate) async fn missing_of_all(
    project: &Project,
    catalog: &Catalog,
) -> ProjectResult<Option<MissingInputs>> {
    missing(project, catalog, all_pairs(catalog).await?).await
}

/// Inspects files like [`missing_after_failures`], and counts the pairs of the project before.
pub(crate) async fn missing_of_all_after_failures(
    project: &Project,
    catalog: &Catalog,
) -> ProjectResult<Option<MissingInputs>> {
    missing_after_failures(project, catalog, all_pairs(catalog).await?).await
}

/// Returns the number of pairs with the retired ones.
async fn all_pairs(catalog: &Catalog) -> ProjectResult<u64> {
    let pairs: u64 = catalog.counters().await?.values().sum();
    Ok(pairs + catalog.retired_count().await?)
}

/// Inspects files like [`missing`], after failures: files that a run did not find count too, if their folder is missing.
pub(crate) async fn missing_after_failures(
    project: &Project,
    catalog: &Catalog,
    pairs: u64,
) -> ProjectResult<Option<MissingInputs>> {
    let sample = sample(project, catalog, pairs).await?;
    let inspection = inspect_files(project, catalog, sample).await?;
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
    let mut sample = sample(project, catalog, pairs).await?;
    // A file that was not there is the reason of a failure, which is said elsewhere.
    sample.files.retain(|file| !file.read.is_gone());
    inspect_files(project, catalog, sample).await
}

/// Returns the files of some pairs and blocks that a run has looked for, as in [`inspect`].
async fn sample(project: &Project, catalog: &Catalog, pairs: u64) -> ProjectResult<InputSample> {
    if project.has_remote_inputs() {
        return Ok(InputSample::default());
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
    let mut add = |owner: usize, inputs: Vec<ReadInput>| {
        let inputs = looked_for(inputs).into_iter();
        files.extend(inputs.map(|(path, read)| SampledInput { owner, path, read }));
    };
    let pairs: Vec<PairId> = known.iter().map(|known| known.pair).collect();
    let mut commands = Vec::new();
    for (owner, known) in known.into_iter().enumerate() {
        let inputs = vec![
            (known.mesh_path, known.mesh),
            (known.print_path, known.print),
        ];
        add(owner, inputs);
    }
    let blocks = catalog.known_blocks().await?.into_iter().take(MAX_BLOCKS);
    for (owner, block) in (pairs.len()..).zip(blocks) {
        commands.push(ImportCommand::of_block(&block.attributes));
        add(owner, block_files(block));
    }
    // The files of pairs that were cut from a block are artifacts.
    files.retain(|file| ArtifactRef::at_path(&file.path).is_none());
    Ok(InputSample {
        files,
        pairs,
        blocks: commands,
    })
}

/// Inspects files for a limited time. Finds nothing if the disk hangs.
async fn inspect_files(
    project: &Project,
    catalog: &Catalog,
    sample: InputSample,
) -> ProjectResult<InputInspection> {
    let project = project.clone();
    let until = Instant::now() + INSPECTION_TIME;
    let InputSample {
        files,
        pairs,
        blocks,
    } = sample;
    let look = move || among(&project, &files, until);
    let looked = blocking_within(MAX_TIME, look).await;
    let mut inspection = looked.unwrap_or_default();
    if let Some(missing) = &mut inspection.missing {
        missing.command = match pairs.get(missing.first_owner) {
            Some(pair) => {
                let attributes = catalog.attributes_of(*pair).await?;
                attributes.map(|pair| ImportCommand::of_pair(&pair))
            }
            None => blocks.get(missing.first_owner - pairs.len()).copied(),
        }
        .unwrap_or_default();
    }
    Ok(inspection)
}

/// The files of some pairs and blocks.
#[derive(Debug, Default)]
struct InputSample {
    files: Vec<SampledInput>,
    /// The pairs, which are the first owners.
    pairs: Vec<PairId>,
    /// How the blocks, which are the other owners, are imported again.
    blocks: Vec<ImportCommand>,
}

/// A file that is inspected.
#[derive(Debug, Clone)]
struct SampledInput {
    /// Number of its pair or block.
    owner: usize,
    /// Path as stored.
    path: String,
    /// What was stored when it was read.
    read: InputVersion,
}

/// Path of an input file as stored, and its version if a run has looked for it.
type ReadInput = (String, Option<InputVersion>);

/// Returns the files of a pair or block that a run has looked for. If it did not find one, it may have stopped there, so the
/// other ones count as not found, too.
fn looked_for(inputs: Vec<ReadInput>) -> Vec<(String, InputVersion)> {
    let mut reads = inputs.iter().filter_map(|(_, read)| read.as_ref());
    let is_one_gone = reads.any(InputVersion::is_gone);
    let inputs = inputs.into_iter().filter_map(|(path, read)| {
        let read = read.or_else(|| is_one_gone.then(InputVersion::gone));
        Some((path, read?))
    });
    inputs.collect()
}

/// Returns the paths of the files of a block, each with its version when it was read.
fn block_files(block: KnownBlock) -> Vec<ReadInput> {
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
        let input = project.input(&file.path);
        match stat_input(&input) {
            Err(InputError::NotThere(_)) => {
                let is_in_missing_folder = folders.add(input.path());
                if file.read.is_gone() && !is_in_missing_folder {
                    // Its failure says so.
                    continue;
                }
                missing.push(file);
            }
            Ok(now) if has_other_size(&file.read, &now) => changed.push(file),
            Ok(_) | Err(_) => {}
        }
        looked_at += 1;
    }
    let shown = |file: &SampledInput| project.input(&file.path).path().display().to_string();
    let owners: BTreeSet<usize> = missing.iter().map(|file| file.owner).collect();
    InputInspection {
        looked_at,
        missing: missing.first().map(|first| MissingInputs {
            missing: missing.len(),
            looked_at,
            first: shown(first),
            owners: owners.len(),
            folders: folders.names(),
            is_below_root: project.is_below_root(&first.path),
            first_owner: first.owner,
            command: ImportCommand::default(),
        }),
        changed: changed.first().map(|first| ChangedInputs {
            changed: changed.len(),
            looked_at,
            first: shown(first),
        }),
    }
}

/// Returns whether a file had another size when it was read than it has `now`. One with a new path since an import was not
/// read there; `other_files` counts it.
fn has_other_size(read: &InputVersion, now: &str) -> bool {
    // The size stands before the modification time.
    let is_other = read.stat.split(':').next() != now.split(':').next();
    is_other && !read.has_new_path() && !read.is_gone()
}

#[cfg(test)]
mod tests;
