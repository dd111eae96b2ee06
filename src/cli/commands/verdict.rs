//! `verdict`: people's verdicts on the results, in an append-only log.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::screen::{Palette, Tone};
use crate::cli::output::streams;
use crate::cli::output::table::{columns, count};
use mocban_catalog::{
    FaultyRow, ImportedVerdicts, NewVerdict, ReviewContext, SetApart, VerdictEvent, reviewer_name,
};
use mocban_core::domain::shell::shell_quoted;
use mocban_core::domain::{Reason, ThresholdMetric, Verdict, one_line};
use mocban_project::files::{self, ListFile};
use mocban_project::verdict_words;
use mocban_project::verdicts::{self, RecordedVerdict, VerdictFileImport, VerdictLog};
use mocban_project::{ExitCode, ProjectResult};
use mocban_system::time_text::{duration, local};

/// Commands on verdicts.
#[derive(Debug, Subcommand)]
pub(crate) enum VerdictCommand {
    /// Record one verdict on the current result of a pair
    Set(VerdictSetArgs),
    /// Record the verdicts of a CSV or XLSX file (columns pair, verdict, reviewer, and optionally metric, reason, note, at,
    /// `angle_read_deg`), or of the verdicts.jsonl of an export
    Import(VerdictImportArgs),
    /// Print the log, oldest first
    Log(VerdictLogArgs),
    /// Undo a reviewer's newest verdict, or the last few; the log keeps them, marked as undone
    Undo(VerdictUndoArgs),
}

/// Arguments of `verdict set`.
#[derive(Debug, Args)]
pub(crate) struct VerdictSetArgs {
    /// The pair
    pub(crate) pair: String,
    /// The verdict: pass, fail or unsure, or a word of the review page
    #[arg(value_parser = verdict_words::verdict)]
    pub(crate) verdict: Verdict,
    /// Name of the reviewer
    #[arg(long, value_name = "NAME", alias = "reader", value_parser = reviewer_name)]
    pub(crate) reviewer: String,
    /// Accept a new reviewer whose name differs from that of another only in case or accents
    #[arg(long)]
    pub(crate) new_reviewer: bool,
    /// Only the result of this metric: `nl_ssim`, density, ensemble or relief [default: all]
    #[arg(long, value_parser = verdict_words::metric)]
    pub(crate) metric: Option<ThresholdMetric>,
    /// Reason of a failure: angle, `strokes_lost`, `background_in`, `shift_or_scale`, mirrored or `wrong_pair`
    #[arg(long, value_parser = verdict_words::reason)]
    pub(crate) reason: Option<Reason>,
    /// Free text
    #[arg(long, value_name = "TEXT")]
    pub(crate) note: Option<String>,
    /// Remaining rotation of the relief to match the print, degrees clockwise
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = angle)]
    pub(crate) angle: Option<f64>,
    /// Settle a conflict: judge only results on which two others disagree
    #[arg(long)]
    pub(crate) adjudicate: bool,
}

/// Arguments of `verdict import`.
#[derive(Debug, Args)]
pub(crate) struct VerdictImportArgs {
    /// The file
    pub(crate) file: PathBuf,
    /// Sheet of an XLSX file [default: the first one]
    #[arg(long, value_name = "NAME")]
    pub(crate) sheet: Option<String>,
    /// Accept new reviewers whose names differ from those of others only in case or accents
    #[arg(long)]
    pub(crate) new_reviewer: bool,
}

/// Arguments of `verdict log`.
#[derive(Debug, Args)]
pub(crate) struct VerdictLogArgs {
    /// Only this pair
    pub(crate) pair: Option<String>,
}

/// Arguments of `verdict undo`.
#[derive(Debug, Args)]
pub(crate) struct VerdictUndoArgs {
    /// Only verdicts of this reviewer; may be left out if nobody else has verdicts
    #[arg(long, value_name = "NAME", alias = "reader", value_parser = reviewer_name)]
    pub(crate) reviewer: Option<String>,
    /// Undo this many of the newest verdicts. One on several metrics counts once, and each row of an imported list is one
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) last: u32,
}

