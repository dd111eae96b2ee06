//! The stage `face`: finds the faces of a scan.

use std::num::NonZeroU64;

use super::context::StageContext;
use super::failure::{failed, output};
use super::scan_stream::ScanStream;
use crate::block_stages::{BlockStageError, BlockStageOutput};
use mocban_align::block::{
    BlockError, FaceOutcome, FoundFace, HEIGHT_STEP_MM, Orientation, draw_height_maps, heights_role,
};
use mocban_align::scan_size::short_face;
use mocban_core::domain::{BlockSide, LengthUnit};
use mocban_core::raster::png_grey16;

/// Least longer side of a face, mm, if the user gave the unit. A character has 6 to 30 mm.
const MIN_SIDE_MM: f64 = 60.0;

/// Finds the faces of a scan and writes their heights.
pub(crate) fn face(context: &StageContext<'_>) -> Result<BlockStageOutput, BlockStageError> {
    let scan = &context.inputs.mesh;
    let fail = |error: BlockError| failed(scan, error);
    let mut mesh = ScanStream::open(scan, &context.limits.mesh, context.stop)?;
    let (frame, part) = Orientation::find(&mut mesh, context.inputs.unit).map_err(fail)?;
    let maps =
        draw_height_maps(&mut mesh, (&frame, &part), context.max_map_pixels).map_err(fail)?;
    let losses = mesh.losses();
    drop(mesh);
    for said in losses.sentences() {
        tracing::warn!(block = %context.inputs.name, "{}: {said}", scan.name());
    }
    let mut faces = Vec::new();
    for (side, map) in [BlockSide::Front, BlockSide::Back].into_iter().zip(maps) {
        let Some(stored) = map.face() else {
            continue;
        };
        drop(map);
        let size = [stored.values.width(), stored.values.height()];
        let bytes = png_grey16(&stored.values);
        context.artifacts.write(&heights_role(side), "png", bytes)?;
        faces.push(FoundFace {
            side,
            size_mm: size.map(|pixels| (pixels as f64 * HEIGHT_STEP_MM * 10.0).round() / 10.0),
            heights: stored.header,
        });
    }
    let longest = faces
        .iter()
        .flat_map(|face| face.size_mm)
        .fold(0.0, f64::max);
    if faces.is_empty() {
        return Err(fail(BlockError::no_face()));
    }
    if let Some(unit) = context.inputs.unit
        && longest < MIN_SIDE_MM
    {
        let found = short_face(longest, unit);
        return Err(fail(BlockError::NoFace { found }));
    }
    let unit = |unit: &LengthUnit| unit.mm() == frame.mm;
    output(&FaceOutcome {
        unit: LengthUnit::ALL
            .into_iter()
            .find(unit)
            .unwrap_or(LengthUnit::Mm),
        triangles: frame.triangles,
        missing_vertices: NonZeroU64::new(losses.missing_vertices),
        incomplete_faces: NonZeroU64::new(losses.incomplete_faces),
        faces,
    })
}
