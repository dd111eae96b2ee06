//! What the program is asked to do.

use std::path::PathBuf;

use clap::Parser;

/// What the catalog costs on many pairs, as Markdown.
#[derive(Debug, Parser)]
#[command(name = "queue")]
pub(super) struct Options {
    /// Sizes of catalogs [default: 100000, and 300 under `cargo test`]
    #[arg(long, value_delimiter = ',', value_name = "N")]
    pairs: Vec<usize>,
    /// Pairs for each line of the comparison of queues [default: 2000, and 20 under `cargo test`]
    #[arg(long, value_name = "N")]
    queue_pairs: Option<usize>,
    /// Pairs in hand at a time in the comparison of queues; the first is that of a run
    #[arg(long, value_delimiter = ',', default_value = "2,16,64")]
    pub(super) workers: Vec<usize>,
    /// Times each line of the comparison is measured; the median counts
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub(super) repeats: usize,
    /// Measure our own queue only, as for a profiler
    #[arg(long)]
    pub(super) ours: bool,
    /// The program of benches/peers-queue, to compare with
    #[arg(long, value_name = "FILE")]
    pub(super) peer: Option<PathBuf>,
    /// Pairs of the built-in dataset that are really run, for the catalog's share; 0 for none [default: 12, and none
    /// under `cargo test`]
    #[arg(long, value_name = "N")]
    real: Option<u64>,
    /// Import and ask only: no pair is run
    #[arg(long)]
    pub(super) import_only: bool,
    /// Pairs of the largest catalog that is checked: a check reads all of it several times
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    pub(super) check_up_to: usize,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

impl Options {
    /// Sizes of catalogs.
    pub(super) fn sizes(&self) -> Vec<usize> {
        match (self.pairs.as_slice(), self.bench) {
            ([], true) => vec![100_000],
            ([], false) => vec![300],
            (sizes, _) => sizes.to_vec(),
        }
    }

    /// Pairs of a line of the comparison.
    pub(super) fn queue_pairs(&self) -> usize {
        self.queue_pairs
            .unwrap_or(if self.bench { 2_000 } else { 20 })
    }

    /// Pairs that are really run.
    pub(super) fn real_pairs(&self) -> Option<u64> {
        let pairs = self.real.unwrap_or(if self.bench { 12 } else { 0 });
        (pairs > 0).then_some(pairs)
    }
}
