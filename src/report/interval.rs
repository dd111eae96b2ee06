//! The ways to tell how sure a share is.

use serde::Serialize;

use super::stats::{binomial_tail, wilson_95};

/// How an interval of a share is computed; its name is told wherever one is shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum IntervalMethod {
    /// Wilson's score interval: right on average.
    #[default]
    Wilson,
    /// Clopper and Pearson's: never too narrow, mostly too wide.
    Exact,
}

impl IntervalMethod {
    /// Every one.
    pub const ALL: [Self; 2] = [Self::Wilson, Self::Exact];

    /// Name in JSON, CSV and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wilson => "wilson",
            Self::Exact => "exact",
        }
    }

    /// What stands over a column of them.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Wilson => "95% Wilson",
            Self::Exact => "95% exact",
        }
    }

    /// The 95 % interval for `passed` of `n`, both bounds in 0..=1; `None` when `n` is 0.
    pub fn of(self, passed: u64, n: u64) -> Option<[f64; 2]> {
        match self {
            Self::Wilson => wilson_95(passed, n),
            Self::Exact => (n > 0).then(|| [1.0 - most(n - passed, n), most(passed, n)]),
        }
    }
}

/// The share under which `count` or fewer of `n` have a chance of 2.5 %.
///
/// Source: Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404.
fn most(count: u64, n: u64) -> f64 {
    let (mut low, mut high) = (count as f64 / n as f64, 1.0);
    // The chance falls from the share that was seen up to 1; halved until nothing lies between.
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if binomial_tail(count, n, middle) > 0.025 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

impl std::str::FromStr for IntervalMethod {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|interval| interval.name() == text)
            .ok_or_else(|| format!("{text:?} is not an interval (wilson, exact)"))
    }
}

#[cfg(test)]
mod tests {
    use super::IntervalMethod;
    use crate::report::stats::wilson_95;

    /// Values of statsmodels 0.15.0 `proportion_confint(method="beta")`.
    const EXACT: [(u64, u64, [f64; 2]); 8] = [
        (584, 587, [0.985_137_485_406_516_2, 0.998_944_801_454_672_8]),
        (578, 587, [0.971_094_935_018_714_7, 0.992_965_799_897_107_3]),
        (586, 587, [0.990_545_152_725_619_7, 0.999_956_870_081_766_8]),
        (0, 10, [0.0, 0.308_497_107_818_760_83]),
        (10, 10, [0.691_502_892_181_239_2, 1.0]),
        (1, 1, [0.025, 1.0]),
        (37, 50, [0.596_552_321_271_934_2, 0.853_699_415_603_445_5]),
        (
            99_990,
            100_000,
            [0.999_816_104_154_623_3, 0.999_952_045_104_861],
        ),
    ];

    #[test]
    fn exact_equals_statsmodels() {
        for (passed, n, [low, high]) in EXACT {
            let found = IntervalMethod::Exact.of(passed, n).expect("n is not 0");
            assert!((found[0] - low).abs() < 1e-10, "{passed}/{n}: {found:?}");
            assert!((found[1] - high).abs() < 1e-10, "{passed}/{n}: {found:?}");
        }
        assert_eq!(IntervalMethod::Exact.of(0, 0), None);
        assert_eq!(IntervalMethod::Wilson.of(3, 7), wilson_95(3, 7));
    }

    #[test]
    fn every_interval_is_found_by_its_name() {
        for interval in IntervalMethod::ALL {
            assert_eq!(interval.name().parse(), Ok(interval));
        }
        assert!("normal".parse::<IntervalMethod>().is_err());
    }
}
