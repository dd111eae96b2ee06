//! `check`: checks the consistency of a project, and repairs it on request.

use std::time::Duration;

use clap::Args;

use crate::cli::output::context::Context;
use crate::cli::output::screen::{Palette, Tone};
use crate::cli::output::table::{columns, count, pairs_and_blocks};
use crate::cli::output::terminal::Terminal;
use mocban_core::domain::one_line;
use mocban_project::check::{check as check_project, missing_inputs};
use mocban_project::error::without_error_numbers;
use mocban_project::{ExitCode, ProjectResult};
use mocban_runner::check::{CheckOptions, CheckSummary, Finding, Kind, Notes, Unreferenced};

/// Arguments of `check`.
#[derive(Debug, Args)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a choice of its own, with a name"
)]
pub(crate) struct CheckArgs {
    /// Queue missing or changed results again, recount, and remove unreferenced files; verdicts are never touched
    #[arg(long)]
    pub(crate) repair: bool,
    /// Repair although most result files are missing; without it, a repair then changes no results, because a disk may not
    /// be mounted
    #[arg(long, requires = "repair")]
    pub(crate) accept_missing: bool,
    /// Compare only the lengths of files instead of every byte
    #[arg(long)]
    pub(crate) quick: bool,
    /// Remove result files that no result references and that are older than this, also during a run [default: 24]
    #[arg(long, value_name = "HOURS", num_args = 0..=1, default_missing_value = "24", require_equals = true,
          value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub(crate) collect: Option<u64>,
    /// Make this catalog the owner of the folder or object store of its result files, in place of another one that is not
    /// used any more
    #[arg(long)]
    pub(crate) take_over: bool,
}

/// Findings of each kind, and inputs, that are listed.
const MAX_LISTED: usize = 5;

pub(crate) async fn check(args: CheckArgs, context: &Context) -> ProjectResult<ExitCode> {
    let options = CheckOptions {
        quick: args.quick,
        repair: args.repair,
        accept_missing: args.accept_missing,
        take_over: args.take_over,
        collect: args.collect.map(|hours| Duration::from_secs(hours * 3600)),
        ..CheckOptions::default()
    };
    let summary = check_project(options, &context.location, &Terminal::new(context)).await?;
    context.print(&summary, || text(&summary, &args, context.stdout))?;
    if summary.inputs_missing.count > 0
        && let Some(missing) = missing_inputs(&context.location).await
    {
        context.warn(&missing.to_string());
    }
    for command in next_steps(&summary, args.repair) {
        context.next(command);
    }
    Ok(if summary.left() > 0 {
        ExitCode::Damaged
    } else {
        ExitCode::Done
    })
}

fn next_steps(summary: &CheckSummary, repaired: bool) -> Vec<&'static str> {
    if summary.repaired.requeued + summary.repaired.requeued_blocks > 0 {
        vec!["run"]
    } else if summary.lacks_most_files() && summary.repaired.not_requeued == 0 {
        vec!["check --repair --accept-missing"]
    } else if !repaired && summary.is_repairable() {
        vec!["check --repair"]
    } else {
        Vec::new()
    }
}

fn text(summary: &CheckSummary, args: &CheckArgs, palette: Palette) -> String {
    let mut lines = vec![headline(summary, palette)];
    for (kind, found) in &summary.damage {
        let tone = if found.left > 0 {
            Tone::Bad
        } else {
            Tone::Warn
        };
        let head = format!("{}: {}", kind.heading(), found.found);
        lines.push(palette.paint(tone, head));
        let is_one_reason = *kind == Kind::FileMissing && summary.lacks_most_files();
        let limit = if is_one_reason { 1 } else { MAX_LISTED };
        lines.push(listed(&found.first, found.found, limit));
    }
    lines.extend(missing_files(summary));
    if summary.damage.contains_key(&Kind::FileUnreadable) {
        lines.push(
            "files that cannot be read may be sound, so their results stay: correct what the lines above name; to give a file up, \
             remove it, then run `check --repair`"
                .to_owned(),
        );
    }
    if summary.damage.contains_key(&Kind::Database) && summary.left() > 0 {
        lines.push(
            "the catalog's file itself is damaged, so nothing was written to it; replace it with a backup, \
             then run `check --repair`"
                .to_owned(),
        );
    }
    lines.extend(repairs(summary, args.repair));
    lines.extend(set_apart(summary));
    lines.extend(notes(&summary.inputs_missing, "missing"));
    let changed = match summary.inputs_changed.count {
        1 => "changed since it was read",
        _ => "changed since they were read",
    };
    lines.extend(notes(&summary.inputs_changed, changed));
    lines.extend(notes(&summary.inputs_unreadable, "unreadable"));
    lines.extend(summary.same_contents.sentences());
    lines.extend(unreferenced(summary.unreferenced.as_ref(), args));
    lines.retain(|line| !line.is_empty());
    let lines = lines.iter().map(|line| line.trim_end());
    without_error_numbers(&lines.collect::<Vec<_>>().join("\n")) + "\n"
}

/// Says what to do if most result files are missing and their results stay.
fn missing_files(summary: &CheckSummary) -> Option<String> {
    let missing = summary.damage.get(&Kind::FileMissing);
    let missing =
        missing.filter(|found| summary.lacks_most_files() && found.left == found.found)?;
    let which = if missing.found == summary.files {
        "no result file is there".to_owned()
    } else {
        let (missing, files) = (missing.found, count(summary.files, "result file"));
        format!("{missing} of {files} are missing")
    };
    let inputs = match summary.inputs_missing.count {
        0 => "",
        _ => "put scans and prints at their places; then ",
    };
    let withheld = if summary.repaired.withheld {
        ", so nothing was queued again"
    } else {
        ""
    };
    Some(format!(
        "{which}, as after `restore`, or if a disk is not mounted{withheld}; if they are really gone, {inputs}\
         `check --repair --accept-missing` and `run` compute them again"
    ))
}

