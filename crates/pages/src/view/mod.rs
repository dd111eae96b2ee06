//! The pages of `mocban view`: a local web server that shows one scan on its print in 3D, or a whole block.

mod block_server;
mod correction_server;
mod page;
mod server;

pub use block_server::bind_block;
pub use correction_server::{CorrectionStore, PointsSaved};
pub use server::{ViewError, ViewServer, bind};
