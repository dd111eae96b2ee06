//! The text that `show` prints about one pair.

use super::digits::{
    DEGREES, LENGTH_DIGITS, PIXELS, SCALE, SCORE, fixed, length, significant, unit_name,
};
use super::screen::{Palette, Tone};
use super::table::columns;
use mocban_catalog::{AttemptRecord, MetricRecord, PairAttributes, PairDetail, StageRecord};
use mocban_core::domain::{
    DepthOutcome, FitOutcome, InkHypothesis, JobStatus, LengthUnit, NormalizeOutcome,
    RegisterOutcome, Stage, Verdict, one_line, value_text,
};
use mocban_project::details::{Adjustment, ManualResult};
use mocban_project::input_warnings;
use mocban_results::ManualCorrection;
use mocban_store::Project;
use mocban_system::time_text::{duration, local};

/// One pair, its project and the colours.
pub(crate) struct PairPage<'a> {
    pub(crate) detail: &'a PairDetail,
    pub(crate) project: &'a Project,
    pub(crate) palette: Palette,
}

/// Formats a heading and the rows below it. Returns an empty text if there are no rows.
fn section(
    name: &str,
    rows: impl IntoIterator<Item = Vec<String>>,
    aligns: &str,
    palette: Palette,
) -> String {
    let rows = columns(rows, aligns);
    if rows.is_empty() {
        return rows;
    }
    format!("{}\n{rows}", palette.paint(Tone::Strong, name))
}

impl PairPage<'_> {
    /// Formats the page without manual alignments, verdicts and what the next run would do.
    pub(crate) fn text(&self) -> String {
        [
            self.attributes(),
            self.failure(),
            self.stages(),
            self.metrics(),
            self.files(),
            self.history(),
        ]
        .concat()
    }

    fn attributes(&self) -> String {
        let attributes = &self.detail.results.attributes;
        let mut names = vec![self.palette.paint(Tone::Strong, &attributes.name)];
        names.extend(attributes.character.clone());
        names.extend(attributes.block.clone());
        let unit = attributes.unit.map_or("unit unknown", LengthUnit::name);
        let side = match attributes.scanned_face_down {
            Some(true) => ", scanned face down",
            Some(false) => ", scanned face up",
            None => "",
        };
        let mesh = self.input(&attributes.mesh_path, &format!(" ({unit}{side})"));
        let print = self.input(&attributes.print_path, "");
        let rows = [
            ("pair", names.join("  ")),
            ("state", self.state()),
            ("mesh", mesh),
            ("print", print),
        ];
        let rows = rows.map(|(key, text)| vec![key.to_owned(), text]);
        let meta = attributes.meta.iter();
        let meta = meta.map(|(key, value)| vec![key.clone(), value_text(value).into_owned()]);
        columns(rows.into_iter().chain(meta), "<<")
    }

    fn input(&self, stored: &str, note: &str) -> String {
        let input = self.project.input(stored);
        let missing = if input.exists() {
            String::new()
        } else {
            self.palette.paint(Tone::Bad, "  missing")
        };
        format!("{}{note}{missing}", input.path().display())
    }

    fn state(&self) -> String {
        let results = &self.detail.results;
        let tone = match results.status {
            JobStatus::Done => Tone::Good,
            JobStatus::Quarantined => Tone::Bad,
            JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff => Tone::Warn,
        };
        let status = self.palette.paint(tone, state_name(results.status));
        let word = if results.status == JobStatus::Quarantined {
            "at"
        } else {
            "before"
        };
        let stage = results.next_stage.map(|stage| format!(" {word} {stage}"));
        let crashes = match self.detail.crashes {
            0 => String::new(),
            crashes => format!(", {crashes} workers died on it"),
        };
        format!("{status}{}{crashes}", stage.unwrap_or_default())
    }

    fn failure(&self) -> String {
        match &self.detail.results.failure {
            Some(failed) => format!(
                "{}  {} ({}, at {}, {})\n",
                self.palette.paint(Tone::Bad, "failed"),
                one_line(&failed.failure.message),
                failed.failure.class,
                failed.stage,
                local(failed.at)
            ),
            None => String::new(),
        }
    }

    fn stages(&self) -> String {
        let attributes = &self.detail.results.attributes;
        let rows = self.detail.results.stages.iter().map(|record| {
            let (stage, took) = (format!("  {}", record.stage), duration(record.ms));
            let numbers = numbers(record, attributes);
            vec![stage, took, record.result_hash.short(), numbers]
        });
        section("stages", rows, "<><<", self.palette)
    }

    fn metrics(&self) -> String {
        let metrics = &self.detail.results.metrics;
        if metrics.is_empty() {
            return String::new();
        }
        let head = metric_head(self.detail.results.attributes.unit);
        let rows = std::iter::once(head).chain(metrics.iter().map(metric_row));
        section("result", rows, "<>>>>>>>>>>>><", self.palette)
    }

    fn files(&self) -> String {
        let stages = self.detail.results.stages.iter();
        let rows = stages
            .flat_map(|record| &record.files)
            .map(|(role, artifact)| {
                let path = self.project.artifact_path(artifact);
                vec![format!("  {role}"), path.display().to_string()]
            });
        section("files", rows, "<<", self.palette)
    }

    fn history(&self) -> String {
        let attempts = self.detail.attempts.iter();
        let rows = attempts.map(|attempt| self.attempt_row(attempt));
        section("history", rows, "<<><", self.palette)
    }

    fn attempt_row(&self, attempt: &AttemptRecord) -> Vec<String> {
        let outcome = match &attempt.failure {
            None => self.palette.paint(Tone::Good, "done"),
            Some(failure) => {
                let class = self.palette.paint(Tone::Bad, failure.class);
                format!("{class}  {}", failure.message)
            }
        };
        vec![
            format!("  {}", local(attempt.at)),
            attempt.stage.to_string(),
            attempt.ms.map_or_else(String::new, duration),
            outcome,
        ]
    }
}

