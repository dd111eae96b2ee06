//! `status`: shows the state of the project on one screen.

use std::convert::Infallible;
use std::io::IsTerminal;
use std::time::Duration;

use clap::Args;
use serde_json::Value;

use super::review::review_step;
use super::run_text::failed_pair_steps;
use super::status_hosts::table_text;
use crate::cli::output::block_status::{blocks_line, failed_blocks_text};
use crate::cli::output::context::Context;
use crate::cli::output::failures::failures_text;
use crate::cli::output::missing_results;
use crate::cli::output::pair_table::pair_table as pair_table_text;
use crate::cli::output::screen::{Palette, Tone, clear_code};
use crate::cli::output::streams;
use crate::cli::output::table::{columns, count};
use mocban_catalog::{Catalog, StageCounts, StatusCounts};
use mocban_core::domain::{JobStatus, MetricOutcome, Stage, ThresholdMetric, Verdict, one_line};
use mocban_project::closing::{AFTER_SILENCE, close_within};
use mocban_project::hosts::WorkerTable;
use mocban_project::location::now;
use mocban_project::pair_table::{self, PairChoice, PairRow};
use mocban_project::shell::shell_quoted;
use mocban_project::status::ProjectStatus;
use mocban_project::{ExitCode, ProjectResult};
use mocban_runner::Stop;
use mocban_store::Project;

/// Arguments of `status`.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub(crate) struct StatusArgs {
    /// Refresh every two seconds until Ctrl-C
    #[arg(short, long)]
    pub(crate) watch: bool,
    /// List every failed pair with its error, not only the first ones of each class
    #[arg(long)]
    pub(crate) failed: bool,
    /// Add a table of all pairs: state, alignment, confidence and verdict
    #[arg(long, conflicts_with = "watch")]
    pub(crate) pairs: bool,
    /// Show the workers of each machine instead: what they have done, how long each stage takes, and what they wait for
    #[arg(long, conflicts_with_all = ["failed", "pairs"])]
    pub(crate) hosts: bool,
}

const WATCH_INTERVAL: Duration = Duration::from_secs(2);

pub(crate) async fn status(args: StatusArgs, context: &Context) -> ProjectResult<ExitCode> {
    let (project, catalog) = context.location.open_read_only().await?;
    if !args.watch {
        print_once(&project, &catalog, &args, context).await?;
        catalog.close().await;
        return Ok(ExitCode::Done);
    }
    let watching = async {
        loop {
            print_once(&project, &catalog, &args, context).await?;
            tokio::time::sleep(WATCH_INTERVAL).await;
        }
    };
    // Also ends a read to which the database server does not reply.
    let ended: ProjectResult<Infallible> = tokio::select! {
        ended = watching => ended,
        _ = tokio::signal::ctrl_c() => {
            close_within(catalog, &Stop::new(), AFTER_SILENCE).await;
            return Ok(ExitCode::Done);
        }
    };
    match ended? {}
}

/// Reads and prints the status.
async fn print_once(
    project: &Project,
    catalog: &Catalog,
    args: &StatusArgs,
    context: &Context,
) -> ProjectResult<()> {
    if args.hosts {
        let workers = WorkerTable::read(catalog, now()).await?;
        let (json, text) = (workers.json(), table_text(&workers, context.stdout));
        print_refreshed(args, context, &json, text)?;
    } else {
        let status = ProjectStatus::read(project, catalog, args.failed, &context.location).await?;
        let pairs = if args.pairs {
            Some(pair_table::read(catalog, PairChoice::All).await?)
        } else {
            None
        };
        print_status(&status, pairs.as_deref(), args, context)?;
    }
    Ok(())
}

