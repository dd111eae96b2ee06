//! `check`: the project held against itself, and mended where it is asked for.

use std::fs::File;
use std::io;
use std::path::Path;

use anyhow::Context as _;
use clap::Args;

use super::context::Context;
use super::error_text;
use super::exit::ExitCode;
use super::output::{self, Palette, Tone};
use super::table::{Align, columns, count};
use crate::catalog::CatalogError;
use crate::check::{CheckOptions, CheckSummary, Finding, Kind, Notes, Spare, check as look};
use crate::runner::RunError;
use crate::store::{CATALOG_FILE, LockError, Project, RunLock};

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Put what is missing or changed back to be done, count anew, remove files that no row names; never a verdict
    #[arg(long)]
    pub(super) repair: bool,
    /// Compare the lengths of files only, not every byte
    #[arg(long)]
    pub(super) quick: bool,
}

/// Findings of a kind, and inputs, that are named on the screen.
const NAMED: usize = 5;

pub(super) async fn check(args: CheckArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let mut checked = once(&args, context).await;
    if is_of_database(&checked) {
        // The database calls some reads that the disk refused damage, so it is looked at twice, and at the disk itself.
        checked = once(&args, context).await;
    }
    let path = context.dir().join(CATALOG_FILE);
    if is_of_database(&checked) && !can_be_read(&path) {
        return Err(CatalogError::Unread(path).into());
    }
    let summary = match checked {
        Ok(summary) => summary,
        Err(error) => return unreadable(error, context),
    };
    if context.global.json {
        output::print_json(&summary)?;
    } else {
        output::print(&text(&summary, args.repair, context.output.out))?;
    }
    for command in next_steps(&summary, args.repair) {
        context.output.next(&context.command(command));
    }
    Ok(if summary.left() > 0 {
        ExitCode::Damaged
    } else {
        ExitCode::Done
    })
}

async fn once(args: &CheckArgs, context: &Context) -> anyhow::Result<CheckSummary> {
    if args.repair {
        repair(args, context).await
    } else {
        read(args, context).await
    }
}

/// Whether the database itself is said to be damaged.
fn is_of_database(checked: &anyhow::Result<CheckSummary>) -> bool {
    match checked {
        Ok(summary) => summary.damage.contains_key(&Kind::Database) && summary.left() > 0,
        Err(error) => {
            let error = error.chain().find_map(error_text::of_catalog);
            error.is_some_and(error_text::is_damaged_file)
        }
    }
}

/// Whether the disk gives every byte of a file.
fn can_be_read(path: &Path) -> bool {
    let read = File::open(path).and_then(|mut file| io::copy(&mut file, &mut io::sink()));
    read.is_ok()
}

/// Looks without changing anything, also while a run goes on.
async fn read(args: &CheckArgs, context: &Context) -> anyhow::Result<CheckSummary> {
    let (project, catalog) = context.reader().await?;
    let options = CheckOptions {
        quick: args.quick,
        repair: false,
        in_use: RunLock::is_held(&project),
    };
    let summary = look(&project, &catalog, options).await;
    catalog.close().await;
    Ok(summary?)
}

/// Mends, while no run can begin.
async fn repair(args: &CheckArgs, context: &Context) -> anyhow::Result<CheckSummary> {
    let (project, catalog) = context.writer().await?;
    let _lock = alone(&project).context("nothing was repaired")?;
    let options = CheckOptions {
        quick: args.quick,
        repair: true,
        in_use: false,
    };
    let summary = look(&project, &catalog, options).await;
    catalog.close().await;
    Ok(summary?)
}

/// The lock of the run, when no other process works on the project.
fn alone(project: &Project) -> Result<RunLock, RunError> {
    let lock = RunLock::acquire(project, false)?;
    if lock.is_alone() {
        Ok(lock)
    } else {
        Err(LockError::InUse { pid: None }.into())
    }
}

/// A catalog that cannot even be opened is damage too.
fn unreadable(error: anyhow::Error, context: &Context) -> anyhow::Result<ExitCode> {
    let of_catalog = error.chain().find_map(error_text::of_catalog);
    let Some(found) = of_catalog.filter(|error| error_text::is_damage(error)) else {
        return Err(error);
    };
    let dir = context.dir();
    let said = match error_text::sentence(found, &dir) {
        Some(said) if !error_text::is_damaged_file(found) => said,
        None if !error_text::is_damaged_file(found) => found.to_string(),
        Some(_) | None => format!(
            "{} is damaged so far that it cannot be read; put a backup in its place, then `check --repair`",
            error_text::file(&dir)
        ),
    };
    context.output.error(&said, ExitCode::Damaged);
    Ok(ExitCode::Damaged)
}

fn next_steps(summary: &CheckSummary, repaired: bool) -> Vec<&'static str> {
    let mendable = |kind: &Kind| *kind != Kind::Database && *kind != Kind::Reference;
    if summary.repaired.put_back > 0 {
        vec!["run"]
    } else if !repaired && summary.damage.keys().any(mendable) {
        vec!["check --repair"]
    } else {
        Vec::new()
    }
}

