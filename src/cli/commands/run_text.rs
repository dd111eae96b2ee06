//! Text about a run: how it ended, what to do next, and what would run.

use super::review::review_step;
use crate::cli::output::block_status::failed_blocks_text;
use crate::cli::output::context::Context;
use crate::cli::output::failures::failures_text;
use crate::cli::output::table::{columns, count, pairs_and_blocks};
use mocban_catalog::{BlockPlanEntry, Plan, StatusCounts};
use mocban_core::domain::JobStatus;
use mocban_core::domain::shell::quoted_id;
use mocban_project::failures::Failures;
use mocban_project::run::RunOutcome;
use mocban_runner::{BlockSummary, CutPairs, RunSummary};
use mocban_system::time_text::duration;

/// Prints how a run ended and which pairs failed.
pub(crate) fn print_outcome(outcome: &RunOutcome, context: &Context) {
    let (summary, failures) = (&outcome.summary, &outcome.failures);
    context.info(&headline(summary));
    if let Some(text) = cut_pairs_text(&summary.blocks.pairs) {
        context.info(&text);
    }
    if summary.failed_in_all > 0 {
        let heading = failed_heading("pair", summary.failed_in_all, summary.failed);
        let text = failures_text(failures, false);
        context.info(&format!("{heading}\n{}", text.trim_end()));
    }
    if summary.blocks.failed_in_all > 0 {
        let BlockSummary {
            failed_in_all,
            failed,
            ..
        } = summary.blocks;
        let heading = failed_heading("block", failed_in_all, failed);
        let text = failed_blocks_text(&failures.blocks, false);
        context.info(&format!("{heading}\n{}", text.trim_end()));
    }
}

/// Returns the line above a list of failures, of which `now` are of this run: `3 blocks failed, 2 of them in earlier runs:`.
fn failed_heading(what: &str, in_all: u64, now: u64) -> String {
    let number = count(in_all, what);
    match in_all.saturating_sub(now) {
        0 => format!("{number} failed:"),
        earlier if earlier == in_all => format!("{number} failed in earlier runs:"),
        earlier => format!("{number} failed, {earlier} of them in earlier runs:"),
    }
}

fn headline(summary: &RunSummary) -> String {
    let pairs = pair_headline(summary);
    let BlockSummary {
        done, failed, left, ..
    } = summary.blocks;
    if done + failed + left == 0 {
        return pairs;
    }
    let blocks = count(done, "block");
    format!("{blocks} done, {failed} failed, {left} left; {pairs}")
}

/// Says how the pairs of blocks changed, unless all are new: `pairs of blocks: 8 retired, 8 added; reviewers
/// had judged 1 of the retired and changed ones`.
fn cut_pairs_text(pairs: &CutPairs) -> Option<String> {
    let CutPairs {
        added,
        changed,
        retired,
        judged,
        restored,
    } = *pairs;
    if changed + retired + restored == 0 {
        return None;
    }
    let judged = if judged > 0 {
        format!("; reviewers had judged {judged} of the retired and changed ones")
    } else {
        String::new()
    };
    let parts = [
        (retired, format!("{retired} retired")),
        (changed, format!("{changed} changed")),
        (added, format!("{added} added")),
        (restored, format!("{restored} came back")),
    ];
    let parts = parts.into_iter().filter(|(number, _)| *number > 0);
    let parts: Vec<String> = parts.map(|(_, text)| text).collect();
    Some(format!("pairs of blocks: {}{judged}", parts.join(", ")))
}

fn pair_headline(summary: &RunSummary) -> String {
    let (took, left) = (duration(summary.elapsed_ms), summary.left);
    let done = count(summary.done, "pair");
    if summary.stopped {
        return format!("stopped after {took}: {done} done, {left} left; the state is safe");
    }
    if summary.too_many_failures {
        let failed = pairs_and_blocks(summary.failed, summary.blocks.failed);
        return format!(
            "stopped after {took} because {failed} failed in this run: {done} done, {left} left"
        );
    }
    if summary.stages == 0 && summary.failed == 0 {
        let retired = summary.status.all_retired();
        return match (summary.status.pairs, retired) {
            (0, Some(retired)) => format!("nothing to do: {retired}"),
            (0, None) => "nothing to do: the project has no pairs".to_owned(),
            (pairs, _) => format!(
                "nothing left to do: {} in the project",
                count(pairs, "pair")
            ),
        };
    }
    format!(
        "{done} done, {} failed, {left} left in {took}",
        summary.failed
    )
}

