//! `review`: serves the review page on this machine.

use std::collections::BTreeSet;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use serde_json::json;

use crate::cli::input::language::language_of_system;
use crate::cli::input::listen_address::listen_address;
use crate::cli::input::signals;
use crate::cli::output::context::Context;
use crate::cli::output::page_address::{open_page, print_address};
use crate::cli::output::streams;
use crate::cli::output::table::count;
use mocban_catalog::{Catalog, SetApart, StatusCounts, reviewer_name};
use mocban_core::domain::shell::shell_quoted;
use mocban_core::domain::{ReviewOrder, ThresholdMetric};
use mocban_core::page_vec;
use mocban_pages::local_server::LocalServer;
use mocban_pages::review::{
    self, CheckRates, FaultShortage, Language, PictureWork, QueueCounts, QueueOptions,
    ReviewOptions, ReviewPages,
};
use mocban_project::closing::{AFTER_SILENCE, close_within};
use mocban_project::error::explanation;
use mocban_project::location::now;
use mocban_project::reviewers;
use mocban_project::status::all_retired;
use mocban_project::verdict_words;
use mocban_project::{ExitCode, ProjectResult, Refusal};
use mocban_runner::{Stop, StopLevel};

/// Time after a signal during which answers still wait for an unavailable database server.
const UNAVAILABLE_AFTER_STOP: Duration = Duration::from_secs(1);
/// Maximum time to close a catalog that has stored every answer.
const CLOSE: Duration = Duration::from_secs(2);

/// Arguments of `review`.
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
#[derive(Debug, Args)]
pub(crate) struct ReviewArgs {
    /// Name of the reviewer; a label for the verdicts, not a login, unless the catalog in PostgreSQL has roles
    #[arg(long, value_name = "NAME", alias = "reader", value_parser = reviewer_name)]
    reviewer: String,
    /// Accept a new reviewer whose name differs from that of another only in case or accents
    #[arg(long)]
    new_reviewer: bool,
    /// Order of the results: random gives an unbiased estimate of the accuracy; least-confident finds failures sooner
    #[arg(long, default_value = "random", value_parser = order)]
    order: ReviewOrder,
    /// Only results on which two other reviewers disagree
    #[arg(long, conflicts_with = "order")]
    adjudicate: bool,
    /// Only results of this metric; may be repeated [default: all]
    #[arg(long, value_parser = verdict_words::metric)]
    metric: Vec<ThresholdMetric>,
    /// Seed of the random order
    #[arg(long, value_name = "N", default_value_t = QueueOptions::DEFAULT_SEED)]
    seed: u64,
    /// Review only the first N results; attention checks and duplicates are added to them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    sample: Option<u32>,
    /// Planted errors per hundred results, at least 5 if there are any, to measure how many the reviewer catches
    #[arg(long, value_name = "PERCENT", default_value = "4", value_parser = percent)]
    attention_checks: f64,
    /// Results per hundred that are shown twice, to measure how consistent the reviewer is
    #[arg(long, value_name = "PERCENT", default_value = "5", value_parser = percent)]
    duplicates: f64,
    /// Shortest time in milliseconds that an image is shown before a verdict is accepted
    #[arg(long, value_name = "MS", default_value = "250", value_parser = clap::value_parser!(u64).range(0..=60_000))]
    min_view_ms: u64,
    /// Do not open the guide, with examples and a practice round, when a reviewer starts for the first time
    #[arg(long)]
    no_guide: bool,
    /// Port on this machine; 0 chooses the same port each time for a project and reviewer, or any free port
    #[arg(long, value_name = "N", default_value = "0")]
    port: u16,
    /// Listen on this address instead of 127.0.0.1; anyone who can reach it sees that the page exists
    #[arg(long, value_name = "ADDRESS", value_parser = listen_address)]
    listen: Option<IpAddr>,
    /// Language of the page, en or vi [default: vi if LANG is Vietnamese, else that of the browser]
    #[arg(long)]
    lang: Option<Language>,
    /// Print the address without opening a browser
    #[arg(long)]
    no_open: bool,
}

/// Parses an order; adjudication has its own flag.
fn order(text: &str) -> Result<ReviewOrder, String> {
    match text.replace('-', "_").parse() {
        Ok(order @ (ReviewOrder::Random | ReviewOrder::LeastConfident)) => Ok(order),
        Ok(ReviewOrder::Adjudicate) | Err(_) => {
            Err("the order is random or least-confident".to_owned())
        }
    }
}

/// Parses a percentage and returns the share.
fn percent(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('%').parse::<f64>() {
        Ok(percent) if (0.0..=100.0).contains(&percent) => Ok(percent / 100.0),
        Ok(_) | Err(_) => Err("a percentage is a number from 0 to 100".to_owned()),
    }
}

