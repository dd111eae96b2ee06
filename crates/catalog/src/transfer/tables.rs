//! The tables that a copy of a catalog contains, with their columns.

use crate::db::dialect::Sql;
use crate::db::value::Argument;

/// A table of a catalog.
#[derive(Debug)]
pub(super) struct CopyTable {
    pub(super) name: &'static str,
    /// Columns by which rows are sorted and paged, in order: one or two of the first columns.
    pub(super) keys: usize,
    /// Number of columns.
    pub(super) columns: usize,
    /// Names of the columns, the keys first.
    pub(super) names: &'static str,
    /// Selects a page of rows that follow a key.
    pub(super) page: Sql,
    /// Selects the largest key.
    pub(super) last: &'static str,
    /// Whether the last key is a text, not a number.
    ends_with_text: bool,
    /// Sets the next id in PostgreSQL, where ids are numbered by a sequence.
    pub(super) renumber: Option<&'static str>,
}

impl CopyTable {
    /// Returns a key that sorts before all rows.
    pub(super) fn key_before_all(&self) -> Vec<Argument> {
        let mut key = vec![Argument::from(i64::MIN); self.keys];
        if self.ends_with_text {
            key[self.keys - 1] = Argument::from("");
        }
        key
    }
}

/// Describes a table with a numeric key, whose new rows the database numbers if `numbered` is given.
macro_rules! table {
    ($name:literal, $columns:literal, $key:literal $(, $rest:literal)* $(; $numbered:ident)?) => {
        CopyTable {
            name: $name,
            keys: 1,
            columns: $columns,
            names: concat!($key $(, ", ", $rest)*),
            page: Sql::both(concat!(
                "SELECT ", $key $(, ", ", $rest)*, " FROM ", $name, " WHERE ", $key, " > ?1 ORDER BY 1 LIMIT ?2"
            )),
            last: concat!("SELECT ", $key, " FROM ", $name, " ORDER BY 1 DESC LIMIT 1"),
            ends_with_text: false,
            renumber: table!(@renumber $name $(, $numbered)?),
        }
    };
    (@renumber $name:literal) => { None };
    (@renumber $name:literal, $numbered:ident) => {
        Some(concat!(
            "SELECT setval(pg_get_serial_sequence('", $name, "', 'id'), (SELECT coalesce(max(id), 0) + 1 FROM ", $name,
            "), false)"
        ))
    };
}

/// Describes a table with two key columns.
macro_rules! table_by_two {
    ($name:literal, $columns:literal, $first:literal, $second:literal $(, $rest:literal)*; $ends_with_text:literal) => {
        CopyTable {
            name: $name,
            keys: 2,
            columns: $columns,
            names: concat!($first, ", ", $second $(, ", ", $rest)*),
            page: Sql::both(concat!(
                "SELECT ", $first, ", ", $second $(, ", ", $rest)*, " FROM ", $name,
                " WHERE (", $first, ", ", $second, ") > (?1, ?2) ORDER BY 1, 2 LIMIT ?3"
            )),
            last: concat!("SELECT ", $first, ", ", $second, " FROM ", $name, " ORDER BY 1 DESC, 2 DESC LIMIT 1"),
            ends_with_text: $ends_with_text,
            renumber: None,
        }
    };
}

/// Every table, in an order in which no row refers to a later table. The counters are counted anew, and the settings of
/// the last plan are not copied.
pub(super) const TABLES: [CopyTable; 26] = [
    table!("review_key", 2, "id", "key"),
    table!("worker", 11, "id", "host", "pid", "boot_id", "started", "heartbeat", "ended", "fingerprints", "block_settings",
        "died", "metrics"; numbered),
    table!("fingerprint", 5, "id", "stage", "hash", "fields", "upstream"; numbered),
    table!("pair", 16, "id", "name", "mesh_path", "print_path", "unit", "scanned_face_down", "character", "block", "meta",
        "prior", "attributes", "mesh_hash", "mesh_stat", "print_hash", "print_stat", "imported"; numbered),
    table!(
        "job",
        14,
        "pair",
        "stage",
        "status",
        "prio",
        "run_at",
        "attempt",
        "crashes",
        "token",
        "worker",
        "deadline",
        "exclusive",
        "fingerprint",
        "dirty",
        "low_confidence"
    ),
    table!(
        "failure",
        9,
        "pair",
        "stage",
        "class",
        "message",
        "fingerprint",
        "mesh_hash",
        "print_hash",
        "attributes",
        "at"
    ),
    table!("attempt", 8, "id", "pair", "stage", "worker", "class", "message", "ms", "at"; numbered),
    table_by_two!(
        "stage_result",
        12,
        "pair",
        "stage",
        "fingerprint",
        "mesh_hash",
        "print_hash",
        "attributes",
        "outcome",
        "files",
        "result_hash",
        "ms",
        "worker",
        "at"; false
    ),
    table_by_two!("metric_result", 5, "pair", "metric", "result_hash", "confidence", "iou"; true),
    table!("review_act", 2, "id", "reviewer"; numbered),
    table!("verdict", 15, "id", "act", "pair", "metric", "result_hash", "verdict", "reviewer", "reason", "note", "at", "event",
        "seen", "shown_ms", "angle_read_deg", "review_order"; numbered),
    table!("verdict_undo", 3, "act", "reviewer", "at"),
    table!("truth", 2, "pair", "body"),
    table!("attention_check_answer", 15, "id", "event", "pair", "metric", "result_hash", "kind", "attention_check", "seen",
        "shown_ms", "angle_read_deg", "verdict", "reviewer", "reason", "note", "at"; numbered),
    table!("attention_check_undo", 3, "answer", "reviewer", "at"),
    table!("manual_alignment", 14, "id", "event", "pair", "mesh_hash", "print_hash", "depth_hash", "seen", "print_from_depth",
        "print_from_mesh", "iou", "dice", "reviewer", "note", "at"; numbered),
    table!("manual_alignment_undo", 3, "alignment", "reviewer", "at"),
    table!(
        "retired_pair",
        8,
        "pair",
        "stage",
        "is_quarantined",
        "token",
        "fingerprint",
        "low_confidence",
        "cause",
        "at"
    ),
    table!("block", 18, "id", "name", "mesh_path", "page_path", "labels_path", "unit", "side", "meta", "attributes",
        "mesh_hash", "mesh_stat", "page_hash", "page_stat", "labels_hash", "labels_stat", "imported", "true_boxes",
        "control_points"; numbered),
    table!(
        "block_job",
        9,
        "block",
        "stage",
        "status",
        "run_at",
        "attempt",
        "crashes",
        "token",
        "worker",
        "deadline"
    ),
    table!(
        "block_failure",
        6,
        "block",
        "stage",
        "class",
        "message",
        "made_with",
        "at"
    ),
    table_by_two!("block_result", 9, "block", "stage", "made_with", "outcome", "files", "result_hash", "ms", "worker", "at"; false),
    table!("block_attempt", 8, "id", "block", "stage", "worker", "class", "message", "ms", "at"; numbered),
    table_by_two!("block_character", 10, "block", "label", "place", "character", "box", "confidence", "state", "reason", "maps",
        "pair"; true),
    table_by_two!("checksum", 4, "record", "row", "value", "previous"; false),
    table_by_two!("set_apart", 5, "record", "row", "value", "fault", "at"; false),
];

#[cfg(test)]
mod tests {
    use super::TABLES;

    #[test]
    fn the_number_of_columns_is_right() {
        for table in &TABLES {
            assert_eq!(
                table.names.split(", ").count(),
                table.columns,
                "{}",
                table.name
            );
        }
    }
}
