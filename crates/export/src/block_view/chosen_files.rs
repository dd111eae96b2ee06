//! Whether a block still has the files on which control points were chosen.

use std::path::PathBuf;

use super::block_error::BlockViewError;
use super::registered_face::{stored_block, unusable};
use mocban_catalog::{BlockDetail, Catalog};
use mocban_core::domain::{BlockName, BlockStage, ContentHash, ControlPoints};
use mocban_store::{Project, hash_input};

/// Returns the file of a block that is another one than the file on which points were chosen, if there is one. A file that
/// cannot be read here counts as the same, because the scan may be on another computer.
pub async fn replaced_file(
    catalog: &Catalog,
    project: &Project,
    block: &BlockName,
    points: &ControlPoints,
) -> Result<Option<PathBuf>, BlockViewError> {
    let detail = stored_block(catalog, block).await?;
    let (project, chosen) = (project.clone(), [points.mesh, points.page]);
    tokio::task::spawn_blocking(move || compare(&project, &detail, chosen)).await?
}

fn compare(
    project: &Project,
    detail: &BlockDetail,
    [mesh, page]: [ContentHash; 2],
) -> Result<Option<PathBuf>, BlockViewError> {
    let attributes = &detail.state.attributes;
    let mut faces = detail.stages.iter();
    let faces = faces.find(|one| one.stage == BlockStage::Face);
    let scanned: Option<ContentHash> = faces
        .map(|stored| serde_json::from_value(stored.provenance["mesh"].clone()))
        .transpose()
        .map_err(|why| unusable(BlockStage::Face, &why.to_string()))?;
    // A run may have found the faces of another scan meanwhile.
    if scanned != Some(mesh) {
        return Ok(Some(project.input_path(&attributes.mesh_path)));
    }
    let mut files = [(&attributes.mesh_path, mesh), (&attributes.page_path, page)].into_iter();
    let replaced = files.find(|(path, chosen)| {
        let now = hash_input(&project.input(path));
        now.is_ok_and(|now| now.hash != *chosen)
    });
    Ok(replaced.map(|(path, _)| project.input_path(path)))
}
