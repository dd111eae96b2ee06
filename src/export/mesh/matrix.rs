//! Text files for CloudCompare and MeshLab.

use std::fmt::Write as _;

/// Returns a matrix as four lines, as CloudCompare (`-APPLY_TRANS`) and MeshLab read it.
pub(super) fn matrix_text(matrix: &[[f64; 4]; 4]) -> String {
    let mut text = String::new();
    for row in matrix {
        // Adding zero makes negative zero positive.
        let [a, b, c, d] = row.map(|value| value + 0.0);
        writeln!(text, "{a} {b} {c} {d}").expect("a String takes any text");
    }
    text
}
