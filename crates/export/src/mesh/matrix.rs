//! The matrix of a placement as a text file.

use std::fmt::Write as _;

/// Returns a matrix as four lines, as `CloudCompare` (`-APPLY_TRANS`) and `MeshLab` read it.
pub(super) fn matrix_text(matrix: &[[f64; 4]; 4]) -> String {
    let mut text = String::new();
    for row in matrix {
        // Adding zero makes negative zero positive.
        let [a, b, c, d] = row.map(|value| value + 0.0);
        writeln!(text, "{a} {b} {c} {d}").expect("a String takes any text");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::matrix_text;

    #[test]
    fn rows_are_lines_with_all_digits() {
        let matrix = [
            [0.1, -0.0, 1e-9, 2.0],
            [25.4, 0.25, 3.0, -1e5],
            [1.0 / 3.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        assert_eq!(
            matrix_text(&matrix),
            "0.1 0 0.000000001 2\n25.4 0.25 3 -100000\n0.3333333333333333 0 1 0\n0 0 0 1\n"
        );
    }
}
