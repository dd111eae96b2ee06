//! The format `viewer`: one page per pair that shows the scan on its print in 3D, without a server.

use super::single_results::{FileOfPair, ShownResult, SingleResultFormat};
use crate::format_writer::PairView;
use crate::pair_pictures::PictureError;
use crate::scan_view::{ScanView, standalone_page};

const PAGE: &str = "3D view of the scan with its print; a page that needs no server and no network";

/// How to use the pages.
const USAGE: &str = "\
## Use

Open `pairs/ID/viewer.html` in a browser. The page holds its data and scripts, so that it can be sent or archived as one
file. Drag to turn the block, use the wheel or two fingers to come closer, and press `?` for the list of keys. Scans of
more than 500,000 triangles are simplified.

The view is mirrored at first, so that the writing reads as in the print. The switch *As printed* shows the block itself,
whose writing is mirrored. Lengths are millimetres, or mesh units if the unit of the mesh is unknown.
";

/// The pages.
#[derive(Default)]
pub(super) struct ViewerFormat;

impl SingleResultFormat for ViewerFormat {
    const PURPOSE: &'static str =
        "Pages that show scans of carved blocks in 3D, with their prints on them.";
    const FILES: &'static [FileOfPair] = &[["page", "pairs/*/viewer.html", PAGE]];
    const USAGE: &'static str = USAGE;

    fn contents(
        &self,
        view: &PairView<'_>,
        shown: ShownResult<'_>,
    ) -> Result<Vec<Vec<u8>>, PictureError> {
        let pair = &view.record.pair.id;
        let scan = ScanView::new(shown.pictures, &shown.record.outcome, shown.scale)?;
        let data = scan.named(pair.to_string()).to_bytes();
        Ok(vec![standalone_page(pair.as_str(), &data).into_bytes()])
    }
}
