//! `export`: writes the aligned pairs for other tools.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde_json::{Value, json};

use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use crate::cli::output::terminal::Terminal;
use mocban_core::domain::{ThresholdMetric, any_case};
use mocban_export::{
    ExportFormat, ExportOptions, ExportSummary, ResultFilter, SplitBy, SplitCounts, SplitSettings,
    SplitShares,
};
use mocban_project::export::{ExportedProject, export as export_project};
use mocban_project::{ExitCode, ProjectResult};

/// Arguments of `export`.
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// Formats, separated by commas. One format is written to DIR itself, several each to DIR/FORMAT
    #[arg(
        long,
        value_name = "FORMAT",
        default_value = "jsonl",
        value_delimiter = ',',
        ignore_case = true,
        value_parser = one_of::<ExportFormat>(ExportFormat::ALL.map(described))
    )]
    pub(crate) to: Vec<ExportFormat>,
    /// The directory to write; an earlier export there is replaced as a whole
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Export only these metrics, separated by commas
    #[arg(
        long,
        value_name = "METRIC",
        value_delimiter = ',',
        ignore_case = true,
        value_parser = one_of::<ThresholdMetric>(ThresholdMetric::ALL.map(ThresholdMetric::name))
    )]
    pub(crate) metric: Vec<ThresholdMetric>,
    /// Export only results that the reviewers passed, or whose confidence is not low
    #[arg(
        long,
        value_name = "WHICH",
        default_value = "all",
        ignore_case = true,
        value_parser = one_of::<ResultFilter>(ResultFilter::ALL.map(ResultFilter::name))
    )]
    pub(crate) only: ResultFilter,
    /// Export only results with at least this confidence, from 0 to 1
    #[arg(long, value_name = "P", value_parser = share)]
    pub(crate) min_confidence: Option<f64>,
    /// Warp the print and all aligned pictures to a square of PX pixels with the ink centred
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub(crate) canvas: Option<u32>,
    /// Divide the pairs: percent of train, validation and test, such as 80/10/10
    #[arg(long, value_name = "PERCENT")]
    pub(crate) split: Option<SplitShares>,
    /// What keeps pairs in one part of the split
    #[arg(
        long,
        value_name = "GROUP",
        requires = "split",
        default_value = "block",
        ignore_case = true,
        value_parser = one_of::<SplitBy>(SplitBy::ALL.map(SplitBy::name))
    )]
    pub(crate) by: SplitBy,
    /// Seed of the split
    #[arg(long, value_name = "N", requires = "split", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Begin CSV files with a byte order mark, so that Excel reads them as UTF-8
    #[arg(long)]
    pub(crate) csv_bom: bool,
    /// Write CSV files with semicolons and decimal commas, as Excel in Vietnamese reads them
    #[arg(long)]
    pub(crate) csv_decimal_comma: bool,
    /// Include pictures in Parquet tables
    #[arg(long)]
    pub(crate) images: bool,
    /// Size in MiB at which the next shard of webdataset or huggingface begins; 256 by default
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=16384))]
    pub(crate) shard_mib: Option<u64>,
    /// Licence of the data in the dataset card, such as cc-by-4.0
    #[arg(long, value_name = "LICENCE")]
    pub(crate) license: Option<String>,
    /// Include computing times; the output then differs from run to run
    #[arg(long)]
    pub(crate) with_times: bool,
}

/// Returns the name of a format with its purpose, for help and completion.
fn described(format: ExportFormat) -> PossibleValue {
    PossibleValue::new(format.name()).help(format.summary())
}

/// Returns a parser of names in any case, which lists them in help, in errors and for completion.
fn one_of<T: FromStr<Err = String> + Clone + Send + Sync + 'static>(
    names: impl IntoIterator<Item = impl Into<PossibleValue>>,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(names).try_map(|name| any_case::<T>(&name))
}

/// Parses a number from 0 to 1.
fn share(text: &str) -> Result<f64, String> {
    let number = text
        .parse()
        .ok()
        .filter(|number| (0.0..=1.0).contains(number));
    number.ok_or_else(|| format!("{text:?} is not a number from 0 to 1"))
}

impl ExportArgs {
    /// Returns the formats, each once, in the order given.
    fn formats(&self) -> Vec<ExportFormat> {
        let mut formats = Vec::new();
        for format in &self.to {
            if !formats.contains(format) {
                formats.push(*format);
            }
        }
        formats
    }
}

pub(crate) async fn export(args: ExportArgs, context: &Context) -> ProjectResult<ExitCode> {
    let limits = context.location.settings()?.config.limits;
    let options = ExportOptions {
        only: args.only,
        min_confidence: args.min_confidence,
        canvas_px: args.canvas,
        split: args.split.map(|shares| SplitSettings {
            shares,
            by: args.by,
            seed: args.seed,
        }),
        with_times: args.with_times,
        csv_bom: args.csv_bom,
        csv_decimal_comma: args.csv_decimal_comma,
        images: args.images,
        shard_mib: args.shard_mib,
        license: args.license.clone(),
        ..ExportOptions::all_of(&args.metric, limits)
    };
    let (location, terminal) = (&context.location, Terminal::new(context));
    let formats = args.formats();
    let exported = export_project(&args.output, &formats, options, location, &terminal);
    let exported = exported.await?;
    print_summary(&exported, &args, context)?;
    Ok(if exported.summary.is_complete() {
        ExitCode::Done
    } else {
        ExitCode::SomeFailed
    })
}

