//! What the numbers of a report were computed from: program, settings, inputs, results and verdicts.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use serde_json::{Map, Value};

use mocban_catalog::PairResults;
use mocban_core::domain::{ContentHash, Stage, UnixMillis};

/// The origin of the numbers. Equal inputs, settings, results and verdicts give an equal value, except `last_result`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Provenance {
    /// Version of the program that made the report.
    pub version: &'static str,
    /// The settings of the results, one entry per fingerprint. There are several if settings changed between runs.
    pub settings: Vec<UsedSettings>,
    /// BLAKE3 over a line for each finished pair by name: its id, the hash of its mesh and the hash of its print,
    /// separated by tabs.
    pub inputs_hash: ContentHash,
    /// BLAKE3 over a line for each result: the id of its pair, the metric and the hash of the result, separated by tabs.
    pub results_hash: ContentHash,
    /// Verdicts on current results, the newest of each reviewer.
    pub verdicts: u64,
    /// Reviewers who gave these verdicts.
    pub reviewers: u64,
    /// When the newest result was stored (RFC 3339, UTC). It differs from run to run, as computing times do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_result: Option<String>,
}

/// Settings with which results were computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UsedSettings {
    /// Hash of revisions and settings of all stages.
    pub fingerprint: ContentHash,
    /// Finished pairs that were computed with them.
    pub pairs: u64,
    /// Revision, method and settings of each stage.
    pub stages: BTreeMap<Stage, Value>,
    /// Settings that are not the default ones. `None` before [`Provenance::compare_with`].
    pub changed: Option<Vec<ChangedSetting>>,
}

/// A setting with another value than the default one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChangedSetting {
    /// Its name, such as `register.min_confidence`.
    pub name: String,
    /// The value used.
    pub value: Value,
    /// The default value. `null` if the program no longer has the setting.
    pub default: Value,
}

impl Provenance {
    /// Finds the settings that differ from the default ones. `defaults` returns revision, method and settings of a stage,
    /// as fingerprints contain them.
    pub fn compare_with(&mut self, defaults: impl Fn(Stage) -> Value) {
        for used in &mut self.settings {
            let stages = used.stages.iter();
            let changed =
                stages.flat_map(|(stage, fields)| changes(*stage, fields, &defaults(*stage)));
            let mut changed: Vec<ChangedSetting> = changed.collect();
            changed.sort_by(|a, b| a.name.cmp(&b.name));
            // Several stages name the method.
            changed.dedup();
            used.changed = Some(changed);
        }
    }
}

/// Returns the settings of a stage that differ from the default ones.
fn changes(stage: Stage, fields: &Value, defaults: &Value) -> Vec<ChangedSetting> {
    let none = Map::new();
    let settings = |fields: &Value| fields["settings"].as_object().cloned();
    let (used, known) = (settings(fields), settings(defaults).unwrap_or_default());
    let used = used.as_ref().unwrap_or(&none).iter();
    let used = used.map(|(name, value)| (format!("{stage}.{name}"), value, known.get(name)));
    let method = [(
        "pipeline.method".to_owned(),
        &fields["method"],
        defaults.get("method"),
    )];
    used.chain(method)
        .filter(|(_, value, default)| !value.is_null() && *default != Some(value))
        .map(|(name, value, default)| ChangedSetting {
            name,
            value: value.clone(),
            default: default.cloned().unwrap_or_default(),
        })
        .collect()
}

/// The sums from which a [`Provenance`] is made.
#[derive(Debug, Clone, Default)]
pub(super) struct ProvenanceSums {
    settings: BTreeMap<ContentHash, UsedSettings>,
    inputs: blake3::Hasher,
    results: blake3::Hasher,
    verdicts: u64,
    reviewers: BTreeSet<String>,
    last_result: Option<UnixMillis>,
}

