//! Known-answer worlds for both methods.
