//! The tables whose rows have checksums: see `records/checksums.rs`.

use mocban_core::domain::enum_names;

/// A table whose rows have checksums.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ChecksummedTable {
    /// Pairs as imported.
    Pair,
    /// True alignments.
    Truth,
    /// The log of verdicts.
    Verdict,
    /// Undone verdicts.
    VerdictUndo,
    /// The log of answers to attention checks.
    Answer,
    /// Undone answers to attention checks.
    AnswerUndo,
    /// The log of manual alignments.
    ManualAlignment,
    /// Undone manual alignments.
    ManualAlignmentUndo,
    /// Blocks as imported.
    Block,
}

enum_names! { pub ChecksummedTable, "a table with checksums":
    Pair = "pair", Truth = "truth", Verdict = "verdict", VerdictUndo = "verdict_undo",
    Answer = "attention_check_answer", AnswerUndo = "attention_check_undo",
    ManualAlignment = "manual_alignment", ManualAlignmentUndo = "manual_alignment_undo",
    Block = "block",
}
