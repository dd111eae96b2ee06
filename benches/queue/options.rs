//! Command line options.

use std::path::PathBuf;

use clap::Parser;

/// Times the catalog on many pairs; prints Markdown.
#[derive(Debug, Parser)]
#[command(name = "queue")]
#[expect(clippy::struct_excessive_bools, reason = "each is an option")]
pub(super) struct Options {
    /// Sizes of catalogs [default: 100000, and 300 under `cargo test`]
    #[arg(long, value_delimiter = ',', value_name = "N")]
    pairs: Vec<usize>,
    /// Pairs for each line of the comparison of queues [default: 2000, and 20 under `cargo test`]
    #[arg(long, value_name = "N")]
    queue_pairs: Option<usize>,
    /// Numbers of pairs in progress in the comparison of queues; the first is also used for the run of real pairs
    #[arg(long, value_delimiter = ',', default_value = "2,16,64")]
    pub(super) workers: Vec<usize>,
    /// Repetitions of each line of the comparison; the median is shown
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub(super) repeats: usize,
    /// Measure only the queue of mocban, for example under a profiler
    #[arg(long)]
    pub(super) ours: bool,
    /// Program of benches/peers-queue to compare with
    #[arg(long, value_name = "FILE")]
    pub(super) peer: Option<PathBuf>,
    /// Address of a PostgreSQL database, such as `postgres://me@localhost/bench`: measures only that
    #[arg(long, value_name = "URL")]
    pub(super) postgres: Option<String>,
    /// Measure claims with and without a snapshot that another session holds, instead of several loads
    #[arg(long, requires = "postgres")]
    pub(super) hold_snapshot: bool,
    /// Connections with `--hold-snapshot`, each with a worker
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub(super) connections: usize,
    /// Seconds of a line of `--hold-snapshot`; without the snapshot at most 60
    #[arg(long, value_name = "N", default_value_t = 36)]
    pub(super) seconds: u64,
    /// With `--hold-snapshot`, measure only loads that store results
    #[arg(long, requires = "hold_snapshot")]
    pub(super) results_only: bool,
    /// Pairs of the demo that are run with real stages, for the catalog's share; 0 for none [default: 12, and none
    /// under `cargo test`]
    #[arg(long, value_name = "N")]
    real: Option<u64>,
    /// Measure only the time to the first byte of each page of the app, for catalogs of the sizes of `--pairs`
    #[arg(long)]
    pub(super) pages: bool,
    /// Only import and query: run no pair
    #[arg(long)]
    pub(super) import_only: bool,
    /// Largest catalog that is checked, because a check reads all rows several times
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    pub(super) check_up_to: usize,
    /// Set by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

impl Options {
    /// Returns the sizes of catalogs in pairs.
    pub(super) fn sizes(&self) -> Vec<usize> {
        match (self.pairs.as_slice(), self.bench) {
            ([], true) => vec![100_000],
            ([], false) => vec![300],
            (sizes, _) => sizes.to_vec(),
        }
    }

    /// Returns the pairs for each line of the comparison.
    pub(super) fn queue_pairs(&self) -> usize {
        self.queue_pairs
            .unwrap_or(if self.bench { 2_000 } else { 20 })
    }

    /// Returns the number of pairs to run with real stages.
    pub(super) fn real_pairs(&self) -> Option<u64> {
        let pairs = self.real.unwrap_or(if self.bench { 12 } else { 0 });
        (pairs > 0).then_some(pairs)
    }
}
