//! The latest results of a run as pictures, and the least confident ones of the last hour.

use maud::{Markup, html};

use super::address::PageQuery;
use super::components::empty;
use super::pairs_page::pair_card;
use super::visit::Visit;
use mocban_catalog::{Catalog, PairResults};
use mocban_core::domain::{ThresholdMetric, UnixMillis};

/// Number of the latest results that are shown.
const LATEST: usize = 12;
/// Number of the least confident results that are shown.
const WORST: usize = 6;
/// Age of the oldest result that may be among the least confident ones, in milliseconds.
const HOUR_MS: UnixMillis = 3_600_000;

/// Results that the page of a run shows.
#[derive(Default)]
pub(super) struct LatestResults {
    /// The newest first.
    newest: Vec<PairResults>,
    /// The least confident results of the last hour, in order of confidence.
    worst: Vec<PairResults>,
}

impl LatestResults {
    pub(super) async fn read(catalog: &Catalog, now: UnixMillis) -> mocban_catalog::Result<Self> {
        let metric = ThresholdMetric::DEFAULT;
        let worst = catalog.least_confident_results(now - HOUR_MS, metric, WORST);
        Ok(Self {
            newest: catalog.recent_results(LATEST).await?,
            worst: worst.await?,
        })
    }
}

/// Returns both galleries. The second one is left out if nothing was aligned in the last hour.
pub(super) fn latest_results(visit: &Visit, results: &LatestResults) -> Markup {
    let gallery = |pairs: &[PairResults]| {
        let (metric, shown) = (ThresholdMetric::DEFAULT, PageQuery::default());
        html! {
            div.gallery { @for pair in pairs { (pair_card(visit, "", pair, metric, &shown)) } }
        }
    };
    html! {
        section #latest {
            h2 { (visit.t("Latest results", "Kết quả mới nhất")) }
            @if results.newest.is_empty() {
                (empty(visit.t("There are no results yet.", "Chưa có kết quả."), &html! {}))
            } @else {
                (gallery(&results.newest))
                p.row { a href="pairs?sort=confidence" { (visit.t("All results, least confident first", "Mọi kết quả, độ tin cậy thấp trước")) } }
            }
        }
        @if !results.worst.is_empty() {
            section #worst {
                h2 { (visit.t("Least confident of the last hour", "Độ tin cậy thấp nhất trong một giờ qua")) }
                (gallery(&results.worst))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{LatestResults, latest_results};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_results::test_fixtures::with_confidence;

    #[test]
    fn the_least_confident_results_are_named_in_both_languages() {
        let mut results = LatestResults {
            newest: vec![with_confidence("a", 0.9)],
            worst: Vec::new(),
        };
        let shown = |results: &LatestResults, language| {
            latest_results(&Visit::in_language(language), results).into_string()
        };
        let old = shown(&results, Language::English);
        assert!(old.contains("Latest results"), "{old}");
        assert!(!old.contains("id=\"worst\""), "{old}");
        results.worst.push(with_confidence("chữ 1", 0.25));
        for (language, title, confidence) in [
            (
                Language::English,
                "Least confident of the last hour",
                "confidence 0.250",
            ),
            (
                Language::Vietnamese,
                "Độ tin cậy thấp nhất trong một giờ qua",
                "độ tin cậy 0,250",
            ),
        ] {
            let shown = shown(&results, language);
            let worst = shown.split("id=\"worst\"").nth(1).expect("a gallery");
            let picture = "src=\"pair/ch%E1%BB%AF%201/picture/thumb-ensemble\"";
            for part in [title, confidence, "chữ 1", picture] {
                assert!(worst.contains(part), "{part}: {worst}");
            }
        }
        let none = shown(&LatestResults::default(), Language::English);
        assert!(none.contains("There are no results yet."), "{none}");
    }
}
