//! Pictures of a pair: the print, the relief and the masks in the frame of the print.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use maud::html;

use super::encoded_picture::{Encoded, JPEG, PICTURE_SIDE, jpeg};
use super::failure::{AppFailure, AppResult};
use super::missing_names::no_pair;
use super::projects::OpenProject;
use super::state::AppState;
use mocban_catalog::PairResults;
use mocban_core::InputLimits;
use mocban_core::domain::{Affine2, PairName, ThresholdMetric, enum_names};
use mocban_core::raster::{Mask, png_mask};
use mocban_export::import_pictures::points_from_above;
use mocban_export::pictures::PrintView;
use mocban_export::scan_view::{ScanView, scan_alone};
use mocban_export::{PictureError, SourcePrint};
use mocban_project::file_headers::scan_points;
use mocban_results::pair_artifacts::PairArtifacts;

/// Longer side of a picture on a card, pixels.
const THUMB_SIDE: usize = 180;

/// A picture of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum PairPicture {
    /// The print with the edges of the relief's strokes, small.
    Thumb,
    /// The print.
    Print,
    /// The relief, lit from the upper left.
    Relief,
    /// The ink of the print.
    PrintMask,
    /// The strokes of the relief.
    DepthMask,
    /// The print with the edges of the relief's strokes.
    Overlay,
    /// Points of the scan as a relief, seen from above.
    Scan,
}

enum_names! { pub PairPicture, "a picture":
    Thumb = "thumb", Print = "print", Relief = "relief", PrintMask = "print_mask", DepthMask = "depth_mask", Overlay = "overlay",
    Scan = "scan",
}

/// Responds with a picture of the result of a metric. `name` is that of the picture and of the metric: `overlay-relief`.
pub(super) async fn picture(
    State(state): State<Arc<AppState>>,
    Path((key, pair, name)): Path<(String, String, String)>,
) -> AppResult<Response> {
    let (picture, metric) = name.split_once('-').unwrap_or((&name, ""));
    let picture: PairPicture = picture
        .parse()
        .map_err(|_unknown: String| AppFailure::not_found())?;
    let metric = metric.parse().unwrap_or(ThresholdMetric::DEFAULT);
    let open = state.open(&key).await?;
    let results = results(&open, &pair).await?;
    let shown = results
        .metric(metric)
        .map(|record| record.result_hash.to_hex());
    let cached = shown
        .filter(|_| picture == PairPicture::Thumb)
        .map(|hash| format!("{key}\0{pair}\0{hash}"));
    if let Some(jpeg) = cached.as_ref().and_then(|id| state.thumbs.get(id)) {
        return Ok(([(header::CONTENT_TYPE, JPEG)], jpeg).into_response());
    }
    let limits = open.settings()?.config.limits;
    let drawn = state
        .work
        .call(move || draw(&open, &results, metric, picture, limits))
        .await?;
    if let (Some(id), Some((JPEG, bytes))) = (cached, &drawn) {
        state.thumbs.add(id, bytes.clone().into());
    }
    let (kind, bytes) = drawn.unwrap_or_else(placeholder);
    Ok(([(header::CONTENT_TYPE, kind)], bytes).into_response())
}

/// Responds with the data of the 3D view, which of a pair without a result has only the scan.
pub(super) async fn scan(
    State(state): State<Arc<AppState>>,
    Path((key, pair)): Path<(String, String)>,
) -> AppResult<Response> {
    let open = state.open(&key).await?;
    let results = results(&open, &pair).await?;
    let limits = open.settings()?.config.limits;
    let dir = open.dir.clone();
    let read = move || -> Result<Vec<u8>, PictureError> {
        let metric = results.metric(ThresholdMetric::DEFAULT);
        let metric = metric.or_else(|| results.metrics.first());
        let metric = metric.map(|record| record.outcome.metric);
        let view = metric.map(|metric| ScanView::read(&open.project, &results, metric, limits));
        match view.transpose()?.flatten() {
            Some(view) => Ok(view.to_bytes()),
            None => scan_alone(&open.project, &results, &limits),
        }
    };
    let read = state.work.call(read).await?;
    let bytes = read.map_err(|error| AppFailure::of(error, &dir))?;
    let kind = [(header::CONTENT_TYPE, "application/octet-stream")];
    Ok((kind, bytes).into_response())
}

