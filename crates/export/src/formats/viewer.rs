//! The format `viewer`: one page per pair that shows the scan on its print in 3D, without a server, and an index of them.

use super::single_results::{
    FileOfPair, ShownResult, SingleResultFormat, SingleResultWriter, SingleResults,
};
use super::viewer_index::{INDEX, ViewerIndex, index_item};
use crate::export_folder::FolderError;
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_pictures::PictureError;
use crate::pictures::PrintView;
use crate::record::PairRecord;
use crate::scan_view::{ScanView, standalone_page};
use mocban_core::raster::jpeg_rgb8;

const PAGE: &str = "3D view of the scan with its print; a page that needs no server and no network";
const PICTURE: &str = "print with the outline of the aligned strokes, small";
/// Longer side of a picture of the index, pixels.
const PICTURE_SIDE: usize = 320;
/// JPEG quality of pictures.
const QUALITY: u8 = 85;

/// How to use the pages.
const USAGE: &str = "\
## Use

Open `index.html` in a browser, or put the folder on a web site. Each picture leads to its page `pairs/ID/viewer.html`,
which holds its data and scripts, so that it can be sent or archived as one file. Drag to turn the block, use the wheel
or two fingers to come closer, and press `?` for the list of keys. Scans of more than 500,000 triangles are simplified.

The view is mirrored at first, so that the writing reads as in the print. The switch *As printed* shows the block itself,
whose writing is mirrored. Lengths are millimetres, or mesh units if the unit of the mesh is unknown.
";

/// Writes the pages and the index.
pub(super) struct ViewerWriter {
    pages: SingleResultWriter<ViewerFormat>,
    index: ViewerIndex,
}

impl ViewerWriter {
    pub(super) fn begin(folder: &FormatFolder) -> Result<Self, FolderError> {
        Ok(Self {
            pages: SingleResultWriter::begin(folder)?,
            index: ViewerIndex::begin(folder.root.clone())?,
        })
    }
}

impl FormatWriter for ViewerWriter {
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let mut encoded = self.pages.encode(view)?;
        if let Some(shown) = SingleResults::of_pair(view) {
            let item = index_item(&view.record.pair, shown.fields);
            encoded.shared.push(item.into_bytes());
        }
        Ok(encoded)
    }

    fn append(&mut self, record: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        let mut parts = shared.into_iter();
        let line = parts.next().into_iter().collect();
        self.pages.append(record, line)?;
        parts.try_for_each(|item| self.index.append(&item))
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        let mut names = self.pages.finish()?;
        names.extend(self.index.finish()?);
        Ok(names)
    }

    fn guide(&self) -> FormatGuide {
        let mut guide = self.pages.guide();
        guide.files.insert(0, INDEX.map(str::to_owned));
        guide
    }
}

/// The pages of pairs.
#[derive(Default)]
struct ViewerFormat;

impl SingleResultFormat for ViewerFormat {
    const PURPOSE: &'static str =
        "Pages that show scans of carved blocks in 3D, with their prints on them.";
    const FILES: &'static [FileOfPair] = &[
        ["page", "pairs/*/viewer.html", PAGE],
        ["picture", "pairs/*/overlay.jpg", PICTURE],
    ];
    const USAGE: &'static str = USAGE;

    fn contents(
        &self,
        view: &PairView<'_>,
        shown: ShownResult<'_>,
    ) -> Result<Vec<Vec<u8>>, PictureError> {
        let pair = &view.record.pair.id;
        let (pictures, outcome) = (shown.pictures, &shown.record.outcome);
        let print = &pictures.source_print()?.picture;
        let small = PrintView::of_side(print, PICTURE_SIDE);
        let displaced = pictures.outcomes.register.displaced.as_ref();
        let picture = small.overlay(print, pictures.depth()?, outcome, displaced);
        let scan = ScanView::new(pictures, outcome, shown.scale)?;
        let data = scan.named(pair.to_string()).to_bytes();
        Ok(vec![
            standalone_page(pair.as_str(), &data).into_bytes(),
            jpeg_rgb8(&picture, QUALITY),
        ])
    }
}
