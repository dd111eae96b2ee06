//! The files of one pair that was aligned without a project.

use super::pair_files::sidecar;
use super::pictures::PrintView;
use mocban_align::stages::{AlignedPair, Print};
use mocban_core::raster::{compact_rgb8, png_grey16, png_mask, warp_depth, warp_mask};

/// Names of the files of [`alignment_files`].
pub const ALIGNMENT_FILES: [&str; 6] = [
    "print_mask.png",
    "depth.png",
    "depth.json",
    "aligned_depth.png",
    "aligned_mask.png",
    "overlay.png",
];

/// Encodes the pictures of an alignment, named like those of an export: ink mask, depth map with its scale, and, under
/// [`AlignedPair::first_metric`], the depth map and the strokes warped onto the print, and the print with their edges.
pub fn alignment_files(pair: &AlignedPair, print: &Print) -> [(&'static str, Vec<u8>); 6] {
    let (metric, depth, image) = (pair.first_metric(), &pair.depth, print.image());
    let size = [image.rgb.width(), image.rgb.height()];
    let pose = &metric.print_from_depth;
    let strokes = depth.stroke_mask(metric.threshold_level);
    let aligned = warp_mask(&strokes, pose, size[0], size[1]);
    let view = PrintView::enlarged(image);
    let displaced = pair.registered.outcome.displaced.as_ref();
    let displaced = displaced.map(|part| (part, &strokes));
    let files = [
        png_mask(&pair.normalized.prints[pair.registered.outcome.ink].ink_of_print()),
        png_grey16(&depth.levels),
        sidecar(&depth.scale, pair.registered.outcome.levelling.as_ref()).into_bytes(),
        png_grey16(&warp_depth(depth, pose, size[0], size[1])),
        png_mask(&aligned),
        compact_rgb8(&view.overlay_on(view.print(image), &aligned, displaced)),
    ];
    let mut names = ALIGNMENT_FILES.into_iter();
    files.map(|file| (names.next().unwrap_or_default(), file))
}
