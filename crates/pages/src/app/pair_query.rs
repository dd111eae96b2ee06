//! The address of a list of pairs: its filter, its order and where its page begins.

use super::address::PageQuery;
use mocban_catalog::{JointVerdict, MetricDifference, PairCursor, PairFilter, PairOrder};
use mocban_core::domain::{JobStatus, ThresholdMetric};

/// States that a list can be filtered by, with the statuses of their jobs.
const STATES: [(&str, &[JobStatus]); 5] = [
    ("aligned", &[JobStatus::Done]),
    ("failed", &[JobStatus::Quarantined]),
    ("waiting", &[JobStatus::Ready, JobStatus::Backoff]),
    ("running", &[JobStatus::Leased]),
    (
        "unfinished",
        &[JobStatus::Ready, JobStatus::Backoff, JobStatus::Leased],
    ),
];

/// State by which a list asks for retired pairs, which have no job.
pub(super) const RETIRED: &str = "retired";

/// Address of the list of all pairs, relative to the pages of a project.
pub(super) const ALL_PAIRS: &str = "pairs";
/// Address of the list of aligned pairs.
pub(super) const ALIGNED_PAIRS: &str = "pairs?state=aligned";
/// Address of the list of results with a low confidence.
pub(super) const LOW_CONFIDENCE_PAIRS: &str = "pairs?confidence=low&sort=confidence";
/// Address of the list of failed pairs.
pub(super) const FAILED_PAIRS: &str = "pairs?state=failed&view=table";
/// Address of the list of pairs that are not finished.
pub(super) const UNFINISHED_PAIRS: &str = "pairs?state=unfinished";
/// Address of the list of retired pairs.
pub(super) const RETIRED_PAIRS: &str = "pairs?state=retired";

/// Differences of IoU that a list can ask for.
pub(super) const DIFFERENCES: [&str; 4] = ["0.01", "0.03", "0.1", "0.3"];

/// Names of the values of an address that choose a list and how it is shown.
const LIST_VALUES: [&str; 11] = [
    "state",
    "class",
    "confidence",
    "verdict",
    "block",
    "character",
    "sort",
    "metric",
    "compare",
    "differs",
    "view",
];

/// Number of cards on a page, and of rows.
const PAGE_SIZES: [usize; 2] = [48, 100];

/// A list of pairs as its address names it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PairQuery {
    pub(super) filter: PairFilter,
    pub(super) order: PairOrder,
    pub(super) metric: ThresholdMetric,
    /// Another metric, whose results are shown beside those of the first.
    pub(super) compared: Option<ThresholdMetric>,
    /// Whether the address asks for a difference of IoU without another metric. Then nothing is listed.
    pub(super) lacks_compared: bool,
    pub(super) is_table: bool,
    /// Whether retired pairs are listed instead of the others.
    pub(super) is_retired: bool,
    pub(super) after: Option<PairCursor>,
}

impl PairQuery {
    /// Reads an address. Values that are not valid are ignored.
    pub(super) fn of(query: &PageQuery) -> Self {
        let state = query.get("state");
        let statuses = STATES.iter().find(|(name, _)| Some(*name) == state);
        let verdict = query.get("verdict");
        let class = query.parsed("class");
        // Pairs without a result have no score by which they could be sorted.
        let has_results = class.is_none() && statuses.is_none_or(|(name, _)| *name == "aligned");
        let order = query.parsed("sort").filter(|_| has_results);
        let metric = query.parsed("metric").unwrap_or(ThresholdMetric::DEFAULT);
        let compared = query
            .parsed::<ThresholdMetric>("compare")
            .filter(|other| *other != metric);
        let min_iou = query.get("differs").and_then(|wanted| {
            let known = DIFFERENCES.into_iter().find(|known| *known == wanted)?;
            known.parse().ok()
        });
        let differs = compared
            .zip(min_iou)
            .map(|(from, min_iou)| MetricDifference { from, min_iou });
        Self {
            filter: PairFilter {
                statuses: statuses.map_or_else(Vec::new, |(_, statuses)| statuses.to_vec()),
                class,
                verdict: query.parsed("verdict"),
                joint: query.parsed::<JointVerdict>("verdict"),
                is_judged: match verdict {
                    Some("none") => Some(false),
                    Some("judged") => Some(true),
                    _ => None,
                },
                is_low_confidence: query.get("confidence") == Some("low"),
                block: query.get("block").map(str::to_owned),
                character: query.get("character").map(str::to_owned),
                differs,
            },
            order: order.unwrap_or_default(),
            metric,
            compared,
            lacks_compared: min_iou.is_some() && compared.is_none(),
            is_table: query.get("view") == Some("table"),
            is_retired: state == Some(RETIRED),
            after: query.get("after").and_then(cursor),
        }
    }

