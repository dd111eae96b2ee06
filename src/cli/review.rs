//! `review`: serves the review page on this machine and says where.

use std::io::Write as _;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::Path;
use std::process::{Command, Stdio};

use clap::Args;
use serde_json::json;

use super::context::{Context, now};
use super::exit::{ExitCode, Refusal};
use super::output;
use super::signals;
use super::table::count;
use super::verdict::reviewer_name;
use crate::domain::{ReviewOrder, ThresholdMetric};
use crate::review::{self, Cards, DeckOptions, Language, Rates, Review, ReviewOptions};
use crate::runner::{Stop, StopLevel};

/// Arguments of `review`.
#[derive(Debug, Args)]
pub(super) struct ReviewArgs {
    /// Who reads; a label for the verdicts, no login
    #[arg(long, value_name = "NAME", alias = "reader", value_parser = reviewer_name)]
    reviewer: String,
    /// What comes first: random estimates the accuracy; least-confident finds failures sooner, but is no sample
    #[arg(long, default_value = "random", value_parser = order)]
    order: ReviewOrder,
    /// Only what two other reviewers contradict each other on
    #[arg(long, conflicts_with = "order")]
    adjudicate: bool,
    /// Only results of this metric; may be given many times [default: all]
    #[arg(long)]
    metric: Vec<ThresholdMetric>,
    /// Another seed gives another random order
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// Only the first so many results of the order
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    sample: Option<u32>,
    /// Planted faults for each hundred results, to measure how many are caught
    #[arg(long, value_name = "PERCENT", default_value = "4", value_parser = percent)]
    controls: f64,
    /// Results of each hundred that are shown twice, to measure how steady the reviewer is
    #[arg(long, value_name = "PERCENT", default_value = "5", value_parser = percent)]
    repeats: f64,
    /// Least time a picture is shown before a verdict is taken, milliseconds
    #[arg(long, value_name = "MS", default_value = "250", value_parser = clap::value_parser!(u64).range(0..=60_000))]
    min_view_ms: u64,
    /// Port on this machine; 0 takes one that is the same for a project and a reviewer, or any that is free
    #[arg(long, value_name = "N", default_value = "0")]
    port: u16,
    /// Listen on this address in the place of 127.0.0.1; whoever can reach it sees that there is a page
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<IpAddr>,
    /// Language of the page, en or vi [default: by LANG]
    #[arg(long)]
    lang: Option<Language>,
    /// Print the address and open no browser
    #[arg(long)]
    no_open: bool,
}

/// An order that can be asked for by name.
fn order(text: &str) -> Result<ReviewOrder, String> {
    match text.replace('-', "_").parse() {
        Ok(order @ (ReviewOrder::Random | ReviewOrder::LeastConfident)) => Ok(order),
        Ok(ReviewOrder::Adjudicate) | Err(_) => {
            Err("an order is random or least-confident".to_owned())
        }
    }
}

/// A share from a number of percent.
fn percent(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('%').parse::<f64>() {
        Ok(percent) if (0.0..=100.0).contains(&percent) => Ok(percent / 100.0),
        Ok(_) | Err(_) => Err("a percentage is a number from 0 to 100".to_owned()),
    }
}

pub(super) async fn review(args: ReviewArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let settings = context.settings()?;
    let keys = review::key_map(&settings.config.review.keys);
    let keys = keys.map_err(|error| Refusal::Usage(error.to_string()))?;
    if args.listen.is_some_and(|address| address.is_unspecified()) {
        // The page answers to its own name only, and "any address" is none.
        let text =
            "--listen needs the one address of this machine under which the page is to be reached";
        return Err(Refusal::Usage(text.to_owned()).into());
    }
    let (project, catalog) = context.open().await?;
    let language = args.lang.unwrap_or_else(language_of_system);
    let options = ReviewOptions {
        listen: SocketAddr::new(
            args.listen.unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST)),
            args.port,
        ),
        language,
        keys,
        min_view_ms: args.min_view_ms,
        limits: settings.config.limits.image,
        now,
        deck: deck(&args),
    };
    let page = review::open(catalog.clone(), project, options).await?;
    if args.adjudicate && page.cards().all == 0 {
        drop(page);
        catalog.close().await;
        return no_conflict(&args, context);
    }
    let _file = tell(&page, &args, context)?;
    let stop = Stop::default();
    let signals = signals::watch(&stop)?;
    let drain = stop.clone();
    let served = page.serve(async move { drain.reached(StopLevel::Drain).await });
    tokio::select! {
        served = served => served?,
        // A second signal does not wait for connections that stay open. What was acknowledged is stored.
        () = stop.reached(StopLevel::Now) => {}
    }
    signals.abort();
    catalog.close().await;
    context
        .output
        .info("the page is closed; every answer is stored");
    context.output.next(&context.command("report"));
    Ok(ExitCode::Done)
}

fn deck(args: &ReviewArgs) -> DeckOptions {
    DeckOptions {
        reviewer: args.reviewer.clone(),
        metrics: args.metric.clone(),
        order: if args.adjudicate {
            ReviewOrder::Adjudicate
        } else {
            args.order
        },
        seed: args.seed,
        sample: args.sample.map(|sample| sample as usize),
        rates: Rates {
            controls: args.controls,
            repeats: args.repeats,
        },
    }
}

