//! The 3D view of a pair without a result: its scan alone, without a plane and a print.

use serde_json::json;

use super::scan_data::{bytes_of, encode};
use super::view_inputs::{MAX_ELEMENTS, element_count};
use crate::pair_pictures::{PictureError, read_mesh};
use mocban_catalog::PairResults;
use mocban_core::InputLimits;
use mocban_core::domain::LengthUnit;
use mocban_core::mesh::Mesh;
use mocban_core::raster::{Grid, png_rgb8};
use mocban_store::Project;

/// Texture coordinates of a vertex beside the print.
const BESIDE_PRINT: [f32; 2] = [-1.0; 2];

/// Reads the scan of a pair, and encodes it as the data of the 3D view. The middle of the scan is the origin, its shortest
/// side points to the viewer, and lengths are millimetres, or mesh units if the unit is unknown.
///
/// # Errors
/// Returns an error if the scan cannot be read, exceeds the limits, or is not the one that a stage of the pair has read.
pub fn scan_alone(
    project: &Project,
    pair: &PairResults,
    limits: &InputLimits,
) -> Result<Vec<u8>, PictureError> {
    let mesh = read_mesh(project, pair, &limits.mesh)?.welded();
    let source_elements = element_count(&mesh);
    let mesh = mesh.clustered(MAX_ELEMENTS);
    let positions = centred(&mesh, pair.attributes.unit.map_or(1.0, LengthUnit::mm));
    let count = positions.len();
    let empty = png_rgb8(&Grid::from_fn(1, 1, |_, _| [0; 3]));
    let corners = mesh.triangles.as_flattened().iter();
    let header = json!({
        "version": 1,
        "pair": pair.attributes.name,
        "metric": null,
        "unit": pair.attributes.unit.map(|_| LengthUnit::Mm.name()),
        "is_alone": true,
        "vertices": count,
        "triangles": mesh.triangles.len(),
        "source_elements": source_elements,
        "threshold": 0.0,
        "height_range": [0.0, 0.0],
        "writing_is_mirrored": false,
        "print_size": [1, 1],
        "texture_size": [1, 1],
        "arrays": {},
    });
    let arrays = [
        ("positions", bytes_of(positions.as_flattened())),
        (
            "texture_coordinates",
            bytes_of(vec![BESIDE_PRINT; count].as_flattened()),
        ),
        ("heights", bytes_of(&vec![0.0; count])),
        ("corners", corners.flat_map(|c| c.to_le_bytes()).collect()),
        ("print", empty.clone()),
        ("masks", empty),
    ];
    Ok(encode(header, arrays))
}

/// Returns the vertices around the middle of the scan, with its shortest side along z. `scale` is the
/// number of millimetres in a mesh unit.
fn centred(mesh: &Mesh, scale: f64) -> Vec<[f32; 3]> {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for vertex in mesh.vertices.iter() {
        for ([low, high], value) in bounds.iter_mut().zip(vertex) {
            (*low, *high) = (low.min(value), high.max(value));
        }
    }
    let size = bounds.map(|[low, high]| high - low);
    let shortest = (0..3).min_by(|a, b| size[*a].total_cmp(&size[*b]));
    // The axes are exchanged in a circle, which mirrors nothing.
    let axes = [1, 2, 3].map(|step| (shortest.unwrap_or(2) + step) % 3);
    let middle = bounds.map(|[low, high]| f64::midpoint(low, high));
    let vertices = mesh.vertices.iter();
    let placed = vertices.map(|vertex| axes.map(|k| ((vertex[k] - middle[k]) * scale) as f32));
    placed.collect()
}

#[cfg(test)]
mod tests {
    use super::centred;
    use mocban_core::mesh::Mesh;

    #[test]
    fn a_scan_lies_around_the_origin_and_is_not_mirrored() {
        let mesh = Mesh {
            vertices: vec![[10.0, 0.0, 0.0], [10.5, 4.0, 0.0], [10.0, 0.0, 2.0]].into(),
            triangles: vec![[0, 1, 2]].into(),
        };
        let placed = centred(&mesh, 10.0);
        // y and z of the file become x and y.
        let expected = [
            [-20.0, -10.0, -2.5],
            [20.0, -10.0, 2.5],
            [-20.0, 10.0, -2.5],
        ];
        assert_eq!(placed, expected);
    }
}
