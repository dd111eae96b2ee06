//! The command line, parsed with clap: global flags and the list of commands.

use std::ffi::OsString;
use std::path::Path;

use clap::builder::{Resettable, StyledStr};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ColorChoice, CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use super::commands::{
    align, app, backup, check, completions, config, contact_sheet, copy, db, demo, docs, export,
    import, man, report, restore, retire, retry, review, run, show, status, verdict, view, worker,
};
use super::input::examples::{with_examples, without_global_options};
use super::input::global::Global;
use super::input::hyphen_tip::hyphen_tip;
use mocban_core::domain::shell::shell_quoted;
use mocban_core::domain::spelling::nearest;
use mocban_project::ExitCode;

/// Aligns 3D scans of carved woodblock characters with images of their prints.
///
/// A project is a directory with a catalog and artifacts. `import` creates one from your files, `run` aligns the
/// pairs that are not aligned yet, and `report` prints the table of results. A run that was interrupted continues
/// where it stopped. `mocban docs` writes the documentation, which begins with the first hour.
#[derive(Debug, Parser)]
#[command(name = "mocban", version, after_help = ExitCode::table(), subcommand_required = true, arg_required_else_help = true)]
pub(super) struct Cli {
    /// Flags of every command.
    #[command(flatten)]
    pub(super) global: Global,
    /// The command.
    #[command(subcommand)]
    pub(super) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Create the built-in dataset, run it and print the report
    Demo(demo::DemoArgs),
    /// Align one scan with one print, without a project
    Align(align::AlignArgs),
    /// Add pairs of meshes and prints to the project
    Import(import::ImportArgs),
    /// Align the pairs that are not aligned yet
    Run(run::RunArgs),
    /// Find the pairs to align for workers on several machines, without aligning any
    Plan(worker::PlanArgs),
    /// Align pairs that were planned, beside workers on this and other machines
    Worker(worker::WorkerArgs),
    /// Show the state of the project on one screen
    Status(status::StatusArgs),
    /// Show one pair: numbers, files, history, and why it will run again
    Show(show::ShowArgs),
    /// Let failed pairs run again
    Retry(retry::RetryArgs),
    /// Take pairs out of every count, or bring them back; their results and verdicts are kept
    Retire(retire::RetireArgs),
    /// Check files, rows and counters against each other
    Check(check::CheckArgs),
    /// Copy pairs, results, verdicts and settings to one file, also during a run
    Backup(backup::BackupArgs),
    /// Make a project of a backup
    Restore(restore::RestoreArgs),
    /// Copy a catalog between a project folder and PostgreSQL
    Copy(copy::CopyArgs),
    /// Create a catalog in PostgreSQL, and roles for its users
    #[command(subcommand)]
    Db(db::DbCommand),
    /// Record and list people's verdicts on the results
    #[command(subcommand)]
    Verdict(verdict::VerdictCommand),
    /// Open the projects of a folder in the browser: runs, pairs, reviews
    App(app::AppArgs),
    /// Judge results in the browser with the keyboard, and align pairs manually
    Review(review::ReviewArgs),
    /// Show a scan in 3D with its print on it, or the page of a block, in the browser
    View(view::ViewArgs),
    /// Measure how far reviewers agree with each other and with themselves, and which planted errors they catch
    Agreement,
    /// Print the table of all results
    Report(report::ReportArgs),
    /// Write the aligned pairs for other tools
    Export(export::ExportArgs),
    /// Draw many overlays on one PNG, worst first, or the page of a block
    #[command(visible_alias = "sheet")]
    ContactSheet(contact_sheet::ContactSheetArgs),
    /// Show the settings in effect
    #[command(subcommand)]
    Config(config::ConfigCommand),
    /// Print a completion script for a shell
    Completions(completions::CompletionsArgs),
    /// Write the documentation as web pages: the first hour, guides and reference, in English and Vietnamese
    Docs(docs::DocsArgs),
    /// Write the manual pages
    Man(man::ManArgs),
}

/// Returns the clap command with examples. Backticks are removed from its help texts.
pub(super) fn command() -> clap::Command {
    with_examples(without_backticks(Cli::command()))
}

fn without_backticks(command: clap::Command) -> clap::Command {
    let about = plain(command.get_about());
    let long_about = plain(command.get_long_about());
    command
        .mut_args(|arg| {
            let (help, long_help) = (plain(arg.get_help()), plain(arg.get_long_help()));
            arg.help(help).long_help(long_help)
        })
        .mut_subcommands(without_backticks)
        .about(about)
        .long_about(long_about)
}

fn plain(text: Option<&StyledStr>) -> Resettable<StyledStr> {
    text.map_or(Resettable::Reset, |text| {
        Resettable::Value(text.to_string().replace('`', "").into())
    })
}

/// Letters of the flags that take no value. Such a letter can be followed by another flag, as in `-nv`.
const FLAGS: [char; 6] = ['h', 'n', 'q', 'v', 'V', 'w'];

