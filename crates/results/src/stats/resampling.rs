//! Samples for the bootstrap. The unit of resampling is an observation, or a cluster of observations.

use std::collections::BTreeMap;

use serde::Serialize;

use super::bootstrap::{QuantitySums, bootstrap_p, percentile_interval_95, resampled_means};

/// Minimum number of units with a value of a quantity. With fewer units, the quantity's interval would be too narrow.
pub const MIN_UNITS: usize = 10;
/// Largest number of units in a sample. A larger sample is not resampled, because its sampling error is negligible.
pub const MAX_UNITS: usize = 100_000;

/// What is resampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ResamplingUnit {
    /// Single pairs.
    Pair,
    /// Whole blocks with all their pairs. A pair without a block counts as a block of its own.
    Block,
}

impl ResamplingUnit {
    /// Returns the plural noun.
    pub const fn plural(self) -> &'static str {
        match self {
            Self::Pair => "pairs",
            Self::Block => "blocks",
        }
    }
}

/// The quantities of a sample, summed by unit. Dependent observations form a cluster, which is one unit.
#[derive(Debug, Clone)]
pub struct ClusterSample {
    width: usize,
    units: Vec<QuantitySums>,
    clusters: BTreeMap<String, usize>,
    is_full: bool,
}

impl ClusterSample {
    /// Returns an empty sample of `width` quantities.
    pub const fn new(width: usize) -> Self {
        Self {
            width,
            units: Vec::new(),
            clusters: BTreeMap::new(),
            is_full: false,
        }
    }

    /// Returns the sums of an observation's unit. Adds a unit if the observation has no cluster, or its cluster is new.
    ///
    /// Returns `None`, and marks the sample as full, if a unit would have to be added beyond [`MAX_UNITS`].
    pub fn unit(&mut self, cluster: Option<&str>) -> Option<&mut QuantitySums> {
        let known = cluster.and_then(|cluster| self.clusters.get(cluster).copied());
        let index = known.unwrap_or(self.units.len());
        if known.is_none() {
            if self.units.len() == MAX_UNITS {
                self.is_full = true;
                return None;
            }
            self.units.push(vec![[0.0; 2]; self.width]);
            if let Some(cluster) = cluster {
                self.clusters.insert(cluster.to_owned(), index);
            }
        }
        self.units.get_mut(index)
    }

    /// Returns the number of units.
    pub const fn units(&self) -> usize {
        self.units.len()
    }

    /// Returns whether an observation was left out because the sample has [`MAX_UNITS`] units.
    pub const fn is_full(&self) -> bool {
        self.is_full
    }

    /// Returns what a unit is: a block if any observation named one, or else a pair.
    pub fn unit_kind(&self) -> ResamplingUnit {
        if self.clusters.is_empty() {
            ResamplingUnit::Pair
        } else {
            ResamplingUnit::Block
        }
    }

    /// Resamples the units.
    pub fn resample(&self) -> ResampledMeans {
        let mut total = vec![[0.0; 2]; self.width];
        let mut units_with = vec![0; self.width];
        for unit in &self.units {
            for (i, [sum, n]) in unit.iter().enumerate() {
                total[i][0] += sum;
                total[i][1] += n;
                units_with[i] += usize::from(*n > 0.0);
            }
        }
        ResampledMeans {
            total,
            units_with,
            means: resampled_means(&self.units, self.width),
        }
    }
}

/// Every quantity of a sample with its resampled means.
#[derive(Debug, Clone)]
pub struct ResampledMeans {
    total: QuantitySums,
    units_with: Vec<usize>,
    means: Vec<Vec<f64>>,
}

impl ResampledMeans {
    /// Returns a quantity's sum and count over the whole sample.
    pub fn total(&self, quantity: usize) -> [f64; 2] {
        self.total[quantity]
    }

    /// Returns the 95 % percentile interval of a quantity's mean, or `None` if fewer than [`MIN_UNITS`] units have a
    /// value of the quantity.
    pub fn ci95(&mut self, quantity: usize) -> Option<[f64; 2]> {
        let is_enough = self.units_with[quantity] >= MIN_UNITS;
        percentile_interval_95(&mut self.means[quantity]).filter(|_| is_enough)
    }

    /// Returns the two-sided p-value of the hypothesis that a quantity's mean is 0. Returns `None` if fewer than
    /// [`MIN_UNITS`] units have a value of the quantity.
    pub fn p(&self, quantity: usize) -> Option<f64> {
        let is_enough = self.units_with[quantity] >= MIN_UNITS;
        bootstrap_p(&self.means[quantity]).filter(|_| is_enough)
    }
}

#[cfg(test)]
mod tests {
    use super::{ClusterSample, ResamplingUnit};

    fn sample(observations: usize, per_cluster: Option<usize>) -> ClusterSample {
        let mut sample = ClusterSample::new(1);
        for i in 0..observations {
            let cluster = per_cluster.map(|size| format!("b{}", i / size));
            let unit = sample.unit(cluster.as_deref()).expect("room");
            unit[0][0] += i as f64;
            unit[0][1] += 1.0;
        }
        sample
    }

    #[test]
    fn observations_of_one_cluster_are_one_unit() {
        let (single, clustered) = (sample(40, None), sample(40, Some(3)));
        let kind = |sample: &ClusterSample| (sample.unit_kind(), sample.units());
        assert_eq!(kind(&single), (ResamplingUnit::Pair, 40));
        assert_eq!(kind(&clustered), (ResamplingUnit::Block, 14));
        assert_eq!(clustered.resample().total(0), [780.0, 40.0]);
        assert_ne!(single.resample().ci95(0), clustered.resample().ci95(0));
    }

    #[test]
    fn few_units_have_neither_interval_nor_p() {
        let mut few = sample(27, Some(3)).resample();
        assert_eq!((few.ci95(0), few.p(0)), (None, None));
        let mut enough = sample(30, Some(3)).resample();
        assert!(enough.ci95(0).is_some() && enough.p(0).is_some());
    }
}