pub(crate) async fn review(args: ReviewArgs, context: &Context) -> ProjectResult<ExitCode> {
    page_vec::keep_few_pages();
    let settings = context.location.settings()?;
    let keys = review::key_map(&settings.config.review.keys);
    let keys = keys.map_err(|error| Refusal::Usage(error.to_string()))?;
    let (project, catalog) = context.location.open().await?;
    let rights = catalog.review_rights().await?;
    rights.require_review(Some(&args.reviewer))?;
    if !args.new_reviewer {
        let names = BTreeSet::from([args.reviewer.clone()]);
        reviewers::refuse_similar(&catalog, &rights, &names).await?;
    }
    let (catalog, damaged) = catalog.without_faulty_rows().await?;
    context.warn_about_set_apart(&SetApart::of(&damaged));
    let language = args.lang.or_else(language_of_system);
    let options = ReviewOptions {
        command: Some(
            context
                .without_setting_flags()
                .command("")
                .trim_end()
                .to_owned(),
        ),
        project_page: None,
        language,
        keys,
        min_view_ms: args.min_view_ms,
        opens_guide: !args.no_guide,
        limits: settings.config.limits,
        explain: explanation,
        now,
        queue: queue_options(&args),
    };
    let ip = args.listen.unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST));
    let name = review::origin_name(&project, &args.reviewer);
    let server = LocalServer::bind(SocketAddr::new(ip, args.port), &name, "review").await?;
    let pages = ReviewPages::open(
        catalog.clone(),
        project,
        options,
        Arc::new(PictureWork::for_one()),
    )
    .await?;
    if pages.counts().items == 0 {
        drop(pages);
        let retired = all_retired(&catalog).await?;
        catalog.close().await;
        if args.adjudicate {
            return no_conflict(&args, context);
        }
        let command = context.command("run");
        let text = match retired {
            Some(retired) => format!("there is no result to judge: {retired}"),
            None => format!("there is no result to judge yet; first: {command}"),
        };
        return Err(Refusal::NothingSelected(text).into());
    }
    let stop = Stop::default();
    let signals = signals::watch(&stop)?;
    let _file = announce(&server, &pages, &args, context)?;
    let drain = stop.clone();
    let served = server.serve(pages.routes(), async move {
        drain.reached(StopLevel::Drain).await;
    });
    let waits = tokio::spawn(stop_waiting(catalog.clone(), stop.clone()));
    let kept = tokio::select! {
        cut_off = served => cut_off + pages.unstored(),
        // After a second signal, do not wait for open connections. Acknowledged answers are already stored.
        () = stop.reached(StopLevel::Now) => 1,
    };
    waits.abort();
    catalog.stop_waiting();
    let is_finished =
        kept == 0 && tokio::time::timeout(CLOSE, pages.is_finished()).await == Ok(true);
    let limit = if kept == 0 { CLOSE } else { AFTER_SILENCE };
    close_within(catalog, &stop, limit).await;
    signals.abort();
    context.info(closing_line(kept == 0));
    if !is_finished {
        let reviewer = shell_quoted(&args.reviewer);
        context.next(&queue_options(&args).to_continue(&reviewer));
    }
    context.next("report");
    if !args.adjudicate {
        let command = context.command(&queue_options(&args).for_another_reviewer());
        context.info(&format!(
            "to measure the agreement, another person judges the same results (put that person's name for NAME): {command}"
        ));
    }
    Ok(ExitCode::Done)
}

/// Ends waits for an unavailable database server some time after a signal. Answers that wait for it are then refused, and
/// the browser keeps them.
async fn stop_waiting(catalog: Catalog, stop: Stop) {
    stop.reached(StopLevel::Drain).await;
    tokio::time::sleep(UNAVAILABLE_AFTER_STOP).await;
    catalog.stop_waiting();
}

/// Returns the command's last message. The browser keeps unacknowledged answers and sends them again.
const fn closing_line(is_complete: bool) -> &'static str {
    if is_complete {
        "the page is closed; every answer is stored"
    } else {
        "the page is closed; every acknowledged answer is stored, and the browser keeps the rest for the next start"
    }
}

fn queue_options(args: &ReviewArgs) -> QueueOptions {
    QueueOptions {
        reviewer: args.reviewer.clone(),
        metrics: args.metric.clone(),
        order: if args.adjudicate {
            ReviewOrder::Adjudicate
        } else {
            args.order
        },
        pairs: None,
        seed: args.seed,
        sample: args.sample.map(|sample| sample as usize),
        rates: CheckRates {
            faults: args.attention_checks,
            duplicates: args.duplicates,
        },
    }
}

