//! What the user of the database may store as a reviewer. Only PostgreSQL has such rights.

use crate::db::query::query_as;
use crate::db::row::from_row;
use crate::records::reviewer_names::person_name;
use crate::{Catalog, CatalogError, Result};

/// Rights of the user of the database.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a right of its own, with a name"
)]
pub struct ReviewRights {
    /// Name of the user. Empty if the catalog is a file.
    user: String,
    /// The name, quoted for SQL if needed.
    quoted: String,
    /// Whether the user may append verdicts.
    adds_verdicts: bool,
    /// Whether the user may store all that the review page stores.
    reviews: bool,
    /// Whether the user may use only the own name as the reviewer.
    is_limited_to_own: bool,
    /// Whether the server takes no changes of this user, such as a standby.
    is_read_only: bool,
}

from_row! { ReviewRights { user: "user_name", quoted, adds_verdicts, reviews, is_limited_to_own, is_read_only } }

/// The policies that limit reviewers to their own names do not apply to workers: see `migrations/roles/postgres.sql`. Read
/// connections are set to read-only, so `reset_val` is compared, the value with which the session began.
const RIGHTS: &str = "
SELECT CAST(session_user AS text) AS user_name, quote_ident(session_user) AS quoted,
    has_any_column_privilege('verdict', 'INSERT') AS adds_verdicts,
    (SELECT bool_and(has_any_column_privilege(name, 'INSERT')) FROM unnest(ARRAY['review_act', 'verdict', 'verdict_undo', 'attention_check_answer',
        'attention_check_undo', 'manual_alignment', 'manual_alignment_undo', 'checksum']) AS name) AS reviews,
    row_security_active('verdict') AND NOT EXISTS (
        SELECT 1 FROM pg_roles WHERE rolname = 'mocban_worker' AND pg_has_role(oid, 'USAGE')) AS is_limited_to_own,
    pg_is_in_recovery() OR EXISTS (
        SELECT 1 FROM pg_settings WHERE name = 'default_transaction_read_only' AND reset_val = 'on') AS is_read_only";

impl Catalog {
    /// Returns what the user of the database may store as a reviewer. In a file, everybody may store everything.
    pub async fn review_rights(&self) -> Result<ReviewRights> {
        if !self.is_shared() {
            return Ok(ReviewRights::ALL);
        }
        let mut conn = self.read_conn().await?;
        query_as(RIGHTS).fetch_one(&mut conn).await
    }
}

impl ReviewRights {
    const ALL: Self = Self {
        user: String::new(),
        quoted: String::new(),
        adds_verdicts: true,
        reviews: true,
        is_limited_to_own: false,
        is_read_only: false,
    };

    /// Returns the only reviewer whose verdicts the user may store or undo, or `None` for any reviewer.
    pub fn only_reviewer(&self) -> Option<&str> {
        self.is_limited_to_own.then_some(self.user.as_str())
    }

    /// Returns whether the user may store verdicts. Whoever may change anything in a catalog may.
    pub const fn may_store(&self) -> bool {
        self.adds_verdicts && !self.is_read_only
    }

    /// Checks that the user may append verdicts of a reviewer.
    pub fn require_verdicts(&self, reviewer: &str) -> Result<()> {
        self.require(self.adds_verdicts, Some(reviewer))
    }

    /// Checks that the user may store all that the review page stores for a reviewer, and undo it. Without `reviewer`,
    /// the user's own name is assumed.
    pub fn require_review(&self, reviewer: Option<&str>) -> Result<()> {
        self.require(self.reviews, reviewer)
    }

    fn require(&self, is_granted: bool, reviewer: Option<&str>) -> Result<()> {
        if !is_granted {
            return Err(CatalogError::MayNotReview(self.quoted.clone()));
        }
        let other = reviewer.filter(|name| {
            self.only_reviewer()
                .is_some_and(|own| person_name(own) != person_name(name))
        });
        match other {
            Some(reviewer) => Err(CatalogError::OtherReviewer {
                user: self.user.clone(),
                reviewer: reviewer.to_owned(),
            }),
            None => Ok(()),
        }
    }
}
