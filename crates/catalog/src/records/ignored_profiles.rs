//! Counts the images whose colour profile could not be applied, by the results of the stages that read them.

use serde::Serialize;

use crate::db::query::query_as;
use crate::db::row::from_row;
use crate::{Catalog, Result};

/// Pairs in the counts whose stage `normalize` names a profile that it ignored: how many, and the first one. Results of other
/// stages, which are longer, and of retired pairs are not read.
pub(crate) const PRINTS: &str = "
SELECT p.name AS id, count(*) OVER () AS count FROM job AS j CROSS JOIN stage_result AS r ON r.pair = j.pair
CROSS JOIN pair AS p ON p.id = j.pair
WHERE r.stage = 2 AND r.outcome LIKE '%\"ignored_profile\":%' ORDER BY j.pair LIMIT 1";

/// Blocks whose stage `align` has a warning, which is about the profile of the page: how many, and the first one.
const PAGES: &str = "
SELECT b.name AS id, count(*) OVER () AS count FROM block_result AS r JOIN block AS b ON b.id = r.block
WHERE r.stage = 1 AND r.outcome LIKE '%\"warnings\":[%' ORDER BY r.block LIMIT 1";

/// Pairs or blocks with such an image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ProfileCount {
    /// The first one.
    pub id: String,
    /// Their number.
    pub count: u64,
}

from_row! { ProfileCount { id, count } }

/// Images whose colour profile could not be applied.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct IgnoredProfiles {
    /// Pairs with such a print.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs: Option<ProfileCount>,
    /// Blocks with such a page.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blocks: Option<ProfileCount>,
}

impl IgnoredProfiles {
    /// Returns whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.pairs.is_none() && self.blocks.is_none()
    }

    /// Returns a sentence about the prints and one about the pages, if there are any.
    pub fn sentences(&self) -> Vec<String> {
        let sentence = |found: &ProfileCount, kind: &str| {
            let ProfileCount { id, count } = found;
            format!(
                "{kind} with a colour profile that cannot be applied: {count}, first of {id}; `show` names the profile"
            )
        };
        let prints = self.pairs.iter().map(|found| sentence(found, "prints"));
        let pages = self.blocks.iter().map(|found| sentence(found, "pages"));
        prints.chain(pages).collect()
    }
}

impl Catalog {
    /// Returns the images whose colour profile could not be applied when their results were computed. Reads a result of each
    /// pair and block.
    pub async fn ignored_profiles(&self) -> Result<IgnoredProfiles> {
        let mut conn = self.read_conn().await?;
        let pairs = query_as(PRINTS).fetch_optional(&mut conn).await?;
        let blocks = query_as(PAGES).fetch_optional(&mut conn).await?;
        Ok(IgnoredProfiles { pairs, blocks })
    }
}
