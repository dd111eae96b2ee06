//! One character of a page.

/// One character of a page.
#[derive(Debug, Clone)]
pub(super) struct TextCell {
    /// Name by column and row, such as `c03-r12` or `c03-r12a`.
    pub name: String,
    /// The character.
    pub character: char,
    /// Middle of its cell, mm.
    pub centre: [f64; 2],
    /// Side of the font's em square, mm.
    pub em_mm: f64,
    /// Factor of the width.
    pub stretch: f64,
    /// Rotation, rad, clockwise on the print.
    pub angle_rad: f64,
    /// Whether it belongs to a note.
    pub is_note: bool,
    /// Whether it belongs to the middle strip.
    pub is_strip: bool,
}
