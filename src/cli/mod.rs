//! The command line: one thin file a command.

mod agreement;
mod args;
mod backup;
mod check;
mod compare;
mod completions;
mod config;
mod contact_sheet;
mod context;
mod demo;
mod error_text;
mod exit;
mod export;
mod failures;
mod files;
mod import;
mod logging;
mod man;
mod manifest_file;
mod output;
mod panics;
mod progress;
mod report;
mod retry;
mod review;
mod run;
mod run_progress;
mod select;
mod show;
mod show_hand;
mod show_text;
mod signals;
mod status;
mod table;
mod time_text;
mod truth_file;
mod verdict;
mod verdict_file;
mod verdict_lines;

use std::ffi::OsString;

use clap::{ColorChoice, FromArgMatches};
use tokio::runtime::{Builder, Runtime};

use crate::catalog::CatalogError;
use crate::config::ConfigError;
use crate::runner::RunError;
use crate::store::StoreError;

use args::{Cli, Command};
use context::Context;
pub use exit::ExitCode;
use exit::Refusal;
use manifest_file::RefusedManifest;
use truth_file::TruthFileError;
use verdict_file::VerdictFileError;

/// Letters that stand for flags without a value, so that others may follow in the same word.
const FLAGS: [char; 6] = ['h', 'n', 'q', 'v', 'V', 'w'];

/// Reads the command line, does what it says, and tells the exit code. Errors are shown here, once.
pub fn main(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args: Vec<OsString> = args.into_iter().collect();
    let cli = match parse(&args) {
        Ok(cli) => cli,
        Err(error) => {
            // A closed stream is all that can go wrong here, and then nobody reads the reason.
            let _ = error.print();
            return match error.exit_code() {
                0 => ExitCode::Done,
                _ => ExitCode::Usage,
            };
        }
    };
    let context = Context::new(cli.global, args.first());
    panics::log_only();
    let work = || match start(cli.command, &context) {
        Ok(code) => code,
        Err(error) => conclude(&error, &context),
    };
    panics::caught(work, |text| context.output.error(text, ExitCode::Error))
}

fn parse(args: &[OsString]) -> Result<Cli, clap::Error> {
    let command = args::command().color(help_color(args));
    let mut cli = Cli::from_arg_matches(&command.try_get_matches_from(args)?)?;
    // clap lets those behind the command's name take the place of those before it.
    cli.global.set = values_of("--set", args);
    cli.global.verbose = times_verbose(args);
    Ok(cli)
}

/// How often `-v` stands on a command line that clap has taken, where a word with a dash in front is never a value.
fn times_verbose(args: &[OsString]) -> u8 {
    let words = args.iter().skip(1).filter_map(|arg| arg.to_str());
    let words = words.take_while(|word| *word != "--");
    let times = words.map(|word| match word.strip_prefix('-') {
        Some("-verbose") => 1,
        // Behind a letter that takes a value stands its value.
        Some(letters) => {
            let flags = letters.chars().take_while(|c| FLAGS.contains(c));
            flags.filter(|c| *c == 'v').count()
        }
        None => 0,
    });
    u8::try_from(times.sum::<usize>()).unwrap_or(u8::MAX)
}

/// Help and usage errors come before the flags are read, so `--color` is looked for by hand.
fn help_color(args: &[OsString]) -> ColorChoice {
    let asked = values_of("--color", args);
    let known = asked.iter().find_map(|value| match value.as_str() {
        "never" => Some(ColorChoice::Never),
        "always" => Some(ColorChoice::Always),
        _ => None,
    });
    known.unwrap_or(ColorChoice::Auto)
}

/// Every value of a flag, wherever on the command line it stands.
fn values_of(flag: &str, args: &[OsString]) -> Vec<String> {
    let words = args.iter().skip(1).filter_map(|arg| arg.to_str());
    let mut words = words.take_while(|word| *word != "--");
    let mut values = Vec::new();
    while let Some(word) = words.next() {
        let joined = word.strip_prefix(flag);
        let value = match joined {
            Some("") => words.next(),
            Some(rest) => rest.strip_prefix('='),
            None => None,
        };
        values.extend(value.map(str::to_owned));
    }
    values
}