/// Parses an angle from -180 to 180 degrees.
fn angle(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(angle) if angle.abs() <= 180.0 => Ok(angle),
        Ok(_) | Err(_) => Err("an angle is a number from -180 to 180".to_owned()),
    }
}

pub(crate) async fn verdict(command: VerdictCommand, context: &Context) -> ProjectResult<ExitCode> {
    match command {
        VerdictCommand::Set(args) => set(args, context).await,
        VerdictCommand::Import(args) => import(args, context).await,
        VerdictCommand::Log(args) => log(args, context).await,
        VerdictCommand::Undo(args) => undo(args, context).await,
    }
}

async fn set(args: VerdictSetArgs, context: &Context) -> ProjectResult<ExitCode> {
    let verdict = |pair| NewVerdict {
        pair,
        metric: args.metric,
        verdict: args.verdict,
        reviewer: args.reviewer,
        reason: args.reason,
        note: args.note,
        context: ReviewContext {
            angle_read_deg: args.angle,
            ..ReviewContext::default()
        },
        at: None,
    };
    let (pair, is_new_allowed) = (&args.pair, args.new_reviewer);
    if args.adjudicate {
        let settled = verdicts::settle(pair, None, verdict, is_new_allowed, &context.location);
        context.info(&settled_text(&settled.await?));
        return Ok(ExitCode::Done);
    }
    let recorded = verdicts::record(pair, None, verdict, is_new_allowed, &context.location);
    let (new, recorded) = recorded.await?;
    context.info(&if recorded == RecordedVerdict::New {
        set_text(&new)
    } else {
        format!("{} is already recorded", verdict_text(&new))
    });
    Ok(ExitCode::Done)
}

/// Returns what `verdict set` recorded, and how to record less or to take it back.
fn set_text(new: &NewVerdict) -> String {
    let undo = format!("`verdict undo --reviewer {}`", shell_quoted(&new.reviewer));
    let one_only = match new.metric {
        Some(_) => "",
        None => ", and --metric judges the result of one metric only",
    };
    format!("{}; {undo} takes it back{one_only}", verdict_text(new))
}

/// Returns which conflicts `verdict set --adjudicate` settled, and how to take it back.
fn settled_text((new, metrics): &(NewVerdict, Vec<ThresholdMetric>)) -> String {
    let NewVerdict {
        pair,
        reviewer,
        verdict,
        ..
    } = new;
    let metrics: Vec<&str> = metrics.iter().map(|metric| metric.name()).collect();
    let (metrics, reviewer) = (metrics.join(", "), shell_quoted(reviewer));
    let what = match verdict {
        Verdict::Unsure => "is recorded, and the conflict stays open",
        Verdict::Pass | Verdict::Fail => "settles the conflict",
    };
    format!(
        "{pair}, {metrics}: {verdict} {what}; `verdict undo --reviewer {reviewer}` takes it back"
    )
}

/// Returns `b01-0117, density: pass`.
fn verdict_text(new: &NewVerdict) -> String {
    let metric = new.metric.map_or("all metrics", ThresholdMetric::name);
    format!("{}, {metric}: {}", new.pair, new.verdict)
}

async fn import(args: VerdictImportArgs, context: &Context) -> ProjectResult<ExitCode> {
    let ListFile { bytes, warning } = files::read_list(&args.file, args.sheet.as_deref())?;
    let (file, location) = (&args.file, &context.location);
    let imported = verdicts::import(file, bytes, args.new_reviewer, location).await;
    // Also of a list that is refused, whose table may be on another sheet.
    if let Some(warning) = &warning {
        context.warn(warning);
    }
    let VerdictFileImport {
        counts,
        first_older,
        warnings,
    } = imported?;
    for warning in warnings {
        context.warn(&warning);
    }
    let ImportedVerdicts {
        recorded: number,
        known,
        left_out,
        older,
        ..
    } = counts;
    context.print_json(
        &json!({"schema": 1, "recorded": number, "left_out": left_out, "known": known, "older": older}),
    )?;
    if left_out > 0 {
        let left_out = count(left_out, "verdict");
        context.warn(&format!(
            "{left_out} left out: the judged result is not the current one of the pair"
        ));
    }
    if let Some(line) = first_older {
        let older = count(older, "verdict");
        context.warn(&format!(
            "{older} left out where the reviewer judged the same result later, first on line {line}"
        ));
    }
    if known > 0 {
        context.info(&format!("{} already recorded", count(known, "verdict")));
    }
    let undo = match number {
        0 | 1 => "",
        _ => "; `verdict undo --reviewer NAME --last N` takes back the newest N of one reviewer",
    };
    context.info(&format!("{} recorded{undo}", count(number, "verdict")));
    context.next("report");
    Ok(ExitCode::Done)
}

