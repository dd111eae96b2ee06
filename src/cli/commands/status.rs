//! `status`: shows the state of the project on one screen.

use std::convert::Infallible;
use std::io::IsTerminal;
use std::time::Duration;

use clap::Args;
use serde_json::{Value, json};

use super::review::review_step;
use super::run_text::{empty_project_step, failed_pair_steps};
use super::status_hosts::table_text;
use crate::cli::output::context::Context;
use crate::cli::output::missing_results;
use crate::cli::output::pair_table::pair_table as pair_table_text;
use crate::cli::output::retired_table::retired_table;
use crate::cli::output::screen::clear_code;
use crate::cli::output::status_screen::screen;
use crate::cli::output::streams;
use mocban_catalog::{Catalog, RetiredPair};
use mocban_core::domain::JobStatus;
use mocban_core::domain::shell::quoted_id;
use mocban_project::closing::{AFTER_SILENCE, close_within};
use mocban_project::hosts::WorkerTable;
use mocban_project::location::now;
use mocban_project::pair_table::{self, PairChoice, PairRow};
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
    /// Add a list of the retired pairs: since when and why they are out of every count
    #[arg(long, conflicts_with = "watch")]
    pub(crate) retired: bool,
    /// Show the workers of each machine instead: what they have done, how long each stage takes, and what they wait for
    #[arg(long, conflicts_with_all = ["failed", "pairs", "retired"])]
    pub(crate) hosts: bool,
}

const WATCH_INTERVAL: Duration = Duration::from_secs(2);