fn start(command: Command, context: &Context) -> anyhow::Result<ExitCode> {
    logging::start(&context.global, &context.screen)?;
    let runtime = runtime(&command)?;
    let result = runtime.block_on(dispatch(command, context));
    runtime.shutdown_background();
    result
}

/// A run computes on threads of its own, and what is left is many short tasks that hand things to each other: on one
/// thread they need not wake another for it.
fn runtime(command: &Command) -> std::io::Result<Runtime> {
    let mut builder = match command {
        Command::Run(_) | Command::Demo(_) => Builder::new_current_thread(),
        _ => Builder::new_multi_thread(),
    };
    builder.worker_threads(2).enable_all().build()
}

async fn dispatch(command: Command, context: &Context) -> anyhow::Result<ExitCode> {
    match command {
        Command::Demo(args) => demo::demo(args, context).await,
        Command::Import(args) => import::import(args, context).await,
        Command::Run(args) => run::run(args, context).await,
        Command::Status(args) => status::status(args, context).await,
        Command::Show(args) => show::show(args, context).await,
        Command::Retry(args) => retry::retry(args, context).await,
        Command::Check(args) => check::check(args, context).await,
        Command::Backup(args) => backup::backup(args, context).await,
        Command::Verdict(command) => verdict::verdict(command, context).await,
        Command::Review(args) => review::review(args, context).await,
        Command::Agreement(args) => agreement::agreement(args, context).await,
        Command::Report(args) => report::report(args, context).await,
        Command::Export(args) => export::export(args, context).await,
        Command::ContactSheet(args) => contact_sheet::contact_sheet(args, context).await,
        Command::Config(command) => config::config(&command, context),
        Command::Completions(args) => completions::completions(&args),
        Command::Man(args) => man::man(&args, context),
    }
}

/// Shows an error with a way on, and finds its exit code.
fn conclude(error: &anyhow::Error, context: &Context) -> ExitCode {
    if is_closed_pipe(error) {
        return ExitCode::Done;
    }
    let code = code_of(error);
    let of_catalog = error.chain().find_map(error_text::of_catalog);
    let explained = of_catalog.and_then(|found| error_text::sentence(found, &context.dir()));
    context
        .output
        .error(&explained.unwrap_or_else(|| sentence(error)), code);
    match code {
        ExitCode::NoProject => {
            context.output.next(&context.command("import pairs.csv"));
            context.output.next(&context.program_with("demo"));
        }
        ExitCode::InUse => context.output.next(&context.command("status --watch")),
        ExitCode::Done
        | ExitCode::Error
        | ExitCode::Usage
        | ExitCode::SomeFailed
        | ExitCode::NothingSelected
        | ExitCode::Damaged
        | ExitCode::BelowFailUnder
        | ExitCode::Incomplete
        | ExitCode::Stopped => {}
    }
    code
}

/// The chain of causes as one sentence; a cause that its parent already quotes is not said twice.
fn sentence(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let part = cause.to_string();
        if text.is_empty() {
            text = part;
        } else if !text.contains(&part) {
            text = format!("{text}: {part}");
        }
    }
    text
}

