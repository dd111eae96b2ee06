//! The project file of `MeshLab`.

use std::fmt::Write as _;

use super::matrix::matrix_text;
use super::placement::MeshPlacement;
use crate::domain::PairName;

/// Returns a project with `scan.ply`.
pub(super) fn project_text(pair: &PairName, _: &MeshPlacement, _: [usize; 2]) -> String {
    let mut identity = [[0.0; 4]; 4];
    for (k, row) in identity.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    let mut text = String::from("<!DOCTYPE MeshLabDocument>\n<MeshLabProject>\n <MeshGroup>\n");
    writeln!(
        text,
        "  <MLMesh label=\"{pair}\" filename=\"scan.ply\">\n   <MLMatrix44>\n{}</MLMatrix44>\n  </MLMesh>",
        matrix_text(&identity)
    )
    .expect("a String takes any text");
    text.push_str(" </MeshGroup>\n <RasterGroup/>\n</MeshLabProject>\n");
    text
}