/// There is no page without anything to settle on it.
fn no_conflict(args: &ReviewArgs, context: &Context) -> anyhow::Result<ExitCode> {
    if context.global.json {
        output::print(&json!({"schema": 1, "url": null}).to_string())?;
    }
    let reviewer = &args.reviewer;
    context.output.info(&format!(
        "no conflict waits for {reviewer}: no two others contradict each other on a result that nobody has settled"
    ));
    context.output.next(&context.command("agreement"));
    Ok(ExitCode::Done)
}

/// How far a reviewer is, such as `lan has answered 0 of 54 pictures: 50 results, and 4 to test the reviewer`.
fn progress(reviewer: &str, cards: Cards) -> String {
    let Cards {
        all,
        results,
        answered,
    } = cards;
    let told = format!(
        "{reviewer} has answered {answered} of {}",
        count(all as u64, "picture")
    );
    match all - results {
        0 => told,
        tests => format!(
            "{told}: {}, and {tests} to test the reviewer",
            count(results as u64, "result")
        ),
    }
}

/// Says where the page is, and opens it where a person sits. The file it is opened by lives as long as what is given
/// back.
fn tell(
    page: &Review,
    args: &ReviewArgs,
    context: &Context,
) -> anyhow::Result<Option<tempfile::NamedTempFile>> {
    let (url, address) = (page.url(), page.address());
    if context.global.json {
        output::print(&json!({"schema": 1, "url": url}).to_string())?;
    } else {
        output::print(&url)?;
    }
    context.output.info(&format!(
        "{}; the address opens once, in one browser; Ctrl-C ends",
        progress(&args.reviewer, page.cards())
    ));
    if address.ip().is_loopback() {
        let port = address.port();
        context.output.info(&format!(
            "on a far machine, first: ssh -L {port}:127.0.0.1:{port} THAT-MACHINE"
        ));
    } else {
        context.output.warn(&format!(
            "the page listens on {address}, not only for this machine, and what it sends is not encrypted"
        ));
    }
    let is_for_script = args.no_open || context.global.json || context.global.quiet;
    Ok(if is_for_script { None } else { open(&url) })
}

/// Opens the address in the system's browser by way of a file that only this user can read, so that the token is in
/// no list of processes. That there is no browser is no error: the address is printed.
fn open(url: &str) -> Option<tempfile::NamedTempFile> {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else {
        let has_screen = ["DISPLAY", "WAYLAND_DISPLAY"].map(std::env::var_os);
        has_screen.iter().flatten().next()?;
        "xdg-open"
    };
    let mut file = tempfile::Builder::new().suffix(".html").tempfile().ok()?;
    write!(
        file,
        "<meta http-equiv=\"refresh\" content=\"0;url={url}\">"
    )
    .ok()?;
    open_by(program, file.path());
    Some(file)
}

fn open_by(program: &str, path: &Path) {
    let started = Command::new(program)
        .arg(path)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    if let Err(error) = started {
        tracing::debug!(%error, "no browser was opened");
    }
}

/// Vietnamese where the system speaks it.
fn language_of_system() -> Language {
    let names = ["LC_ALL", "LC_MESSAGES", "LANG"];
    let set = names.iter().filter_map(|name| std::env::var(name).ok());
    let mut set = set.filter(|value| !value.is_empty());
    match set.next() {
        Some(value) if value.starts_with("vi") => Language::Vietnamese,
        Some(_) | None => Language::English,
    }
}

#[cfg(test)]
mod tests {
    use super::{Cards, order, percent, progress};
    use crate::config::{Sources, load};
    use crate::domain::ReviewOrder;
    use crate::review::key_map;

    #[test]
    fn the_settings_give_every_action_a_key_of_its_own() {
        let settings = load(&Sources::default()).expect("the defaults");
        let keys = &settings.config.review.keys;
        let map = key_map(keys).expect("the default keys");
        assert_eq!((map.len(), keys.len()), (40, 40));
        assert_eq!(map["KeyP"], "pass");
    }

    #[test]
    fn what_tests_the_reviewer_is_counted_apart() {
        let cards = |all, results| Cards {
            all,
            results,
            answered: 7,
        };
        assert_eq!(
            progress("lan", cards(54, 50)),
            "lan has answered 7 of 54 pictures: 50 results, and 4 to test the reviewer"
        );
        assert_eq!(
            progress("lan", cards(50, 50)),
            "lan has answered 7 of 50 pictures"
        );
    }

    #[test]
    fn percentages_and_orders_are_read() {
        assert_eq!(percent("4"), Ok(0.04));
        assert_eq!(percent("12.5%"), Ok(0.125));
        assert!(percent("101").is_err() && percent("-1").is_err() && percent("NaN").is_err());
        assert_eq!(order("least-confident"), Ok(ReviewOrder::LeastConfident));
        assert!(order("adjudicate").is_err());
    }
}
