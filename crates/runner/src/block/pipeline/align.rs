//! The stage `align`: finds the map from a face to the page, or refuses.

use super::context::StageContext;
use super::failure::{failed, output};
use super::stage_cache::{HeldFaces, HeldInputs, log_warning};
use crate::block_stages::{BlockStageError, BlockStageOutput};
use mocban_align::block::{
    self, AlignOutcome, BlockError, CarvedFace, PageAlignment, PageInk, StoredPageMap,
};
use mocban_core::domain::{BlockSide, ControlPoints, FailureClass};

/// Aligns the page with a face of the block: from the control points, if there are some, or else by a search.
pub(crate) fn align(
    context: &StageContext<'_>,
    held: &HeldInputs,
) -> Result<BlockStageOutput, BlockStageError> {
    let page = held.page(context)?;
    let faces = held.faces(context)?;
    let found = match &context.inputs.control_points {
        Some(points) => {
            from_points(context, &faces, &page.ink, points).map(|found| (points.side, found))
        }
        None => by_search(context, &faces, &page.ink),
    };
    let (side, found) = found.inspect_err(|_| log_warning(&context.inputs.page, &page.image))?;
    output(&AlignOutcome {
        side,
        warnings: page.image.profile_warning().into_iter().collect(),
        page_size: page.ink.size(),
        px_per_mm: found.map.scale(),
        angle_deg: found.map.angle_rad().to_degrees(),
        agreement: found.agreement,
        support: found.support,
        page_from_face: StoredPageMap::from(&found.map),
    })
}

/// Searches the position of the page on the side that the user gave, or on every side.
fn by_search(
    context: &StageContext<'_>,
    faces: &HeldFaces,
    page: &PageInk,
) -> Result<(BlockSide, PageAlignment), BlockStageError> {
    let inputs = context.inputs;
    let (sides, faces): (Vec<BlockSide>, Vec<&CarvedFace>) = (faces.iter())
        .filter(|(side, _)| inputs.side.is_none_or(|wanted| wanted == *side))
        .map(|(side, face)| (*side, face))
        .unzip();
    if let (Some(side), true) = (inputs.side, faces.is_empty()) {
        return Err(no_face(context, side));
    }
    let found = block::align(&faces, page);
    let (side, found) = found.map_err(|error| failed(&inputs.page, error))?;
    Ok((sides[side], found))
}

/// Aligns the page from control points.
fn from_points(
    context: &StageContext<'_>,
    faces: &HeldFaces,
    page: &PageInk,
    points: &ControlPoints,
) -> Result<PageAlignment, BlockStageError> {
    let face = faces.iter().find(|(side, _)| *side == points.side);
    let (_, face) = face.ok_or_else(|| no_face(context, points.side))?;
    let found = block::align_at(face, page, &points.points);
    let file = &context.inputs.page;
    found.map_err(|error| file.failed(FailureClass::NoSolution, error))
}

fn no_face(context: &StageContext<'_>, side: BlockSide) -> BlockStageError {
    let found = format!("its {side} has no large flat part");
    failed(&context.inputs.mesh, BlockError::NoFace { found })
}
