//! Lists of pairs, filtered and sorted, in pages that start behind a key. Every page reads a limited part of an index, so
//! that a list of a million pairs is as fast as a short one.

use std::cmp::Ordering;

use crate::db::conn::Conn;
use crate::db::query::query_as;
use crate::db::row::from_row;
use crate::records::joint_verdict::{JointVerdict, earlier_verdicts, standing_of_verdicts};
use crate::records::model::PairResults;
use crate::records::reviewer_names::Spellings;
use crate::records::status::from_current_verdicts;
use crate::{Catalog, Result};
use mocban_core::domain::{FailureClass, JobStatus, ThresholdMetric, Verdict, enum_names};

/// Maximum number of pairs that are looked at for one page.
const MAX_SCANNED: usize = 4000;

/// Largest rounding error of a difference of two scores, so that 0.65 and 0.55 differ by 0.1.
const ROUNDING: f64 = 1e-9;

/// The order of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum PairOrder {
    /// As imported.
    #[default]
    Imported,
    /// Results of lowest confidence first. Pairs without a result are left out.
    LeastConfident,
    /// Results of highest confidence first.
    MostConfident,
    /// Results of lowest intersection over union first. Pairs without a result are left out.
    LowestIou,
    /// Results of highest intersection over union first.
    HighestIou,
}

enum_names! { pub PairOrder, "an order of pairs":
Imported = "imported", LeastConfident = "confidence", MostConfident = "confidence-down", LowestIou = "iou", HighestIou = "iou-down" }

impl PairOrder {
    /// Returns the key of a pair, by which keys ascend in this order. `None` if the pair is not in the list.
    fn key(self, row: &ListedRow) -> Option<f64> {
        match self {
            Self::Imported => Some(0.0),
            Self::LeastConfident => row.confidence,
            Self::MostConfident => row.confidence.map(|value| -value),
            Self::LowestIou => row.iou,
            Self::HighestIou => row.iou.map(|value| -value),
        }
    }
}

/// Which pairs are in a list. All conditions must hold.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PairFilter {
    /// Status of the job; with several, one of them.
    pub statuses: Vec<JobStatus>,
    /// Class of the failure of a quarantined pair.
    pub class: Option<FailureClass>,
    /// A verdict of a reviewer on the current result of the metric.
    pub verdict: Option<Verdict>,
    /// What all reviewers together must say of this result.
    pub joint: Option<JointVerdict>,
    /// Whether the current result of the metric must have a verdict, or must have none.
    pub is_judged: Option<bool>,
    /// Whether the result of the default metric must have a low confidence.
    pub is_low_confidence: bool,
    /// The block of the list.
    pub block: Option<String>,
    /// The character.
    pub character: Option<String>,
    /// A metric whose IoU differs from that of the metric of the list.
    pub differs: Option<MetricDifference>,
}

/// By how much the results of a pair under two metrics must differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetricDifference {
    /// The other metric.
    pub from: ThresholdMetric,
    /// Smallest difference of IoU, above 0.
    pub min_iou: f64,
}

/// Where a page of a list begins: behind the pair with this key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairCursor {
    /// Value by which the list is sorted.
    pub key: f64,
    /// Row id of the pair.
    pub id: i64,
}

/// A page of a list.
#[derive(Debug)]
pub struct PairListPage {
    /// The pairs.
    pub pairs: Vec<PairResults>,
    /// Where the next page begins. `None` at the end of the list.
    pub next: Option<PairCursor>,
    /// Number of pairs that were looked at, if the page is not full for this reason.
    pub scanned: Option<usize>,
}

/// A pair as found by a source.
#[derive(Debug, Clone, Copy)]
pub(super) struct ListedRow {
    pub(super) id: i64,
    confidence: Option<f64>,
    iou: Option<f64>,
    passes: bool,
}

from_row! { ListedRow { id, confidence, iou, passes } }