/// Returns the commands that make sense after a run.
pub(crate) fn next_steps(outcome: &RunOutcome) -> Vec<String> {
    let RunOutcome {
        summary,
        failures,
        are_results_missing,
        ..
    } = outcome;
    let mut steps = Vec::new();
    steps.extend(empty_project_step(&summary.status, failures));
    let jobs = |status| summary.status.jobs.get(&status).copied().unwrap_or(0);
    if jobs(JobStatus::Ready) + jobs(JobStatus::Backoff) + summary.blocks.left > 0
        || *are_results_missing
    {
        steps.push("run".to_owned());
    }
    if let Some(first) = failures.blocks.first_failed() {
        steps.push(format!("show {}", quoted_id(&first)));
    }
    if summary.failed_in_all > 0 {
        steps.extend(failed_pair_steps(failures));
    }
    if jobs(JobStatus::Done) > 0 && !summary.stopped {
        if !are_results_missing {
            steps.extend(review_step(&summary.status));
        }
        steps.push("report".to_owned());
    }
    steps
}

/// Returns what helps if no pair counts: a look at the retired ones, or an import.
pub(crate) fn empty_project_step(counts: &StatusCounts, failures: &Failures) -> Option<String> {
    let is_retired = counts.all_retired().is_some();
    let step = if is_retired {
        "status --retired"
    } else {
        "import pairs.csv"
    };
    let is_empty = counts.pairs == 0 && failures.blocks.is_empty();
    (is_empty || is_retired).then(|| step.to_owned())
}

/// Returns the commands that show a failed pair and let failed pairs run again.
pub(crate) fn failed_pair_steps(failures: &Failures) -> Vec<String> {
    let first = failures.pairs.first();
    let show = first.map(|first| format!("show {}", quoted_id(first.name.as_str())));
    let may_retry = first.is_some() && failures.may_succeed_unchanged();
    let retry = may_retry.then(|| "retry".to_owned());
    show.into_iter().chain(retry).collect()
}

/// Returns the numbers of pairs that would run, and a line for each reason.
pub(crate) fn plan_text(plan: &Plan, running: bool) -> String {
    let leased = if running {
        "running in another process"
    } else {
        "interrupted (they would continue)"
    };
    let mut parts = vec![format!("{} would run", count(plan.pairs(), "pair"))];
    for (number, what) in [
        (plan.done, "done"),
        (plan.quarantined, "failed"),
        (plan.leased, leased),
    ] {
        if number > 0 {
            parts.push(format!("{number} {what}"));
        }
    }
    let rows = plan.entries.iter().map(|entry| {
        let (pairs, from) = (format!("  {}", entry.pairs), format!("from {}", entry.from));
        vec![pairs, from, entry.to_string()]
    });
    format!("{}\n{}", parts.join(", "), columns(rows, "><<"))
}

/// Returns a line for each block that would run.
pub(crate) fn block_plan_text(blocks: &[BlockPlanEntry]) -> String {
    if blocks.is_empty() {
        return String::new();
    }
    let rows = blocks.iter().map(|entry| {
        let (block, from) = (format!("  {}", entry.block), format!("from {}", entry.from));
        vec![block, from, entry.why.to_string()]
    });
    let number = count(blocks.len() as u64, "block");
    format!(
        "{number} would run, which may add pairs\n{}",
        columns(rows, "<<<")
    )
}

#[cfg(test)]
mod tests {
    use super::{CutPairs, Plan, cut_pairs_text, failed_heading, plan_text};
    use mocban_catalog::{FieldChange, FingerprintId, PlanEntry, StaleReason};
    use mocban_core::domain::Stage;

    #[test]
    fn failures_of_earlier_runs_are_told_from_those_of_this_run() {
        let heading = |in_all, now| failed_heading("block", in_all, now);
        assert_eq!(heading(3, 3), "3 blocks failed:");
        assert_eq!(heading(3, 1), "3 blocks failed, 2 of them in earlier runs:");
        assert_eq!(heading(1, 0), "1 block failed in earlier runs:");
    }

    #[test]
    fn changes_of_the_pairs_of_blocks_are_told_with_lost_verdicts() {
        let mut pairs = CutPairs {
            added: 8,
            ..CutPairs::default()
        };
        assert_eq!(cut_pairs_text(&pairs), None);
        (pairs.retired, pairs.judged) = (8, 1);
        let text = cut_pairs_text(&pairs).expect("a text");
        assert_eq!(
            text,
            "pairs of blocks: 8 retired, 8 added; reviewers had judged 1 of the retired and changed ones"
        );
        let pairs = CutPairs {
            changed: 2,
            restored: 1,
            ..CutPairs::default()
        };
        let text = cut_pairs_text(&pairs).expect("a text");
        assert_eq!(text, "pairs of blocks: 2 changed, 1 came back");
    }

    #[test]
    fn plan_names_the_setting_that_changed() {
        let plan = Plan {
            entries: vec![PlanEntry {
                from: Stage::Register,
                why: StaleReason::Settings {
                    stage: Stage::Register,
                    old: FingerprintId(1),
                },
                changes: Some(vec![FieldChange {
                    field: "register.max_scale".into(),
                    old: Some(1.2.into()),
                    new: Some(1.3.into()),
                }]),
                pairs: 24,
            }],
            done: 2,
            quarantined: 1,
            leased: 3,
        };
        insta::assert_snapshot!(plan_text(&plan, false));
        insta::assert_snapshot!("during_a_run", plan_text(&plan, true));
    }
}
