//! The page that `show` prints of one pair.

use super::output::{Palette, Tone};
use super::table::{Align, columns};
use super::time_text::{span, utc};
use crate::catalog::{AttemptRecord, MetricRecord, PairDetail, StageRecord};
use crate::domain::{DepthOutcome, FitOutcome, JobStatus, NormalizeOutcome, Stage, Verdict};
use crate::store::Project;

/// One pair, its project and the colours.
pub(super) struct Page<'a> {
    pub(super) detail: &'a PairDetail,
    pub(super) project: &'a Project,
    pub(super) palette: Palette,
}

/// A heading on a line of its own.
pub(super) fn heading(word: &str, palette: Palette) -> String {
    format!("{}\n", palette.paint(Tone::Strong, word))
}

impl Page<'_> {
    /// Everything but verdicts and next steps.
    pub(super) fn text(&self) -> String {
        [
            self.facts(),
            self.failure(),
            self.stages(),
            self.metrics(),
            self.files(),
            self.history(),
        ]
        .concat()
    }

    fn facts(&self) -> String {
        let facts = &self.detail.results.facts;
        let mut names = vec![self.palette.paint(Tone::Strong, &facts.name)];
        names.extend(
            [&facts.character, &facts.block]
                .into_iter()
                .flatten()
                .cloned(),
        );
        let unit = facts.unit.map_or("unit unknown", |unit| unit.name());
        let side = match facts.scanned_face_down {
            Some(true) => ", scanned face down",
            Some(false) => ", scanned face up",
            None => "",
        };
        let mut rows = vec![
            ["pair".to_owned(), names.join("  ")],
            ["state".to_owned(), self.state()],
            [
                "mesh".to_owned(),
                format!("{} ({unit}{side})", self.input(&facts.mesh_path)),
            ],
            ["print".to_owned(), self.input(&facts.print_path)],
        ];
        for (key, value) in &facts.meta {
            let text = value
                .as_str()
                .map_or_else(|| value.to_string(), ToOwned::to_owned);
            rows.push([key.clone(), text]);
        }
        let rows: Vec<Vec<String>> = rows.into_iter().map(Vec::from).collect();
        columns(&rows, &[Align::Left; 2])
    }

    fn input(&self, stored: &str) -> String {
        let path = self.project.input_path(stored);
        let missing = if path.exists() {
            String::new()
        } else {
            self.palette.paint(Tone::Bad, "  not there")
        };
        format!("{}{missing}", path.display())
    }

    fn state(&self) -> String {
        let results = &self.detail.results;
        let tone = match results.status {
            JobStatus::Done => Tone::Good,
            JobStatus::Quarantined => Tone::Bad,
            JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff | JobStatus::Held => {
                Tone::Warn
            }
        };
        let status = self.palette.paint(tone, results.status);
        let stage = results.next_stage.map(|stage| format!(" before {stage}"));
        let crashes = match self.detail.crashes {
            0 => String::new(),
            crashes => format!(", {crashes} workers died over it"),
        };
        format!("{status}{}{crashes}", stage.unwrap_or_default())
    }

    fn failure(&self) -> String {
        match &self.detail.results.failure {
            Some(failed) => format!(
                "{}  {} ({}, at {}, {})\n",
                self.palette.paint(Tone::Bad, "failed"),
                failed.failure.message,
                failed.failure.class,
                failed.stage,
                utc(failed.at)
            ),
            None => String::new(),
        }
    }

    fn stages(&self) -> String {
        let records = &self.detail.results.stages;
        if records.is_empty() {
            return String::new();
        }
        let rows: Vec<Vec<String>> = records
            .iter()
            .map(|record| {
                vec![
                    format!("  {}", record.stage),
                    span(record.ms),
                    record.result_hash.short(),
                    numbers(record),
                ]
            })
            .collect();
        let aligns = [Align::Left, Align::Right, Align::Left, Align::Left];
        format!(
            "{}{}",
            heading("stages", self.palette),
            columns(&rows, &aligns)
        )
    }

    fn metrics(&self) -> String {
        let metrics = &self.detail.results.metrics;
        if metrics.is_empty() {
            return String::new();
        }
        let head = "  metric,angle °,scale,shift px,threshold,ssim,iou,iou box,dice,margin,confidence,verdicts";
        let mut rows = vec![head.split(',').map(ToOwned::to_owned).collect()];
        rows.extend(metrics.iter().map(metric_row));
        let mut aligns = [Align::Right; 12];
        aligns[0] = Align::Left;
        aligns[11] = Align::Left;
        format!(
            "{}{}",
            heading("result", self.palette),
            columns(&rows, &aligns)
        )
    }

    fn files(&self) -> String {
        let rows: Vec<Vec<String>> = self
            .detail
            .results
            .stages
            .iter()
            .flat_map(|record| &record.files)
            .map(|(role, artifact)| {
                let path = self.project.artifact_path(artifact);
                vec![format!("  {role}"), path.display().to_string()]
            })
            .collect();
        if rows.is_empty() {
            return String::new();
        }
        format!(
            "{}{}",
            heading("files", self.palette),
            columns(&rows, &[Align::Left; 2])
        )
    }

    fn history(&self) -> String {
        let attempts = &self.detail.attempts;
        if attempts.is_empty() {
            return String::new();
        }
        let rows: Vec<Vec<String>> = attempts
            .iter()
            .map(|attempt| self.attempt_row(attempt))
            .collect();
        let aligns = [Align::Left, Align::Left, Align::Right, Align::Left];
        format!(
            "{}{}",
            heading("history", self.palette),
            columns(&rows, &aligns)
        )
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
            format!("  {}", utc(attempt.at)),
            attempt.stage.to_string(),
            attempt.ms.map_or_else(String::new, span),
            outcome,
        ]
    }
}