impl ProvenanceSums {
    /// Counts one pair. Pairs must be added in the order of their names.
    pub(super) fn add(&mut self, pair: &PairResults) {
        let name = &pair.attributes.name;
        for record in &pair.metrics {
            let (metric, hash) = (record.outcome.metric, record.result_hash);
            self.results
                .update(format!("{name}\t{metric}\t{hash}\n").as_bytes());
            self.verdicts += record.verdicts.len() as u64;
            for given in &record.verdicts {
                if !self.reviewers.contains(&given.reviewer) {
                    self.reviewers.insert(given.reviewer.clone());
                }
            }
        }
        self.last_result = self
            .last_result
            .max(pair.stages.iter().map(|stage| stage.at).max());
        let Some(last) = pair.stage(Stage::Register) else {
            return;
        };
        let print = last.print_hash.map(ContentHash::to_hex).unwrap_or_default();
        let mesh = last.mesh_hash;
        self.inputs
            .update(format!("{name}\t{mesh}\t{print}\n").as_bytes());
        let used = self
            .settings
            .entry(last.fingerprint_hash)
            .or_insert_with(|| UsedSettings {
                fingerprint: last.fingerprint_hash,
                pairs: 0,
                stages: (pair.stages.iter())
                    .map(|record| (record.stage, record.fingerprint_fields.clone()))
                    .collect(),
                changed: None,
            });
        used.pairs += 1;
    }

    pub(super) fn finish(self) -> Provenance {
        let hash = |hasher: blake3::Hasher| ContentHash::from_bytes(*hasher.finalize().as_bytes());
        let time = |at| jiff::Timestamp::from_millisecond(at).ok();
        Provenance {
            version: env!("CARGO_PKG_VERSION"),
            settings: self.settings.into_values().collect(),
            inputs_hash: hash(self.inputs),
            results_hash: hash(self.results),
            verdicts: self.verdicts,
            reviewers: self.reviewers.len() as u64,
            last_result: (self.last_result.and_then(time))
                .map(|time| time.strftime("%Y-%m-%dT%H:%M:%SZ").to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::ProvenanceSums;
    use crate::test_fixtures::{done, stage};
    use mocban_core::domain::{Stage, Verdict};

    #[test]
    fn settings_that_differ_are_named_with_both_values() {
        let mut sums = ProvenanceSums::default();
        for (name, min_confidence) in [("a", 0.5), ("b", 0.5)] {
            let mut pair = done(name, 0.8, &[Verdict::Pass, Verdict::Fail]);
            let mut record = stage(Stage::Register, 1);
            record.fingerprint_fields = json!({
                "revision": 1, "method": "default", "settings": {"min_confidence": min_confidence, "window": 3},
            });
            pair.stages = vec![record];
            sums.add(&pair);
        }
        let mut found = sums.finish();
        assert_eq!((found.verdicts, found.reviewers), (16, 2));
        assert_eq!(found.last_result.as_deref(), Some("1970-01-01T00:00:00Z"));
        found.compare_with(
            |_| json!({"method": "paper", "settings": {"min_confidence": 0.3, "window": 3}}),
        );
        let [used] = &found.settings[..] else {
            panic!("one fingerprint")
        };
        assert_eq!(used.pairs, 2);
        let changed = used.changed.as_ref().expect("compared");
        let named: Vec<(&str, &Value, &Value)> = changed
            .iter()
            .map(|one| (one.name.as_str(), &one.value, &one.default))
            .collect();
        let wanted = [
            ("pipeline.method", &json!("default"), &json!("paper")),
            ("register.min_confidence", &json!(0.5), &json!(0.3)),
        ];
        assert_eq!(named, wanted);
    }

    #[test]
    fn hashes_follow_inputs_and_results() {
        let hashes = |name: &str, is_other: bool| {
            let mut sums = ProvenanceSums::default();
            let mut pair = done(name, 0.8, &[]);
            let mut record = stage(Stage::Register, 1);
            if is_other {
                record.mesh_hash = mocban_core::domain::ContentHash::of(b"other");
            }
            pair.stages = vec![record];
            sums.add(&pair);
            let found = sums.finish();
            (found.inputs_hash, found.results_hash)
        };
        let (inputs, results) = hashes("a", false);
        assert_eq!(hashes("a", false), (inputs, results));
        assert_ne!(hashes("b", false).1, results);
        let other = hashes("a", true);
        assert!(other.0 != inputs && other.1 == results);
    }
}
