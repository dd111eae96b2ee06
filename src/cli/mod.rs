//! The command line: one thin file per command.
//!
//! `commands` has the commands, `output` what they print and the context that all have, `input` what users name.

mod args;
mod commands;
mod input;
mod output;

use std::ffi::OsString;

use tokio::runtime::{Builder, Runtime};

use args::Command;
use commands::{
    agreement, align, app, backup, check, completions, config, contact_sheet, copy, db, demo, docs,
    export, import, man, report, restore, retire, retry, review, run, show, status, verdict, view,
    worker,
};
use input::nearby_projects;
pub use mocban_project::ExitCode;
use output::context::Context;
use output::screen::Screen;
use output::{logging, panics};

use mocban_core::domain::{ErrorCode, is_hidden};
use mocban_project::{ProjectError, ProjectResult};
use mocban_system::platform;

/// Parses the command line, executes the command and returns the exit code. Prints each error once.
pub fn main(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args: Vec<OsString> = args.into_iter().collect();
    let cli = match args::parse(&args) {
        Ok(cli) => cli,
        Err(error) => {
            if args
                .iter()
                .any(|arg| arg.to_string_lossy().contains(is_hidden))
            {
                // The error may quote an argument with terminal codes, so print it through the sanitizing screen.
                Screen::new().line(error.render().to_string().trim_end());
            } else {
                // Printing fails only if the stream is closed. Then nobody could read an error either.
                let _ = error.print();
            }
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
        Err(error) => report_error(&error, &context),
    };
    let code = panics::catch(work, |text| context.error(text, ExitCode::Error));
    context.screen.count_warnings();
    code
}

fn start(command: Command, context: &Context) -> ProjectResult<ExitCode> {
    logging::start(&context.global, &context.screen)?;
    let runtime = runtime(&command)?;
    let result = runtime.block_on(dispatch(command, context));
    runtime.shutdown_background();
    result
}

/// Returns the asynchronous runtime for a command. A run computes its stages on separate threads. Its asynchronous
/// tasks are short and exchange many messages, so they run faster on a single thread.
fn runtime(command: &Command) -> std::io::Result<Runtime> {
    // Tokio panics if it cannot open its streams for signals.
    platform::check_free_files(8)?;
    let mut builder = match command {
        Command::Run(_) | Command::Worker(_) | Command::Demo(_) => Builder::new_current_thread(),
        _ => Builder::new_multi_thread(),
    };
    builder.worker_threads(2).enable_all().build()
}

async fn dispatch(command: Command, context: &Context) -> ProjectResult<ExitCode> {
    match command {
        Command::Demo(args) => Box::pin(demo::demo(args, context)).await,
        Command::Align(args) => align::align(args, context).await,
        Command::Import(args) => import::import(args, context).await,
        Command::Run(args) => run::run(args, context).await,
        Command::Plan(args) => worker::plan(args, context).await,
        Command::Worker(args) => worker::worker(args, context).await,
        Command::Status(args) => status::status(args, context).await,
        Command::Show(args) => show::show(args, context).await,
        Command::Retry(args) => retry::retry(args, context).await,
        Command::Retire(args) => retire::retire(args, context).await,
        Command::Check(args) => check::check(args, context).await,
        Command::Backup(args) => backup::backup(args, context).await,
        Command::Copy(args) => copy::copy(args, context).await,
        Command::Db(command) => db::db(command, context).await,
        Command::Restore(args) => restore::restore(args, context).await,
        Command::Verdict(command) => verdict::verdict(command, context).await,
        Command::App(args) => app::app(args, context).await,
        Command::Review(args) => review::review(args, context).await,
        Command::View(args) => view::view(args, context).await,
        Command::Agreement => agreement::agreement(context).await,
        Command::Report(args) => report::report(args, context).await,
        Command::Export(args) => export::export(args, context).await,
        Command::ContactSheet(args) => contact_sheet::contact_sheet(args, context).await,
        Command::Config(command) => config::config(&command, context),
        Command::Completions(args) => completions::completions(&args, args::command()).await,
        Command::Docs(args) => docs::docs(args, context),
        Command::Man(args) => man::man(args, args::command(), context),
    }
}

/// Prints an error, suggests commands that help, and returns the exit code of the error.
fn report_error(error: &ProjectError, context: &Context) -> ExitCode {
    let code = error.code();
    if code == ErrorCode::ClosedPipe {
        return ExitCode::Done;
    }
    context.error(&error.text(&context.location.dir), code.into());
    if code == ErrorCode::NoProject {
        for project in nearby_projects::nearby_projects(&context.location.dir) {
            context.at(&project).next("status");
        }
        context.next("import pairs.csv");
        context.next_command(&context.program_with("demo"));
    } else if code == ErrorCode::ProjectInUse {
        context.next("status --watch");
    }
    code.into()
}
