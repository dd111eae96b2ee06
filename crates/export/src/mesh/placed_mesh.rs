//! A scan in the frame of exported meshes, with the colours of the print and stroke labels.

use super::placement::MeshPlacement;
use crate::pictures::Rgb;
use mocban_core::domain::cancel::polled;
use mocban_core::mesh::Mesh;

/// A placed scan. All lists of vertices have the same order and length.
#[derive(Debug)]
pub(crate) struct PlacedMesh {
    /// Positions in millimetres, or mesh units if the unit is unknown; see [`MeshPlacement`].
    pub(crate) positions: Vec<[f32; 3]>,
    /// Print pixels.
    pub(crate) pixels: Vec<[f32; 2]>,
    /// Colours of the print; `None` outside of it.
    pub(super) colours: Vec<Option<[u8; 3]>>,
    /// Heights over the fitted surface, or over its levelling, in the unit of the positions.
    pub(crate) heights: Vec<f32>,
    /// Whether a vertex belongs to a stroke and lies over the print.
    pub(super) strokes: Vec<bool>,
    /// The scan in its own frame. Its faces have the winding of the file.
    pub(crate) source: Mesh,
}

impl PlacedMesh {
    /// Places a scan and colours its vertices by the print. A vertex has the colour of the print pixel that it maps to.
    pub(crate) fn new(mesh: Mesh, placement: &MeshPlacement, print: &Rgb) -> Self {
        let count = mesh.vertices.len();
        let mut placed = Self {
            positions: Vec::with_capacity(count),
            pixels: Vec::with_capacity(count),
            colours: Vec::with_capacity(count),
            heights: Vec::with_capacity(count),
            strokes: Vec::with_capacity(count),
            source: mesh,
        };
        for vertex in polled(placed.source.vertices.iter()) {
            let point = placement.place(vertex);
            placed.positions.push(point.position.map(|c| c as f32));
            placed.pixels.push(point.pixel.map(|c| c as f32));
            let colour = colour_at(print, point.pixel);
            placed.colours.push(colour);
            placed.heights.push(point.height as f32);
            placed.strokes.push(point.is_stroke && colour.is_some());
        }
        placed
    }

    /// Returns whether a vertex lies over the print.
    pub(super) fn is_on_print(&self, vertex: u32) -> bool {
        self.colours[vertex as usize].is_some()
    }
}

/// Returns the colour of the pixel whose square holds a point. Returns `None` outside of the image.
fn colour_at(print: &Rgb, pixel: [f64; 2]) -> Option<[u8; 3]> {
    let [x, y] = pixel.map(|c| (c + 0.5).floor() as i64);
    print.get(x, y)
}

#[cfg(test)]
pub(super) mod tests {
    use super::{PlacedMesh, colour_at};
    use crate::mesh::placement::tests::{mesh_point, placement};
    use crate::pictures::Rgb;
    use mocban_core::domain::LengthUnit;
    use mocban_core::mesh::Mesh;

    /// Returns a print in which every pixel has its own colour.
    pub(crate) fn print() -> Rgb {
        Rgb::from_fn(200, 100, |x, y| [x as u8, y as u8, 77])
    }

    /// Returns three triangles: two over the print, and one beside it.
    pub(crate) fn placed(unit: Option<LengthUnit>) -> PlacedMesh {
        let on_plane = [
            [-2.0, 1.2, 0.0],
            [-2.9, 1.6, -0.9],
            [-2.0, 2.0, 0.1],
            [-2.9, 2.1, -0.9],
            [90.0, 0.0, 0.0],
        ];
        let mesh = Mesh {
            vertices: on_plane.map(mesh_point).to_vec().into(),
            triangles: vec![[0, 1, 2], [2, 1, 3], [2, 3, 4]].into(),
        };
        PlacedMesh::new(mesh, &placement(unit), &print())
    }

    #[test]
    fn vertices_have_the_colour_of_their_pixel() {
        let placed = placed(None);
        for (pixel, colour) in placed.pixels.iter().zip(&placed.colours).take(4) {
            let [x, y] = pixel.map(|c| c.round() as u8);
            assert_eq!(*colour, Some([x, y, 77]));
        }
        assert_eq!(placed.colours[4], None);
        assert_eq!(placed.strokes, [true, false, true, false, false]);
    }

    #[test]
    fn a_pixel_reaches_half_a_pixel_around_its_centre() {
        let print = print();
        let red = |x: f64| colour_at(&print, [x, 3.2]).map(|[red, ..]| red);
        assert_eq!(
            [-0.51, -0.5, 0.49, 0.5].map(red),
            [None, Some(0), Some(0), Some(1)]
        );
        assert_eq!([199.49, 199.5].map(red), [Some(199), None]);
        assert_eq!(colour_at(&print, [3.0, f64::INFINITY]), None);
    }
}
