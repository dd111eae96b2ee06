//! Input files of blocks: their current versions, and which of them have changed.

use std::path::PathBuf;

use crate::block_stages::{BlockFile, BlockInputs, BlockStageError};
use crate::error::RunError;
use crate::input_reads::{ReadItem, ReadLimits, read_each};
use crate::retry::retried;
use mocban_catalog::{
    BlockAttributes, BlockInputVersions, BlockSelection, Catalog, InputVersion, KnownBlock,
};
use mocban_core::domain::{BlockId, BlockStage, ContentHash, ControlPoints, Failure, FailureClass};
use mocban_store::{Input, InputError, Project, hash_input, stat_input};

/// Stores the new versions of changed input files of blocks in the catalog, of all or of those in `selection`. Skips scans
/// and pages that no stage has read; labels may have been added to a block that was finished without them. A file
/// counts as unchanged if reading it fails or is ended by `limits`.
pub(crate) async fn store_changes(
    project: &Project,
    catalog: &Catalog,
    selection: Option<&BlockSelection>,
    limits: &ReadLimits,
) -> Result<(), RunError> {
    let known = retried!(catalog.known_blocks())?.into_iter();
    let known =
        known.filter(|known| selection.is_none_or(|selection| selection.contains(known.block)));
    let compared = known.map(|known| ComparedBlock {
        project: project.clone(),
        known,
    });
    let changed = read_each(compared.collect(), limits).await;
    let changed: Vec<_> = changed.into_iter().flatten().flatten().collect();
    if !changed.is_empty() {
        retried!(catalog.store_block_inputs(changed.clone()))?;
    }
    Ok(())
}

/// A block whose input files are compared with the known ones.
struct ComparedBlock {
    project: Project,
    known: KnownBlock,
}

impl ReadItem for ComparedBlock {
    type Output = Option<(BlockId, BlockInputVersions)>;

    fn read(&self) -> Self::Output {
        let KnownBlock {
            attributes, inputs, ..
        } = &self.known;
        let changed_file =
            |path: &str, known: Option<&InputVersion>| change(&self.project.input(path), known?);
        let unread = InputVersion {
            hash: ContentHash::of(b""),
            stat: String::new(),
        };
        let known_labels = inputs.labels.as_ref().unwrap_or(&unread);
        let labels = attributes.labels_path.as_ref();
        let changed = BlockInputVersions {
            mesh: changed_file(&attributes.mesh_path, inputs.mesh.as_ref()),
            page: changed_file(&attributes.page_path, inputs.page.as_ref()),
            labels: labels.and_then(|path| changed_file(path, Some(known_labels))),
        };
        let is_changed = changed != BlockInputVersions::default();
        is_changed.then_some((self.known.block, changed))
    }

    fn path(&self) -> PathBuf {
        self.project.input_path(&self.known.attributes.mesh_path)
    }
}

/// Returns the current version of a file if it may differ from the known version. A missing file counts as changed only
/// if an import has changed its path since the last read.
fn change(input: &Input, known: &InputVersion) -> Option<InputVersion> {
    match stat_input(input) {
        Ok(stat) if stat == known.stat => None,
        Ok(_) => hash_input(input).ok(),
        Err(error) if error.is_correctable() && known.stat.is_empty() => Some(InputVersion::gone()),
        Err(_) => None,
    }
}

