//! A pair of a project: its import, its numbers, and its alignment from the stored files.

use std::path::PathBuf;

use serde_json::json;

use crate::state::NeededParts;
use mocban_align::stages::normalize::PrintMasks;
use mocban_align::stages::{AlignedPair, Print, ScanHints};
use mocban_catalog::{Catalog, PairDetail, PairResults};
use mocban_core::InputLimits;
use mocban_core::domain::artifact_role::stroke_map;
use mocban_core::domain::{JobStatus, NormalizeOutcome, RegisterOutcome, Stage};
use mocban_export::SourcePrint;
use mocban_project::events::Listener;
use mocban_project::import_pairs::{AllowedChanges, PairImport, PairSource, import_pairs};
use mocban_project::location::Location;
use mocban_project::pair_choices::PairChoices;
use mocban_project::{ProjectError, ProjectResult, Refusal, selection};
use mocban_results::pair_artifacts::{PairArtifacts, PairArtifactsError};
use mocban_store::Project;

/// Reads everything about a pair.
pub(crate) async fn detail(id: &str, location: &Location) -> ProjectResult<PairDetail> {
    let (_project, catalog) = location.open_read_only().await?;
    let detail = read(&catalog, id).await;
    catalog.close().await;
    detail
}

/// Imports rows in JSON Lines. Returns what changed, in JSON.
pub(crate) async fn import(
    file: PathBuf,
    rows: Vec<u8>,
    allowed: AllowedChanges,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<String> {
    let import = PairImport {
        source: PairSource::List {
            file,
            bytes: Some(rows),
        },
        truth: None,
        allowed,
        choices: PairChoices::default(),
    };
    let outcome = import_pairs(import, location, listener).await?;
    let summary = outcome.summary;
    let changed = summary.changed.iter().map(|pair| pair.name.to_string());
    let counts = json!({
        "added": summary.added,
        "changed": changed.collect::<Vec<_>>(),
        "unchanged": summary.unchanged,
        "retired": summary.retired,
        "restored": summary.restored,
        "still_retired": summary.still_retired,
        "missing_files": outcome.missing.lines,
        "warnings": outcome.warnings,
    });
    Ok(counts.to_string())
}

async fn read(catalog: &Catalog, id: &str) -> ProjectResult<PairDetail> {
    let name = selection::pair(catalog, id).await?;
    let detail = catalog.pair(&name).await?;
    let gone = || ProjectError::unexpected(format!("pair {id} was removed while it was read"));
    detail.ok_or_else(gone)
}

/// Reads the alignment of a finished pair, and the print that was aligned.
pub(crate) async fn alignment(
    id: &str,
    location: &Location,
) -> ProjectResult<(AlignedPair, Print)> {
    let limits = location.settings()?.config.limits;
    let (project, catalog) = location.open_read_only().await?;
    let detail = read(&catalog, id).await;
    catalog.close().await;
    let results = detail?.results;
    if results.status != JobStatus::Done {
        let why = match &results.failure {
            Some(failed) => format!("it failed: {}", failed.failure.message),
            None => "run it".to_owned(),
        };
        let text = format!("pair {id} has no alignment: {why}");
        return Err(Refusal::NothingSelected(text).into());
    }
    assembled(&project, &results, limits)
}

fn assembled(
    project: &Project,
    results: &PairResults,
    limits: InputLimits,
) -> ProjectResult<(AlignedPair, Print)> {
    let unreadable = |error: PairArtifactsError| {
        Refusal::Damaged(format!("pair {}: {error}", results.attributes.name))
    };
    let print = SourcePrint::read(project, results, &limits.image)
        .map_err(|error| Refusal::Damaged(format!("pair {}: {error}", results.attributes.name)))?;
    let artifacts = PairArtifacts::new(project, results);
    let normalize: NormalizeOutcome = artifacts.outcome(Stage::Normalize).map_err(unreadable)?;
    let register: RegisterOutcome = artifacts.outcome(Stage::Register).map_err(unreadable)?;
    let (used, known) = (register.ink, normalize.inks.len());
    let unknown_ink = || {
        let name = &results.attributes.name;
        let text = format!(
            "pair {name}: its result uses interpretation {used} of the print, but only {known} are stored; run it again"
        );
        Refusal::Damaged(text)
    };
    if used >= known {
        return Err(unknown_ink().into());
    }
    let masks = PrintMasks::from_grey(
        &artifacts.print_grey().map_err(unreadable)?,
        normalize.mask_scale(),
    );
    // All metrics have maps, or none. A map belongs to the metric at its place.
    let maps = register.metrics.iter().map_while(|metric| {
        let role = stroke_map(metric.metric);
        artifacts.artifact(Stage::Register, &role).ok()?;
        Some(artifacts.grey(Stage::Register, &role))
    });
    let stroke_maps = maps.collect::<Result<Vec<_>, _>>().map_err(unreadable)?;
    let parts = NeededParts {
        hints: ScanHints {
            unit: results.attributes.unit,
            scanned_face_down: results.attributes.scanned_face_down,
        },
        fit: artifacts.outcome(Stage::Fit).map_err(unreadable)?,
        depth: artifacts.depth().map_err(unreadable)?,
        normalize,
        masks,
        register,
        stroke_maps,
    };
    let pair = parts.into_pair().ok_or_else(unknown_ink)?;
    Ok((pair, print.picture.into()))
}