fn print_status(
    status: &ProjectStatus,
    pairs: Option<&[PairRow]>,
    args: &StatusArgs,
    context: &Context,
) -> ProjectResult<()> {
    let dir = context.location.dir.display().to_string();
    let mut text = screen(status, &dir, args.failed, context.stdout);
    let mut json = status.json(args.failed)?;
    if let Some(pairs) = pairs {
        text.push('\n');
        text.push_str(&pair_table_text(pairs, context.stdout));
        json["pair_list"] = serde_json::to_value(pairs)?;
    }
    print_refreshed(args, context, &json, text)?;
    if !context.global.json {
        for command in next_steps(status) {
            context.next(&command);
        }
    }
    Ok(())
}

/// Prints JSON or text. With `--watch`, a JSON document is one line, and a text replaces the last one on the terminal.
fn print_refreshed(
    args: &StatusArgs,
    context: &Context,
    json: &Value,
    mut text: String,
) -> ProjectResult<()> {
    if context.global.json {
        if args.watch {
            streams::print_json_text(&json.to_string())?;
        } else {
            streams::print_json(json)?;
        }
        return Ok(());
    }
    if args.watch && std::io::stdout().is_terminal() {
        text.insert_str(0, &clear_code());
    }
    Ok(streams::print(&text)?)
}