fn print_summary(
    exported: &ExportedProject,
    args: &ExportArgs,
    context: &Context,
) -> ProjectResult<()> {
    let summary = &exported.summary;
    let unreadable = summary.unreadable.iter();
    let unreadable = unreadable.map(|(pair, why)| json!({"id": pair, "error": why}));
    let blocks = summary.unreadable_blocks.iter();
    let blocks = blocks.map(|(block, why)| json!({"block": block, "error": why}));
    let left_out_by = summary.left_out.iter();
    let left_out_by = left_out_by.map(|(reason, number)| (reason.name().to_owned(), number.into()));
    let left_out_by: serde_json::Map<String, Value> = left_out_by.collect();
    context.print_json(&json!({
        "schema": 1,
        "set_apart": summary.set_apart,
        "done": summary.pairs.done,
        "without_result": summary.pairs.without_result,
        "left_out": summary.pairs.left_out,
        "left_out_by": left_out_by,
        "split": summary.split.map(|SplitCounts { pairs: [train, validation, test], .. }| {
            json!({"train": train, "validation": validation, "test": test})
        }),
        "unreadable": unreadable.collect::<Vec<_>>(),
        "unreadable_blocks": blocks.collect::<Vec<_>>(),
        "kept_earlier": summary.kept_earlier,
    }))?;
    let missing = exported.missing_inputs.as_ref();
    let unexplained = unexplained(exported);
    for warning in &unexplained {
        context.warn(warning);
    }
    if let Some(missing) = missing {
        context.warn(&missing.to_string());
    }
    let shown = args.output.display();
    if summary.kept_earlier {
        let lost = lost_files(summary);
        context.info(&format!(
            "the earlier export in {shown} was kept, because the new one would lack the files of {lost}; repair them, or export to a new directory"
        ));
    } else {
        print_done(exported, args, context);
    }
    if let Some((path, why)) = &summary.leftover {
        context.warn(&format!(
            "the earlier export was replaced but could not be removed from {}: {why}; the next export removes it",
            path.display()
        ));
    }
    if !summary.is_complete() {
        // A run trusts the catalog, so the check must come first. If most files or only inputs are missing, it says what to do.
        let is_all_explained = missing.is_some() && unexplained.is_empty();
        if is_all_explained || summary.unreadable.len() as u64 > summary.pairs.done {
            context.next("check");
        } else {
            context.next("check --repair");
            context.next("run");
        }
    }
    Ok(())
}

/// Returns a warning for each pair and block whose files cannot be read for another reason than a missing folder.
fn unexplained(exported: &ExportedProject) -> Vec<String> {
    let (summary, missing) = (&exported.summary, exported.missing_inputs.as_ref());
    let is_explained = |why: &str| missing.is_some_and(|missing| missing.explains(why));
    let blocks = summary.unreadable_blocks.iter();
    let blocks = blocks
        .filter(|(_, why)| !is_explained(why))
        .map(|(block, why)| format!("the export lacks files of block {block}: {why}"));
    let pairs = summary.unreadable.iter();
    let pairs = pairs
        .filter(|(_, why)| !is_explained(why))
        .map(|(pair, why)| format!("the export has no files of {pair}: {why}"));
    blocks.chain(pairs).collect()
}

/// Returns how many pairs and blocks have files that cannot be read.
fn lost_files(summary: &ExportSummary) -> String {
    let numbers = [
        (summary.unreadable.len(), "pair"),
        (summary.unreadable_blocks.len(), "block"),
    ];
    let lost = numbers.into_iter().filter(|(number, _)| *number > 0);
    let lost: Vec<String> = lost
        .map(|(number, what)| count(number as u64, what))
        .collect();
    lost.join(" and ")
}

/// Returns where the files are explained, and what is unusual about tables.
fn explanation(args: &ExportArgs) -> String {
    let formats = args.formats();
    let readme = match formats.len() {
        1 => format!(
            "{} explains the files",
            args.output.join("README.md").display()
        ),
        _ => "README.md in each directory explains its files".to_owned(),
    };
    let is_table = |format: &ExportFormat| {
        matches!(
            format,
            ExportFormat::Jsonl | ExportFormat::Csv | ExportFormat::Parquet
        )
    };
    let tables = if formats.iter().any(is_table) {
        "; a row of a table is one pair and metric"
    } else {
        ""
    };
    let excel = if formats.contains(&ExportFormat::Csv) && !args.csv_bom {
        "; for Excel, add --csv-bom"
    } else {
        ""
    };
    readme + tables + excel
}

fn print_done(exported: &ExportedProject, args: &ExportArgs, context: &Context) {
    let summary = &exported.summary;
    let unreadable = match summary.unreadable.len() {
        0 => String::new(),
        lost => format!(", {lost} with missing or changed files"),
    };
    let without_result = match summary.pairs.without_result {
        0 => String::new(),
        pairs => format!(", {pairs} without a result"),
    };
    let left_out = match summary.pairs.left_out {
        0 => String::new(),
        left_out => {
            let reasons = summary.left_out.text(exported.least_confidence);
            format!(", {left_out} left out ({reasons})")
        }
    };
    context.info(&format!(
        "{} exported to {}{without_result}{left_out}{unreadable}",
        count(summary.pairs.done, "pair"),
        args.output.display()
    ));
    context.info(&explanation(args));
    if summary.pairs.done == 0 && summary.pairs.without_result > 0 {
        context.next("status");
    }
    if let Some(counts) = &summary.split {
        let [train, validation, test] = counts.pairs;
        context.info(&format!(
            "split: {train} train, {validation} validation, {test} test"
        ));
        if counts.is_uneven() {
            let why = match args.by {
                SplitBy::Pair => "there are too few pairs".to_owned(),
                by => format!("the pairs of a {by} stay together, and there are too few {by}s"),
            };
            context.warn(&format!("the split differs from its percentages: {why}"));
        }
    }
}
