//! The project file of `MeshLab`.

use super::matrix::matrix_text;
use mocban_core::domain::PairName;

/// The rows of the matrix of a mesh that is in its place.
const IDENTITY: [[f64; 4]; 4] = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 1.0],
];

/// Returns a project with a mesh file, which is in its place.
pub(super) fn project_text(pair: &PairName, file: &str) -> String {
    let matrix = matrix_text(&IDENTITY);
    format!(
        "<!DOCTYPE MeshLabDocument>\n<MeshLabProject>\n <MeshGroup>\n  \
         <MLMesh label=\"{pair}\" filename=\"{file}\" visible=\"1\">\n   <MLMatrix44>\n{matrix}</MLMatrix44>\n  \
         </MLMesh>\n </MeshGroup>\n <RasterGroup/>\n</MeshLabProject>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::project_text;

    #[test]
    fn a_project_names_pair_and_file() {
        let pair = "a-1".parse().expect("a valid name");
        let text = project_text(&pair, "scan.ply");
        assert!(text.contains("<MLMesh label=\"a-1\" filename=\"scan.ply\" visible=\"1\">"));
        assert!(text.contains("<MLMatrix44>\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n</MLMatrix44>"));
    }
}
