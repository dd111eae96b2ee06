//! Numbers with a fixed number of significant digits, for lengths in any unit, and numbers with a fixed number of decimals.

use mocban_core::domain::LengthUnit;
pub(crate) use mocban_core::domain::{fixed, significant};

/// Significant digits of lengths.
pub(crate) const LENGTH_DIGITS: i32 = 3;
/// Decimals of scores and confidences.
pub(crate) const SCORE: usize = 3;
/// Decimals of angles in degrees.
pub(crate) const DEGREES: usize = 2;
/// Decimals of scales.
pub(crate) const SCALE: usize = 4;
/// Decimals of shifts in pixels.
pub(crate) const PIXELS: usize = 1;

/// Formats a length of a mesh, such as `0.00213 m`, or `2.13 mesh units` if the unit is unknown.
pub(crate) fn length(value: f64, unit: Option<LengthUnit>) -> String {
    let value = significant(value, LENGTH_DIGITS);
    format!("{value} {}", unit_name(unit))
}

/// Returns the unit of lengths of a mesh.
pub(crate) fn unit_name(unit: Option<LengthUnit>) -> &'static str {
    unit.map_or("mesh units", LengthUnit::name)
}
