//! The names of all pairs of a list, if they are few.

use crate::db::query::query_scalar;
use crate::db::rows::json_array;
use crate::records::pair_list::{ListReader, PairFilter, PairOrder};
use crate::{Catalog, Result};
use mocban_core::domain::{PairName, ThresholdMetric};

/// Maximum number of pairs that are looked at.
const MAX_SEARCHED: usize = 100_000;

/// Names in the order of import. The join reads each pair by its key.
pub(crate) const NAMES: &str = "
SELECT p.name FROM (SELECT CAST(atom AS bigint) AS id FROM json_each(?1)) AS c CROSS JOIN pair AS p ON p.id = c.id ORDER BY p.id";

/// The pairs of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ListedNames {
    /// The names of all pairs, in the order of import.
    All(Vec<PairName>),
    /// There are more than the limit.
    TooMany,
    /// The first pairs in the order of the list were looked at, but not all, because there are too many.
    NotSearched {
        /// Number of pairs that were looked at.
        searched: usize,
    },
}

impl Catalog {
    /// Returns the names of all pairs of a list, if they are at most `limit`. Reads a limited part of an index.
    pub async fn listed_names(
        &self,
        filter: &PairFilter,
        order: PairOrder,
        metric: ThresholdMetric,
        limit: usize,
    ) -> Result<ListedNames> {
        let mut conn = self.snapshot().await?;
        let reader = ListReader::new(&mut conn, filter, order, metric).await?;
        let (mut ids, mut after, mut searched): (Vec<i64>, _, usize) = (Vec::new(), None, 0);
        loop {
            let size = limit + 1 - ids.len();
            let (rows, next, scanned) = reader.page(&mut conn, after, size).await?;
            ids.extend(rows.iter().map(|row| row.id));
            if ids.len() > limit {
                return Ok(ListedNames::TooMany);
            }
            if next.is_none() {
                break;
            }
            after = next;
            searched += scanned.unwrap_or_default();
            if searched >= MAX_SEARCHED {
                return Ok(ListedNames::NotSearched { searched });
            }
        }
        let names = query_scalar(NAMES).bind(json_array(ids));
        Ok(ListedNames::All(names.fetch_all(&mut conn).await?))
    }
}