async fn log(args: VerdictLogArgs, context: &Context) -> ProjectResult<ExitCode> {
    let log = verdicts::log(args.pair.as_deref(), &context.location).await?;
    let VerdictLog { events, damaged } = log;
    context.warn_about_set_apart(&SetApart::of(&damaged));
    if context.global.json {
        for event in &events {
            streams::print_json_text(&serde_json::to_string(event)?)?;
        }
        for row in &damaged {
            let row = json!({"set_apart": {
                "table": row.table.name(), "row": row.row, "pair": row.pair, "fault": row.fault.name(), "values": row.values,
            }});
            streams::print_json_text(&row.to_string())?;
        }
    } else if events.is_empty() && damaged.is_empty() {
        context.info("no verdicts yet");
    } else {
        streams::print(&log_text(&events, context.stdout))?;
        if !damaged.is_empty() {
            streams::print(&damaged_text(&damaged, context.stdout))?;
        }
    }
    Ok(ExitCode::Done)
}

/// Formats damaged rows of the log with all their values, one line each.
fn damaged_text(rows: &[FaultyRow], palette: Palette) -> String {
    let line = |row: &FaultyRow| {
        let values = row.values.iter();
        let values = values.map(|(name, value)| format!("{name}={value}"));
        let text = format!("{row}: {}", values.collect::<Vec<_>>().join(" "));
        let head = palette.paint(Tone::Bad, "set apart");
        format!("{head}  {}\n", one_line(&text))
    };
    rows.iter().map(line).collect()
}

async fn undo(args: VerdictUndoArgs, context: &Context) -> ProjectResult<ExitCode> {
    let undone = verdicts::undo(args.reviewer.as_deref(), args.last, &context.location).await?;
    context.print_json(&json!({"schema": 1, "undone": undone}))?;
    for event in &undone {
        context.info(&format!(
            "undone: {} for {} {} by {}",
            event.verdict, event.pair, event.metric, event.reviewer
        ));
    }
    Ok(ExitCode::Done)
}

/// Formats the log, one line per event.
pub(crate) fn log_text(events: &[VerdictEvent], palette: Palette) -> String {
    let rows = events.iter().map(|event| log_row(event, palette));
    columns(rows, "<<<<<<<<<")
}

fn log_row(event: &VerdictEvent, palette: Palette) -> Vec<String> {
    let tone = match event.verdict {
        Verdict::Pass => Tone::Good,
        Verdict::Fail => Tone::Bad,
        Verdict::Unsure => Tone::Warn,
    };
    let state = match (event.undone_at, event.current) {
        (Some(at), _) => format!("undone {}", local(at)),
        (None, true) => String::new(),
        (None, false) => "on an older result".to_owned(),
    };
    vec![
        local(event.at),
        event.pair.to_string(),
        event.metric.to_string(),
        palette.paint(tone, event.verdict),
        event.reviewer.clone(),
        event.reason.map_or("", Reason::name).to_owned(),
        view_text(&event.context),
        event.note.clone().unwrap_or_default(),
        state,
    ]
}

/// Formats how long the result was shown, and by how many degrees the reviewer would still rotate the relief.
fn view_text(context: &ReviewContext) -> String {
    let shown = context.shown_ms.map(duration);
    let angle = context.angle_read_deg.map(|angle| format!("{angle:+}°"));
    let parts: Vec<String> = shown.into_iter().chain(angle).collect();
    parts.join(" ")
}
