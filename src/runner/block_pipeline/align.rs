//! The stage `align`: finds the map from a face to the page, or refuses.

use super::context::StageContext;
use super::failure::{failed, output};
use super::held::HeldInputs;
use crate::block::{self, AlignOutcome, BlockError, CarvedFace, StoredPageMap};
use crate::domain::BlockSide;
use crate::runner::block_stages::{BlockStageError, BlockStageOutput};

/// Aligns the page with the faces of the block.
pub(super) fn align(
    context: &StageContext<'_>,
    held: &HeldInputs,
) -> Result<BlockStageOutput, BlockStageError> {
    let inputs = context.inputs;
    let page = held.page(context)?;
    let faces = held.faces(context)?;
    let (sides, faces): (Vec<BlockSide>, Vec<&CarvedFace>) = (faces.iter())
        .filter(|(side, _)| inputs.side.is_none_or(|wanted| wanted == *side))
        .map(|(side, face)| (*side, face))
        .unzip();
    if let (Some(side), true) = (inputs.side, faces.is_empty()) {
        let found = format!("its {side} has no large flat part");
        return Err(failed(&inputs.mesh, BlockError::NoFace { found }));
    }
    let found = block::align(&faces, &page.ink).map_err(|error| failed(&inputs.page, error))?;
    output(&AlignOutcome {
        side: sides[found.side],
        page_size: page.ink.size(),
        px_per_mm: found.map.scale(),
        angle_deg: found.map.angle_rad().to_degrees(),
        agreement: found.agreement,
        support: found.support,
        page_from_face: StoredPageMap::from(&found.map),
    })
}
