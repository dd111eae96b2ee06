//! Sizes of long-running tests: small by default, larger through environment variables.

/// Returns the number in an environment variable, or the default.
pub(crate) fn size_from_env(variable: &str, default: usize) -> usize {
    std::env::var(variable).map_or(default, |number| number.parse().expect(variable))
}
