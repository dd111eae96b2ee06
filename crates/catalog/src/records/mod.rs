//! Data of pairs: imports, results, verdicts, review answers and counts.

pub(crate) mod append_verdicts;
pub(crate) mod checksums;
pub(crate) mod faulty_rows;
pub(crate) mod ground_truth;
pub(crate) mod identity;
pub(crate) mod import;
pub(crate) mod input_paths;
pub(crate) mod left_out;
pub(crate) mod listed_names;
pub(crate) mod manual_alignments;
pub(crate) mod model;
pub(crate) mod pair_groups;
pub(crate) mod pair_list;
pub(crate) mod pair_lookups;
pub(crate) mod pair_results;
pub(crate) mod pair_work;
pub(crate) mod review_answers;
pub(crate) mod review_context;
pub(crate) mod review_rights;
pub(crate) mod reviewer_names;
pub(crate) mod set_apart;
pub(crate) mod similar_names;
pub(crate) mod stage_results;
pub(crate) mod status;
pub(crate) mod verdict_rules;
pub(crate) mod verdicts;
