//! `view PAIR` shows a scan on its print in the browser, `view BLOCK` a whole page.

use std::sync::Arc;

use axum::Router;
use clap::Args;

use crate::cli::input::language::language_of_system;
use crate::cli::output::context::Context;
use crate::cli::output::served_pages::ServedPages;
use mocban_catalog::Catalog;
use mocban_core::domain::shell::quoted_id;
use mocban_core::domain::{BlockName, ThresholdMetric};
use mocban_core::page_vec;
use mocban_export::scan_view::ScanView;
use mocban_pages::review::Language;
use mocban_pages::view::{BlockAccess, PictureReading, open_block, scan_page};
use mocban_project::blocking::blocking;
use mocban_project::selection;
use mocban_project::verdict_words;
use mocban_project::{ExitCode, ProjectError, ProjectResult, Refusal};
use mocban_store::Project;

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// The pair, or a block
    pair: String,
    /// The metric whose result is shown [default: ensemble, or else the first that the pair has]
    #[arg(long, value_parser = verdict_words::metric)]
    metric: Option<ThresholdMetric>,
    /// Port on this machine; 0 chooses the same port each time for a name, or any free port
    #[arg(long, value_name = "N", default_value = "0")]
    port: u16,
    /// Language of the page, en or vi [default: vi if LANG is Vietnamese, else that of the browser]
    #[arg(long)]
    lang: Option<Language>,
    /// Print the address without opening a browser
    #[arg(long)]
    no_open: bool,
}

impl ViewArgs {
    /// Returns the language of the page. Without one, the browser decides.
    fn language(&self) -> Option<Language> {
        self.lang.or_else(language_of_system)
    }
}

pub(crate) async fn view(args: ViewArgs, context: &Context) -> ProjectResult<ExitCode> {
    page_vec::keep_few_pages();
    let (project, catalog) = context.location.open_read_only().await?;
    if let Some(block) = selection::block(&catalog, &args.pair).await? {
        let page = block_page(&block, &args, &project, &catalog, context).await;
        catalog.close().await;
        return serve(block.as_str(), page?, &args, context).await;
    }
    let limits = context.location.settings()?.config.limits;
    let name = selection::pair(&catalog, &args.pair).await?;
    let detail = catalog.pair(&name).await?;
    catalog.close().await;
    let Some(pair) = detail.map(|detail| detail.results) else {
        let text = format!("pair {name} was removed while it was read");
        return Err(ProjectError::unexpected(text));
    };
    let default = pair.metric(ThresholdMetric::DEFAULT);
    let default = default.or_else(|| pair.metrics.first());
    let metric = args.metric.or(default.map(|record| record.outcome.metric));
    let read = move |metric| ScanView::read(&project, &pair, metric, limits);
    let scan = match metric {
        None => None,
        Some(metric) => blocking(move || read(metric)).await??,
    };
    let Some(scan) = scan else {
        let of = args
            .metric
            .map_or_else(String::new, |metric| format!(" of {metric}"));
        let command = context.command(&format!("show {}", quoted_id(name.as_str())));
        let text = format!("pair {name} has no result{of} to show; see: {command}");
        return Err(Refusal::NothingSelected(text).into());
    };
    let page = scan_page(name.as_str(), &scan, args.language());
    serve(name.as_str(), page, &args, context).await
}

/// Returns the routes of the page of a block. If its page was refused, only its correction is shown.
async fn block_page(
    name: &BlockName,
    args: &ViewArgs,
    project: &Project,
    catalog: &Catalog,
    context: &Context,
) -> ProjectResult<Router> {
    let next = Some(context.command("run"));
    let store = BlockAccess::new(&context.location, name, next, Arc::default());
    let limits = context.location.settings()?.config.limits;
    let language = args.language();
    let shown = (name, args.metric);
    let reading = PictureReading::First;
    let opened = open_block(catalog, project, shown, limits, store, language, reading).await?;
    if let Some(why) = opened.refused {
        context.warn(&format!("block {name} is not aligned: {why}"));
        context.info("choose the same places on the relief and on the page to align them");
    }
    Ok(opened.pages)
}

async fn serve(
    name: &str,
    pages: Router,
    args: &ViewArgs,
    context: &Context,
) -> ProjectResult<ExitCode> {
    let served = ServedPages {
        pages,
        name,
        port: args.port,
        command: "view",
        ending: "",
        no_open: args.no_open,
    };
    served.serve(context).await
}
