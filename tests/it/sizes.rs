//! How much a test does: little by default, as much as a variable of the environment asks for on a long look.

/// The number that this variable asks for, or else this one.
pub(crate) fn asked(variable: &str, default: usize) -> usize {
    std::env::var(variable).map_or(default, |number| number.parse().expect(variable))
}
