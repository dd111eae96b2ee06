//! The stage `cut`: writes the mesh and the print of each character.

use std::io;

use rayon::prelude::*;
use serde_json::{Value, json};

use super::context::StageContext;
use super::failure::{failed, output};
use super::scan_stream::ScanStream;
use super::stage_cache::HeldInputs;
use crate::block_stages::{BlockStageError, BlockStageOutput, CharacterOutput, CutFiles};
use mocban_align::block::{
    AlignOutcome, BlockError, BoxesOutcome, CUT_MARGIN_MM, CharacterMap, CutError, CutOutcome,
    CutPlan, FaceOutcome, PageMap, PlacedCharacter, PrintCrop, cut_meshes, cut_print,
    reading_turns,
};
use mocban_core::domain::cancel::{ThreadToken, poll};
use mocban_core::domain::{AlignmentPrior, ArtifactRef, BlockStage, FailureClass};
use mocban_core::mesh::write::MeshFormat;
use mocban_core::raster::png_rgb8;

/// Meshes with fewer triangles show no character.
const MIN_TRIANGLES: usize = 200;
/// The face looks up or down if its normal has at least this z.
const MIN_NORMAL_Z: f64 = 0.3;

/// Least confidence of a position that `register` gets as a prior.
const MIN_PRIOR: f64 = 0.5;

/// The print of a character, or why it cannot be cut.
type CutPrint = Result<(ArtifactRef, PrintCrop), String>;

/// Cuts the characters out of the scan and the page.
pub(crate) fn cut(
    context: &StageContext<'_>,
    held: &HeldInputs,
) -> Result<BlockStageOutput, BlockStageError> {
    let page = held.page(context)?;
    let faces = held.faces(context)?;
    let scan: FaceOutcome = context.outcome(BlockStage::Face)?;
    let aligned: AlignOutcome = context.outcome(BlockStage::Align)?;
    let boxes: BoxesOutcome = context.outcome(BlockStage::Boxes)?;
    let face = faces.iter().find(|(side, _)| *side == aligned.side);
    let (_, face) = face.ok_or(BlockStageError::RerunFrom(BlockStage::Face))?;
    let turns = turns_of(&boxes);
    let map = PageMap::try_from(boxes.page_from_face)
        .ok()
        .ok_or(BlockStageError::RerunFrom(BlockStage::Boxes))?;
    let margin_px = CUT_MARGIN_MM * aligned.px_per_mm;
    let token = ThreadToken::current();
    let cut_print_of = |character: &PlacedCharacter| -> Result<CutPrint, BlockStageError> {
        let bounds = character.label.page_box;
        let Some(crop) = cut_print(&page.image, bounds, margin_px, turns) else {
            return Ok(Err("its box lies outside the page".to_owned()));
        };
        let role = format!("{}.png", character.label.name);
        let print = context.artifacts.write(&role, "png", png_rgb8(&crop.rgb))?;
        Ok(Ok((print, crop)))
    };
    let prints: Vec<CutPrint> = (boxes.characters.par_iter())
        .map(|character| token.scope(|| cut_print_of(character)))
        .collect::<Result<_, BlockStageError>>()?;
    let meshes = meshes(
        context,
        &CutPlan::of(face, &boxes.characters),
        &boxes.characters,
    )?;
    let normal_z = face.map.frame.axes[2][2];
    let characters: Vec<CharacterOutput> = (boxes.characters.iter().zip(prints).zip(meshes))
        .map(|((character, print), mesh)| {
            let local = CharacterMap::of(face, &map, character);
            let rounded = CharacterMap::rounded(face, &map, character, aligned.px_per_mm);
            let cut = print.and_then(|(print, crop)| {
                let mesh = mesh?;
                Ok((print, crop, mesh))
            });
            let maps = cut.as_ref().ok().map(|(_, crop, _)| maps(&local, crop));
            CharacterOutput {
                label: character.label.name.clone(),
                character: character.label.text.clone(),
                bounds: character.label.page_box,
                confidence: Some(character.confidence),
                maps,
                cut: cut.map(|(print, crop, mesh)| CutFiles {
                    mesh,
                    print,
                    unit: Some(scan.unit),
                    scanned_face_down: (normal_z.abs() >= MIN_NORMAL_Z).then_some(normal_z < 0.0),
                    prior: (character.confidence >= MIN_PRIOR)
                        .then(|| prior(&rounded, &crop, character.confidence))
                        .flatten(),
                }),
            }
        })
        .collect();
    let count = characters.iter().filter(|c| c.cut.is_ok()).count();
    let outcome = output(&CutOutcome {
        count,
        left: characters.len() - count,
    })?;
    Ok(BlockStageOutput {
        characters,
        ..outcome
    })
}

