//! Pages of the results of pairs: of all pairs, or only of judged ones.

use std::vec::IntoIter;

use crate::db::query::query_scalar;
use crate::records::model::PairResults;
use crate::{Catalog, Result};
use mocban_core::domain::PairName;

/// Selects the pairs of all stored verdicts, which may be undone, by name.
pub(crate) const JUDGED: &str = "
SELECT p.id FROM (SELECT DISTINCT pair FROM verdict) AS v CROSS JOIN pair AS p ON p.id = v.pair ORDER BY p.name";

/// Reads the results of pairs page by page, sorted by name. Only one page is read into memory at a time.
#[derive(Debug)]
pub struct ResultPages<'a> {
    catalog: &'a Catalog,
    size: usize,
    rest: UnreadPairs,
}

/// The pairs that were not read yet.
#[derive(Debug)]
enum UnreadPairs {
    /// All pairs behind a name.
    Behind(Option<PairName>),
    /// The pairs with these row ids.
    Listed(IntoIter<i64>),
}

impl Catalog {
    /// Returns the results of all pairs in pages of at most `size`.
    pub const fn result_pages(&self, size: usize) -> ResultPages<'_> {
        ResultPages {
            catalog: self,
            size,
            rest: UnreadPairs::Behind(None),
        }
    }

    /// Returns the results of the pairs with verdicts, undone or not, in pages of at most `size`. Reads no other pair.
    pub async fn judged_pages(&self, size: usize) -> Result<ResultPages<'_>> {
        Ok(ResultPages {
            catalog: self,
            size,
            rest: UnreadPairs::Listed(self.judged_pairs().await?.into_iter()),
        })
    }

    /// Returns the row ids of the pairs with verdicts, undone or not, sorted by name.
    pub(crate) async fn judged_pairs(&self) -> Result<Vec<i64>> {
        let mut conn = self.read_conn().await?;
        query_scalar(JUDGED).fetch_all(&mut conn).await
    }
}

impl ResultPages<'_> {
    /// Returns the next page, which is never empty, or `None` after the last page.
    pub async fn next(&mut self) -> Result<Option<Vec<PairResults>>> {
        match &mut self.rest {
            UnreadPairs::Behind(after) => {
                let page = self.catalog.results_page(after.as_ref(), self.size).await?;
                let Some(last) = page.last() else {
                    return Ok(None);
                };
                *after = Some(last.attributes.name.clone());
                Ok(Some(page))
            }
            UnreadPairs::Listed(ids) => loop {
                let next: Vec<i64> = ids.by_ref().take(self.size).collect();
                if next.is_empty() {
                    return Ok(None);
                }
                let mut conn = self.catalog.snapshot().await?;
                // Retired pairs have no results.
                let page = self.catalog.results_of(&mut conn, &next).await?;
                if !page.is_empty() {
                    return Ok(Some(page));
                }
            },
        }
    }
}