/// Selects pairs from a source with a column `id`, of which `?4` rows are read, and says whether they pass the filter.
/// Retired pairs, which have no job, never do.
/// Sources use `?2` and `?3`, the key and the row id of the last pair of the page before; `?5` is the metric.
macro_rules! listed {
    ($source:literal) => {
        concat!(
            "SELECT c.id, m.confidence, m.iou, CASE WHEN (?6 IS NULL OR p.block = ?6) AND (?7 IS NULL OR p.character = ?7)
        AND (?8 >> CAST(j.status AS integer)) % 2 = 1 AND (?9 IS NULL OR f.class = ?9)
        AND (?10 IS NULL OR EXISTS (SELECT 1 ",
            from_current_verdicts!(),
            " AND v.pair = c.id AND v.metric = ?5 AND v.verdict = ?10))
        AND (?16 = 0 OR (?16 >> (",
            standing_of_verdicts!(),
            ")) % 2 = 1)
        AND (?17 = 0 OR j.status = 3 AND EXISTS (",
            earlier_verdicts!(),
            "))
        AND (?11 < 0 OR (?11 = 0) <> EXISTS (SELECT 1 ",
            from_current_verdicts!(),
            " AND v.pair = c.id AND v.metric = ?5))
        AND (?12 = 0 OR j.status = 3 AND j.low_confidence = 1) AND (?13 = 0 OR j.status = 3)
        AND (?14 IS NULL OR j.status = 3 AND abs(m.iou - o.iou) >= ?15) THEN 1 ELSE 0 END AS passes
FROM (",
            $source,
            " LIMIT ?4) AS c CROSS JOIN pair AS p ON p.id = c.id LEFT JOIN job AS j ON j.pair = c.id
    LEFT JOIN failure AS f ON f.pair = c.id AND j.status = 4
    LEFT JOIN metric_result AS m ON m.pair = c.id AND m.metric = ?5
    LEFT JOIN metric_result AS o ON o.pair = c.id AND o.metric = ?14"
        )
    };
}

const ALL: &str = listed!("SELECT pair AS id FROM job WHERE pair > ?3 ORDER BY pair");
const OF_BLOCK: &str = listed!("SELECT id FROM pair WHERE block = ?6 AND id > ?3 ORDER BY id");
const OF_CHARACTER: &str =
    listed!("SELECT id FROM pair WHERE character = ?7 AND id > ?3 ORDER BY id");
const FAILED: &str =
    listed!("SELECT pair AS id FROM job WHERE status = 4 AND pair > ?3 ORDER BY pair");
const OF_CLASS: &str =
    listed!("SELECT pair AS id FROM failure WHERE class = ?9 AND pair > ?3 ORDER BY pair");
const LOW: &str = listed!(
    "SELECT pair AS id FROM job WHERE low_confidence = 1 AND status = 3 AND pair > ?3 ORDER BY pair"
);
const JUDGED: &str = listed!(
    "SELECT DISTINCT pair AS id FROM verdict WHERE verdict = ?10 AND pair > ?3 ORDER BY pair"
);
const JUDGED_BY_ANYBODY: &str =
    listed!("SELECT DISTINCT pair AS id FROM verdict WHERE pair > ?3 ORDER BY pair");
const BY_CONFIDENCE: &str = listed!(
    "SELECT pair AS id FROM metric_result WHERE metric = ?5 AND (confidence, pair) > (?2, ?3) ORDER BY confidence, pair"
);
const BY_CONFIDENCE_DOWN: &str = listed!(
    "SELECT pair AS id FROM metric_result WHERE metric = ?5 AND (confidence, pair) < (-?2, -?3)
    ORDER BY confidence DESC, pair DESC"
);
const BY_IOU: &str = listed!(
    "SELECT pair AS id FROM metric_result WHERE metric = ?5 AND (iou, pair) > (?2, ?3) ORDER BY iou, pair"
);
const BY_IOU_DOWN: &str = listed!(
    "SELECT pair AS id FROM metric_result WHERE metric = ?5 AND (iou, pair) < (-?2, -?3) ORDER BY iou DESC, pair DESC"
);

/// Returns every statement of this list, with a name.
#[cfg(test)]
pub(crate) fn statements() -> [(&'static str, &'static str); 12] {
    [
        ("all", ALL),
        ("block", OF_BLOCK),
        ("character", OF_CHARACTER),
        ("failed", FAILED),
        ("class", OF_CLASS),
        ("low", LOW),
        ("judged", JUDGED),
        ("judged by anybody", JUDGED_BY_ANYBODY),
        ("confidence", BY_CONFIDENCE),
        ("confidence down", BY_CONFIDENCE_DOWN),
        ("iou", BY_IOU),
        ("iou down", BY_IOU_DOWN),
    ]
}

impl PairFilter {
    /// Returns the source that has the fewest pairs besides those of the list, in the order of import.
    const fn source(&self) -> &'static str {
        if self.given_verdict().is_some() {
            JUDGED
        } else if self.joint.is_some() || matches!(self.is_judged, Some(true)) {
            JUDGED_BY_ANYBODY
        } else if self.class.is_some() {
            OF_CLASS
        } else if self.is_low_confidence {
            LOW
        } else if self.block.is_some() {
            OF_BLOCK
        } else if self.character.is_some() {
            OF_CHARACTER
        } else if matches!(self.statuses.as_slice(), [JobStatus::Quarantined]) {
            FAILED
        } else {
            ALL
        }
    }

    /// Returns a verdict that somebody must have given on the current result.
    const fn given_verdict(&self) -> Option<Verdict> {
        match (self.verdict, self.joint) {
            (None, Some(joint)) => joint.given(),
            (verdict, _) => verdict,
        }
    }

    /// Returns one bit for each status of the filter.
    fn status_bits(&self) -> i64 {
        let bits = self.statuses.iter().map(|status| 1 << status.code());
        match bits.sum() {
            0 => i64::from(u8::MAX),
            bits => bits,
        }
    }
}

/// Returns the source that is sorted by an order.
const fn sorted_source(order: PairOrder) -> &'static str {
    match order {
        PairOrder::Imported => ALL,
        PairOrder::LeastConfident => BY_CONFIDENCE,
        PairOrder::MostConfident => BY_CONFIDENCE_DOWN,
        PairOrder::LowestIou => BY_IOU,
        PairOrder::HighestIou => BY_IOU_DOWN,
    }
}

/// What a list is read with.
pub(super) struct ListReader<'l> {
    filter: &'l PairFilter,
    order: PairOrder,
    metric: ThresholdMetric,
    renamed: String,
}

impl<'l> ListReader<'l> {
    pub(super) async fn new(
        conn: &mut Conn,
        filter: &'l PairFilter,
        order: PairOrder,
        metric: ThresholdMetric,
    ) -> Result<Self> {
        Ok(Self {
            filter,
            order,
            metric,
            renamed: Spellings::read(conn).await?.renamed(),
        })
    }

    /// Reads at most `limit` rows of a source behind a pair.
    async fn read(
        &self,
        conn: &mut Conn,
        source: &'static str,
        after: Option<PairCursor>,
        limit: usize,
    ) -> Result<Vec<ListedRow>> {
        let filter = self.filter;
        let descends = matches!(self.order, PairOrder::MostConfident | PairOrder::HighestIou)
            && source == sorted_source(self.order);
        // No pair of a list has this key: all are above it, and the negated ones below its opposite.
        let first = PairCursor {
            key: f64::MIN,
            id: if descends { -i64::MAX } else { -1 },
        };
        let after = after.unwrap_or(first);
        // Descending sources negate both, so that ties also continue in their order.
        let id = if descends && after.id >= 0 {
            -after.id
        } else {
            after.id
        };
        let verdict = filter.given_verdict().map(Verdict::name);
        let is_stale = filter.joint == Some(JointVerdict::Stale);
        let query = query_as(source)
            .bind(self.renamed.as_str())
            .bind(after.key)
            .bind(id)
            .bind(limit as i64)
            .bind(self.metric.name())
            .bind(&filter.block)
            .bind(&filter.character)
            .bind(filter.status_bits())
            .bind(filter.class.map(FailureClass::name))
            .bind(verdict)
            .bind(filter.is_judged.map_or(-1, i64::from))
            .bind(i64::from(filter.is_low_confidence))
            // The scores of a pair that runs again are those of its last result.
            .bind(i64::from(self.order != PairOrder::Imported))
            .bind(filter.differs.map(|differs| differs.from.name()))
            .bind(
                filter
                    .differs
                    .map_or(0.0, |differs| differs.min_iou - ROUNDING),
            )
            .bind(filter.joint.map_or(0, JointVerdict::standings))
            .bind(i64::from(is_stale));
        query.fetch_all(conn).await
    }

    /// Compares two pairs of the list.
    fn compare(&self, a: &ListedRow, b: &ListedRow) -> Ordering {
        let keys = |row| self.order.key(row).unwrap_or(f64::MAX);
        let ids = match self.order {
            PairOrder::MostConfident | PairOrder::HighestIou => b.id.cmp(&a.id),
            _ => a.id.cmp(&b.id),
        };
        keys(a).total_cmp(&keys(b)).then(ids)
    }

    /// Returns whether a pair is behind a cursor.
    fn is_after(&self, row: &ListedRow, cursor: Option<PairCursor>) -> bool {
        let Some(PairCursor { key, id }) = cursor else {
            return true;
        };
        let own = self.order.key(row).unwrap_or(f64::MAX);
        let by_id = match self.order {
            PairOrder::MostConfident | PairOrder::HighestIou => id.cmp(&row.id),
            _ => row.id.cmp(&id),
        };
        own.total_cmp(&key).then(by_id) == Ordering::Greater
    }

    fn cursor(&self, row: &ListedRow) -> PairCursor {
        PairCursor {
            key: self.order.key(row).unwrap_or(f64::MAX),
            id: row.id,
        }
    }

    /// Reads all pairs of the filter's own source and sorts them. Returns `None` if there are too many.
    async fn sorted(&self, conn: &mut Conn) -> Result<Option<Vec<ListedRow>>> {
        let source = self.filter.source();
        if self.order == PairOrder::Imported || source == ALL {
            return Ok(None);
        }
        let mut rows = self.read(conn, source, None, MAX_SCANNED).await?;
        if rows.len() == MAX_SCANNED {
            return Ok(None);
        }
        rows.retain(|row| row.passes && self.order.key(row).is_some());
        rows.sort_by(|a, b| self.compare(a, b));
        Ok(Some(rows))
    }

    /// Returns the next pairs of the list, and where to continue. Reads more and more rows until the page is full.
    pub(super) async fn page(
        &self,
        conn: &mut Conn,
        mut after: Option<PairCursor>,
        size: usize,
    ) -> Result<(Vec<ListedRow>, Option<PairCursor>, Option<usize>)> {
        if let Some(rows) = self.sorted(conn).await? {
            let mut rows: Vec<_> = rows
                .into_iter()
                .filter(|row| self.is_after(row, after))
                .take(size + 1)
                .collect();
            let has_more = rows.len() > size;
            rows.truncate(size);
            let next = rows.last().filter(|_| has_more);
            return Ok((rows.clone(), next.map(|row| self.cursor(row)), None));
        }
        let source = match self.order {
            PairOrder::Imported => self.filter.source(),
            order => sorted_source(order),
        };
        let (mut found, mut scanned, mut limit) = (Vec::new(), 0, size + 1);
        loop {
            let mut rows = self.read(conn, source, after, limit).await?;
            let (count, is_end) = (rows.len(), rows.len() < limit);
            rows.sort_by(|a, b| self.compare(a, b));
            for row in rows {
                // A row behind a full page shows that there is another one.
                if found.len() == size && row.passes {
                    let next = found.last().map(|row| self.cursor(row));
                    return Ok((found, next, None));
                }
                if row.passes {
                    found.push(row);
                }
                after = Some(self.cursor(&row));
            }
            scanned += count;
            if is_end {
                return Ok((found, None, None));
            }
            if scanned >= MAX_SCANNED {
                return Ok((found, after, Some(scanned)));
            }
            limit = (4 * limit).min(MAX_SCANNED - scanned);
        }
    }
}

impl Catalog {
    /// Returns a page of at most `size` pairs of a list. The scores are those of `metric`. Retired pairs are in no list.
    pub async fn pair_list(
        &self,
        filter: &PairFilter,
        order: PairOrder,
        metric: ThresholdMetric,
        after: Option<PairCursor>,
        size: usize,
    ) -> Result<PairListPage> {
        let mut conn = self.snapshot().await?;
        let reader = ListReader::new(&mut conn, filter, order, metric).await?;
        let (rows, next, scanned) = reader.page(&mut conn, after, size).await?;
        let ids: Vec<i64> = rows.iter().map(|row| row.id).collect();
        Ok(PairListPage {
            pairs: self.results_of(&mut conn, &ids).await?,
            next,
            scanned,
        })
    }
}
