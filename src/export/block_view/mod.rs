//! What a person sees of a whole block: its page, the relief in the frame of the page, and the characters with their
//! results.

mod block_error;
mod block_sheets;
mod block_view;
mod characters;
mod page_layers;

pub use block_error::BlockViewError;
pub use block_view::BlockView;
pub use characters::{CharacterStatus, CharacterView};
pub use page_layers::{PageLayer, PageLayers, PageRegion};
