//! A pair aligned by the method of the paper, beside its stored result. It is computed when a page asks for it, and not stored.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::body::Bytes;
use tokio::time::timeout;

use super::encoded_picture::{PICTURE_SIDE, jpeg};
use super::failure::{AppFailure, AppResult};
use super::number_text::grouped;
use super::projects::OpenProject;
use super::sentence::Sentence;
use crate::local_server::WorkThread;
use mocban_align::stages::{AlignmentMethod, Print, Scan, ScanHints, Settings};
use mocban_catalog::PairResults;
use mocban_core::InputLimits;
use mocban_core::domain::{ContentHash, MetricOutcome, ThresholdMetric};
use mocban_core::locked;
use mocban_export::pictures::PrintView;
use mocban_export::{PictureError, SourcePrint, read_mesh};
use mocban_project::align::align_pair;

/// Value of `compare` in the address of the page of a pair that asks for this method.
pub(super) const PAPER: &str = "paper";
/// Most pairs whose results are kept. The oldest is forgotten.
const KEPT: usize = 8;

/// What the method has found for the pairs that were asked for last.
#[derive(Debug, Default)]
pub(super) struct PaperMethod {
    /// Computes one pair at a time.
    work: WorkThread,
    kept: Mutex<Vec<(ContentHash, Arc<PaperOutcome>)>>,
}

/// What the method finds, or why it finds nothing.
pub(super) type PaperOutcome = Result<PaperAlignment, Sentence>;

/// A pair aligned by the method.
#[derive(Debug)]
pub(super) struct PaperAlignment {
    /// Each metric with the print and the edges of the aligned strokes, as JPEG.
    pub(super) metrics: Vec<(MetricOutcome, Bytes)>,
}

impl PaperAlignment {
    /// Returns the result of a metric, or of the default one if the method does not compute it.
    pub(super) fn of(&self, metric: ThresholdMetric) -> Option<&(MetricOutcome, Bytes)> {
        let find = |metric| {
            let mut metrics = self.metrics.iter();
            metrics.find(|(outcome, _)| outcome.metric == metric)
        };
        find(metric).or_else(|| find(ThresholdMetric::DEFAULT))
    }
}

/// Returns whether the results of a pair can be compared with those of the method. Only the default method computes relief.
pub(super) fn is_comparable(pair: &PairResults) -> bool {
    pair.metric(ThresholdMetric::Relief).is_some()
}

impl PaperMethod {
    /// Returns what the method finds for a pair, which is computed if it is not kept.
    pub(super) async fn of(
        &self,
        open: &Arc<OpenProject>,
        pair: &PairResults,
    ) -> AppResult<Arc<PaperOutcome>> {
        let stored = pair.metric(ThresholdMetric::Relief);
        let stored = stored.ok_or_else(|| AppFailure::refused(not_comparable()))?;
        let config = open.settings()?.config;
        let (mut stages, limits) = (config.stages, config.limits);
        stages.pipeline.method = AlignmentMethod::Paper;
        let text =
            serde_json::to_string(&stages).map_err(|error| AppFailure::of(error, &open.dir))?;
        let [project, name] = [open.key.as_str(), pair.attributes.name.as_str()];
        let key = format!("{project}\0{name}\0{}\0{text}", stored.result_hash.to_hex());
        let key = ContentHash::of(key.as_bytes());
        let known = locked(&self.kept)
            .iter()
            .find(|(known, _)| *known == key)
            .cloned();
        if let Some((_, known)) = known {
            return Ok(known);
        }
        let (own, pair) = (Arc::clone(open), pair.clone());
        let computed = self
            .work
            .call(move || compute(&own, &pair, &stages, &limits));
        let longest = Duration::from_secs(config.run.stage_timeout_s);
        // The work ends when nobody waits for it any more.
        let computed = timeout(longest, computed).await;
        let computed = computed.map_err(|_elapsed| AppFailure::refused(too_long(longest)))??;
        let computed = computed.map_err(|error| AppFailure::of(error, &open.dir))?;
        let computed = Arc::new(computed);
        let mut kept = locked(&self.kept);
        kept.retain(|(known, _)| *known != key);
        if kept.len() >= KEPT {
            kept.remove(0);
        }
        kept.push((key, Arc::clone(&computed)));
        Ok(computed)
    }
}

/// Aligns a pair from its files, as a project with these settings does, and draws the results.
///
/// # Errors
/// Returns an error if a file cannot be read, or has changed since it was aligned.
fn compute(
    open: &OpenProject,
    pair: &PairResults,
    settings: &Settings,
    limits: &InputLimits,
) -> Result<PaperOutcome, PictureError> {
    let source = SourcePrint::read(&open.project, pair, &limits.image)?;
    let scan = Scan::from(read_mesh(&open.project, pair, &limits.mesh)?);
    let print = Print::from(source.picture);
    let hints = ScanHints {
        unit: pair.attributes.unit,
        scanned_face_down: pair.attributes.scanned_face_down,
    };
    let aligned = match align_pair(&scan, &print, hints, settings) {
        Ok(aligned) => aligned,
        Err(failure) => return Ok(Err(Sentence::of_program(&failure.message))),
    };
    let view = PrintView::of_side(print.image(), PICTURE_SIDE);
    let displaced = aligned.registered.outcome.displaced.as_ref();
    let drawn = aligned.metrics().iter().map(|outcome| {
        let overlay = view.overlay(print.image(), &aligned.depth, outcome, displaced);
        let (_, bytes) = jpeg(&overlay);
        (*outcome, Bytes::from(bytes))
    });
    Ok(Ok(PaperAlignment {
        metrics: drawn.collect(),
    }))
}

fn too_long(longest: Duration) -> Sentence {
    let seconds = grouped(longest.as_secs());
    Sentence::new(
        format!(
            "the paper's method was stopped after {seconds} s, the longest time of a stage; choose a longer one on the page Settings"
        ),
        format!(
            "phương pháp của bài báo đã bị dừng sau {seconds} giây, thời gian dài nhất của một bước; hãy chọn thời gian dài hơn ở trang Thiết lập"
        ),
    )
}

fn not_comparable() -> Sentence {
    Sentence::new(
        "this pair has no result of the default method with which the paper's method could be compared: press Align on the page Run, or choose the default method on the page Settings first",
        "cặp này chưa có kết quả của phương pháp mặc định để so sánh với phương pháp của bài báo: hãy bấm Căn chỉnh ở trang Căn chỉnh, hoặc trước hết chọn phương pháp mặc định ở trang Thiết lập",
    )
}
