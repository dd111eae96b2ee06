//! Pictures for people: overlays, lit reliefs, contact sheets.

mod font;
mod overlay;
mod paint;
mod relief;
mod sheet;

pub use overlay::View;
pub use paint::Rgb;
pub use relief::shaded;
pub use sheet::{SHEET_WIDTH, SheetCell, contact_sheet, tile_side};
