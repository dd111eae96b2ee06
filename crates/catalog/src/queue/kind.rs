//! The two kinds of job: pairs and blocks. The queue is written once for both. Its statements are templates with the
//! names of a kind.

use std::borrow::Cow;
use std::fmt::{Debug, Display};
use std::sync::OnceLock;

use serde::Serialize;
use serde_json::Value;

use crate::Result;
use crate::db::conn::Conn;
use crate::db::dialect::{Sql, postgres_text};
use crate::db::script::Script;
use crate::queue::fragments::fingerprint_before;
use crate::queue::provenance::FingerprintId;
use mocban_core::domain::WorkerId;

/// A kind of job: what it works on and its stages.
pub trait JobKind: Debug + Clone + Copy + PartialEq + Eq + Send + Sync + 'static {
    /// Row id of what a job works on.
    type Unit: Debug + Copy + Ord + Send + Sync;
    /// The user's id of it.
    type Name: Debug + Clone + PartialEq + Eq + Send + Sync;
    /// Some of them.
    type Selection: Debug + Clone + Send + Sync;
    /// A stage.
    type Stage: Debug + Display + Copy + Ord + Send + Sync;
    /// Settings, inputs and attributes that a result or a failure was made with.
    type Provenance: Debug + Clone + PartialEq + Send + Sync;
    /// Versions of the input files.
    type Inputs: Debug + Clone + PartialEq + Send + Sync;

    /// Number of stages. Also the position of a job that is done.
    const STAGES: usize;

    /// Returns what has a row id.
    fn unit(id: i64) -> Self::Unit;
    /// Returns a row id.
    fn id(unit: Self::Unit) -> i64;
    /// Returns the user's id as text.
    fn text(name: &Self::Name) -> &str;
    /// Returns the ids of a selection as a JSON array.
    fn ids(selection: &Self::Selection) -> Cow<'_, str>;
    /// Returns the stage with an index from 0.
    fn stage(index: usize) -> Option<Self::Stage>;
    /// Returns the index of a stage.
    fn index(stage: Self::Stage) -> usize;
    /// Returns the fingerprint of the settings, for a pair.
    fn fingerprint(provenance: &Self::Provenance) -> Option<FingerprintId>;

    /// Returns the stage after another one.
    fn next(stage: Self::Stage) -> Option<Self::Stage> {
        Self::stage(Self::index(stage) + 1)
    }
}

/// How the jobs of a kind are stored.
pub(crate) trait StoredKind: JobKind {
    /// Number of the kind: the place of its values in [`NAMES`].
    const NUMBER: usize;
    /// Whether jobs are counted by position, status and fingerprint.
    const IS_COUNTED: bool;
    /// Columns of results and failures that hold the provenance, each with its value in an item of a statement.
    const PROVENANCE: &'static [(&'static str, &'static str)];

    /// Returns the fields of an item that [`Self::PROVENANCE`] reads.
    fn provenance(provenance: &Self::Provenance) -> Result<impl Serialize + use<'_, Self>>;

    /// Returns these fields for a stage whose worker died, from what is known of inputs and settings.
    fn crashed(
        conn: &mut Conn,
        unit: Self::Unit,
        stage: Self::Stage,
        worker: Option<WorkerId>,
    ) -> impl Future<Output = Result<Value>> + Send;

    /// Returns whether the version of a file is known.
    fn are_known(inputs: &Self::Inputs) -> bool;

    /// Adds the statements that store versions of input files to a script.
    fn add_inputs<'i>(
        script: &mut Script,
        inputs: impl Iterator<Item = (Self::Unit, &'i Self::Inputs)>,
    ) -> Result<()>;
}

/// Counts claimed pairs, in PostgreSQL.
const COUNT_CLAIMED: &str = ",
counted AS (
    INSERT INTO counter_part (stage, status, fingerprint, n)
    SELECT c.stage, moved.status, coalesce(c.fingerprint, 0), sum(moved.n)
    FROM claimed AS c, (VALUES (0, -1), (1, 1)) AS moved (status, n)
    GROUP BY 1, 2, 3 ORDER BY 1, 2, 3
    ON CONFLICT (slot, stage, status, fingerprint) DO UPDATE SET n = counter_part.n + excluded.n)";

/// Sets the fingerprint to that of the result before a stage, for a job that goes back to the stage.
macro_rules! go_back_to {
    ($stage:literal) => {
        concat!(", fingerprint = ", fingerprint_before!($stage))
    };
}

