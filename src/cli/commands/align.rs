//! `align MESH PRINT`: aligns one pair without a project.

use std::path::{Path, PathBuf};

use crate::cli::output::context::Context;
use crate::cli::output::digits::{
    DEGREES, LENGTH_DIGITS, PIXELS, SCORE, fixed, length, significant,
};
use crate::cli::output::table::columns;
use clap::Args;
use mocban_align::stages::{AlignedPair, Print, ScanHints};
use mocban_core::domain::LengthUnit;
use mocban_project::align::{self, AlignInput, FileAlignment, side};
use mocban_project::{ExitCode, ProjectResult};

/// Arguments of `align`.
#[derive(Debug, Args)]
pub(crate) struct AlignArgs {
    /// The scan: OBJ, PLY, STL or XYZ
    pub(crate) mesh: PathBuf,
    /// The image of its print: PNG, JPEG or TIFF
    pub(crate) print: PathBuf,
    /// Write depth map, masks, overlay and alignment.json to this directory; files that this command wrote there
    /// earlier are replaced
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Unit of the mesh: mm, cm, m or in [default: unknown]
    #[arg(long, value_parser = LengthUnit::named)]
    pub(crate) unit: Option<LengthUnit>,
    /// Whether the carved face points towards -z of the mesh [default: found out]
    #[arg(long, value_name = "BOOL")]
    pub(crate) scanned_face_down: Option<bool>,
}

pub(crate) async fn align(args: AlignArgs, context: &Context) -> ProjectResult<ExitCode> {
    if let Some(dir) = &args.output {
        align::alignment_folder(dir)?;
    }
    let files = AlignInput {
        mesh: args.mesh,
        print: args.print,
        hints: ScanHints {
            unit: args.unit,
            scanned_face_down: args.scanned_face_down,
        },
    };
    let found = align::align(files, &context.location).await?;
    let json = found.to_json();
    let (pair, print) = match &found {
        FileAlignment::Aligned { pair, print } => (pair, print),
        FileAlignment::Refused(failure) => {
            context.print_json(&json)?;
            if !context.global.json {
                context.warn(&format!("not aligned: {failure}"));
                if let Some(dir) = &args.output {
                    context.warn(&format!("nothing was written to {}", dir.display()));
                }
            }
            return Ok(ExitCode::SomeFailed);
        }
    };
    for warning in align::warnings(pair, print) {
        context.warn(&warning);
    }
    if let Some(dir) = &args.output {
        write_files(dir, pair, print, context)?;
    }
    context.print(&json, || text(pair))?;
    Ok(ExitCode::Done)
}

fn write_files(
    dir: &Path,
    pair: &AlignedPair,
    print: &Print,
    context: &Context,
) -> ProjectResult<()> {
    if let Some((path, error)) = align::write_alignment(dir, pair, print)? {
        let path = path.display();
        context.warn(&format!(
            "the earlier files were replaced but could not be removed from {path}: {error}"
        ));
    }
    context.info(&format!("the files are in {}", dir.display()));
    Ok(())
}

/// Returns what was found in five lines.
fn text(pair: &AlignedPair) -> String {
    let metric = pair.first_metric();
    let shift = metric.shift_px.map(|px| fixed(px, PIXELS)).join(", ");
    let confidence = match metric.confidence {
        Some(confidence) if metric.is_low_confidence() => {
            format!("{}: look at it before you use it", fixed(confidence, SCORE))
        }
        Some(confidence) => fixed(confidence, SCORE),
        None => "not known under this method".to_owned(),
    };
    let map = pair.print_from_mesh(metric);
    let unit = pair.hints.unit;
    let rows = [
        ("confidence", confidence),
        (
            "pose",
            format!(
                "turned by {}\u{b0}, shifted by {shift} px, {}",
                fixed(metric.angle_deg, DEGREES),
                scale_text(pixels_per_unit(&map.0), unit)
            ),
        ),
        ("carved side", format!("towards {} of the mesh", side(pair))),
        (
            "threshold",
            format!(
                "{} at {} below the fitted surface",
                metric.metric,
                length(-metric.threshold_depth, unit)
            ),
        ),
        (
            "agreement",
            format!(
                "SSIM {}, IoU {}, Dice {}",
                fixed(metric.scores.ssim, SCORE),
                fixed(metric.scores.iou, SCORE),
                fixed(metric.scores.dice, SCORE)
            ),
        ),
    ];
    columns(rows.map(|(name, value)| vec![name.to_owned(), value]), "<<")
}

/// Formats a number of pixels per unit of the mesh: `20.5 px per mm`.
fn scale_text(scale: f64, unit: Option<LengthUnit>) -> String {
    let unit = unit.map_or("unit of the mesh", LengthUnit::name);
    format!("{} px per {unit}", significant(scale, LENGTH_DIGITS))
}

/// Returns how many pixels of the print a unit of the mesh is long on it.
fn pixels_per_unit(map: &[[f64; 4]; 3]) -> f64 {
    let length = |row: &[f64; 4]| {
        row[..3]
            .iter()
            .map(|value| value * value)
            .sum::<f64>()
            .sqrt()
    };
    f64::midpoint(length(&map[0]), length(&map[1]))
}

#[cfg(test)]
mod tests {
    use super::{LengthUnit, length, scale_text};

    #[test]
    fn lengths_and_scales_have_their_unit() {
        for (unit, threshold, scale) in [
            (Some(LengthUnit::M), "0.000412 m", "20512 px per m"),
            (Some(LengthUnit::In), "0.0162 in", "521 px per in"),
            (None, "0.412 mesh units", "20.5 px per unit of the mesh"),
        ] {
            let mm = unit.map_or(1.0, LengthUnit::mm);
            assert_eq!(length(0.412 / mm, unit), threshold);
            assert_eq!(scale_text(20.512 * mm, unit), scale);
        }
    }
}