fn text(summary: &CheckSummary, repaired: bool, palette: Palette) -> String {
    let mut lines = vec![headline(summary, palette)];
    for kind in Kind::ALL {
        if let Some(found) = summary.damage.get(&kind) {
            let tone = if found.left > 0 {
                Tone::Bad
            } else {
                Tone::Warn
            };
            let head = format!("{}: {}", kind.heading(), found.found);
            lines.push(palette.paint(tone, head));
            lines.push(named(&found.first, found.found));
        }
    }
    if summary.damage.contains_key(&Kind::Database) && summary.left() > 0 {
        lines.push(
            "the catalog's file itself is damaged, so nothing was written to it: put a backup in its place, \
             then `check --repair`"
                .to_owned(),
        );
    }
    lines.extend(mended(summary, repaired));
    lines.extend(notes(&summary.inputs_missing, "not there"));
    lines.extend(notes(&summary.inputs_changed, "not what was read"));
    lines.extend(spare(summary.spare.as_ref(), repaired));
    lines.retain(|line| !line.is_empty());
    let lines = lines.iter().map(|line| line.trim_end());
    lines.collect::<Vec<_>>().join("\n") + "\n"
}

fn headline(summary: &CheckSummary, palette: Palette) -> String {
    let how = if summary.quick {
        "by length"
    } else {
        "byte by byte"
    };
    let looked = format!(
        "{} and {} of results looked at, {how}",
        count(summary.pairs, "pair"),
        count(summary.files, "file")
    );
    let verdict = match (summary.found(), summary.left()) {
        (0, _) => palette.paint(Tone::Good, "all is as it should be"),
        (found, 0) => palette.paint(Tone::Good, format!("{found} wrong, all mended")),
        (found, left) if left < found => {
            palette.paint(Tone::Bad, format!("{found} wrong, {left} left"))
        }
        (found, _) => palette.paint(Tone::Bad, format!("{found} wrong")),
    };
    format!("{looked}: {verdict}")
}

/// The first findings of a kind, a line each.
fn named(first: &[Finding], found: u64) -> String {
    let row = |finding: &Finding| match (&finding.pair, finding.stage) {
        (Some(pair), Some(stage)) => {
            vec![format!("  {pair}"), stage.to_string(), finding.what.clone()]
        }
        _ => vec![format!("  {}", finding.what)],
    };
    let mut rows: Vec<_> = first.iter().take(NAMED).map(row).collect();
    let more = found.saturating_sub(rows.len() as u64);
    if more > 0 {
        rows.push(vec![format!("  and {more} more")]);
    }
    columns(&rows, &[Align::Left; 3])
}

fn mended(summary: &CheckSummary, repaired: bool) -> Vec<String> {
    let done = &summary.repaired;
    let mut lines = Vec::new();
    for (is_done, what) in [
        (done.indexes, "the indexes were made anew"),
        (done.schema, "what was gone of the schema was made anew"),
        (done.counters, "the counters were counted anew"),
    ] {
        if is_done {
            lines.push(what.to_owned());
        }
    }
    if repaired && done.put_back > 0 {
        let pairs = count(done.put_back, "pair");
        lines.push(format!(
            "{pairs} put back to be done again from the stage named"
        ));
    }
    lines
}

fn notes(notes: &Notes, what: &str) -> Option<String> {
    (notes.count > 0).then(|| {
        let mut named = notes.first.iter().take(NAMED).cloned().collect::<Vec<_>>();
        let more = notes.count.saturating_sub(named.len() as u64);
        if more > 0 {
            named.push(format!("and {more} more"));
        }
        let files = count(notes.count, "input file");
        let verb = if notes.count == 1 { "is" } else { "are" };
        format!("{files} {verb} {what}: {}", named.join(", "))
    })
}

fn spare(spare: Option<&Spare>, repaired: bool) -> Option<String> {
    let Some(spare) = spare else {
        let text = "files that no result names were not looked for, because a run may be writing";
        return Some(text.to_owned());
    };
    let megabytes = spare.bytes as f64 / 1e6;
    let files = count(spare.files, "file");
    let ours = match (spare.files, repaired) {
        (0, _) => None,
        (_, false) => Some(format!(
            "{files} of {megabytes:.1} MB that no result names; `check --repair` removes them"
        )),
        (_, true) => Some(format!(
            "{} of {files} that no result names removed, {megabytes:.1} MB",
            spare.removed
        )),
    };
    let strangers = (spare.strangers > 0).then(|| {
        let files = count(spare.strangers, "file");
        format!("{files} in the artifacts folder not of this program, left alone")
    });
    let lines: Vec<String> = ours.into_iter().chain(strangers).collect();
    (!lines.is_empty()).then(|| lines.join("\n"))
}