fn headline(summary: &CheckSummary, palette: Palette) -> String {
    let how = if summary.quick {
        "by length"
    } else {
        "byte by byte"
    };
    let checked = format!(
        "checked {} and {}, {how}",
        count(summary.pairs, "pair"),
        count(summary.files, "result file")
    );
    let problems = count(summary.found(), "problem");
    let (tone, verdict) = match (summary.found(), summary.left()) {
        (0, _) if summary.inputs_missing.count > 0 => (
            Tone::Warn,
            "no problems found in the results, but inputs are missing".to_owned(),
        ),
        (0, _) => (Tone::Good, "no problems found".to_owned()),
        (_, 0) => (Tone::Good, format!("{problems} found, all repaired")),
        (found, left) if left < found => {
            (Tone::Bad, format!("{problems} found, {left} not repaired"))
        }
        _ => (Tone::Bad, format!("{problems} found")),
    };
    format!("{checked}: {}", palette.paint(tone, verdict))
}

/// Formats the first findings of a kind, one line each.
fn listed(first: &[Finding], found: u64, limit: usize) -> String {
    let row = |finding: &Finding| match (&finding.pair, finding.stage) {
        (Some(pair), Some(stage)) => {
            vec![format!("  {pair}"), stage.to_string(), finding.what.clone()]
        }
        _ => vec![format!("  {}", finding.what)],
    };
    let mut rows: Vec<_> = first.iter().take(limit).map(row).collect();
    let more = found.saturating_sub(rows.len() as u64);
    if more > 0 {
        rows.push(vec![format!("  and {more} more")]);
    }
    columns(rows, "<<<")
}

fn repairs(summary: &CheckSummary, repaired: bool) -> Vec<String> {
    let done = &summary.repaired;
    let schema = "the missing parts of the schema were created again";
    let parts = [
        (done.indexes, "the indexes were rebuilt"),
        (done.schema, schema),
        (done.counters, "the counters were recounted"),
    ];
    let parts = parts.iter().filter(|(is_done, _)| *is_done);
    let mut lines: Vec<String> = parts.map(|(_, what)| (*what).to_owned()).collect();
    if done.set_apart > 0 {
        let rows = count(done.set_apart, "damaged row");
        lines.push(format!(
            "{rows} set apart: not counted, kept as stored, and shown by `verdict log`; to count a verdict after all, enter it \
             again with `verdict set`"
        ));
    }
    if done.not_requeued > 0 {
        let pairs = count(done.not_requeued, "damaged pair");
        lines.push(format!(
            "{pairs} not queued again, because a mesh or print is missing or cannot be read: put it back, then run `check --repair`"
        ));
    }
    if repaired && done.requeued + done.requeued_blocks > 0 {
        let requeued = pairs_and_blocks(done.requeued, done.requeued_blocks);
        lines.push(format!(
            "{requeued} will run again from the stage listed above"
        ));
    }
    lines
}

/// Formats the rows that the owner set apart earlier.
fn set_apart(summary: &CheckSummary) -> Option<String> {
    let found = &summary.set_apart;
    (!found.is_empty()).then(|| {
        let rows = count(found.count, "damaged row");
        let named = found.first.iter().take(MAX_LISTED);
        let mut lines = vec![format!("{rows} set apart earlier and not counted:")];
        lines.extend(named.map(|row| format!("  {row}")));
        let more = found.count.saturating_sub(MAX_LISTED as u64);
        lines.extend((more > 0).then(|| format!("  and {more} more")));
        lines.join("\n")
    })
}

fn notes(notes: &Notes, problem: &str) -> Option<String> {
    (notes.count > 0).then(|| {
        let mut names: Vec<_> = notes.first.iter().take(MAX_LISTED).cloned().collect();
        let more = notes.count.saturating_sub(names.len() as u64);
        if more > 0 {
            names.push(format!("and {more} more"));
        }
        let files = count(notes.count, "input file");
        let verb = if notes.count == 1 { "is" } else { "are" };
        format!("{files} {verb} {problem}: {}", one_line(&names.join(", ")))
    })
}

fn unreferenced(found: Option<&Unreferenced>, args: &CheckArgs) -> Option<String> {
    let Some(found) = found else {
        let text = "unreferenced files were not searched for, because a run may be writing, or results are missing or cannot be read";
        return Some(text.to_owned());
    };
    let artifacts = (found.files > 0).then(|| {
        let (removed, megabytes) = (found.removed, found.bytes as f64 / 1e6);
        let files = count(found.files, "file");
        if let Some(hours) = args.collect {
            format!(
                "removed {removed} of {files} not referenced by any result, {megabytes:.1} MB in all; the others are less than \
                 {hours} h old"
            )
        } else if args.repair {
            format!("removed {removed} of {files} not referenced by any result, {megabytes:.1} MB")
        } else {
            format!("{files} of {megabytes:.1} MB not referenced by any result; `check --repair` removes them")
        }
    });
    let unknown = (found.unknown > 0).then(|| {
        let files = count(found.unknown, "file");
        format!("{files} in the artifacts directory not written by this program, left untouched")
    });
    let lines: Vec<String> = artifacts.into_iter().chain(unknown).collect();
    (!lines.is_empty()).then(|| lines.join("\n"))
}
