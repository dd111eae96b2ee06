//! The format `viewer`: one page per pair that shows the scan on its print in 3D, without a server.

use super::single_results::{FileOfPair, SingleResults};
use crate::export_folder::FolderError;
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_pictures::PictureError;
use crate::record::PairRecord;
use crate::scan_view::{ScanView, standalone_page};

/// The file of a pair.
const FILES: [FileOfPair; 1] = [[
    "page",
    "pairs/*/viewer.html",
    "3D view of the scan with its print; a page that needs no server and no network",
]];

/// How to use the pages.
const USAGE: &str = "\
## Use

Open `pairs/ID/viewer.html` in a browser. The page holds its data and scripts, so that it can be sent or archived as one
file. Drag to turn the block, use the wheel or two fingers to come closer, and press `?` for the list of keys. Scans of
more than 500,000 triangles are simplified.

The view is mirrored at first, so that the writing reads as in the print. The switch *As printed* shows the block itself,
whose writing is mirrored. Lengths are millimetres, or mesh units if the unit of the mesh is unknown.
";

/// Writes the pages.
pub(super) struct ViewerWriter {
    results: SingleResults,
}

impl ViewerWriter {
    pub(super) fn begin(folder: &FormatFolder) -> Result<Self, FolderError> {
        Ok(Self {
            results: SingleResults::begin(folder)?,
        })
    }
}

impl FormatWriter for ViewerWriter {
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let Some(shown) = SingleResults::of_pair(view) else {
            return Ok(self.results.without_result(view));
        };
        let pair = &view.record.pair.id;
        let scan = ScanView::new(shown.pictures, &shown.record.outcome, shown.scale)?;
        let data = scan.named(pair.to_string()).to_bytes();
        let page = standalone_page(pair.as_str(), &data).into_bytes();
        Ok(self.results.with_files(view, shown.fields, &FILES, [page]))
    }

    fn append(&mut self, _: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        shared.iter().try_for_each(|line| self.results.append(line))
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        Ok(vec![self.results.finish()?])
    }

    fn guide(&self) -> FormatGuide {
        let purpose = "Pages that show scans of carved blocks in 3D, with their prints on them.";
        self.results.guide_of_files(purpose, &FILES, USAGE)
    }
}
