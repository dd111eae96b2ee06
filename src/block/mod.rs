//! Registration of a whole carved block with the image of its page, as pure functions.

mod agreement;
mod align;
mod bounds;
mod character_map;
mod characters;
mod coarse;
mod control_start;
mod cut;
mod error;
mod face_layer;
mod face_sampler;
mod field;
mod found_boxes;
mod height_map;
mod label_fit;
mod orientation;
mod outcomes;
mod page_ink;
mod page_map;
mod print_crop;
mod relief;
mod square_fft;
mod stored_heights;
#[cfg(test)]
mod test_world;
mod window_images;
mod window_template;
mod windows;

pub use agreement::{Agreement, Support};
pub use align::{CarvedFace, PageAlignment, align};
pub use character_map::CharacterMap;
pub use characters::{CharacterBox, PlacedCharacter, PlacedCharacters, place_characters};
pub use control_start::{ControlPointError, align_at};
pub use cut::{CUT_MARGIN_MM, CutError, CutPlan, cut_meshes};
pub use error::BlockError;
pub use found_boxes::{FoundBox, find_boxes};
pub use height_map::{HEIGHT_STEP_MM, HeightMap, draw_height_maps};
pub use label_fit::{LabelFit, check_label_fit};
pub use orientation::Orientation;
pub use outcomes::{AlignOutcome, BoxesOutcome, CutOutcome, FaceOutcome, FoundFace, heights_role};
pub use page_ink::{InkSampler, PageInk};
pub use page_map::{PageMap, StoredPageMap};
pub use print_crop::{PrintCrop, cut_print};
pub use relief::Relief;
pub use stored_heights::{HeightHeader, StoredHeights};
pub use windows::WindowMatch;