/// Returns the word for a status that `status` uses too.
pub(crate) const fn state_name(status: JobStatus) -> &'static str {
    match status {
        JobStatus::Done => "done",
        JobStatus::Quarantined => "failed",
        JobStatus::Leased => "running",
        JobStatus::Ready | JobStatus::Backoff => "waiting",
    }
}

/// Returns the few numbers of a stage that show whether it succeeded.
fn numbers(record: &StageRecord, attributes: &PairAttributes) -> String {
    let text = match record.stage {
        Stage::Fit => record.parse().map(|fit| {
            fit_numbers(
                &fit,
                &input_warnings::of_fit(&fit, attributes),
                attributes.unit,
            )
        }),
        Stage::Depth => record.parse().map(|depth| {
            let numbers = depth_numbers(&depth, attributes.unit);
            let warning = input_warnings::of_depth(&depth, attributes);
            std::iter::once(numbers)
                .chain(warning)
                .collect::<Vec<_>>()
                .join("; ")
        }),
        Stage::Normalize => record.parse().map(|found| ink_numbers(&found)),
        Stage::Register => record.parse().map(|found| displaced_text(&found)),
    };
    text.unwrap_or_else(|_| "written by another version of this program".to_owned())
}

fn fit_numbers(fit: &FitOutcome, notes: &[String], unit: Option<LengthUnit>) -> String {
    let curvature = match fit.curvature {
        Some(_) => format!(", curvature {}", length(fit.curvature_height, unit)),
        None => String::new(),
    };
    let notes = if notes.is_empty() {
        String::new()
    } else {
        format!("; {}", notes.join("; "))
    };
    let [relief, rms] = [fit.relief, fit.rms].map(|value| length(value, unit));
    let [inliers, side] = [fit.inlier_ratio, fit.side.confidence].map(|share| fixed(share, SCORE));
    format!(
        "relief {relief}, rms {rms}, inliers {inliers}, side confidence {side}{curvature}; {} vertices, {} triangles{notes}",
        fit.vertices, fit.triangles
    )
}

fn depth_numbers(depth: &DepthOutcome, unit: Option<LengthUnit>) -> String {
    let DepthOutcome { width, height, .. } = depth;
    let side = length(depth.scale.mesh_unit_per_px, unit);
    let covered = depth.coverage * 100.0;
    format!("{width} x {height} px, {side} a pixel, {covered:.0} % covered")
}