/// The input files of a block, with what is known about them.
#[derive(Debug, Clone)]
pub(crate) struct BlockSources {
    attributes: BlockAttributes,
    mesh: Input,
    page: Input,
    labels: Option<Input>,
    /// Largest mesh and largest other file in bytes, with the names of the settings.
    limits: [(u64, &'static str); 2],
}

impl BlockSources {
    pub(crate) fn new(
        project: &Project,
        attributes: &BlockAttributes,
        limits: [(u64, &'static str); 2],
    ) -> Self {
        let labels = attributes.labels_path.as_ref();
        Self {
            mesh: project.input(&attributes.mesh_path),
            page: project.input(&attributes.page_path),
            labels: labels.map(|path| project.input(path)),
            attributes: attributes.clone(),
            limits,
        }
    }

    /// Returns the versions of the files that a stage depends on. Hashes a file only if its size, modification time or
    /// inode differs from the known version. May block.
    ///
    /// # Errors
    /// Returns an error if a file is missing, unreadable or too large.
    pub(crate) fn versions(
        &self,
        stage: BlockStage,
        known: &BlockInputVersions,
    ) -> Result<BlockInputVersions, BlockStageError> {
        let [mesh, other] = self.limits;
        let labels = self.labels.as_ref().filter(|_| stage.depends_on_labels());
        let page = stage.reads_page().then_some(&self.page);
        let labels = labels.map(|input| version(input, known.labels.as_ref(), other));
        let page = page.map(|input| version(input, known.page.as_ref(), other));
        Ok(BlockInputVersions {
            mesh: Some(version(&self.mesh, known.mesh.as_ref(), mesh)?),
            page: page.transpose()?,
            labels: labels.transpose()?,
        })
    }

    /// Returns the versions of the files that are missing. May block.
    pub(crate) fn missing(&self) -> BlockInputVersions {
        let gone = |input: &Input| {
            let error = stat_input(input).err()?;
            error.is_correctable().then(InputVersion::gone)
        };
        BlockInputVersions {
            mesh: gone(&self.mesh),
            page: gone(&self.page),
            labels: self.labels.as_ref().and_then(gone),
        }
    }

    /// Checks that no file has changed since its version was determined.
    ///
    /// # Errors
    /// Returns an error that names the changed file.
    pub(crate) fn check_unchanged(&self, read: &BlockInputVersions) -> Result<(), BlockStageError> {
        let files = [
            (Some(&self.mesh), &read.mesh),
            (Some(&self.page), &read.page),
            (self.labels.as_ref(), &read.labels),
        ];
        for (input, version) in files {
            let (Some(input), Some(version)) = (input, version) else {
                continue;
            };
            if stat_input(input)? != version.stat {
                return Err(InputError::Changed(input.path().to_owned()).into());
            }
        }
        Ok(())
    }

    /// Returns what a stage is computed from. `control_points` are those of these files.
    pub(crate) fn inputs(&self, control_points: Option<ControlPoints>) -> BlockInputs {
        let file = |path: &str, input: &Input| {
            BlockFile::new(path.to_owned(), input.clone(), input.size())
        };
        let attributes = &self.attributes;
        let labels = attributes.labels_path.as_ref().zip(self.labels.as_ref());
        BlockInputs {
            name: attributes.name.clone(),
            mesh: file(&attributes.mesh_path, &self.mesh),
            page: file(&attributes.page_path, &self.page),
            labels: labels.map(|(path, input)| file(path, input)),
            unit: attributes.unit,
            side: attributes.side,
            control_points,
        }
    }
}

/// Returns the current version of a file.
fn version(
    input: &Input,
    known: Option<&InputVersion>,
    (limit, setting): (u64, &'static str),
) -> Result<InputVersion, BlockStageError> {
    let stat = stat_input(input)?;
    if let Some(known) = known.filter(|known| known.stat == stat) {
        return Ok(known.clone());
    }
    let bytes = input.size();
    if bytes > limit {
        let path = input.path().to_owned();
        let error = InputError::TooLarge {
            path,
            bytes,
            limit,
            setting,
        };
        return Err(error.into());
    }
    Ok(hash_input(input)?)
}

/// Returns the first stage whose result does not belong to these versions, among the stages before `stage`.
pub(crate) fn outdated(
    stage: BlockStage,
    used: &BlockInputVersions,
    now: &BlockInputVersions,
) -> Option<BlockStage> {
    let differs = |used: &Option<InputVersion>, now: &Option<InputVersion>| match (used, now) {
        (Some(used), Some(now)) => used.hash != now.hash,
        _ => false,
    };
    [
        (BlockStage::Face, differs(&used.mesh, &now.mesh)),
        (BlockStage::Align, differs(&used.page, &now.page)),
        (BlockStage::Boxes, differs(&used.labels, &now.labels)),
    ]
    .into_iter()
    .find_map(|(first, differs)| (differs && first < stage).then_some(first))
}

/// Converts an error of a stage to the failure that is stored. Also returns whether a retry may succeed.
pub(crate) fn as_failure(error: BlockStageError) -> (Failure, bool) {
    match error {
        BlockStageError::Failed {
            failure,
            is_transient,
        } => (failure, is_transient),
        BlockStageError::RerunFrom(stage) => {
            let text = format!("the result of {stage} is not usable");
            (Failure::new(FailureClass::Bug, text), false)
        }
        BlockStageError::Store(error) => (Failure::new(FailureClass::Io, error.to_string()), true),
        BlockStageError::Stopped => {
            let text = "the stage ended although it was not stopped";
            (Failure::new(FailureClass::Bug, text), false)
        }
    }
}
