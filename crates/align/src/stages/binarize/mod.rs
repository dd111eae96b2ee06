//! Binarization of the print: dark ground, background, colour, polarity, Otsu threshold, ink mask.

mod background;
mod colour;
mod ground;
mod hypotheses;
mod ink;
mod ink_shares;
mod outlined;
mod polarity;
mod samples;
#[cfg(test)]
mod test_strokes;

pub(super) use hypotheses::hypotheses;
pub(super) use ink::BinarizeError;
pub(super) use ink::{InkMask, fixed, require_strokes};
pub(super) use ink_shares::keep_shares;
pub(super) use mocban_core::raster::otsu::{Split, split, split_inner};
pub(super) use outlined::{hypotheses_within, inside};
pub(super) use polarity::rim_share;