/// The names in braces in a [`Template`], and what each stands for: for pairs, and for blocks.
const NAMES: [(&str, [&str; 2]); 19] = [
    ("job", ["job", "block_job"]),
    ("unit", ["pair", "block"]),
    ("result", ["stage_result", "block_result"]),
    ("attempt", ["attempt", "block_attempt"]),
    ("failure", ["failure", "block_failure"]),
    ("settings", ["fingerprints", "block_settings"]),
    ("prio", ["prio, ", ""]),
    ("turn", ["turn", "stage"]),
    ("exclusive", ["exclusive", "0"]),
    ("fingerprint", ["fingerprint", "NULL"]),
    // A checkpoint of a block that is sent again is stored once. Checkpoints of pairs in PostgreSQL have a statement of their
    // own, with this condition.
    ("and_in_place", ["", " AND block_job.stage = [stage]"]),
    (
        "and_advance",
        [
            ", exclusive = 0, low_confidence = [low_confidence], fingerprint = [fingerprint],
    dirty = dirty OR [mixed] OR ([first] IS NOT NULL
        AND job.fingerprint IS NOT (SELECT upstream FROM fingerprint WHERE id = [first]))",
            "",
        ],
    ),
    (
        "and_fail",
        [
            concat!(
                ", exclusive = max(exclusive, [exclusive])",
                go_back_to!("min(job.stage, [stage])")
            ),
            "",
        ],
    ),
    (
        "and_requeue",
        [
            concat!(", prio = 0, exclusive = 0", go_back_to!("([1])")),
            "",
        ],
    ),
    (
        "and_send_back",
        [
            concat!(
                ", prio = 0, exclusive = 0",
                go_back_to!("min(job.stage, [1])")
            ),
            "",
        ],
    ),
    (
        "and_not_retired",
        [
            " AND NOT EXISTS (SELECT 1 FROM retired_pair AS r WHERE r.pair = [0])",
            "",
        ],
    ),
    ("and_recover", [", exclusive = max(exclusive, [1])", ""]),
    ("and_overdue", [", exclusive = 1", ""]),
    ("and_count_claimed", [COUNT_CLAIMED, ""]),
];

/// A statement for all kinds of job and both databases. `{name}` stands for a name of the kind, and `[field]` for a number
/// of `item`, a row of `jsonb_each`. The text for a kind and a database never changes, so that it is prepared once.
pub(crate) struct Template {
    text: &'static str,
    filled: [OnceLock<Sql>; 2],
}

impl Template {
    pub(crate) const fn new(text: &'static str) -> Self {
        Self {
            text,
            filled: [const { OnceLock::new() }; 2],
        }
    }

    /// Returns the statement for a kind.
    pub(crate) fn of<K: StoredKind>(&self) -> Sql {
        *self.filled[K::NUMBER].get_or_init(|| {
            let named = with_names::<K>(self.text);
            let sqlite = with_fields(&named, |field| format!("item.value ->> {field}"));
            // SQLite locks the whole database.
            let sqlite = sqlite.replace(" FOR UPDATE", "");
            let postgres = with_fields(&named, |field| {
                format!("CAST(item.value ->> {field} AS bigint)")
            });
            Sql::pair(sqlite.leak(), postgres_text(&postgres).leak())
        })
    }
}

/// Replaces the names in braces.
fn with_names<K: StoredKind>(template: &str) -> String {
    let columns = K::PROVENANCE.iter().map(|(column, _)| *column);
    let values = K::PROVENANCE.iter().map(|(_, value)| *value);
    let updates = columns.clone();
    let updates = updates.map(|column| format!("{column} = excluded.{column}"));
    let mut text = template
        .replace("{provenance}", &columns.collect::<Vec<_>>().join(", "))
        .replace(
            "{provenance_values}",
            &values.collect::<Vec<_>>().join(", "),
        )
        .replace(
            "{provenance_updates}",
            &updates.collect::<Vec<_>>().join(", "),
        );
    for (name, values) in NAMES {
        text = text.replace(&format!("{{{name}}}"), values[K::NUMBER]);
    }
    text
}

/// Replaces the fields in brackets, which are names or numbers.
fn with_fields(text: &str, value: impl Fn(&str) -> String) -> String {
    let mut parts = text.split('[');
    let mut filled = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (field, rest) = part.split_once(']').unwrap_or((part, ""));
        let is_number = field.bytes().all(|byte| byte.is_ascii_digit());
        let field = if is_number {
            field.to_owned()
        } else {
            format!("'{field}'")
        };
        filled.push_str(&value(&field));
        filled.push_str(rest);
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::{Template, with_fields};
    use crate::queue::pair_job::PairJob;

    #[test]
    fn names_and_fields_are_replaced_for_each_database() {
        static TEXT: Template = Template::new(
            "UPDATE {job} SET stage = [stage] FROM jsonb_each(?) AS item WHERE {unit} = [0]",
        );
        let sql = TEXT.of::<PairJob>();
        assert_eq!(
            sql.sqlite,
            "UPDATE job SET stage = item.value ->> 'stage' FROM jsonb_each(?) AS item WHERE pair = item.value ->> 0"
        );
        assert_eq!(
            sql.postgres_query(),
            "UPDATE job SET stage = CAST(item.value ->> 'stage' AS bigint) FROM json_each($) AS item \
             WHERE pair = CAST(item.value ->> 0 AS bigint)"
        );
        assert_eq!(with_fields("a", str::to_owned), "a");
    }
}