/// Parses a command line.
pub(super) fn parse(args: &[OsString]) -> Result<Cli, clap::Error> {
    let command = without_global_options(command().color(help_color(args)));
    let matches = command
        .try_get_matches_from(args)
        .map_err(|error| with_tip(error, args))?;
    let mut cli = Cli::from_arg_matches(&matches)?;
    // If a flag is given before and after the command's name, clap keeps only the values after it.
    cli.global.set = values_of("--set", args);
    cli.global.verbose = count_verbose(args);
    Ok(cli)
}

/// Adds a tip to the error of a command line in which a project folder or a name with spaces is written wrongly.
fn with_tip(mut error: clap::Error, args: &[OsString]) -> clap::Error {
    drop_far_commands(&mut error);
    let word = |kind| match error.get(kind) {
        Some(ContextValue::String(word)) => Some(word.clone()),
        _ => None,
    };
    let tip = match error.kind() {
        ErrorKind::InvalidSubcommand => {
            word(ContextKind::InvalidSubcommand).and_then(|word| folder_tip(&word))
        }
        ErrorKind::UnknownArgument => word(ContextKind::InvalidArg).and_then(|word| {
            let is_similar = error.get(ContextKind::SuggestedArg).is_some();
            let hyphen = || hyphen_tip(command(), &word, words(args)).filter(|_| !is_similar);
            argument_tip(&word).or_else(hyphen)
        }),
        _ => None,
    };
    // A dash makes a value of the option, so that another word may be named in the error.
    let dash = words(args).find_map(dash_tip);
    let tip = dash.or_else(|| two_folders_tip(words(args))).or(tip);
    if let Some(tip) = tip {
        error.insert(
            ContextKind::Suggested,
            ContextValue::StyledStrs(vec![tip.into()]),
        );
    }
    error
}

/// Returns the words of a command line that are UTF-8, without the program.
fn words(args: &[OsString]) -> impl Iterator<Item = &str> + Clone {
    args.iter().skip(1).filter_map(|arg| arg.to_str())
}

/// Removes suggested commands that resemble the unknown one by a few letters only.
fn drop_far_commands(error: &mut clap::Error) {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) else {
        return;
    };
    let word = word.clone();
    let Some(ContextValue::Strings(found)) = error.remove(ContextKind::SuggestedSubcommand) else {
        return;
    };
    let names = found.iter().map(String::as_str);
    let near = nearest(&word, names, found.len()).into_iter();
    let near: Vec<String> = near.map(str::to_owned).collect();
    if !near.is_empty() {
        error.insert(
            ContextKind::SuggestedSubcommand,
            ContextValue::Strings(near),
        );
    }
}

/// Returns a tip on an import that names two folders without options.
fn two_folders_tip<'a>(words: impl Iterator<Item = &'a str> + Clone) -> Option<String> {
    let mut after = words.skip_while(|word| *word != "import").skip(1);
    let is_folder = |word: &&str| Path::new(word).is_dir();
    match [after.next(), after.next(), after.next()] {
        [Some(meshes), Some(prints), None] if is_folder(&meshes) && is_folder(&prints) => {
            let [meshes, prints] = [meshes, prints].map(shell_quoted);
            Some(format!(
                "name the folders with options, as in: mocban import --meshes {meshes} --prints {prints}"
            ))
        }
        _ => None,
    }
}

/// Returns a tip on an argument or option that is not expected.
fn argument_tip(word: &str) -> Option<String> {
    if ["-c", "--C", "--directory"].contains(&word) {
        return Some("the folder of a project is named with a capital -C".to_owned());
    }
    if word.starts_with('-') {
        return None;
    }
    folder_tip(word).or_else(|| {
        Some(format!(
            "if {word} belongs to a name or path with spaces, put all of it in quotes"
        ))
    })
}

/// Dashes, and a minus sign, that word processors write instead of hyphens.
const LONG_DASHES: [char; 6] = [
    '\u{2010}', '\u{2011}', '\u{2012}', '\u{2013}', '\u{2014}', '\u{2212}',
];

/// Returns a tip on an option that begins with a dash instead of a hyphen.
fn dash_tip(word: &str) -> Option<String> {
    let option = word.trim_start_matches(LONG_DASHES).trim_start_matches('-');
    let is_typed = word.starts_with(LONG_DASHES) && option.starts_with(char::is_alphabetic);
    let hyphens = if option.chars().count() == 1 {
        "-"
    } else {
        "--"
    };
    is_typed.then(|| format!("type hyphens instead of the dash, as in: {hyphens}{option}"))
}

/// Returns a tip on a word that is the name of a folder.
fn folder_tip(word: &str) -> Option<String> {
    Path::new(word).is_dir().then(|| {
        let folder = shell_quoted(word);
        format!("{folder} is a folder; name it with -C, as in: mocban -C {folder} status")
    })
}

