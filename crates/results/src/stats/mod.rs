//! Statistics on plain numbers: intervals of proportions, paired tests, chance-corrected agreement, the bootstrap.
//!
//! The functions do not depend on the catalog, on metrics or on verdicts. Intervals are at the 95 % level, and tests
//! are two-sided.

mod binomial;
mod bootstrap;
mod hypothesis;
mod interval;
mod kappa;
mod mcnemar;
mod quantile;
mod rate;
mod resampling;

pub use binomial::binomial_cdf;
pub use bootstrap::{
    BOOTSTRAP_SEED, QuantitySums, bootstrap_p, percentile_interval_95, resample_count,
    resampled_means,
};
pub use hypothesis::{SIGNIFICANCE_LEVEL, holm, holm_of_known};
pub use interval::{IntervalMethod, clopper_pearson_95, wilson_95};
pub use kappa::AgreementTable;
pub use mcnemar::{McNemarTest, mcnemar_exact, mcnemar_sample_size};
pub use quantile::{median, quantile};
pub use rate::{Rate, ratio};
pub use resampling::{ClusterSample, MAX_UNITS, MIN_UNITS, ResampledMeans, ResamplingUnit};
