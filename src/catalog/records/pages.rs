//! Results of all pairs, page by page.

use crate::catalog::db::error::Result;
use crate::catalog::handle::Catalog;
use crate::catalog::records::model::PairResults;
use crate::domain::PairName;

/// Pairs in the order of names, a page at a time, so that memory does not grow with their number.
#[derive(Debug)]
pub struct ResultPages<'a> {
    catalog: &'a Catalog,
    size: usize,
    after: Option<PairName>,
}

impl Catalog {
    /// Results of all pairs in pages of at most `size`.
    pub const fn result_pages(&self, size: usize) -> ResultPages<'_> {
        ResultPages {
            catalog: self,
            size,
            after: None,
        }
    }
}

impl ResultPages<'_> {
    /// The next page, which is never empty; `None` at the end.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn next(&mut self) -> Result<Option<Vec<PairResults>>> {
        let page = self.catalog.results_page(self.after.as_ref(), self.size);
        let page = page.await?;
        let Some(last) = page.last() else {
            return Ok(None);
        };
        self.after = Some(last.attributes.name.clone());
        Ok(Some(page))
    }
}