fn screen(status: &ProjectStatus, dir: &str, all: bool, palette: Palette) -> String {
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
    if status.counts.retired > 0 {
        let pairs = count(status.counts.retired, "pair");
        let text = format!("{pairs} out of every count; results and verdicts are kept");
        parts.push(line("retired", &text));
    }
    if status.are_results_missing {
        parts.push(line("files", missing_results::TEXT));
    }
    if let Some(missing) = &status.missing_inputs {
        parts.push(line("inputs", &missing.to_string()));
    }
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

fn next_steps(status: &ProjectStatus) -> Vec<String> {
    let mut steps = Vec::new();
    if status.counts.pairs == 0 && status.failures.blocks.is_empty() {
        steps.push("import pairs.csv".to_owned());
    }
    if status.are_results_missing {
        steps.push(missing_results::NEXT.to_owned());
    }
    let leased = status.failures.blocks.leased();
    let running = status.in_process() > 0 || (status.running && leased > 0);
    let waiting = status.waiting() + status.failures.blocks.waiting();
    let interrupted = status.interrupted() + if status.running { 0 } else { leased };
    let has_work = waiting + interrupted + status.counts.stale > 0;
    if !running && (has_work || status.are_results_missing) {
        steps.push("run".to_owned());
    }
    if let Some(first) = status.failures.blocks.first_failed() {
        steps.push(format!("show {}", shell_quoted(&first)));
    }
    steps.extend(failed_pair_steps(&status.failures));
    if status.counts.low_confidence > 0 {
        steps.push("show --low".to_owned());
        steps.push("contact-sheet --order confidence".to_owned());
    }
    if status.jobs(JobStatus::Done) > 0 && !running {
        if !status.are_results_missing {
            steps.extend(review_step(&status.counts));
        }
        steps.push("report".to_owned());
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::{
        JobStatus, Palette, ProjectStatus, Stage, StageCounts, StatusCounts, Verdict, next_steps,
        screen,
    };
    use mocban_catalog::{FailedPair, StoredFailure};
    use mocban_core::domain::{Failure, FailureClass};
    use mocban_project::failures::Failures;
    use mocban_project::missing_inputs::MissingInputs;

    fn status(done: u64, ready: u64) -> ProjectStatus {
        let stage = StageCounts {
            done,
            pending: ready,
            failed: 0,
        };
        ProjectStatus {
            counts: StatusCounts {
                schema: 1,
                pairs: done + ready,
                retired: 0,
                jobs: [(JobStatus::Done, done), (JobStatus::Ready, ready)].into(),
                stages: Stage::ALL.map(|name| (name, stage)).into(),
                stale: 0,
                low_confidence: 0,
                verdicts: std::collections::BTreeMap::new(),
            },
            running: true,
            failures: Failures::default(),
            are_results_missing: false,
            missing_inputs: None,
        }
    }

    #[test]
    fn pairs_of_a_dead_process_are_interrupted() {
        let mut status = status(3, 0);
        status.counts.jobs.insert(JobStatus::Leased, 2);
        let headline = |status: &ProjectStatus| {
            let text = screen(status, "demo", false, Palette::PLAIN);
            text.lines().next().map(str::to_owned)
        };
        let expected = |word: &str| {
            Some(format!(
                "project      demo · 3 pairs · 3 done · 2 {word} · 100.0 %"
            ))
        };
        assert_eq!(headline(&status), expected("running"));
        assert!(next_steps(&status).is_empty());
        status.running = false;
        assert_eq!(headline(&status), expected("interrupted"));
        let steps = next_steps(&status);
        assert_eq!([&steps[0], &steps[steps.len() - 1]], ["run", "report"]);
        assert_eq!(status.json(false).expect("JSON")["running"], false);
    }

    #[test]
    fn screens_of_all_states() {
        let mut all = status(3, 1);
        all.counts.jobs.insert(JobStatus::Leased, 2);
        insta::assert_snapshot!("running", screen(&all, "demo", false, Palette::PLAIN));
        all.running = false;
        all.counts.stale = 1;
        all.counts.low_confidence = 2;
        all.counts.verdicts = [(Verdict::Pass, 4), (Verdict::Unsure, 1)].into();
        insta::assert_snapshot!("interrupted", screen(&all, "demo", false, Palette::PLAIN));
        insta::assert_snapshot!("next_steps", next_steps(&all).join("\n"));
    }

    #[test]
    fn pairs_of_low_confidence_are_counted_with_the_command_that_draws_them() {
        let mut status = status(3, 0);
        assert!(!screen(&status, "demo", false, Palette::PLAIN).contains("confidence"));
        status.counts.low_confidence = 1;
        let text = screen(&status, "demo", false, Palette::PLAIN);
        let line = "confidence   1 done pair below 0.5 (ensemble)\n";
        assert!(text.ends_with(line), "{text}");
        let steps = next_steps(&status);
        assert_eq!(
            steps[..2],
            ["show --low", "contact-sheet --order confidence"]
        );
    }

    #[test]
    fn a_failure_that_may_not_occur_again_is_offered_to_retry() {
        let mut status = status(3, 0);
        status.failures.pairs = vec![FailedPair {
            name: "b1".parse().expect("a name"),
            status: JobStatus::Quarantined,
            failure: StoredFailure {
                stage: Stage::Fit,
                failure: Failure::new(FailureClass::Io, "no space left"),
                at: 0,
            },
        }];
        status.failures.counts = vec![(FailureClass::Io, 1)];
        assert_eq!(next_steps(&status)[..2], ["show b1", "retry"]);
        status.failures.counts = vec![(FailureClass::BadInput, 1)];
        assert!(!next_steps(&status).contains(&"retry".to_owned()));
    }

    #[test]
    fn next_step_follows_from_the_counts() {
        assert_eq!(next_steps(&status(0, 0)), ["import pairs.csv"]);
        assert_eq!(next_steps(&status(0, 2)), ["run"]);
        let mut done = status(2, 0);
        let steps = next_steps(&done);
        assert!(steps[0].starts_with("review --reviewer "), "{steps:?}");
        assert_eq!(steps[1..], ["report"]);
        done.counts.verdicts.insert(Verdict::Pass, 1);
        assert_eq!(next_steps(&done), ["report"]);
        done.missing_inputs = Some(MissingInputs {
            missing: 3,
            looked_at: 8,
            first: "d/1.stl".to_owned(),
        });
        done.are_results_missing = true;
        done.running = false;
        assert_eq!(
            next_steps(&done),
            [super::missing_results::NEXT, "run", "report"]
        );
        let text = screen(&done, "demo", false, Palette::PLAIN);
        assert!(
            text.contains("files        the depth maps and masks"),
            "{text}"
        );
        assert!(
            text.contains("inputs       3 of 8 input files that were looked at are missing or have moved, first d/1.stl; `check --json` lists all\n"),
            "{text}"
        );
    }
}
