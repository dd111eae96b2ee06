//! What the program is asked to do.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Parser;
use mocban::config::Preset;
use mocban::demo::Tier;
use mocban::domain::ThresholdMetric;

use super::case::Case;
use super::method::Method;

/// Pairs of each tier and seed when nothing else is asked for.
const PAIRS: u64 = 60;

/// Accuracy and speed of the four stages on the built-in data, as Markdown.
#[derive(Debug, Parser)]
#[command(name = "accuracy")]
pub(super) struct Options {
    /// Kinds of pairs
    #[arg(long, value_delimiter = ',', default_value = "upright,pose,hard,real")]
    pub(super) tiers: Vec<Tier>,
    /// Pairs of each tier and seed; the real tier has 20 [default: 60, and 1 under `cargo test`]
    #[arg(long, value_name = "N")]
    pairs: Option<u64>,
    /// Scans of about so many vertices [default: 20,000 to 150,000]
    #[arg(long, value_name = "N")]
    vertices: Option<u32>,
    /// Seeds of the data
    #[arg(long, value_delimiter = ',', default_value = "1")]
    seeds: Vec<u64>,
    /// Presets to compare: default, paper
    #[arg(long, value_delimiter = ',', default_value = "default", value_parser = preset)]
    presets: Vec<Preset>,
    /// A setting laid over each preset; repeatable
    #[arg(long = "set", value_name = "SECTION.KEY=VALUE")]
    sets: Vec<String>,
    /// Pairs at work at a time, each on one core [default: the cores there are]
    #[arg(long, value_name = "N", default_value_t = cores(), hide_default_value = true)]
    pub(super) workers: NonZeroUsize,
    /// The metric that sheets and the question of decoys go by
    #[arg(long, default_value = ThresholdMetric::ALL[ThresholdMetric::ALL.len() - 1].name())]
    pub(super) metric: ThresholdMetric,
    /// Also run pairs without a right answer: a wrong print, a mirrored mesh, an uncarved mesh
    #[arg(long)]
    pub(super) decoys: bool,
    /// How many of the worst pairs go on a contact sheet
    #[arg(long, value_name = "N", default_value_t = 50, requires = "sheets")]
    pub(super) worst: usize,
    /// Where contact sheets go: one PNG a tier and preset
    #[arg(long, value_name = "DIR")]
    pub(super) sheets: Option<PathBuf>,
    /// Where every number of every pair and metric goes
    #[arg(long, value_name = "FILE")]
    pub(super) pairs_csv: Option<PathBuf>,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

impl Options {
    /// The presets with the settings laid over them.
    pub(super) fn methods(&self) -> anyhow::Result<Vec<Method>> {
        let load = |preset: &Preset| Method::load(*preset, &self.sets);
        self.presets.iter().map(load).collect()
    }

    /// The pairs, by tier, seed and index.
    pub(super) fn cases(&self) -> Vec<Case> {
        let wanted = self.pairs.unwrap_or(if self.bench { PAIRS } else { 1 });
        let mut cases = Vec::new();
        for tier in &self.tiers {
            let count = wanted.min(tier.max_pairs().unwrap_or(u64::MAX));
            for seed in &self.seeds {
                let case = |index| Case::new(*tier, *seed, index, self.vertices);
                cases.extend((0..count).map(case));
            }
        }
        cases
    }
}

fn preset(name: &str) -> Result<Preset, String> {
    Preset::named(name).ok_or_else(|| format!("{name:?} is not a preset (default, paper)"))
}

fn cores() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}
