//! The screen of `status`: counts, stages, failures and what to do about them.

use super::block_status::{blocks_line, failed_blocks_text};
use super::failures::failures_text;
use super::missing_results;
use super::screen::{Palette, Tone};
use super::table::{columns, count};
use mocban_catalog::{StageCounts, StatusCounts};
use mocban_core::domain::{JobStatus, MetricOutcome, Stage, ThresholdMetric, Verdict, one_line};
use mocban_project::status::ProjectStatus;

/// Formats the screen of a project in a folder, with all failures or the first ones of each class.
pub(crate) fn screen(status: &ProjectStatus, dir: &str, all: bool, palette: Palette) -> String {
    let line = |word: &str, text: &str| format!("{}  {text}\n", label(word, palette));
    let mut parts = vec![line("project", &headline(status, dir, palette))];
    if !status.failures.blocks.is_empty() {
        parts.push(line(
            "blocks",
            &blocks_line(&status.failures.blocks, status.running, palette),
        ));
        parts.push(failed_blocks_text(&status.failures.blocks, all));
    }
    parts.push(stage_table(&status.counts, palette));
    if status.failed() > 0 {
        parts.push(format!("{}\n", palette.paint(Tone::Strong, "failed")));
        parts.push(failures_text(&status.failures, all));
    }
    if status.interrupted() > 0 {
        let text = "their run ended before it finished them; the next run continues them";
        parts.push(line("interrupted", text));
    }
    if status.counts.stale > 0 {
        let pairs = count(status.counts.stale, "pair");
        let text = format!("{pairs} computed with other settings or files than the current ones");
        parts.push(line("stale", &text));
    }
    if status.counts.other_files > 0 {
        let pairs = count(status.counts.other_files, "pair");
        let text = format!(
            "{pairs} with another mesh or print in the list than before; the next run looks at them"
        );
        parts.push(line("changed", &text));
    }
    let blocks = status.failures.blocks.other_files();
    if blocks > 0 {
        let blocks = count(blocks, "block");
        let text = format!(
            "{blocks} with another scan, page or labels than before; the next run looks at them"
        );
        parts.push(line("changed", &text));
    }
    if status.counts.retired > 0 {
        let pairs = count(status.counts.retired, "pair");
        let text = format!(
            "{pairs} out of every count; results and verdicts are kept; `status --retired` lists them"
        );
        parts.push(line("retired", &text));
    }
    if status.are_results_missing {
        parts.push(line("files", missing_results::TEXT));
    }
    if let Some(missing) = &status.missing_inputs {
        parts.push(line("inputs", &missing.to_string()));
    }
    if let Some(changed) = &status.changed_inputs {
        parts.push(line("inputs", &changed.to_string()));
    }
    let same = status.same_contents.sentences();
    parts.extend(same.iter().map(|text| line("copies", text)));
    let profiles = status.ignored_profiles.sentences();
    parts.extend(profiles.iter().map(|text| line("colours", text)));
    parts.extend(low_confidence_line(&status.counts).map(|text| line("confidence", &text)));
    parts.extend(verdict_line(&status.counts).map(|text| line("verdicts", &text)));
    parts.concat()
}

fn label(word: &str, palette: Palette) -> String {
    palette.paint(Tone::Strong, format!("{word:<11}"))
}

/// Returns `demo · 24 pairs · 22 done · 1 failed · 1 waiting · 91.7 %`
fn headline(status: &ProjectStatus, dir: &str, palette: Palette) -> String {
    let done = status.jobs(JobStatus::Done);
    let pairs = status.counts.pairs;
    let mut parts = vec![
        one_line(dir).into_owned(),
        count(pairs, "pair"),
        palette.paint(Tone::Good, format!("{done} done")),
    ];
    for (number, word, tone) in [
        (status.failed(), "failed", Tone::Bad),
        (status.in_process(), "running", Tone::Strong),
        (status.interrupted(), "interrupted", Tone::Warn),
        (status.waiting(), "waiting", Tone::Warn),
    ] {
        if number > 0 {
            parts.push(palette.paint(tone, format!("{number} {word}")));
        }
    }
    if pairs > 0 {
        parts.push(format!("{:.1} %", done as f64 * 100.0 / pairs as f64));
    }
    parts.join(" · ")
}

fn stage_table(counts: &StatusCounts, palette: Palette) -> String {
    let of = |stage: Stage| counts.stages.get(&stage).copied().unwrap_or_default();
    let head = Stage::ALL.map(|stage| palette.paint(Tone::Strong, stage));
    let row = |name: &str, cell: &dyn Fn(StageCounts) -> String| {
        let cells = Stage::ALL.map(|stage| cell(of(stage)));
        [vec![label(name, palette)], cells.to_vec()].concat()
    };
    let failed = |stage: StageCounts| {
        let tone = if stage.failed == 0 {
            Tone::Faint
        } else {
            Tone::Bad
        };
        palette.paint(tone, stage.failed)
    };
    let rows = [
        [vec![label("stages", palette)], head.to_vec()].concat(),
        row("  done", &|stage| stage.done.to_string()),
        row("  pending", &|stage| stage.pending.to_string()),
        row("  failed", &failed),
    ];
    columns(rows, "<>>>>")
}

fn low_confidence_line(counts: &StatusCounts) -> Option<String> {
    (counts.low_confidence > 0).then(|| {
        let pairs = count(counts.low_confidence, "done pair");
        let metric = ThresholdMetric::DEFAULT;
        format!("{pairs} below {} ({metric})", MetricOutcome::LOW_CONFIDENCE)
    })
}

fn verdict_line(counts: &StatusCounts) -> Option<String> {
    let of = |verdict: Verdict| counts.verdicts.get(&verdict).copied().unwrap_or(0);
    let total: u64 = Verdict::ALL.into_iter().map(of).sum();
    let parts = Verdict::ALL.map(|verdict| format!("{} {verdict}", of(verdict)));
    (total > 0).then(|| parts.join(" · "))
}
