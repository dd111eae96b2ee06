//! Calibrated TIFF images for `ImageJ` and Fiji.

mod imagej_tags;
mod images;
mod tiff_stack;

pub(super) use images::{AlignedPictures, FijiImages};
