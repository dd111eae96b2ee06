//! Fingerprints of the settings that the result of a stage depends on.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value, json};

use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::rows::json_array;
use crate::db::transaction::in_transaction;
use crate::db::value::Json;
use crate::jobs::plan::{FieldChange, METHOD};
use crate::queue::provenance::FingerprintId;
use crate::{Catalog, Result};
use mocban_core::domain::{ContentHash, Stage};

/// The fingerprint of one stage's settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Fingerprint {
    /// Hash over the stage, its fields and the previous stage's fingerprint.
    pub hash: ContentHash,
    /// Revision and settings of the stage.
    pub fields: Value,
}

/// The current fingerprints of the stages.
#[derive(Debug, Clone, PartialEq)]
pub struct Fingerprints([Fingerprint; Stage::COUNT]);

impl Fingerprints {
    /// Computes the fingerprint of each stage from its fields. Each hash includes the previous stage's hash, so a
    /// changed setting also changes the fingerprints of all later stages.
    pub fn new(fields: impl Fn(Stage) -> Value) -> Self {
        let mut upstream: Option<ContentHash> = None;
        Self(Stage::ALL.map(|stage| {
            let fields = fields(stage);
            let hash = hash_of(stage, &fields, upstream);
            upstream = Some(hash);
            Fingerprint { hash, fields }
        }))
    }

    /// Returns the fingerprint of a stage.
    pub fn of(&self, stage: Stage) -> &Fingerprint {
        &self.0[stage.index()]
    }

    /// Returns the hashes on one line. Another process can pass the line to [`Catalog::changes_from`].
    pub fn hash_line(&self) -> String {
        let hashes = self.0.each_ref().map(|fingerprint| fingerprint.hash);
        hashes.map(ContentHash::to_hex).join(" ")
    }
}

/// Returns the hash of a stage's fingerprint. `upstream` is the hash of the fingerprint of the stage before.
pub(crate) fn hash_of(stage: Stage, fields: &Value, upstream: Option<ContentHash>) -> ContentHash {
    let whole = json!({ "stage": stage, "fields": fields, "upstream": upstream });
    ContentHash::of(whole.to_string().as_bytes())
}

/// Row ids of the current fingerprints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FingerprintIds([FingerprintId; Stage::COUNT]);

impl FingerprintIds {
    /// Returns the fingerprint of a stage.
    pub const fn of(&self, stage: Stage) -> FingerprintId {
        self.0[stage.index()]
    }

    /// Returns the ids as a JSON array by stage.
    pub(crate) fn json(self) -> String {
        json_array(self.0.map(|FingerprintId(id)| id))
    }
}

const INSERT: &str = "
INSERT INTO fingerprint (stage, hash, fields, upstream) VALUES (?1, ?2, ?3, ?4)
ON CONFLICT (hash) DO UPDATE SET upstream = excluded.upstream RETURNING id";

/// Adds the counters of a fingerprint, one for each job status, if they do not exist.
pub(crate) const ADD_COUNTERS: Sql = Sql::pair(
    "
INSERT INTO counter (stage, status, fingerprint, n) SELECT ?1, value, ?2, 0 FROM json_each('[0,1,2,3,4]') WHERE true
ON CONFLICT DO NOTHING",
    "
INSERT INTO counter_part (slot, stage, status, fingerprint, n) SELECT 0, ?1, status, ?2, 0 FROM generate_series(0, 4) AS status
ON CONFLICT DO NOTHING",
);

impl Catalog {
    /// Stores the fingerprints that are not stored yet. Returns the ids of all.
    pub async fn register_fingerprints(
        &self,
        fingerprints: &Fingerprints,
    ) -> Result<FingerprintIds> {
        let fingerprints = fingerprints.clone();
        in_transaction!(self, |conn| {
            let mut upstream: Option<FingerprintId> = None;
            let mut ids = [FingerprintId(0); Stage::COUNT];
            for stage in Stage::ALL {
                let fingerprint = fingerprints.of(stage);
                let id = query_scalar(INSERT)
                    .bind(stage.index() as i64)
                    .bind(&fingerprint.hash.as_bytes()[..])
                    .bind(fingerprint.fields.to_string())
                    .bind(upstream)
                    .fetch_one(&mut *conn)
                    .await?;
                let counters = query(ADD_COUNTERS).bind(stage.index() as i64 + 1);
                counters.bind(id).execute(&mut *conn).await?;
                ids[stage.index()] = id;
                upstream = Some(id);
            }
            Ok(FingerprintIds(ids))
        })
    }

    /// Returns the settings in which `fingerprints` differ from those of another process, which is described by its
    /// [`Fingerprints::hash_line`]. Skips a stage if the catalog does not know the other process's hash.
    pub async fn changes_from(
        &self,
        hash_line: &str,
        fingerprints: &Fingerprints,
    ) -> Result<Vec<FieldChange>> {
        let mut conn = self.read_conn().await?;
        let mut changes = Vec::new();
        for (stage, hash) in Stage::ALL.into_iter().zip(hash_line.split_whitespace()) {
            let sql = "SELECT fields FROM fingerprint WHERE hash = unhex(?1)";
            let fields = query_scalar(sql).bind(hash);
            if let Some(Json(old)) = fields.fetch_optional(&mut conn).await? {
                changes.extend(differences(
                    stage.name(),
                    &old,
                    &fingerprints.of(stage).fields,
                ));
            }
        }
        Ok(changes)
    }
}