fn ink_numbers(found: &NormalizeOutcome) -> String {
    let text = |ink: &InkHypothesis| {
        let polarity = ["dark on light", "light on dark"][usize::from(ink.light_on_dark)];
        let threshold = ink.threshold_print;
        format!("print threshold {threshold:.0} of 65535, {polarity}")
    };
    let texts: Vec<String> = found.inks.iter().map(text).collect();
    let turned = found
        .print_orientation
        .map_or_else(String::new, |orientation| {
            format!("; turned upright by its EXIF orientation {orientation}")
        });
    let warning = input_warnings::of_normalize(found);
    let warning = warning.map_or_else(String::new, |warning| format!("; {warning}"));
    format!("{}{turned}{warning}", texts.join("; or "))
}

fn displaced_text(found: &RegisterOutcome) -> String {
    let part = found.displaced.as_ref();
    part.map_or_else(String::new, ToString::to_string)
}

/// Formats a share, such as `1.5 %`.
fn percent(share: f64) -> String {
    format!("{:.1} %", share * 100.0)
}

fn metric_head(unit: Option<LengthUnit>) -> Vec<String> {
    let unit = unit_name(unit);
    let head = format!(
        "  metric,angle °,scale,shift px,threshold {unit},ssim,iou,iou box,dice,no ink,no wood,margin,confidence,verdicts"
    );
    head.split(',').map(ToOwned::to_owned).collect()
}

fn metric_row(record: &MetricRecord) -> Vec<String> {
    let result = &record.outcome;
    let bound = if result.at_bound { " at a limit" } else { "" };
    vec![
        format!("  {}", result.metric),
        fixed(result.angle_deg, DEGREES),
        fixed(result.scale, SCALE),
        result.shift_px.map(|px| fixed(px, PIXELS)).join(", "),
        significant(result.threshold_depth, LENGTH_DIGITS),
        fixed(result.scores.ssim, SCORE),
        fixed(result.scores.iou, SCORE),
        fixed(result.scores.iou_box, SCORE),
        fixed(result.scores.dice, SCORE),
        percent(result.disagreement.missing_ink),
        percent(result.disagreement.missing_wood),
        fixed(result.margin, SCORE),
        result
            .confidence
            .map_or_else(|| "-".to_owned(), |confidence| fixed(confidence, SCORE)),
        format!("{}{bound}", verdicts(record)),
    ]
}

fn verdicts(record: &MetricRecord) -> String {
    let number = |verdict| {
        let equal = record
            .verdicts
            .iter()
            .filter(|read| read.verdict == verdict);
        equal.count()
    };
    let counts = Verdict::ALL.map(|verdict| (number(verdict), verdict));
    let given = counts.iter().filter(|(number, _)| *number > 0);
    let mut parts: Vec<String> = given
        .map(|(number, verdict)| format!("{number} {verdict}"))
        .collect();
    if record.older_verdicts > 0 {
        parts.push(format!("{} for an older result", record.older_verdicts));
    }
    parts.join(", ")
}

/// Formats manual alignments, one line each. Returns an empty text if there are none.
pub(crate) fn manual_text(manual: &[ManualResult], palette: Palette) -> String {
    let rows = manual.iter().map(|one| vec![manual_line(one)]);
    section("manual alignments", rows, "<", palette)
}

/// Returns `  2026-11-22 02:10:00  lan: rotated 5.0°, shifted 12.1 px, scaled 1.000 from ensemble; IoU 0.616, before
/// 0.702`.
fn manual_line(manual: &ManualResult) -> String {
    let made = &manual.stored.made;
    let change = match &manual.adjustment {
        Some(adjustment) => adjustment_text(adjustment, made.iou),
        None if manual.stored.holds => "on an earlier depth map".to_owned(),
        None => "for another mesh or print".to_owned(),
    };
    let note = made.note.as_deref().map(|note| format!(" ({note})"));
    format!(
        "  {}  {}: {change}{}",
        local(manual.stored.at),
        made.reviewer,
        note.unwrap_or_default()
    )
}

fn adjustment_text(adjustment: &Adjustment, iou: f64) -> String {
    let ManualCorrection {
        rotation_deg,
        shift_px: [x, y],
        scale,
        mirrored,
    } = adjustment.by;
    let rotation_deg = fixed(rotation_deg, 1);
    let mirrored = if mirrored { ", mirrored" } else { "" };
    format!(
        "rotated {rotation_deg}\u{b0}, shifted {:.1} px, scaled {scale:.3}{mirrored} from {}; IoU {iou:.3}, before {:.3}",
        x.hypot(y),
        adjustment.from,
        adjustment.from_iou
    )
}

#[cfg(test)]
mod tests;
