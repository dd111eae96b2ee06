//! Settings: read, merge, validate; unknown keys are errors; each value knows where it came from.