/// Returns the ids of the fingerprints. `None` marks a fingerprint that is not stored.
pub(crate) async fn known(
    conn: &mut Conn,
    fingerprints: &Fingerprints,
) -> Result<[Option<FingerprintId>; Stage::COUNT]> {
    let mut ids = [None; Stage::COUNT];
    for (id, stage) in ids.iter_mut().zip(Stage::ALL) {
        let query = query_scalar("SELECT id FROM fingerprint WHERE hash = ?1")
            .bind(&fingerprints.of(stage).hash.as_bytes()[..]);
        *id = query.fetch_optional(&mut *conn).await?;
    }
    Ok(ids)
}

/// Returns the ids of the fingerprints as a JSON array. A fingerprint that is not stored has the id -1, which
/// matches no result.
pub(crate) async fn current_json(conn: &mut Conn, fingerprints: &Fingerprints) -> Result<String> {
    let ids = known(conn, fingerprints).await?;
    let ids = ids.iter().map(|id| id.map_or(-1, |FingerprintId(id)| id));
    Ok(json_array(ids))
}

/// Reads the settings of a fingerprint.
pub(crate) async fn fields_of(conn: &mut Conn, id: FingerprintId) -> Result<Value> {
    let query = query_scalar("SELECT fields FROM fingerprint WHERE id = ?1").bind(id);
    let Json(fields) = query.fetch_one(conn).await?;
    Ok(fields)
}

/// All stored fingerprints, and the ids of the current ones.
pub(crate) struct FingerprintChains {
    /// Stage and upstream by id.
    stored: BTreeMap<FingerprintId, (Stage, Option<FingerprintId>)>,
    current: [Option<FingerprintId>; Stage::COUNT],
}

impl FingerprintChains {
    /// Reads all fingerprints. Each combination of settings has added at most one for each stage.
    pub(crate) async fn load(conn: &mut Conn, fingerprints: &Fingerprints) -> Result<Self> {
        let current = known(conn, fingerprints).await?;
        let query = query_as("SELECT id, stage, upstream FROM fingerprint");
        let found: Vec<(_, _, _)> = query.fetch_all(conn).await?;
        let stored = found.into_iter();
        Ok(Self {
            stored: stored
                .map(|(id, stage, upstream)| (id, (stage, upstream)))
                .collect(),
            current,
        })
    }

    /// Follows a fingerprint's chain back to the first stage. Returns the earliest stage whose settings differ from the
    /// current ones, and this stage's fingerprint in the chain.
    pub(crate) fn first_change(&self, id: i64) -> Option<(Stage, FingerprintId)> {
        let mut change = None;
        let mut next = Some(FingerprintId(id));
        while let Some(id) = next {
            let (stage, upstream) = *self.stored.get(&id)?;
            if self.current[stage.index()] != Some(id) {
                change = Some((stage, id));
            }
            next = upstream;
        }
        change
    }
}

/// Returns the settings of a stage that differ, by name: `register.max_scale`.
pub(crate) fn differences(stage: &str, old: &Value, new: &Value) -> Vec<FieldChange> {
    let (old, new) = (leaves(stage, old), leaves(stage, new));
    let names: BTreeSet<_> = old.keys().chain(new.keys()).collect();
    let changed = names
        .into_iter()
        .filter(|name| old.get(*name) != new.get(*name));
    let changes = changed.map(|name| FieldChange {
        field: name.clone(),
        old: old.get(name).cloned(),
        new: new.get(name).cloned(),
    });
    changes.collect()
}

/// Flattens nested objects, with the names of the settings: the key `settings` is left out. The method, which every stage has,
/// is returned for the first stage only.
fn leaves(stage: &str, fields: &Value) -> Map<String, Value> {
    let mut found = Map::new();
    let mut open = vec![(stage.to_owned(), fields)];
    while let Some((path, value)) = open.pop() {
        let Some(inner) = value.as_object() else {
            found.insert(path, value.clone());
            continue;
        };
        for (key, value) in inner {
            let path = match key.as_str() {
                "settings" => path.clone(),
                "method" if path == Stage::Fit.name() => METHOD.to_owned(),
                "method" if path == stage => continue,
                key => format!("{path}.{key}"),
            };
            open.push((path, value));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{Fingerprints, differences};
    use mocban_core::domain::Stage;

    #[test]
    fn the_method_is_a_setting_of_the_pipeline_and_named_once() {
        let fields = |method| json!({ "method": method, "settings": { "seed": 1 } });
        let of = |stage| differences(stage, &fields("default"), &fields("paper"));
        let found = of("fit");
        assert_eq!(found.len(), 1);
        assert_eq!(
            found[0].to_string(),
            "pipeline.method: \"default\" -> \"paper\""
        );
        assert_eq!(of("register"), []);
    }

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

    #[test]
    fn a_changed_setting_is_named_with_old_and_new() {
        let old = json!({ "revision": 1, "settings": { "max_scale": 1.2, "seed": 0 } });
        let new = json!({ "revision": 1, "settings": { "max_scale": 1.3, "seed": 0 } });
        let changes = differences("register", &old, &new);
        let text: Vec<_> = changes.iter().map(ToString::to_string).collect();
        assert_eq!(text, ["register.max_scale: 1.2 -> 1.3"]);
    }
}