/// Reports that there is nothing to adjudicate.
fn no_conflict(args: &ReviewArgs, context: &Context) -> ProjectResult<ExitCode> {
    if context.global.json {
        streams::print_json_text(&json!({"schema": 1, "url": null}).to_string())?;
    }
    let reviewer = &args.reviewer;
    context.info(&format!(
        "there is nothing to adjudicate for {reviewer}: no two other reviewers disagree on an open result"
    ));
    context.next("agreement");
    Ok(ExitCode::Done)
}

/// Returns a reviewer's progress: `lan has answered 0 of 54 images: 50 results and 4 attention checks or duplicates`.
fn progress(reviewer: &str, counts: QueueCounts) -> String {
    let images = count(counts.items as u64, "image");
    let results = count(counts.results as u64, "result");
    let text = format!("{reviewer} has answered {} of {images}", counts.answered);
    match counts.items - counts.results {
        0 => text,
        checks => format!("{text}: {results} and {checks} attention checks or duplicates"),
    }
}

/// Prints the page's address and opens the page in a browser. Returns the file of [`open_page`].
fn announce(
    server: &LocalServer,
    pages: &ReviewPages,
    args: &ReviewArgs,
    context: &Context,
) -> ProjectResult<Option<tempfile::NamedTempFile>> {
    let (url, address) = (server.url(), server.address());
    print_address(&url, context)?;
    context.info(&format!(
        "{}; press Ctrl-C to end",
        progress(&args.reviewer, pages.counts())
    ));
    if let Some(FaultShortage {
        wanted,
        planted,
        example,
    }) = pages.shortage()
    {
        context.warn(&format!(
            "only {planted} of {wanted} attention checks could be planted, because files of results cannot be read ({example}); `check` lists them"
        ));
    }
    context.info("the address works once; if you close the page, press Ctrl-C and start this command again: nothing is lost");
    if address.ip().is_loopback() {
        let port = address.port();
        context.info(&format!(
            "if this machine is remote, first run: ssh -L {port}:127.0.0.1:{port} MACHINE"
        ));
    } else {
        context.warn(&format!(
            "the page listens on {address}, which other machines can reach, and its traffic is not encrypted"
        ));
    }
    Ok(open_page(&url, args.no_open, context))
}

/// Returns the `review` command as a next step, or `None` if there are verdicts.
pub(crate) fn review_step(counts: &StatusCounts) -> Option<String> {
    let is_unjudged = counts.verdicts.values().all(|number| *number == 0);
    is_unjudged.then(|| review_command(user_name().as_deref()))
}

/// Returns the `review` command with the user's name as the reviewer, or `me` if it is not known: a next step can be run as
/// it is.
fn review_command(user: Option<&str>) -> String {
    let name = user.and_then(|user| reviewer_name(user).ok());
    let name = name.unwrap_or_else(|| "me".to_owned());
    format!("review --reviewer {}", shell_quoted(&name))
}

/// Returns the name of the user, as Unix or Windows gives it.
fn user_name() -> Option<String> {
    let mut names = ["USER", "USERNAME"].into_iter();
    names.find_map(|name| std::env::var(name).ok())
}

#[cfg(test)]
mod tests {
    use super::{CheckRates, QueueCounts, order, percent, progress, review_command};
    use mocban_config::{Sources, load};
    use mocban_core::domain::ReviewOrder;
    use mocban_pages::review::key_map;

    #[test]
    fn default_settings_give_every_action_its_own_key() {
        let settings = load(&Sources::default()).expect("the defaults");
        let keys = &settings.config.review.keys;
        let map = key_map(keys).expect("the default keys");
        assert_eq!((map.len(), keys.len()), (42, 42));
        assert_eq!(map["KeyP"], "pass");
    }

    #[test]
    fn attention_checks_and_duplicates_are_counted_separately() {
        let counts = |items, results| QueueCounts {
            items,
            results,
            answered: 7,
        };
        assert_eq!(
            progress("lan", counts(54, 50)),
            "lan has answered 7 of 54 images: 50 results and 4 attention checks or duplicates"
        );
        assert_eq!(
            progress("lan", counts(50, 50)),
            "lan has answered 7 of 50 images"
        );
    }

    #[test]
    fn percentages_and_orders_are_parsed() {
        let plain = CheckRates::default();
        assert_eq!(percent("4"), Ok(plain.faults), "the default of the option");
        assert_eq!(
            percent("5"),
            Ok(plain.duplicates),
            "the default of the option"
        );
        assert_eq!(percent("12.5%"), Ok(0.125));
        assert!(percent("101").is_err() && percent("-1").is_err() && percent("NaN").is_err());
        assert_eq!(order("least-confident"), Ok(ReviewOrder::LeastConfident));
        assert!(order("adjudicate").is_err());
    }

    #[test]
    fn the_suggested_reviewer_is_the_user() {
        assert_eq!(review_command(Some("lê văn")), "review --reviewer 'lê văn'");
        assert_eq!(review_command(None), "review --reviewer me");
    }
}
