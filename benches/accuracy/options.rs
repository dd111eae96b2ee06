//! Command-line options.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Parser;
use mocban::config::Preset;
use mocban::demo::Tier;
use mocban::domain::ThresholdMetric;

use super::case::Case;
use super::method::Method;

/// Default number of pairs of each tier and seed.
const PAIRS: u64 = 60;

/// Accuracy and speed of the four stages on the built-in data, as Markdown.
#[derive(Debug, Parser)]
#[command(name = "accuracy")]
pub(super) struct Options {
    /// Kinds of pairs; `all` is every kind
    #[arg(long, value_delimiter = ',', default_value = "upright,pose,hard,real")]
    pub(super) tiers: Vec<Tier>,
    /// Pairs of each tier and seed; the real tier has 20 [default: 60, and 1 under `cargo test`]
    #[arg(long, value_name = "N")]
    pairs: Option<u64>,
    /// Approximate number of vertices of the scans [default: 20,000 to 150,000]
    #[arg(long, value_name = "N")]
    vertices: Option<u32>,
    /// Shrink prints to this longest side in pixels; of several sizes, pairs take each in turn
    #[arg(
        long,
        value_name = "PX",
        value_delimiter = ',',
        conflicts_with = "sheets"
    )]
    print_px: Vec<u32>,
    /// Seeds of the data
    #[arg(long, value_delimiter = ',', default_value = "1")]
    seeds: Vec<u64>,
    /// Presets to compare: default, paper
    #[arg(long, value_delimiter = ',', default_value = "default")]
    presets: Vec<Preset>,
    /// A setting that overrides each preset; repeatable
    #[arg(long = "set", value_name = "SECTION.KEY=VALUE")]
    sets: Vec<String>,
    /// Pairs computed at the same time, each on one core [default: all cores]
    #[arg(long, value_name = "N", default_value_t = cores(), hide_default_value = true)]
    pub(super) workers: NonZeroUsize,
    /// The metric for contact sheets and decoys
    #[arg(long, default_value = ThresholdMetric::Relief.name())]
    pub(super) metric: ThresholdMetric,
    /// Also run pairs without a right answer: a wrong print, a mirrored mesh, an uncarved mesh
    #[arg(long)]
    pub(super) decoys: bool,
    /// Fit the weights of the confidence model on these pairs and their decoys, and print nothing else
    #[arg(long, visible_alias = "fit")]
    pub(super) fit_confidence: bool,
    /// Seeds of the pairs on which fitted weights are checked
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1001",
        requires = "fit_confidence"
    )]
    held_out_seeds: Vec<u64>,
    /// Number of the worst pairs on a contact sheet
    #[arg(long, value_name = "N", default_value_t = 50, requires = "sheets")]
    pub(super) worst: usize,
    /// Folder for contact sheets, one PNG a tier and preset
    #[arg(long, value_name = "DIR")]
    pub(super) sheets: Option<PathBuf>,
    /// CSV file for every number of every pair and metric
    #[arg(long, value_name = "FILE")]
    pub(super) pairs_csv: Option<PathBuf>,
    /// Passed by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

impl Options {
    /// Replaces the tier `all` by every other tier.
    pub(super) fn with_every_tier(mut self) -> Self {
        if self.tiers.contains(&Tier::All) {
            self.tiers = Tier::ALL
                .into_iter()
                .filter(|tier| *tier != Tier::All)
                .collect();
        }
        self
    }

    /// Returns the presets with the overridden settings.
    pub(super) fn methods(&self) -> anyhow::Result<Vec<Method>> {
        let load = |preset: &Preset| Method::load(*preset, &self.sets);
        self.presets.iter().map(load).collect()
    }

    /// Returns the pairs, by tier, seed and index.
    pub(super) fn cases(&self) -> Vec<Case> {
        self.cases_of(&self.seeds)
    }

    /// Returns the pairs on which fitted weights are checked.
    pub(super) fn held_out_cases(&self) -> Vec<Case> {
        self.cases_of(&self.held_out_seeds)
    }

    fn cases_of(&self, seeds: &[u64]) -> Vec<Case> {
        let wanted = self.pairs.unwrap_or(if self.bench { PAIRS } else { 1 });
        let mut cases = Vec::new();
        for tier in &self.tiers {
            let count = wanted.min(tier.max_pairs().unwrap_or(u64::MAX));
            for seed in seeds {
                let case = |index: u64| {
                    let size = index as usize % self.print_px.len().max(1);
                    let print_px = self.print_px.get(size).copied();
                    Case::new(*tier, *seed, index, self.vertices, print_px)
                };
                cases.extend((0..count).map(case));
            }
        }
        cases
    }
}

fn cores() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}