pub(crate) async fn status(args: StatusArgs, context: &Context) -> ProjectResult<ExitCode> {
    let (project, catalog) = context.location.open_read_only().await?;
    if !args.watch {
        print_once(&project, &catalog, &args, context, &mut None).await?;
        catalog.close().await;
        return Ok(ExitCode::Done);
    }
    let watching = async {
        let mut last = None;
        loop {
            print_once(&project, &catalog, &args, context, &mut last).await?;
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

/// Reads and prints the status, and keeps it as the last one.
async fn print_once(
    project: &Project,
    catalog: &Catalog,
    args: &StatusArgs,
    context: &Context,
    last: &mut Option<ProjectStatus>,
) -> ProjectResult<()> {
    if args.hosts {
        let workers = WorkerTable::read(catalog, now()).await?;
        let (json, text) = (workers.json(), table_text(&workers, context.stdout));
        print_refreshed(args, context, &json, text)?;
    } else {
        let (failed, location) = (args.failed, &context.location);
        let status = ProjectStatus::read(project, catalog, failed, location, last.as_ref()).await?;
        let mut lists = AddedLists::default();
        if args.pairs {
            lists.pairs = Some(pair_table::read(catalog, PairChoice::All).await?);
        }
        if args.retired {
            lists.retired = Some(catalog.retired_pairs().await?);
        }
        print_status(&status, &lists, args, context)?;
        *last = Some(status);
    }
    Ok(())
}

/// Lists that are printed below the screen on request.
#[derive(Debug, Default)]
struct AddedLists {
    pairs: Option<Vec<PairRow>>,
    retired: Option<Vec<RetiredPair>>,
}

fn print_status(
    status: &ProjectStatus,
    lists: &AddedLists,
    args: &StatusArgs,
    context: &Context,
) -> ProjectResult<()> {
    let dir = context.location.dir.display().to_string();
    let mut text = screen(status, &dir, args.failed, context.stdout);
    let mut json = status.json(args.failed)?;
    if let Some(pairs) = &lists.pairs {
        text.push('\n');
        text.push_str(&pair_table_text(pairs, context.stdout));
        json["pair_list"] = serde_json::to_value(pairs)?;
    }
    if let Some(retired) = &lists.retired {
        text.push('\n');
        text.push_str(&retired_table(retired, context.stdout));
        let retired = retired.iter();
        json["retired_list"] = retired
            .map(|pair| json!({"id": pair.name, "cause": pair.cause, "at": pair.at}))
            .collect();
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

fn next_steps(status: &ProjectStatus) -> Vec<String> {
    let mut steps = Vec::new();
    steps.extend(empty_project_step(&status.counts, &status.failures));
    if status.are_results_missing {
        steps.push(missing_results::NEXT.to_owned());
    }
    let leased = status.failures.blocks.leased();
    let running = status.in_process() > 0 || (status.running && leased > 0);
    let waiting = status.waiting() + status.failures.blocks.waiting();
    let interrupted = status.interrupted() + if status.running { 0 } else { leased };
    let other_files = status.counts.other_files + status.failures.blocks.other_files();
    let changed = status.counts.stale + other_files + u64::from(status.changed_inputs.is_some());
    let has_work = waiting + interrupted + changed > 0;
    if !running && (has_work || status.are_results_missing) {
        steps.push("run".to_owned());
    }
    if let Some(first) = status.failures.blocks.first_failed() {
        steps.push(format!("show {}", quoted_id(&first)));
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
    use super::{ProjectStatus, next_steps, screen};
    use crate::cli::output::screen::Palette;
    use mocban_catalog::{
        FailedPair, IgnoredProfiles, ProfileCount, SameContents, SameFiles, StageCounts,
        StatusCounts, StoredFailure,
    };
    use mocban_core::domain::{Failure, FailureClass, JobStatus, Stage, Verdict};
    use mocban_project::failures::Failures;
    use mocban_project::import_command::ImportCommand;
    use mocban_project::missing_inputs::{ChangedInputs, MissingInputs};

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
                other_files: 0,
                low_confidence: 0,
                verdicts: std::collections::BTreeMap::new(),
            },
            running: true,
            failures: Failures::default(),
            are_results_missing: false,
            missing_inputs: None,
            changed_inputs: None,
            same_contents: SameContents::default(),
            ignored_profiles: IgnoredProfiles::default(),
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
    fn pairs_with_other_files_are_counted_and_run() {
        let mut status = status(3, 0);
        status.running = false;
        assert!(!next_steps(&status).contains(&"run".to_owned()));
        status.counts.other_files = 2;
        let text = screen(&status, "demo", false, Palette::PLAIN);
        let line = "changed      2 pairs with another mesh or print in the list than before; the next run looks at them\n";
        assert!(text.ends_with(line), "{text}");
        assert_eq!(next_steps(&status)[0], "run");
    }

    #[test]
    fn changed_inputs_are_run_and_copies_named() {
        let mut status = status(3, 0);
        status.running = false;
        status.changed_inputs = Some(ChangedInputs {
            changed: 1,
            looked_at: 6,
            first: "d/1.stl".to_owned(),
        });
        status.same_contents.pairs = Some(SameFiles {
            id: "b".to_owned(),
            known: "a".to_owned(),
            count: 2,
        });
        assert_eq!(next_steps(&status)[0], "run");
        let text = screen(&status, "demo", false, Palette::PLAIN);
        for line in [
            "inputs       1 of 6 input files that were looked at have another size than when they were read, first d/1.stl; `run` reads them\n",
            "copies       pairs with the same mesh and print as an earlier one: 2, first b, as a; `retire` takes a copy out of every count\n",
        ] {
            assert!(text.contains(line), "{text}");
        }
        let json = status.json(false).expect("JSON");
        assert_eq!(json["changed_inputs"]["changed"], 1);
        assert_eq!(json["same_contents"]["pairs"]["count"], 2);
    }

    #[test]
    fn images_with_a_profile_that_cannot_be_applied_are_counted() {
        let mut status = status(3, 0);
        status.ignored_profiles.pairs = Some(ProfileCount {
            id: "b".to_owned(),
            count: 2,
        });
        let text = screen(&status, "demo", false, Palette::PLAIN);
        let line = "colours      prints with a colour profile that cannot be applied: 2, first of b; `show` names the profile\n";
        assert!(text.contains(line), "{text}");
        let json = status.json(false).expect("JSON");
        assert_eq!(json["ignored_profiles"]["pairs"]["count"], 2);
        assert!(json["ignored_profiles"]["blocks"].is_null());
    }

    #[test]
    fn blocks_with_other_files_are_counted_and_run() {
        let mut status = status(3, 0);
        status.running = false;
        let mut block = crate::cli::output::block_status::tests::state("a", JobStatus::Done);
        status.failures.blocks.0 = vec![block.clone()];
        assert_eq!(next_steps(&status)[0], "run");
        let text = screen(&status, "demo", false, Palette::PLAIN);
        let line = "changed      1 block with another scan, page or labels than before; the next run looks at them\n";
        assert!(text.contains(line), "{text}");
        block.other_files = false;
        status.failures.blocks.0 = vec![block];
        assert!(!next_steps(&status).contains(&"run".to_owned()));
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
        let mut retired = status(0, 0);
        retired.counts.retired = 2;
        assert_eq!(next_steps(&retired), ["status --retired"]);
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
            owners: 2,
            folders: Vec::new(),
            is_below_root: false,
            first_owner: 0,
            command: ImportCommand::List,
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
            text.contains("inputs       3 of 8 input files that were looked at are missing or have moved, first d/1.stl; `check --json` lists all; put them back, or import them from their new place (`import LIST --allow-changed-files`)\n"),
            "{text}"
        );
    }
}
