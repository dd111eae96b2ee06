//! Aligns one scan with one print, without a project.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use crate::error::{ProjectResult, TaskStopped};
use crate::exit::Refusal;
use crate::location::Location;
use mocban_align::scan_size;
use mocban_align::stages::{AlignedPair, Print, Scan, ScanHints, Settings, StageError};
use mocban_core::domain::{Failure, FailureClass, MetricOutcome};
use mocban_core::{InputLimits, mesh, raster};
use mocban_store::{Input, InputError, open_input, read_input};

/// One scan and one print.
#[derive(Debug, Clone)]
pub struct AlignInput {
    /// The mesh.
    pub mesh: PathBuf,
    /// The image of the print.
    pub print: PathBuf,
    /// What is known of the scan.
    pub hints: ScanHints,
}

/// The result of an alignment.
#[derive(Debug)]
pub enum FileAlignment {
    /// The pair is aligned.
    Aligned {
        /// The results of the stages.
        pair: Box<AlignedPair>,
        /// The print.
        print: Box<Print>,
    },
    /// The pair is refused. The message names the file and the reason.
    Refused(Failure),
}

/// Aligns a pair with the settings of a location, whose folder need not be a project. The result is that of a project
/// with this pair.
///
/// # Errors
/// Returns an error if a file cannot be read.
pub async fn align(input: AlignInput, location: &Location) -> ProjectResult<FileAlignment> {
    let config = location.settings()?.config;
    let work = move || align_files(&input, &config.stages, &config.limits);
    Ok(tokio::task::spawn_blocking(work)
        .await
        .map_err(TaskStopped)??)
}

fn align_files(
    files: &AlignInput,
    settings: &Settings,
    limits: &InputLimits,
) -> Result<FileAlignment, Refusal> {
    let (scan, print) = match (
        read_scan(&files.mesh, limits)?,
        read_print(&files.print, limits)?,
    ) {
        (Ok(scan), Ok(print)) => (scan, print),
        (Err(failure), _) | (_, Err(failure)) => return Ok(FileAlignment::Refused(failure)),
    };
    let length = scan_size::length_of(&scan.mesh().vertices);
    if let Some(reason) = scan_size::wrong_unit(length, files.hints.unit) {
        let text = format!("{}: {reason}", files.mesh.display());
        return Ok(FileAlignment::Refused(Failure::new(
            FailureClass::BadInput,
            text,
        )));
    }
    Ok(
        match AlignedPair::with_hints(&scan, &print, files.hints, settings) {
            Ok(pair) => FileAlignment::Aligned {
                pair: Box::new(pair),
                print: Box::new(print),
            },
            Err(error) => FileAlignment::Refused(refusal(&error, files, length)),
        },
    )
}

fn refusal(error: &StageError, files: &AlignInput, length: f64) -> Failure {
    let path = if error.is_of_print() {
        &files.print
    } else {
        &files.mesh
    };
    let advice = scan_size::advice_for(error, length, files.hints.unit);
    Failure::new(
        error.class(),
        format!("{}: {error}{advice}", path.display()),
    )
}

/// Reads a mesh. The inner error is that of its content.
fn read_scan(path: &Path, limits: &InputLimits) -> Result<Result<Scan, Failure>, Refusal> {
    let input = Input::file(path.to_owned());
    let opened = open_input(&input, limits.mesh.max_bytes, "limits.mesh.max_bytes");
    let mut file = opened.map_err(|error| unreadable(&error))?;
    let (size, name) = (file.size(), path.to_string_lossy());
    match mesh::read_from(&mut file, size, &name, &limits.mesh) {
        Ok(mesh) => Ok(Ok(mesh.into())),
        Err(mesh::MeshReadError::Io(error)) => Err(unreadable(&file.error(error))),
        Err(mesh::MeshReadError::Mesh(error)) => {
            Ok(Err(Failure::new(error.class(), format!("{name}: {error}"))))
        }
    }
}

/// Reads a print. The inner error is that of its content.
fn read_print(path: &Path, limits: &InputLimits) -> Result<Result<Print, Failure>, Refusal> {
    let input = Input::file(path.to_owned());
    let read = read_input(&input, limits.image.max_bytes, "limits.image.max_bytes");
    let file = read.map_err(|error| unreadable(&error))?;
    let decoded = raster::decode(&file.bytes, &limits.image);
    Ok(decoded
        .map(Print::from)
        .map_err(|error| Failure::new(error.class(), format!("{}: {error}", path.display()))))
}

fn unreadable(error: &InputError) -> Refusal {
    Refusal::Usage(error.to_string())
}

impl FileAlignment {
    /// Returns the result as `align --json` prints it.
    pub fn to_json(&self) -> Value {
        match self {
            Self::Aligned { pair, .. } => aligned_json(pair),
            Self::Refused(failure) => json!({
                "schema": 1,
                "status": "refused",
                "refusal": {"code": failure.class, "message": failure.message},
            }),
        }
    }
}

fn aligned_json(pair: &AlignedPair) -> Value {
    let first = pair.first_metric();
    let result = |metric: &MetricOutcome| {
        let scores = &metric.scores;
        json!({
            "threshold_depth": metric.threshold_depth,
            "ssim": scores.ssim,
            "nl_ssim": scores.nl_ssim,
            "iou": scores.iou,
            "iou_box": scores.iou_box,
            "dice": scores.dice,
            "confidence": metric.confidence,
        })
    };
    let results: Map<String, Value> = pair
        .metrics()
        .iter()
        .map(|metric| (metric.metric.name().to_owned(), result(metric)))
        .collect();
    json!({
        "schema": 1,
        "status": "aligned",
        "refusal": null,
        "confidence": first.confidence,
        "rotation_deg": first.angle_deg,
        "scale": first.scale,
        "shift_px": first.shift_px,
        "mirrored": false,
        "side": side(pair),
        "print_from_mesh": pair.print_from_mesh(first),
        "results": results,
    })
}

/// Returns the direction of the mesh towards which the carved face points: the nearest of its axes, such as `+z`.
pub fn side(pair: &AlignedPair) -> String {
    let normal = pair.fit.plane_from_mesh.0[2];
    let axis = (0..3).fold(0, |best, axis| {
        if normal[axis].abs() > normal[best].abs() {
            axis
        } else {
            best
        }
    });
    let sign = if normal[axis] < 0.0 { '-' } else { '+' };
    format!("{sign}{}", ["x", "y", "z"][axis])
}