fn code_of(error: &anyhow::Error) -> ExitCode {
    for cause in error.chain() {
        if let Some(refusal) = cause.downcast_ref::<Refusal>() {
            return refusal.code();
        }
        if is_refused_text(cause) {
            return ExitCode::Usage;
        }
        match cause.downcast_ref::<RunError>() {
            Some(RunError::InUse(_)) => return ExitCode::InUse,
            Some(RunError::OtherSettings(_)) => return ExitCode::Usage,
            Some(RunError::NoSuchPair(_)) => return ExitCode::NothingSelected,
            Some(_) | None => {}
        }
        match error_text::of_catalog(cause) {
            Some(CatalogError::Missing(_)) => return ExitCode::NoProject,
            Some(CatalogError::NetworkFileSystem { .. }) => return ExitCode::Usage,
            Some(
                CatalogError::UnknownPair(_)
                | CatalogError::NoResult(_)
                | CatalogError::NoMetricResult(..)
                | CatalogError::NothingToUndo(_),
            ) => return ExitCode::NothingSelected,
            Some(_) | None => {}
        }
        if matches!(
            cause.downcast_ref::<StoreError>(),
            Some(StoreError::NoProject(_))
        ) {
            return ExitCode::NoProject;
        }
        if matches!(
            cause.downcast_ref::<StoreError>(),
            Some(StoreError::NotUtf8(_))
        ) {
            return ExitCode::Usage;
        }
    }
    ExitCode::Error
}

/// Settings and lists that are refused as they stand.
fn is_refused_text(cause: &(dyn std::error::Error + 'static)) -> bool {
    cause.is::<ConfigError>()
        || cause.is::<RefusedManifest>()
        || cause.is::<TruthFileError>()
        || cause.is::<VerdictFileError>()
}

/// `mocban report | head` is no error.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<std::io::Error>()
            .is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
    })
}

#[cfg(test)]
mod tests {
    use super::{ColorChoice, ExitCode, FLAGS, Refusal, code_of, help_color, parse, sentence};

    fn args(text: &str) -> Vec<std::ffi::OsString> {
        text.split(' ').map(Into::into).collect()
    }

    #[test]
    fn color_is_found_before_the_command_line_is_read() {
        assert_eq!(
            help_color(&args("mocban --color never run")),
            ColorChoice::Never
        );
        assert_eq!(
            help_color(&args("mocban run --color=always")),
            ColorChoice::Always
        );
        assert_eq!(
            help_color(&args("mocban -- --color never")),
            ColorChoice::Auto
        );
    }

    #[test]
    fn settings_before_and_behind_the_command_add_up() {
        let cli = parse(&args(
            "mocban --set run.workers=1 run --set=fit.seed=2 --set run.workers=3",
        ));
        let wanted = ["run.workers=1", "fit.seed=2", "run.workers=3"];
        assert_eq!(cli.expect("valid").global.set, wanted);
    }

    #[test]
    fn verbose_before_and_behind_the_command_adds_up() {
        for (text, times) in [
            ("mocban run", 0),
            ("mocban -v run", 1),
            ("mocban run -v", 1),
            ("mocban -v run -v", 2),
            ("mocban --verbose status -wv", 2),
            ("mocban -vv run -j2 -Cv", 2),
            ("mocban run -nvv -- -v", 2),
        ] {
            let cli = parse(&args(text)).expect(text);
            assert_eq!(cli.global.verbose, times, "{text}");
        }
    }

    /// The letters that may be followed by others in a word are those of the command line.
    #[test]
    fn letters_without_a_value_are_all_known() {
        fn check(command: &clap::Command) {
            for arg in command.get_arguments() {
                let Some(letter) = arg.get_short() else {
                    continue;
                };
                let takes_value = arg.get_action().takes_values();
                assert_eq!(FLAGS.contains(&letter), !takes_value, "-{letter}");
            }
            command.get_subcommands().for_each(check);
        }
        let mut command = super::args::command();
        command.build();
        check(&command);
    }

    #[test]
    fn refusal_keeps_its_code_under_context() {
        let error =
            anyhow::Error::new(Refusal::NothingSelected("no pair".to_owned())).context("run");
        assert_eq!(code_of(&error), ExitCode::NothingSelected);
        assert_eq!(sentence(&error), "run: no pair");
    }

    #[test]
    fn cause_is_not_said_twice() {
        let io = std::io::Error::other("disk on fire");
        let error = anyhow::Error::new(io).context("a.png: disk on fire");
        assert_eq!(sentence(&error), "a.png: disk on fire");
    }
}
