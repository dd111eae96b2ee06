//! The built-in dataset: same seed same bytes, truth true.
