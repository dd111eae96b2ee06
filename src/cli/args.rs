//! The command line as clap reads it: global flags and the list of commands.

use std::path::PathBuf;

use clap::builder::{Resettable, StyledStr};
use clap::{ArgAction, Args, CommandFactory as _, Parser, Subcommand, ValueEnum};

use super::exit::ExitCode;
use super::{
    agreement, backup, check, completions, config, contact_sheet, demo, export, import, man,
    report, retry, review, run, show, status, verdict,
};

/// Aligns 3D scans of carved woodblock characters with images of their prints.
///
/// A project is a directory with a catalog and artifacts. `import` makes one from your files, `run` aligns what
/// is left to align, `report` prints the table. A run that was stopped goes on where it was.
#[derive(Debug, Parser)]
#[command(name = "mocban", version, after_help = ExitCode::table(), subcommand_required = true, arg_required_else_help = true)]
pub(super) struct Cli {
    /// Flags of every command.
    #[command(flatten)]
    pub(super) global: Global,
    /// What to do.
    #[command(subcommand)]
    pub(super) command: Command,
}

/// The command line with its help as a terminal shows it: without the marks of code in its texts.
pub(super) fn command() -> clap::Command {
    unmarked(Cli::command())
}

fn unmarked(command: clap::Command) -> clap::Command {
    let about = plain(command.get_about());
    let long_about = plain(command.get_long_about());
    command
        .mut_args(|arg| {
            let (help, long_help) = (plain(arg.get_help()), plain(arg.get_long_help()));
            arg.help(help).long_help(long_help)
        })
        .mut_subcommands(unmarked)
        .about(about)
        .long_about(long_about)
}

fn plain(text: Option<&StyledStr>) -> Resettable<StyledStr> {
    text.map_or(Resettable::Reset, |text| {
        Resettable::Value(text.to_string().replace('`', "").into())
    })
}

/// Flags of every command.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Global options")]
pub(super) struct Global {
    /// The project's directory [default: the current one]
    #[arg(short = 'C', value_name = "DIR", global = true)]
    pub(super) directory: Option<PathBuf>,
    /// Settings from this file in the place of the project's mocban.toml; "default" and "paper" are built in
    #[arg(long, value_name = "FILE", global = true)]
    pub(super) config: Option<String>,
    /// One setting, stronger than any file, such as run.workers=2; may be given many times
    #[arg(long, value_name = "SECTION.KEY=VALUE", global = true, action = ArgAction::Append)]
    pub(super) set: Vec<String>,
    /// Say nothing but warnings and errors
    #[arg(short, long, global = true)]
    pub(super) quiet: bool,
    /// Log more; -vv logs all
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub(super) verbose: u8,
    /// Answer in JSON on stdout
    #[arg(long, global = true)]
    pub(super) json: bool,
    /// When to colour: auto, always or never
    #[arg(
        long,
        hide_possible_values = true,
        value_name = "WHEN",
        global = true,
        default_value = "auto"
    )]
    pub(super) color: ColorWhen,
    /// Form of the log: text or json
    #[arg(
        long,
        hide_possible_values = true,
        value_name = "FORM",
        global = true,
        default_value = "text"
    )]
    pub(super) log_format: LogFormat,
    /// Log to this file instead of stderr; it is appended to
    #[arg(long, value_name = "FILE", global = true)]
    pub(super) log_file: Option<PathBuf>,
    /// How a run shows its progress on stderr: auto, bar, plain, json or none
    #[arg(
        long,
        hide_possible_values = true,
        value_name = "HOW",
        global = true,
        default_value = "auto"
    )]
    pub(super) progress: ProgressMode,
}

/// When to colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ColorWhen {
    /// On a terminal, unless `NO_COLOR` is set.
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// Form of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object a line.
    Json,
}

/// How a run shows its progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ProgressMode {
    /// A bar on a terminal, plain lines elsewhere.
    Auto,
    /// A bar.
    Bar,
    /// A line every ten seconds or five per cent.
    Plain,
    /// One JSON object an event.
    Json,
    /// Nothing.
    None,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Make the built-in dataset, run it and print the report
    Demo(demo::DemoArgs),
    /// Take pairs of meshes and prints into the project
    Import(import::ImportArgs),
    /// Align the pairs that are left to align
    Run(run::RunArgs),
    /// Show on one screen where the project stands
    Status(status::StatusArgs),
    /// Show one pair: numbers, files, history, and why it runs again
    Show(show::ShowArgs),
    /// Take failed pairs up again at the next run
    Retry(retry::RetryArgs),
    /// Hold files, rows and counters against each other
    Check(check::CheckArgs),
    /// Copy the catalog and the verdicts to a file, also while a run goes on
    Backup(backup::BackupArgs),
    /// Record what people say of the results
    #[command(subcommand)]
    Verdict(verdict::VerdictCommand),
    /// Judge results in the browser, by keys, and lay reliefs by hand
    Review(review::ReviewArgs),
    /// Measure how far reviewers agree with each other and with themselves, and which planted errors they catch
    Agreement(agreement::AgreementArgs),
    /// Print the table of all results
    Report(report::ReportArgs),
    /// Write the aligned pairs for other tools
    Export(export::ExportArgs),
    /// Draw many overlays on one PNG, worst first
    #[command(visible_alias = "sheet")]
    ContactSheet(contact_sheet::ContactSheetArgs),
    /// Show the settings in force
    #[command(subcommand)]
    Config(config::ConfigCommand),
    /// Print a completion script for a shell
    Completions(completions::CompletionsArgs),
    /// Write the manual pages
    Man(man::ManArgs),
}

#[cfg(test)]
mod tests {
    use super::command;

    #[test]
    fn command_line_is_sound() {
        command().debug_assert();
    }

    #[test]
    fn help_is_without_the_marks_of_code() {
        fn check(mut command: clap::Command) {
            let help = command.render_long_help().to_string();
            assert!(!help.contains('`'), "{help}");
            command.get_subcommands().cloned().for_each(check);
        }
        let shown = command().render_long_help().to_string();
        assert!(
            shown.contains("import makes one from your files"),
            "{shown}"
        );
        check(command());
    }
}
