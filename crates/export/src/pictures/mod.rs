//! Images for people: overlays, shaded reliefs, contact sheets.

mod font;
mod marked_page;
mod overlay;
mod paint;
mod relief;
mod sheet_layout;

pub(super) use marked_page::{
    LegendEntry, MarkedBox, PictureLegend, mark, mark_edges, with_legend,
};
pub use overlay::PrintView;
pub use paint::Rgb;
pub(super) use paint::{BLUE, ORANGE, VERMILLION, resized};
pub use relief::shaded;
pub use sheet_layout::{
    ContactSheetCell, FrameKind, NOTE_SPACE, SHEET_WIDTH, SheetLegend, contact_sheet, tile_side,
};
