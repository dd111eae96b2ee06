//! Images of an item as PNG. Attention checks are rendered like results.
//!
//! The page never shows a print larger than [`IMAGE_SIDE`] pixels, even when it zooms in. Therefore only the rendered
//! images are kept. A print is dropped once its image is rendered.

use axum::body::Bytes;
use serde::Deserialize;

use super::alignment_inputs::AlignmentInputs;
use super::image_error::ImageError;
use super::item::ReviewItem;
use mocban_align::stages::normalize::PrintMasks;
use mocban_align::stages::register::StrokeMap;
use mocban_catalog::PairResults;
use mocban_core::domain::Affine2;
use mocban_core::raster::{self, MaskOverlap, png_grey8, png_mask, png_rgb8};
use mocban_export::SourcePrint;
use mocban_export::pictures::PrintView;
use mocban_results::pair_artifacts::PairArtifacts;
use mocban_store::Project;

/// Longer side of an image in pixels.
pub(super) const IMAGE_SIDE: usize = 640;

/// One of the images of an item, by its name in URLs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ImageLayer {
    /// The print.
    Print,
    /// Ink mask of the print.
    PrintMask,
    /// Shaded relief in the print's frame.
    Relief,
    /// Stroke mask of the relief in the print's frame.
    DepthMask,
    /// Where mask and ink disagree, in the print's frame; values as in [`StrokeMap`].
    StrokeMap,
    /// Shaded relief in the depth map's frame, for manual alignment.
    DepthFrameRelief,
    /// Stroke mask in the depth map's frame.
    DepthFrameMask,
    /// Ink mask on the canvas on which scores are computed.
    CanvasMask,
}

/// The encoded images of an item, and their frame.
#[derive(Debug)]
pub(super) struct ItemImages {
    /// Frame of the images.
    pub(super) view: PrintView,
    /// Print pixels to pixels of the canvas on which scores are computed.
    pub(super) canvas_from_print: Affine2,
    /// Scores of the alignment that the item shows.
    pub(super) scores: MaskOverlap,
    print: Bytes,
    print_mask: Bytes,
    relief: Bytes,
    depth_mask: Bytes,
    stroke_map: Bytes,
}

impl ItemImages {
    /// Renders the images of an item.
    ///
    /// # Errors
    /// Returns an error if files of the pair cannot be read, or if the pair has a new result.
    pub(super) fn render(
        project: &Project,
        pair: &PairResults,
        item: &ReviewItem,
        limits: &raster::ImageLimits,
    ) -> Result<Self, ImageError> {
        let aligned = PairArtifacts::new(project, pair);
        let inputs = AlignmentInputs::read(&aligned, item)?;
        let (view, print) = {
            let source = SourcePrint::read(project, pair, limits)?;
            let view = PrintView::of_side(&source.picture, IMAGE_SIDE);
            (view, png_rgb8(&view.print(&source.picture)))
        };
        let print_from_depth = &item.view.print_from_depth;
        let masks = PrintMasks::from_grey(&aligned.print_grey()?, aligned.mask_scale()?);
        let print_mask = view.mask(&masks.ink_of_print(), &Affine2::IDENTITY);
        Ok(Self {
            view,
            canvas_from_print: inputs.canvas_from_print,
            scores: inputs.mask_overlap(print_from_depth),
            print: exact(print),
            print_mask: exact(png_mask(&print_mask)),
            relief: exact(png_rgb8(&view.relief(&inputs.depth, print_from_depth))),
            depth_mask: exact(png_mask(&view.mask(&inputs.strokes, print_from_depth))),
            stroke_map: exact(stroke_map(&view, &inputs, &masks, item)),
        })
    }

    /// Returns a layer as PNG, or `None` if it is drawn on demand.
    pub(super) fn layer(&self, layer: ImageLayer) -> Option<Bytes> {
        let image = match layer {
            ImageLayer::Print => &self.print,
            ImageLayer::PrintMask => &self.print_mask,
            ImageLayer::Relief => &self.relief,
            ImageLayer::DepthMask => &self.depth_mask,
            ImageLayer::StrokeMap => &self.stroke_map,
            ImageLayer::DepthFrameRelief | ImageLayer::DepthFrameMask | ImageLayer::CanvasMask => {
                return None;
            }
        };
        Some(image.clone())
    }

    /// Returns the number of bytes of the images.
    pub(super) const fn bytes(&self) -> usize {
        self.print.len()
            + self.print_mask.len()
            + self.relief.len()
            + self.depth_mask.len()
            + self.stroke_map.len()
    }
}

/// Returns an image without spare capacity, because [`ItemImages::bytes`] counts only its length.
fn exact(image: Vec<u8>) -> Bytes {
    image.into_boxed_slice().into()
}

/// Draws where the mask and the ink of an item disagree. The map is computed again from the alignment that the item
/// shows, because no map of an attention check is stored.
fn stroke_map(
    view: &PrintView,
    inputs: &AlignmentInputs,
    masks: &PrintMasks,
    item: &ReviewItem,
) -> Vec<u8> {
    let map = StrokeMap::of_alignment(
        &inputs.depth,
        masks,
        &inputs.canvas_from_print,
        &item.view.print_from_depth,
        inputs.canvas_mask.width() as u32,
        item.view.level,
    );
    let print_from_canvas = inputs.canvas_from_print.inverse();
    let print_from_canvas = print_from_canvas.unwrap_or(Affine2::IDENTITY);
    png_grey8(&view.labels(&map.grey, StrokeMap::DISAGREEMENTS, &print_from_canvas))
}

#[cfg(test)]
mod tests {
    use super::ImageLayer;

    #[test]
    fn layers_are_found_by_name_and_nothing_else_is() {
        let layer = |name: &str| serde_json::from_value::<ImageLayer>(name.into()).ok();
        assert_eq!(layer("print-mask"), Some(ImageLayer::PrintMask));
        assert_eq!(
            layer("depth-frame-relief"),
            Some(ImageLayer::DepthFrameRelief)
        );
        for name in ["", "PRINT", "../print", "print.png"] {
            assert_eq!(layer(name), None, "{name}");
        }
    }
}
