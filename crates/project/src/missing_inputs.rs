//! Finds out with few lookups whether input files are missing, as after their folder has moved.

use std::time::Duration;

use serde::Serialize;

use crate::error::ProjectResult;
use mocban_catalog::{BlockInputVersions, Catalog, InputVersion, PairSelection};
use mocban_core::domain::{ArtifactRef, PairId, one_line};
use mocban_store::{InputError, Project, stat_input};

/// Largest number of pairs whose files are looked at. They are spread over the project.
const MAX_PAIRS: u64 = 150;
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

/// Looks at the files of some pairs and blocks of a project. `pairs` counts the retired pairs too, because they have ids,
/// but their files are not looked at. Returns `None` if no file is missing, if inputs may be in an object store, or if the
/// disk does not answer in time.
pub async fn find(
    project: &Project,
    catalog: &Catalog,
    pairs: u64,
) -> ProjectResult<Option<MissingInputs>> {
    if project.has_remote_inputs() {
        return Ok(None);
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
    let mut paths = Vec::new();
    for known in known {
        paths.extend(known.mesh.filter(was_read).map(|_| known.mesh_path));
        paths.extend(known.print.filter(was_read).map(|_| known.print_path));
    }
    // The files of pairs that were cut from a block are artifacts.
    paths.retain(|path| ArtifactRef::at_path(path).is_none());
    let blocks = catalog.known_blocks().await?.into_iter().take(MAX_BLOCKS);
    for block in blocks {
        let BlockInputVersions { mesh, page, .. } = block.inputs;
        paths.extend(mesh.filter(was_read).map(|_| block.attributes.mesh_path));
        paths.extend(page.filter(was_read).map(|_| block.attributes.page_path));
    }
    let project = project.clone();
    let look = tokio::task::spawn_blocking(move || among(&project, paths));
    let looked = tokio::time::timeout(MAX_TIME, look).await;
    Ok(looked.ok().and_then(Result::ok).flatten())
}

/// Returns whether a file was there. The pairs and blocks of others failed, which is said elsewhere.
fn was_read(version: &InputVersion) -> bool {
    !version.is_gone()
}

fn among(project: &Project, paths: Vec<String>) -> Option<MissingInputs> {
    let looked_at = paths.len();
    let is_missing = |path: &String| {
        matches!(
            stat_input(&project.input(path)),
            Err(InputError::NotThere(_))
        )
    };
    let mut missing = paths.into_iter().filter(is_missing);
    let first = missing.next()?;
    Some(MissingInputs {
        missing: 1 + missing.count(),
        looked_at,
        first: project.input(&first).path().display().to_string(),
    })
}
