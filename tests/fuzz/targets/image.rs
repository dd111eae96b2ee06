//! Reads arbitrary bytes as a print image: gives a one-line error, or an image within the limits.

#![no_main]

use libfuzzer_sys::fuzz_target;
use mocban::raster::{ImageLimits, decode};

const LIMITS: ImageLimits = ImageLimits {
    max_bytes: 1 << 20,
    max_pixels: 1 << 16,
};

fuzz_target!(|bytes: &[u8]| {
    match decode(bytes, &LIMITS) {
        Ok(picture) => assert!(picture.rgb.data().len() as u64 <= LIMITS.max_pixels),
        Err(error) => mocban_fuzz::one_sentence(&error.to_string()),
    }
});
