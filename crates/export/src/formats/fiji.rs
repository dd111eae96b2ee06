//! The format `fiji`: calibrated TIFF images.

use super::single_results::{FileOfPair, ShownResult, SingleResultFormat};
use crate::fiji::{AlignedPictures, FijiImages};
use crate::format_writer::PairView;
use crate::pair_pictures::PictureError;

const HEIGHTS: &str =
    "32-bit heights over the fitted surface in mm, in the frame of the depth map; NaN is no data";
const STACK: &str = "three 32-bit channels in the frame of the pictures: print (0-255), heights in mm, stroke mask \
    (255 = stroke)";
const STROKES: &str =
    "16-bit label image in the frame of the pictures: connected strokes from 1, 0 is background";

const USAGE: &str = "\
## Use

All images are calibrated: ImageJ and Fiji show and measure lengths in millimetres, or in `mesh unit` if the unit of the
mesh is unknown. A pixel of the depth map is `mesh_unit_per_px` wide, and a pixel of the print that divided by `scale`.
Heights are measured over the fitted surface, which may be curved (see Coordinates). If the
print has different scales along two axes, the calibration is their mean.

`Analyze > Tools > ROI Manager...` and the plugin MorphoLibJ (`Plugins > MorphoLibJ > Analyze > Analyze Regions`) take
`strokes.tif`; open `stack.tif` and `strokes.tif` together to measure heights per stroke.

```python
import tifffile
with tifffile.TiffFile(\"pairs/ID/heights.tif\") as file:
    heights = file.asarray()                                   # mm
    n, d = file.pages[0].tags[\"XResolution\"].value             # pixels per mm = n / d
```
";

/// The calibrated images.
#[derive(Default)]
pub(super) struct FijiFormat;

impl SingleResultFormat for FijiFormat {
    const PURPOSE: &'static str = "Prints and heights of carved blocks as calibrated TIFF images.";
    const FILES: &'static [FileOfPair] = &[
        ["heights", "pairs/*/heights.tif", HEIGHTS],
        ["stack", "pairs/*/stack.tif", STACK],
        ["strokes", "pairs/*/strokes.tif", STROKES],
    ];
    const USAGE: &'static str = USAGE;

    fn contents(
        &self,
        _: &PairView<'_>,
        shown: ShownResult<'_>,
    ) -> Result<Vec<Vec<u8>>, PictureError> {
        let (pictures, outcome) = (shown.pictures, &shown.record.outcome);
        let aligned = AlignedPictures {
            print: pictures.print_rgb()?,
            levels: pictures.aligned_depth(outcome)?,
            mask: pictures.aligned_mask(outcome)?.into_owned(),
            from_depth: pictures
                .frame()?
                .from_print
                .after(&outcome.print_from_depth),
        };
        let images = FijiImages::new(&pictures.depth()?.levels, &shown.scale, &aligned);
        Ok(vec![images.heights, images.stack, images.strokes])
    }
}
