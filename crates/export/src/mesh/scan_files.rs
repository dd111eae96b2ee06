//! The files of one scan.

use std::io;

use serde_json::{Value, json};

use super::glb::{GlbContent, write_glb};
use super::matrix::matrix_text;
use super::meshlab::project_text;
use super::placed_mesh::PlacedMesh;
use super::placement::MeshPlacement;
use super::ply::write_ply;
use crate::pictures::Rgb;
use mocban_core::domain::{LengthUnit, PairName, ThresholdMetric};
use mocban_core::mesh::Mesh;
use mocban_core::raster::{png_grey8, png_rgb8};

/// Name of the PLY, which the project refers to.
const PLY: &str = "scan.ply";
/// Metres per unit of the frame.
const METRES: f64 = 1e-3;

/// Bytes of a vertex and of a face, in the larger of the two mesh files.
const VERTEX_BYTES: usize = 20;
const FACE_BYTES: usize = 13;
/// At least the bytes of what precedes the vertices.
const HEADER_BYTES: usize = 8192;

/// What the files name the scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScanTitle<'a> {
    /// The pair.
    pub(crate) pair: &'a PairName,
    /// The metric whose threshold separates strokes.
    pub(crate) metric: ThresholdMetric,
}

/// The files of a scan in the frame of its print.
#[derive(Debug)]
pub(crate) struct ScanFiles {
    /// Mesh with colours, labels and heights.
    pub(crate) ply: Vec<u8>,
    /// Mesh with the print as texture.
    pub(crate) glb: Vec<u8>,
    /// The similarity from the scan to the frame, as text.
    pub(crate) matrix: String,
    /// `MeshLab` project with [`PLY`].
    pub(crate) project: String,
}

impl ScanFiles {
    /// Places a scan, whose repeated vertices were merged, and encodes its files.
    ///
    /// # Errors
    /// Returns an error if a file would be too large for its format.
    pub(crate) fn new(
        mesh: Mesh,
        placement: &MeshPlacement,
        print: &Rgb,
        title: &ScanTitle<'_>,
    ) -> io::Result<Self> {
        let placed = PlacedMesh::new(mesh, placement, print);
        let png = print_png(print);
        let bytes = VERTEX_BYTES * placed.positions.len()
            + FACE_BYTES * placed.source.triangles.len()
            + HEADER_BYTES;
        let mut ply = Vec::with_capacity(bytes);
        write_ply(&placed, placement.unit(), &mut ply)?;
        let content = GlbContent {
            name: title.pair.as_str(),
            png: &png,
            size: [print.width(), print.height()],
            extras: extras(placement, title),
        };
        let mut glb = Vec::with_capacity(bytes + png.len());
        write_glb(&placed, &content, &mut glb)?;
        Ok(Self {
            ply,
            glb,
            matrix: matrix_text(&placement.frame_from_mesh()),
            project: project_text(title.pair, PLY),
        })
    }
}

/// Encodes a print as PNG, grey if it has no colours.
fn print_png(print: &Rgb) -> Vec<u8> {
    if print.data().iter().all(|[r, g, b]| r == g && g == b) {
        png_grey8(&print.map(|[grey, ..]| *grey))
    } else {
        png_rgb8(print)
    }
}

/// Returns the fields of `asset.extras` of a GLB.
fn extras(placement: &MeshPlacement, title: &ScanTitle<'_>) -> Value {
    let mut metres_from_mesh = placement.frame_from_mesh();
    for value in metres_from_mesh[..3].as_flattened_mut() {
        *value *= METRES;
    }
    json!({
        "unit": "m",
        "axes": "x right, y up as in the print, z out of the block; the writing is mirrored, as on the block",
        "pair": title.pair,
        "metric": title.metric,
        "mesh_unit": placement.unit().map(LengthUnit::name),
        "metres_per_mesh_unit": placement.frame_unit_per_mesh_unit() * METRES,
        "metres_from_mesh": metres_from_mesh,
        "print_from_mesh": placement.print_from_mesh(),
    })
}

#[cfg(test)]
mod tests {
    use super::print_png;
    use crate::pictures::Rgb;
    use mocban_core::raster::{ImageLimits, decode, decode_grey8};

    #[test]
    fn grey_prints_are_grey_files_with_the_same_pixels() {
        let grey = Rgb::from_fn(5, 4, |x, y| [(40 * x + y) as u8; 3]);
        assert!(decode_grey8(&print_png(&grey)).is_ok());
        let mut coloured = grey.clone();
        coloured.set(2, 2, [1, 2, 3]);
        for print in [grey, coloured] {
            let found = decode(&print_png(&print), &ImageLimits::SUGGESTED).expect("reads");
            assert_eq!(
                found.rgb,
                print
                    .map(|colour| colour.map(|c| u16::from(c) * 257))
                    .into()
            );
        }
    }
}
