//! Reads what the 3D view of a result shows, and encodes its textures.

use crate::mesh::{MeshPlacement, PlacedMesh};
use crate::pair_pictures::{PairPictures, PictureError};
use crate::pictures::PrintView;
use mocban_core::domain::{Affine2, DepthScale, MetricOutcome};
use mocban_core::mesh::Mesh;
use mocban_core::raster::{Grid, Mask, PrintImage, png_rgb8};

/// Maximum number of triangles, or of points of a point set. Larger scans are simplified.
pub(super) const MAX_ELEMENTS: usize = 500_000;
/// Maximum length in pixels of the longer side of a texture. All browsers support textures of this size.
const TEXTURE_SIDE: usize = 2048;

/// The print and the masks in the frame of the print.
#[derive(Debug)]
pub(super) struct ViewTextures {
    /// Size in pixels, at most [`TEXTURE_SIDE`].
    pub(super) size: [usize; 2],
    /// Width and height of the original print in pixels.
    pub(super) print_size: [usize; 2],
    /// The print as PNG.
    pub(super) print: Vec<u8>,
    /// PNG whose red channel is the strokes of the scan and whose green channel is the ink of the print.
    pub(super) masks: Vec<u8>,
}

impl ViewTextures {
    fn new(print: &PrintImage, strokes: &Mask, ink: &Mask) -> Self {
        let print_size = [print.rgb.width(), print.rgb.height()];
        let side = print_size[0].max(print_size[1]).clamp(1, TEXTURE_SIDE);
        let view = PrintView::of_side(print, side);
        let picture = view.print(print);
        let [strokes, ink] = [strokes, ink].map(|mask| view.mask(mask, &Affine2::IDENTITY));
        let channel = |mask: &Mask, x, y| if mask.at(x, y) { 255 } else { 0 };
        let masks = Grid::from_fn(picture.width(), picture.height(), |x, y| {
            [channel(&strokes, x, y), channel(&ink, x, y), 0]
        });
        Self {
            size: [picture.width(), picture.height()],
            print_size,
            print: png_rgb8(&picture),
            masks: png_rgb8(&masks),
        }
    }
}

/// A placed scan with its textures.
#[derive(Debug)]
pub(super) struct ViewInputs {
    pub(super) placement: MeshPlacement,
    pub(super) scan: PlacedMesh,
    /// Triangles, or points of a point set, of the scan file.
    pub(super) source_elements: usize,
    pub(super) textures: ViewTextures,
}

impl ViewInputs {
    /// Reads the files of a pair. `outcome` is the alignment to show, and `scale` the scale of its depth map.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, has changed since it was aligned, or exceeds the limits.
    pub(super) fn read(
        pictures: &PairPictures<'_>,
        outcome: &MetricOutcome,
        scale: DepthScale,
    ) -> Result<Self, PictureError> {
        let picture = &pictures.source_print()?.picture;
        let print = picture.rgb.to_rgb8();
        let size = [print.width(), print.height()];
        let placement = pictures.placement(outcome, scale, size)?;
        let strokes = pictures.mask_on_print(outcome)?;
        let textures = ViewTextures::new(picture, strokes, pictures.source_mask()?);
        let mesh = pictures.mesh()?.welded();
        let source_elements = element_count(&mesh);
        // The scan is simplified before it is placed, so that heights and texture coordinates are exact.
        let scan = PlacedMesh::new(mesh.clustered(MAX_ELEMENTS), &placement, &print);
        Ok(Self {
            placement,
            scan,
            source_elements,
            textures,
        })
    }
}

/// Returns the number of triangles, or of points of a point set.
pub(super) fn element_count(mesh: &Mesh) -> usize {
    if mesh.triangles.is_empty() {
        mesh.vertices.len()
    } else {
        mesh.triangles.len()
    }
}