/// Counts `-v`. Only for a command line that clap has accepted: in such a line, no value starts with a dash.
fn count_verbose(args: &[OsString]) -> u8 {
    let words = words(args).take_while(|word| *word != "--");
    let counts = words.map(|word| match word.strip_prefix('-') {
        Some("-verbose") => 1,
        // The rest of the word after a letter that takes a value is that value.
        Some(letters) => {
            let flags = letters.chars().take_while(|c| FLAGS.contains(c));
            flags.filter(|c| *c == 'v').count()
        }
        None => 0,
    });
    u8::try_from(counts.sum::<usize>()).unwrap_or(u8::MAX)
}

/// Finds `--color` before clap parses the line, because clap itself prints help and usage errors.
fn help_color(args: &[OsString]) -> ColorChoice {
    let values = values_of("--color", args);
    let choice = values.iter().find_map(|value| value.parse().ok());
    choice.unwrap_or(ColorChoice::Auto)
}

/// Returns every value of a flag, before and after the name of the command.
fn values_of(flag: &str, args: &[OsString]) -> Vec<String> {
    let words = args.iter().skip(1).filter_map(|arg| arg.to_str());
    let mut words = words.take_while(|word| *word != "--");
    let mut values = Vec::new();
    while let Some(word) = words.next() {
        let value = match word.strip_prefix(flag) {
            Some("") => words.next(),
            Some(rest) => rest.strip_prefix('='),
            None => None,
        };
        values.extend(value.map(str::to_owned));
    }
    values
}

#[cfg(test)]
mod tests {
    use super::{ColorChoice, FLAGS, command, help_color, parse};

    fn args(text: &str) -> Vec<std::ffi::OsString> {
        text.split(' ').map(Into::into).collect()
    }

    #[test]
    fn command_line_is_consistent() {
        command().debug_assert();
    }

    #[test]
    fn help_has_no_backticks() {
        fn check(mut command: clap::Command) {
            let help = command.render_long_help().to_string();
            assert!(!help.contains('`'), "{help}");
            command.get_subcommands().cloned().for_each(check);
        }
        check(command());
    }

    #[test]
    fn color_is_found_before_the_command_line_is_parsed() {
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
    fn wrong_command_lines_get_a_tip() {
        let error = |text: &str| parse(&args(text)).expect_err(text).to_string();
        let folder = error("mocban src status");
        assert!(folder.contains("tip: src is a folder"), "{folder}");
        assert!(folder.contains("mocban -C src status"), "{folder}");
        let spaces = error("mocban verdict set block 4 pass --reviewer lan");
        assert!(
            spaces.contains("if pass belongs to a name or path with spaces"),
            "{spaces}"
        );
        let dash = error("mocban \u{2013}C blocks status");
        assert!(dash.contains("as in: -C\n"), "{dash}");
        let json = error("mocban status \u{2014}json");
        assert!(json.contains("as in: --json\n"), "{json}");
        let folder = error("mocban status src");
        assert!(folder.contains("mocban -C src status"), "{folder}");
        let folders = error("mocban import src tests");
        assert!(
            folders.contains("import --meshes src --prints tests"),
            "{folders}"
        );
        let dash = error("mocban import --meshes src \u{2013}-prints tests");
        assert!(dash.contains("as in: --prints\n"), "{dash}");
        let far = error("mocban xem");
        assert!(!far.contains("similar"), "{far}");
        let near = error("mocban reprot");
        assert!(near.contains("'report'"), "{near}");
        let small = error("mocban -c blocks status");
        assert!(small.contains("capital -C"), "{small}");
        let plain = error("mocban report --fomat html");
        assert!(plain.contains("'--format'"), "{plain}");
        let id = error("mocban -C blocks show -a1");
        assert!(
            id.contains(
                "tip: if -a1 is an id, write -- before it, and options before that, as in: mocban -C blocks show -- -a1\n"
            ),
            "{id}"
        );
        let id = error("mocban show --config postgres://u:secret@h/d -a1");
        assert!(!id.contains("secret"), "{id}");
        let id = error("mocban verdict set -a1 pass --reviewer lan");
        assert!(
            id.contains("as in: mocban verdict set --reviewer lan -- -a1 pass\n"),
            "{id}"
        );
        let value = error("mocban verdict set a1 pass --reviewer -lan");
        assert!(value.contains("as in: --reviewer=-lan\n"), "{value}");
        assert!(!value.contains("is an id"), "{value}");
        let id = error("mocban show --json -o1");
        assert!(id.contains("if -o1 is an id"), "{id}");
        for other in ["mocban report -a1", "mocban show --jsn", "mocban status -x"] {
            let text = error(other);
            assert!(!text.contains("is an id"), "{text}");
        }
    }

    #[test]
    fn settings_before_and_after_the_command_add_up() {
        let cli = parse(&args(
            "mocban --set run.workers=1 run --set=fit.seed=2 --set run.workers=3",
        ));
        let expected = ["run.workers=1", "fit.seed=2", "run.workers=3"];
        assert_eq!(cli.expect("valid").global.set, expected);
    }

    #[test]
    fn verbose_before_and_after_the_command_adds_up() {
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

    #[test]
    fn letters_of_flags_without_a_value_are_complete() {
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
        let mut command = command();
        command.build();
        check(&command);
    }
}
