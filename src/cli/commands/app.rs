//! `app`: serves the pages of all projects of a folder on this machine.

use std::net::IpAddr;
use std::path::PathBuf;

use clap::Args;

use crate::cli::input::language::language_of_system;
use crate::cli::input::listen_address::listen_address;
use crate::cli::output::context::Context;
use crate::cli::output::served_pages::ServedPages;
use mocban_core::page_vec;
use mocban_pages::app::{AppOptions, app_pages};
use mocban_pages::review::Language;
use mocban_project::error::WithContext as _;
use mocban_project::{ExitCode, ProjectResult, Refusal};

/// Arguments of `app`.
#[derive(Debug, Args)]
pub(crate) struct AppArgs {
    /// A project, or a folder of projects [default: the folder of -C, or the current one]
    #[arg(value_name = "FOLDER")]
    folder: Option<PathBuf>,
    /// Port on this machine; 0 chooses the same port each time for a folder, or any free port
    #[arg(long, value_name = "N", default_value = "0")]
    port: u16,
    /// Address of this computer at which invited reviewers reach it [default: its address in its network]
    #[arg(long, value_name = "ADDRESS", value_parser = listen_address)]
    listen: Option<IpAddr>,
    /// Language of the pages, en or vi [default: vi if LANG is Vietnamese, else that of the browser]
    #[arg(long)]
    lang: Option<Language>,
    /// Print the address without opening a browser
    #[arg(long)]
    no_open: bool,
}

pub(crate) async fn app(args: AppArgs, context: &Context) -> ProjectResult<ExitCode> {
    page_vec::keep_few_pages();
    let location = &context.location;
    if location.catalog.is_some() || location.config.is_some() || !location.sets.is_empty() {
        let text = "`app` shows projects with their own settings: leave out --catalog, --config and --set, and write them to the mocban.toml of the project";
        return Err(Refusal::Usage(text.into()).into());
    }
    let folder = args.folder.unwrap_or_else(|| context.location.dir.clone());
    if !folder.is_dir() {
        let text = format!("there is no folder {}", folder.display());
        return Err(Refusal::Usage(text).into());
    }
    if let Some(address) = args.listen {
        // A wrong address is refused now, not at the first invitation.
        std::net::TcpListener::bind((address, 0)).with_context(|| {
            format!("cannot listen on {address}; name an address of this computer")
        })?;
    }
    // Pages name the files in it with their whole paths. Links in the path stay as the user knows them.
    let folder = std::path::absolute(&folder).unwrap_or(folder);
    let whole = folder.canonicalize();
    let name = whole
        .unwrap_or_else(|_| folder.clone())
        .display()
        .to_string();
    let program = std::env::current_exe();
    let options = AppOptions {
        folder,
        listen: args.listen,
        language: args.lang.or_else(language_of_system),
        program: program.with_context(|| "cannot find this program, to start runs".to_owned())?,
    };
    let served = ServedPages {
        pages: app_pages(options),
        name: &name,
        port: args.port,
        command: "app",
        ending: ": runs that were started go on",
        no_open: args.no_open,
    };
    served.serve(context).await
}