    /// Returns the address of the same list from its beginning, without values that change nothing. It is empty for the list of
    /// all pairs.
    pub(super) fn plain(query: &PageQuery) -> PageQuery {
        let values = LIST_VALUES.map(|name| (name, query.get(name).unwrap_or_default()));
        let mut plain = PageQuery::default();
        for (name, value) in values {
            plain = plain.with(name, value);
        }
        let list = Self::of(&plain);
        for name in LIST_VALUES {
            let without = plain.with(name, "");
            if Self::of(&without) == list {
                plain = without;
            }
        }
        plain
    }

    /// Returns the query of the page of a pair, which shows the same metrics.
    pub(super) fn of_pair(&self) -> PageQuery {
        let chosen = Some(self.metric).filter(|metric| *metric != ThresholdMetric::DEFAULT);
        let metric = chosen.map_or("", ThresholdMetric::name);
        let compared = self.compared.map_or("", ThresholdMetric::name);
        PageQuery::default()
            .with("metric", metric)
            .with("compare", compared)
    }

    /// Returns how many pairs a page has.
    pub(super) const fn page_size(&self) -> usize {
        PAGE_SIZES[self.is_table as usize]
    }
}

/// Parses where a page begins, such as `-0.97,118`.
fn cursor(text: &str) -> Option<PairCursor> {
    let (key, id) = text.split_once(',')?;
    let (key, id) = (key.parse::<f64>().ok()?, id.parse::<i64>().ok()?);
    (key.is_finite() && id > 0).then_some(PairCursor { key, id })
}

/// Returns where a page begins as text.
pub(super) fn cursor_text(cursor: PairCursor) -> String {
    format!("{},{}", cursor.key, cursor.id)
}

#[cfg(test)]
mod tests {
    use super::{PairQuery, cursor_text};
    use crate::app::address::PageQuery;
    use mocban_catalog::{JointVerdict, PairCursor, PairOrder};
    use mocban_core::domain::{FailureClass, JobStatus, ThresholdMetric, Verdict};

    #[test]
    fn an_address_names_a_list() {
        let of = |text: &str| PairQuery::of(&PageQuery::parse(text));
        let after = PairCursor { key: -0.1, id: 7 };
        let text = format!(
            "verdict=none&sort=iou-down&metric=relief&view=table&after={}",
            cursor_text(after)
        );
        let query = of(&text);
        assert_eq!(query.after, Some(after));
        assert_eq!(query.order, PairOrder::HighestIou);
        assert_eq!(query.metric, ThresholdMetric::Relief);
        assert_eq!(query.filter.is_judged, Some(false));
        assert!(query.is_table && !query.is_retired);
        let judged = of("verdict=judged").filter;
        assert_eq!((judged.verdict, judged.is_judged), (None, Some(true)));
        assert_eq!(of("state=unfinished").filter.statuses.len(), 3);
        assert!(of("state=retired").is_retired);
        for joint in JointVerdict::ALL {
            let text = format!("verdict={joint}");
            let filter = of(&text).filter;
            assert_eq!((filter.verdict, filter.joint), (None, Some(joint)));
        }
        let given = of("verdict=fail").filter;
        assert_eq!((given.verdict, given.joint), (Some(Verdict::Fail), None));
        let failed = of("class=io&state=waiting&sort=iou");
        assert_eq!(failed.filter.class, Some(FailureClass::Io));
        assert_eq!(
            failed.filter.statuses,
            [JobStatus::Ready, JobStatus::Backoff]
        );
        assert_eq!(failed.order, PairOrder::Imported, "no scores to sort by");
        let compared = of("metric=relief&compare=density&differs=0.1");
        assert_eq!(compared.compared, Some(ThresholdMetric::Density));
        let differs = compared.filter.differs.map(|differs| differs.min_iou);
        assert_eq!(differs, Some(0.1));
        assert!(!compared.lacks_compared);
        for lacking in ["differs=0.1", "compare=ensemble&differs=0.1"] {
            assert!(of(lacking).lacks_compared, "{lacking}");
        }
        let plain = of("");
        for bad in [
            "state=x",
            "class=1",
            "sort=a&after=NaN,1",
            "after=1,-2",
            "after=1",
            "compare=ensemble",
            "differs=0.2",
            "compare=x",
        ] {
            assert_eq!(of(bad), plain, "{bad}");
        }
    }

    #[test]
    fn a_plain_address_has_only_what_chooses_the_list() {
        let plain = |text| PairQuery::plain(&PageQuery::parse(text)).text();
        for (address, expected) in [
            ("", ""),
            ("after=0.5,7&done=retire&at=1&state=x&sort=imported", ""),
            ("metric=ensemble&view=gallery&compare=ensemble", ""),
            (
                "view=table&sort=iou&state=aligned&metric=relief",
                "?state=aligned&sort=iou&metric=relief&view=table",
            ),
            ("class=io&sort=iou", "?class=io"),
            (
                "compare=density&differs=0.1",
                "?compare=density&differs=0.1",
            ),
            ("differs=0.2&block=b+03", "?block=b%2003"),
        ] {
            assert_eq!(plain(address), expected, "{address}");
            assert_eq!(plain(expected.trim_start_matches('?')), expected);
        }
    }
}
