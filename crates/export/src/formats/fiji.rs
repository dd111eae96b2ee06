//! The format `fiji`: calibrated TIFF images.

use super::single_results::{FileOfPair, SingleResults};
use crate::export_folder::FolderError;
use crate::fiji::{AlignedPictures, FijiImages};
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_pictures::PictureError;
use crate::record::PairRecord;

/// Files of a pair.
const FILES: [FileOfPair; 3] = [
    ["heights", "pairs/*/heights.tif", HEIGHTS],
    ["stack", "pairs/*/stack.tif", STACK],
    ["strokes", "pairs/*/strokes.tif", STROKES],
];
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

/// Writes the images.
pub(super) struct FijiWriter {
    results: SingleResults,
}

impl FijiWriter {
    pub(super) fn begin(folder: &FormatFolder) -> Result<Self, FolderError> {
        Ok(Self {
            results: SingleResults::begin(folder)?,
        })
    }
}

impl FormatWriter for FijiWriter {
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let Some(shown) = SingleResults::of_pair(view) else {
            return Ok(self.results.without_result(view));
        };
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
        let contents = [images.heights, images.stack, images.strokes];
        Ok(self
            .results
            .with_files(view, shown.fields, &FILES, contents))
    }

    fn append(&mut self, _: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        shared.iter().try_for_each(|line| self.results.append(line))
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        Ok(vec![self.results.finish()?])
    }

    fn guide(&self) -> FormatGuide {
        let purpose = "Prints and heights of carved blocks as calibrated TIFF images.";
        self.results.guide_of_files(purpose, &FILES, USAGE)
    }
}
