//! Sizes of long-running tests: small by default, larger through environment variables.

/// Returns the number in an environment variable, or the default.
pub(crate) fn size_from_env(variable: &str, default: usize) -> usize {
    std::env::var(variable).map_or(default, |number| number.parse().expect(variable))
}

/// Returns the number of trials of a race or an attack: `MOCBAN_TRIALS`, or the default, which keeps `cargo test` fast.
pub(crate) fn trials(default: usize) -> usize {
    size_from_env("MOCBAN_TRIALS", default)
}
