//! Fingerprints: what the result of a stage depends on besides the inputs.

use serde_json::{Value, json};
use sqlx::SqliteConnection;

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::lease::FingerprintId;
use crate::catalog::queue::plan::FieldChange;
use crate::catalog::queue::staleness::differences;
use crate::domain::{ContentHash, Stage};

/// One stage's fingerprint.
#[derive(Debug, Clone, PartialEq)]
pub struct Fingerprint {
    /// Hash over the stage, its fields and the fingerprint before it.
    pub hash: ContentHash,
    /// Revision and settings of the stage.
    pub fields: Value,
}

/// The current fingerprints of the four stages.
#[derive(Debug, Clone, PartialEq)]
pub struct Fingerprints([Fingerprint; 4]);

impl Fingerprints {
    /// Fingerprints from each stage's fields. A stage's hash takes in the one before it, so that a changed setting
    /// changes the fingerprints of its stage and of all later ones.
    pub fn new(fields: impl Fn(Stage) -> Value) -> Self {
        let mut upstream: Option<ContentHash> = None;
        Self(Stage::ALL.map(|stage| {
            let fields = fields(stage);
            let whole = json!({ "stage": stage, "fields": fields, "upstream": upstream });
            let hash = ContentHash::of(whole.to_string().as_bytes());
            upstream = Some(hash);
            Fingerprint { hash, fields }
        }))
    }

    /// The fingerprint of a stage.
    pub fn of(&self, stage: Stage) -> &Fingerprint {
        &self.0[stage.index()]
    }

    /// The fingerprints in a line, for processes to compare; [`Catalog::changes_from`] reads it.
    pub fn terms(&self) -> String {
        self.0
            .each_ref()
            .map(|fingerprint| fingerprint.hash.to_hex())
            .join(" ")
    }
}

/// Numbers of the current fingerprints in the catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FingerprintIds([FingerprintId; 4]);

impl FingerprintIds {
    /// The fingerprint of a stage.
    pub const fn of(&self, stage: Stage) -> FingerprintId {
        self.0[stage.index()]
    }

    /// The numbers as a JSON array by stage.
    pub(crate) fn json(self) -> String {
        rows::array(self.0.map(|FingerprintId(id)| id)).to_string()
    }
}

const ENTER: &str = "
INSERT INTO fingerprint (stage, hash, fields, upstream) VALUES (?1, ?2, ?3, ?4)
ON CONFLICT (hash) DO UPDATE SET upstream = excluded.upstream RETURNING id";

impl Catalog {
    /// Enters the current fingerprints where they are new; gives their numbers.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn register_fingerprints(
        &self,
        fingerprints: &Fingerprints,
    ) -> Result<FingerprintIds> {
        let fingerprints = fingerprints.clone();
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let mut upstream: Option<i64> = None;
                for stage in Stage::ALL {
                    let fingerprint = fingerprints.of(stage);
                    let id = sqlx::query_scalar(ENTER)
                        .bind(stage.index() as i64)
                        .bind(&fingerprint.hash.as_bytes()[..])
                        .bind(fingerprint.fields.to_string())
                        .bind(upstream)
                        .fetch_one(&mut *conn)
                        .await?;
                    upstream = Some(id);
                }
                let mut ids = [FingerprintId(0); 4];
                for (id, found) in ids.iter_mut().zip(known(conn, &fingerprints).await?) {
                    *id = found.ok_or_else(|| {
                        CatalogError::Corrupt("a fingerprint just written is not there".to_owned())
                    })?;
                }
                Ok(FingerprintIds(ids))
            })
        })
        .await
    }
}

impl Catalog {
    /// What differs between fingerprints as [`Fingerprints::terms`] told them and these; what the catalog does not know of is
    /// left out.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn changes_from(
        &self,
        terms: &str,
        fingerprints: &Fingerprints,
    ) -> Result<Vec<FieldChange>> {
        let mut conn = self.read_conn().await?;
        let mut changes = Vec::new();
        for (stage, hash) in Stage::ALL.into_iter().zip(terms.split_whitespace()) {
            let fields: Option<String> =
                sqlx::query_scalar("SELECT fields FROM fingerprint WHERE hash = unhex(?1)")
                    .bind(hash)
                    .fetch_optional(&mut *conn)
                    .await?;
            if let Some(fields) = fields {
                let old = serde_json::from_str(&fields)?;
                changes.extend(differences(stage, &old, &fingerprints.of(stage).fields));
            }
        }
        Ok(changes)
    }
}

/// Numbers of the fingerprints that the catalog knows.
pub(crate) async fn known(
    conn: &mut SqliteConnection,
    fingerprints: &Fingerprints,
) -> Result<[Option<FingerprintId>; 4]> {
    let mut ids = [None; 4];
    for (id, stage) in ids.iter_mut().zip(Stage::ALL) {
        *id = sqlx::query_scalar("SELECT id FROM fingerprint WHERE hash = ?1")
            .bind(&fingerprints.of(stage).hash.as_bytes()[..])
            .fetch_optional(&mut *conn)
            .await?
            .map(FingerprintId);
    }
    Ok(ids)
}

/// The fingerprints as a JSON array of stage and number for `json_each`; a number no result has where it is unknown.
pub(crate) async fn current_json(
    conn: &mut SqliteConnection,
    fingerprints: &Fingerprints,
) -> Result<String> {
    let ids = known(conn, fingerprints).await?;
    let ids = ids.iter().map(|id| id.map_or(-1, |FingerprintId(id)| id));
    Ok(rows::array(ids).to_string())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::Fingerprints;
    use crate::domain::Stage;

    #[test]
    fn a_changed_setting_changes_its_stage_and_those_after_it() {
        let old = Fingerprints::new(|_| json!({ "revision": 1 }));
        let new = Fingerprints::new(|stage| match stage {
            Stage::Normalize => json!({ "revision": 2 }),
            Stage::Fit | Stage::Depth | Stage::Register => json!({ "revision": 1 }),
        });
        let changed = Stage::ALL.map(|stage| old.of(stage).hash != new.of(stage).hash);
        assert_eq!(changed, [false, false, true, true]);
    }
}