/// Reads a pair by its name in an address.
pub(super) async fn results(open: &OpenProject, pair: &str) -> AppResult<PairResults> {
    let name: PairName = pair.parse().map_err(|_invalid| no_pair(pair))?;
    let detail = open.catalog.pair(&name).await?;
    Ok(detail.ok_or_else(|| no_pair(pair))?.results)
}

/// Draws a picture. `None` if there is none, because a file cannot be read or the pair has no result yet.
fn draw(
    open: &OpenProject,
    pair: &PairResults,
    metric: ThresholdMetric,
    picture: PairPicture,
    limits: InputLimits,
) -> Option<Encoded> {
    if picture == PairPicture::Scan {
        let path = open.project.input_path(&pair.attributes.mesh_path);
        let points = scan_points(&path, &limits.mesh).ok()?;
        return Some(jpeg(&points_from_above(&points, THUMB_SIDE)?));
    }
    let source = SourcePrint::read(&open.project, pair, &limits.image).ok()?;
    let side = match picture {
        PairPicture::Thumb => THUMB_SIDE,
        _ => PICTURE_SIDE,
    };
    let view = PrintView::of_side(&source.picture, side);
    let print = || Some(jpeg(&view.print(&source.picture)));
    let artifacts = PairArtifacts::new(&open.project, pair);
    let record = pair.metric(metric).map(|record| &record.outcome);
    match (picture, record) {
        (PairPicture::Print, _) | (PairPicture::Thumb | PairPicture::Overlay, None) => print(),
        (PairPicture::PrintMask, _) => {
            let ink = artifacts.print_mask().ok()?;
            Some(mask(&view.mask(&ink, &Affine2::IDENTITY)))
        }
        (PairPicture::Relief, outcome) => {
            let depth = artifacts.depth().ok()?;
            let print = &source.picture.rgb;
            let aligned = outcome.map(|outcome| outcome.print_from_depth);
            let print_from_depth = aligned.unwrap_or_else(|| {
                centred(
                    [depth.levels.width(), depth.levels.height()],
                    [print.width(), print.height()],
                )
            });
            Some(jpeg(&view.relief(&depth, &print_from_depth)))
        }
        (PairPicture::Scan, _) | (_, None) => None,
        (PairPicture::DepthMask, Some(outcome)) => {
            let strokes = artifacts.depth().ok()?.stroke_mask(outcome.threshold_level);
            Some(mask(&view.mask(&strokes, &outcome.print_from_depth)))
        }
        (PairPicture::Thumb | PairPicture::Overlay, Some(outcome)) => {
            let (depth, displaced) = (artifacts.depth().ok()?, artifacts.displaced().ok()?);
            let overlay = view.overlay(&source.picture, &depth, outcome, displaced.as_ref());
            Some(jpeg(&overlay))
        }
    }
}

/// Returns the map from the pixels of a picture to those of another one, in whose centre it is as large as fits. Sizes are
/// widths and heights in pixels.
fn centred(from: [usize; 2], to: [usize; 2]) -> Affine2 {
    let [from, to] = [from, to].map(|size| size.map(|side| side.max(1) as f64));
    let scale = (to[0] / from[0]).min(to[1] / from[1]);
    let shift = [0, 1].map(|axis| (to[axis] - 1.0 - scale * (from[axis] - 1.0)) / 2.0);
    Affine2::scale_shift(scale, shift)
}

fn mask(mask: &Mask) -> Encoded {
    ("image/png", png_mask(&mask.map(|stroke| !stroke)))
}

/// Returns the picture of a pair that has none.
fn placeholder() -> Encoded {
    let drawing = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 180 180" {
            rect width="180" height="180" fill="#8884" {}
            path d="M60 60 L120 120 M120 60 L60 120" stroke="#888" stroke-width="6" {}
        }
    };
    ("image/svg+xml", drawing.into_string().into_bytes())
}

#[cfg(test)]
mod tests {
    use super::centred;

    #[test]
    fn a_picture_is_centred_and_as_large_as_fits() {
        let map = centred([10, 20], [100, 50]);
        for (from, to) in [([4.5, 9.5], [49.5, 24.5]), ([-0.5, -0.5], [37.0, -0.5])] {
            let [x, y] = map.apply(from);
            assert!(
                (x - to[0]).abs() < 1e-9 && (y - to[1]).abs() < 1e-9,
                "{x} {y}"
            );
        }
    }
}
