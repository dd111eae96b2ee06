//! The size of an image by its header, for a look before it is decoded.

use std::io::{BufRead, Read as _, Seek, SeekFrom};

use image::ImageReader;

use super::error::{DecodeError, broken};
use super::limits::ImageLimits;
use super::tags::TagFileWindow;
use super::tiff;
use crate::domain::FileKind;
use crate::page_vec::fill;

/// Bytes at the end of a file in which the mark of its end is searched. Some programs write metadata behind it.
const TAIL_BYTES: u64 = 1 << 16;
/// Most segments of a JPEG before its frame header.
const MAX_SEGMENTS: usize = 1000;

/// Returns width and height of a stored image in pixels, by its header. `len` is the length of the file in bytes.
///
/// # Errors
/// Returns an error if the file is no PNG, JPEG or TIFF image, ends before the mark of its end, or exceeds the limits.
pub fn header_size(
    mut file: impl BufRead + Seek,
    len: u64,
    limits: &ImageLimits,
) -> Result<[u32; 2], DecodeError> {
    if len == 0 {
        return Err(DecodeError::Empty);
    }
    if len > limits.max_bytes {
        let limit = limits.max_bytes;
        return Err(DecodeError::TooManyBytes { bytes: len, limit });
    }
    let kind = match file.fill_buf() {
        Ok(head) => FileKind::of(head),
        Err(error) => return Err(broken(FileKind::Binary, &error.to_string())),
    };
    let size = match kind {
        FileKind::Tiff => tiff::size(&TagFileWindow::new(&mut file)),
        FileKind::Jpeg => jpeg_size(&mut file).or_else(|| dimensions(&mut file)),
        FileKind::Png => dimensions(&mut file),
        other => return Err(DecodeError::NotAnImage(other)),
    };
    let [width, height] = size.ok_or(DecodeError::Truncated(kind))?;
    limits.check_size(width, height)?;
    if has_end(kind, &mut file, len) {
        Ok([width, height])
    } else {
        Err(DecodeError::Truncated(kind))
    }
}

/// Reads the frame header of a JPEG, which a general reader finds only in the whole file. `None` if a segment before it is
/// not where its length says.
fn jpeg_size(file: &mut (impl BufRead + Seek)) -> Option<[u32; 2]> {
    let mut at = 2;
    for _ in 0..MAX_SEGMENTS {
        let mut head = [0; 9];
        file.seek(SeekFrom::Start(at)).ok()?;
        if fill(file, &mut head).ok()? < head.len() {
            return None;
        }
        let number = |at: usize| u16::from_be_bytes([head[at], head[at + 1]]);
        match (head[0], head[1]) {
            (0xff, 0xff) => at += 1,
            (0xff, 0x01 | 0xd0..=0xd8) => at += 2,
            (0xff, 0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf) => {
                return Some([number(7), number(5)].map(u32::from));
            }
            // The end, or a scan before the frame.
            (0xff, 0x00 | 0xd9 | 0xda) => return None,
            (0xff, _) => at += 2 + u64::from(number(2)),
            _ => return None,
        }
    }
    None
}

fn dimensions(file: &mut (impl BufRead + Seek)) -> Option<[u32; 2]> {
    file.rewind().ok()?;
    let reader = ImageReader::new(file).with_guessed_format().ok()?;
    let (width, height) = reader.into_dimensions().ok()?;
    Some([width, height])
}

/// Returns whether the last bytes have the mark that ends an image. A TIFF has none.
fn has_end(kind: FileKind, file: &mut (impl BufRead + Seek), len: u64) -> bool {
    let mark: &[u8] = match kind {
        FileKind::Png => b"IEND",
        FileKind::Jpeg => &[0xff, 0xd9],
        _ => return true,
    };
    let mut tail = Vec::new();
    let start = SeekFrom::Start(len.saturating_sub(TAIL_BYTES));
    let read = file.seek(start).is_ok() && file.take(TAIL_BYTES).read_to_end(&mut tail).is_ok();
    !read || tail.windows(mark.len()).any(|bytes| bytes == mark)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::header_size;
    use crate::raster::{DecodeError, Grid, ImageLimits, jpeg_rgb8, png_rgb8};

    #[test]
    fn sizes_and_cut_files_are_known_by_headers_and_ends() {
        let picture = Grid::new(120, 80, [200, 100, 50]);
        for bytes in [png_rgb8(&picture), jpeg_rgb8(&picture, 85)] {
            let size = |bytes: &[u8]| {
                let len = bytes.len() as u64;
                header_size(Cursor::new(bytes), len, &ImageLimits::SUGGESTED)
            };
            assert_eq!(size(&bytes), Ok([120, 80]));
            let cut = size(&bytes[..bytes.len() - 13]).expect_err("cut");
            assert!(matches!(cut, DecodeError::Truncated(_)), "{cut}");
            assert_eq!(size(&[]), Err(DecodeError::Empty));
            let pointer = size(b"version https://git-lfs.github.com/spec/v1\noid x\n");
            let pointer = pointer.expect_err("a pointer").to_string();
            assert!(pointer.contains("Git LFS"), "{pointer}");
        }
    }
}