/// The few numbers of a stage that tell whether it went well.
fn numbers(record: &StageRecord) -> String {
    let text = match record.stage {
        Stage::Fit => record.parse::<FitOutcome>().map(|fit| fit_numbers(&fit)),
        Stage::Depth => record
            .parse::<DepthOutcome>()
            .map(|depth| depth_numbers(&depth)),
        Stage::Normalize => record.parse::<NormalizeOutcome>().map(|found| {
            let polarity = if found.light_on_dark {
                "light on dark"
            } else {
                "dark on light"
            };
            format!(
                "print threshold {:.0} of 65535, {polarity}",
                found.threshold_print
            )
        }),
        Stage::Register => Ok(String::new()),
    };
    text.unwrap_or_else(|_| "written by another version of the program".to_owned())
}

fn fit_numbers(fit: &FitOutcome) -> String {
    let bow = match fit.bow {
        Some(_) => format!(", bow {:.3}", fit.bow_height),
        None => String::new(),
    };
    format!(
        "relief {:.3}, rms {:.4}, inliers {:.2}, side sure {:.2}{bow}; {} vertices, {} triangles",
        fit.relief, fit.rms, fit.inlier_ratio, fit.side.confidence, fit.vertices, fit.triangles
    )
}

fn depth_numbers(depth: &DepthOutcome) -> String {
    format!(
        "{} x {} px, {:.4} a pixel, {:.0} % covered",
        depth.width,
        depth.height,
        depth.scale.mesh_unit_per_px,
        depth.coverage * 100.0
    )
}

fn metric_row(record: &MetricRecord) -> Vec<String> {
    let result = &record.outcome;
    let bound = if result.at_bound { " at a bound" } else { "" };
    vec![
        format!("  {}", result.metric),
        format!("{:.2}", result.angle_deg),
        format!("{:.4}", result.scale),
        format!("{:.1}, {:.1}", result.shift_px[0], result.shift_px[1]),
        format!("{:.4}", result.threshold_depth),
        format!("{:.3}", result.scores.ssim),
        format!("{:.3}", result.scores.iou),
        format!("{:.3}", result.scores.iou_box),
        format!("{:.3}", result.scores.dice),
        format!("{:.3}", result.margin),
        result
            .confidence
            .map_or_else(|| "-".to_owned(), |sure| format!("{sure:.3}")),
        format!("{}{bound}", verdicts(record)),
    ]
}

fn verdicts(record: &MetricRecord) -> String {
    let mut parts: Vec<String> = Verdict::ALL
        .into_iter()
        .filter_map(|verdict| {
            let number = record
                .verdicts
                .iter()
                .filter(|read| read.verdict == verdict)
                .count();
            (number > 0).then(|| format!("{number} {verdict}"))
        })
        .collect();
    if record.older_verdicts > 0 {
        parts.push(format!("{} for an older result", record.older_verdicts));
    }
    parts.join(", ")
}
