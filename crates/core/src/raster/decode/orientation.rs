//! The EXIF orientation of an image: how the stored pixels are turned to show the image upright.

use image::metadata::Orientation;

use crate::raster::Grid;

/// Returns the orientation of a PNG. Its `eXIf` chunk may stand before or after the pixels.
pub(super) fn of_png(bytes: &[u8]) -> Orientation {
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 8) {
        let (len, kind) = head.split_at(4);
        let len = len
            .iter()
            .fold(0, |sum, byte| sum << 8 | usize::from(*byte));
        if kind == b"eXIf" {
            return of_exif(bytes.get(at + 8..at + 8 + len));
        }
        at += 12 + len;
    }
    Orientation::NoTransforms
}

/// Returns the orientation in an EXIF block. An unreadable one counts as upright.
pub(super) fn of_exif(block: Option<&[u8]>) -> Orientation {
    block
        .and_then(Orientation::from_exif_chunk)
        .unwrap_or(Orientation::NoTransforms)
}

/// Returns the orientation with a number from a tag. A number that is not in 1..=8 counts as upright.
pub(super) fn of_tag(number: Option<u64>) -> Orientation {
    number
        .and_then(|number| u8::try_from(number).ok())
        .and_then(Orientation::from_exif)
        .unwrap_or(Orientation::NoTransforms)
}

/// Returns the pixels of the upright image.
pub(super) fn upright<T: Copy>(stored: Grid<T>, orientation: Orientation) -> Grid<T> {
    let (width, height) = (stored.width(), stored.height());
    let (right, bottom) = (width.saturating_sub(1), height.saturating_sub(1));
    let same = |pixel: &dyn Fn(usize, usize) -> T| Grid::from_fn(width, height, pixel);
    let turned = |pixel: &dyn Fn(usize, usize) -> T| Grid::from_fn(height, width, pixel);
    match orientation {
        Orientation::NoTransforms => stored,
        Orientation::FlipHorizontal => same(&|x, y| stored.at(right - x, y)),
        Orientation::Rotate180 => same(&|x, y| stored.at(right - x, bottom - y)),
        Orientation::FlipVertical => same(&|x, y| stored.at(x, bottom - y)),
        Orientation::Rotate90FlipH => turned(&|x, y| stored.at(y, x)),
        Orientation::Rotate90 => turned(&|x, y| stored.at(y, bottom - x)),
        Orientation::Rotate270FlipH => turned(&|x, y| stored.at(right - y, bottom - x)),
        Orientation::Rotate270 => turned(&|x, y| stored.at(right - y, x)),
    }
}

#[cfg(test)]
mod tests {
    use image::DynamicImage;
    use image::metadata::Orientation;

    use super::{of_tag, upright};
    use crate::raster::Grid;

    #[test]
    fn every_orientation_is_applied_as_by_the_image_crate() {
        for number in 1..=8 {
            let orientation = Orientation::from_exif(number).expect("an orientation");
            let stored = Grid::from_fn(3, 2, |x, y| (10 * y + x) as u8);
            let grey = image::GrayImage::from_raw(3, 2, stored.data().to_vec());
            let mut wanted = DynamicImage::ImageLuma8(grey.expect("six pixels"));
            wanted.apply_orientation(orientation);
            let found = upright(stored, orientation);
            let size = (wanted.width() as usize, wanted.height() as usize);
            assert_eq!((found.width(), found.height()), size, "{number}");
            assert_eq!(found.data(), wanted.as_bytes(), "{number}");
        }
    }

    #[test]
    fn an_unknown_number_counts_as_upright() {
        for number in [None, Some(0), Some(9), Some(300)] {
            assert_eq!(of_tag(number), Orientation::NoTransforms);
        }
    }
}