/// Returns the quarter turns that make the prints upright. Boxes that were found are named by column and row, which gives
/// the reading direction. They keep these names in exported labels; a page whose boxes have other names is shown as it is.
fn turns_of(boxes: &BoxesOutcome) -> u8 {
    let characters = boxes.characters.iter();
    let places = characters.filter_map(|c| Some((c.label.name.parse().ok()?, c.label.page_box)));
    reading_turns(&places.collect::<Vec<_>>())
}

/// Cuts the meshes of the characters and writes them. Returns the file of each, or why there is none.
fn meshes(
    context: &StageContext<'_>,
    plan: &CutPlan<'_>,
    characters: &[PlacedCharacter],
) -> Result<Vec<Result<ArtifactRef, String>>, BlockStageError> {
    let scan = &context.inputs.mesh;
    let mut stream = ScanStream::open(scan, &context.limits.mesh, context.stop)?;
    let spill_failed = |error: io::Error| {
        let text = format!("the temporary file of the cut: {error}");
        BlockStageError::failed(FailureClass::Io, text)
    };
    let mut spill = tempfile::tempfile().map_err(spill_failed)?;
    let mut written = Vec::with_capacity(characters.len());
    let mut failure = None;
    let outcome = cut_meshes(&mut stream, plan, &mut spill, |number, mesh| {
        poll();
        if mesh.triangles.len() < MIN_TRIANGLES {
            written.push(Err("the scan shows no surface at its box".to_owned()));
            return Ok(());
        }
        let role = format!("{}.ply", characters[number].label.name);
        let bytes = MeshFormat::PlyLittleEndian.encode(&mesh);
        match context.artifacts.write(&role, "ply", bytes) {
            Ok(file) => written.push(Ok(file)),
            Err(error) => {
                failure = Some(error);
                return Err(io::Error::other("the mesh of a character was not written"));
            }
        }
        Ok(())
    });
    if let Some(error) = failure {
        return Err(error);
    }
    match outcome {
        Ok(()) => Ok(written),
        Err(CutError::Mesh(error)) => Err(failed(scan, BlockError::Mesh(error))),
        Err(CutError::Spill(error) | CutError::Store(error)) => Err(spill_failed(error)),
    }
}

/// Returns the maps of a character for exports.
fn maps(local: &CharacterMap, crop: &PrintCrop) -> Value {
    let [first, second] = crop.page_from_crop.0;
    json!({
        "page_from_crop": [first, second, [0.0, 0.0, 1.0]],
        "page_from_mesh": local.page_from_mesh,
    })
}

/// Returns the alignment that `register` may expect, as JSON. The confidence is rounded down, so that it seldom changes when other
/// boxes of the page change.
fn prior(rounded: &CharacterMap, crop: &PrintCrop, confidence: f64) -> Option<Value> {
    let prior = AlignmentPrior {
        print_from_mesh: rounded.print_from_mesh(&crop.page_from_crop)?,
        confidence: (confidence * 10.0).floor() / 10.0,
    };
    serde_json::to_value(prior).ok()
}
