//! The pages of `mocban view`: one scan on its print in 3D, or a whole block.

mod block_access;
mod block_labels;
mod block_page;
mod block_pictures;
mod block_points;
mod boxes_page;
mod correction_page;
mod opened_block;
pub(crate) mod page;
mod read_once;
mod refusal;
mod scan_page;
mod shown_block;

pub use block_access::BlockAccess;
pub use opened_block::{OpenedBlock, PictureReading, open_block};
pub(crate) use scan_page::asset as scan_asset;
pub use scan_page::scan_page;
