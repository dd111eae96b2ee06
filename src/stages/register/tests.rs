//! Known alignments come back.
