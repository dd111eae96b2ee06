//! Aligns one scan with one print, without a project.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use crate::blocking::blocking;
use crate::error::ProjectResult;
use crate::exit::Refusal;
use crate::generated_folder::GeneratedFolder;
use crate::input_paths::in_existing_form;
use crate::location::Location;
use mocban_align::scan_size;
use mocban_align::stages::{AlignedPair, Print, Scan, ScanHints, Settings};
use mocban_core::domain::{Failure, FailureClass, LengthUnit, MetricOutcome};
use mocban_core::{InputLimits, mesh, raster};
use mocban_export::{ALIGNMENT_FILES, alignment_files};
use mocban_store::{Input, InputError, Leftover, open_input, read_input};

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
    Ok(blocking(work).await??)
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
        (Ok(scan), Ok(read)) => (scan, read.print),
        (Err(failure), _) | (_, Err(failure)) => return Ok(FileAlignment::Refused(failure)),
    };
    let named = |failure: AlignFailure| {
        let path = if failure.is_of_print {
            &files.print
        } else {
            &files.mesh
        };
        let text = format!("{}: {}", path.display(), failure.message);
        FileAlignment::Refused(Failure::new(failure.class, text))
    };
    if let Some(failure) = wrong_unit(&scan, files.hints.unit) {
        return Ok(named(failure));
    }
    Ok(match align_pair(&scan, &print, files.hints, settings) {
        Ok(pair) => FileAlignment::Aligned {
            pair: Box::new(pair),
            print: Box::new(print),
        },
        Err(failure) => named(failure),
    })
}

/// Why a pair in memory is not aligned. The message does not name the scan or the print.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlignFailure {
    /// What the failure means for the pair.
    pub class: FailureClass,
    /// Lower-case fragment with the values.
    pub message: String,
    /// Whether the print is the likelier cause.
    pub is_of_print: bool,
}

/// Returns why the unit of a scan must be wrong, or `None` if it may be right.
pub fn wrong_unit(scan: &Scan, unit: Option<LengthUnit>) -> Option<AlignFailure> {
    unit?;
    let length = scan_size::length_of(&scan.mesh().vertices);
    scan_size::wrong_unit(length, unit).map(|message| AlignFailure {
        class: FailureClass::BadInput,
        message,
        is_of_print: false,
    })
}

/// Runs the four stages on a pair in memory.
///
/// # Errors
/// Returns the failure of the first stage that finds no result.
pub fn align_pair(
    scan: &Scan,
    print: &Print,
    hints: ScanHints,
    settings: &Settings,
) -> Result<AlignedPair, AlignFailure> {
    AlignedPair::with_hints(scan, print, hints, settings).map_err(|error| {
        let length = scan_size::length_of(&scan.mesh().vertices);
        let advice = scan_size::advice_for(&error, length, hints.unit);
        AlignFailure {
            class: error.class(),
            message: format!("{error}{advice}"),
            is_of_print: error.is_of_print(),
        }
    })
}

/// Reads a mesh. The inner error is that of its content.
pub fn read_scan(path: &Path, limits: &InputLimits) -> Result<Result<Scan, Failure>, Refusal> {
    let input = Input::file(in_existing_form(path));
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

/// A print and what its file says about it.
#[derive(Debug)]
pub struct ReadPrint {
    /// The print.
    pub print: Print,
    /// Pixels per inch of the upright image, from left to right and from top to bottom.
    pub dpi: Option<[f64; 2]>,
}

/// Reads a print. The inner error is that of its content.
pub fn read_print(
    path: &Path,
    limits: &InputLimits,
) -> Result<Result<ReadPrint, Failure>, Refusal> {
    let input = Input::file(in_existing_form(path));
    let read = read_input(&input, limits.image.max_bytes, "limits.image.max_bytes");
    let file = read.map_err(|error| unreadable(&error))?;
    let decoded = raster::decode(&file.bytes, &limits.image);
    let read = |image: raster::PrintImage| ReadPrint {
        print: image.into(),
        dpi: raster::stated_dpi(&file.bytes),
    };
    Ok(decoded
        .map(read)
        .map_err(|error| Failure::new(error.class(), format!("{}: {error}", path.display()))))
}

fn unreadable(error: &InputError) -> Refusal {
    Refusal::Usage(error.to_string())
}

impl FileAlignment {
    /// Returns the result as `align --json` prints it.
    pub fn to_json(&self) -> Value {
        match self {
            Self::Aligned { pair, print } => aligned_json(pair, print),
            Self::Refused(failure) => json!({
                "schema": 1,
                "status": "refused",
                "refusal": {"code": failure.class, "message": failure.message},
            }),
        }
    }
}

/// Returns what may be wrong with the files of an aligned pair, one sentence each.
pub fn warnings(pair: &AlignedPair, print: &Print) -> Vec<String> {
    let lost = pair.fit.losses().sentences().into_iter();
    let lost = lost.map(|text| format!("mesh: {text}"));
    let profile = print.image().profile_warning();
    let profile = profile.map(|warning| format!("print: {warning}"));
    let said = scan_size::contradictions(&pair.fit, pair.hints).into_iter();
    let length = scan_size::length_of_map(&pair.depth);
    let said = said.chain(scan_size::doubtful_surface(length, pair.hints.unit));
    let said = said.map(|text| format!("mesh: {text}"));
    let displaced = pair.registered.outcome.displaced;
    let displaced = displaced.map(|part| format!("print: {part}"));
    lost.chain(said).chain(profile).chain(displaced).collect()
}

/// Returns the result of an aligned pair as `align --json` prints it.
pub fn aligned_json(pair: &AlignedPair, print: &Print) -> Value {
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
        "displaced": pair.registered.outcome.displaced,
        "warnings": warnings(pair, print),
    })
}

/// The file with the numbers.
const NUMBERS: &str = "alignment.json";

/// Returns the folder for the files of an alignment.
///
/// # Errors
/// Returns an error if it holds anything else.
pub fn alignment_folder(dir: &Path) -> ProjectResult<GeneratedFolder<'_>> {
    let folder = GeneratedFolder {
        dir,
        content: "alignment",
        marker: (NUMBERS, "\"print_from_mesh\""),
        keeps_changes: true,
    };
    let names = ALIGNMENT_FILES.iter().chain([&NUMBERS]);
    folder.refuse_foreign(&names.map(Path::new).collect::<Vec<_>>())?;
    Ok(folder)
}

/// Writes the pictures and the numbers of an alignment. Returns an earlier folder that could not be removed.
///
/// # Errors
/// Returns an error like [`alignment_folder`], or if the folder cannot be replaced, which leaves it as it was.
pub fn write_alignment(dir: &Path, pair: &AlignedPair, print: &Print) -> ProjectResult<Leftover> {
    let folder = alignment_folder(dir)?;
    let mut files = alignment_files(pair, print).to_vec();
    files.push((
        NUMBERS,
        format!("{:#}\n", aligned_json(pair, print)).into_bytes(),
    ));
    folder.write(&files)
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
