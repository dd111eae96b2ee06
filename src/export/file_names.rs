//! Names of the files and folders in an export folder.

/// The file of lines; a folder with it is an export.
pub(super) const LINES: &str = "pairs.jsonl";
/// The folder with the files of the pairs.
pub(super) const PAIRS: &str = "pairs";
/// The log of verdicts.
pub(super) const VERDICTS: &str = "verdicts.jsonl";
/// The log of answers to attention checks.
pub(super) const ATTENTION_CHECKS: &str = "attention_checks.jsonl";
/// The log of manual alignments.
pub(super) const MANUAL_ALIGNMENTS: &str = "manual_alignments.jsonl";
