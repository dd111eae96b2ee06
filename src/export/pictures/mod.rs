//! Images for people: overlays, shaded reliefs, contact sheets.

mod font;
mod overlay;
mod paint;
mod relief;
mod sheet_layout;

pub use overlay::PrintView;
pub use paint::Rgb;
pub(super) use paint::eight_bits;
pub use relief::shaded;
pub use sheet_layout::{
    ContactSheetCell, FrameKind, NOTE_SPACE, SHEET_WIDTH, SheetLegend, contact_sheet, tile_side,
};
