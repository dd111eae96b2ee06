//! What a person sees of a whole block: its page, the relief in the frame of the page, and the characters with their
//! results.

mod block_correction;
mod block_error;
mod block_sheets;
mod box_edits;
mod characters;
mod chosen_files;
mod editable_boxes;
mod page_layers;
mod page_picture;
mod page_view;
mod registered_face;

pub use block_correction::{BlockCorrection, CorrectionError, PicturePoint, TriedAlignment};
pub use block_error::BlockViewError;
pub use box_edits::{BoxEditError, BoxEdits};
pub use characters::{CharacterStatus, CharacterView};
pub use chosen_files::replaced_file;
pub use editable_boxes::EditableBoxes;
pub use page_layers::{PageLayer, PageLayers, PageRegion};
pub use page_picture::DecodedPage;
pub use page_view::{AlignedBlock, BlockView};
pub(super) use registered_face::RegisteredFace;
