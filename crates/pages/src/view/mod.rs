//! The pages of `mocban view`: one scan on its print in 3D, or a whole block.

mod block_page;
mod correction_page;
pub(crate) mod page;
mod scan_page;

pub use block_page::block_page;
pub use correction_page::{CorrectionStore, PointsSaved};
pub(crate) use scan_page::asset as scan_asset;
pub use scan_page::scan_page;
