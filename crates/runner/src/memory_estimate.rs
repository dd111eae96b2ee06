//! Estimates the memory that a pair needs while it is aligned, from its input files or from data in memory.

use std::io::BufReader;
use std::path::Path;

use mocban_align::stages::depth::DepthParams;
use mocban_core::raster;
use mocban_store::Input;

/// Bytes reserved for each pair's maps and masks, in addition to its mesh and print, with a depth map of up to
/// [`INCLUDED_MAP_PIXELS`].
pub(super) const PAIR_BYTES: u64 = 32 << 20;
const INCLUDED_MAP_PIXELS: u64 = 512 * 512;
/// Bytes needed for each further pixel of the depth map. Measured: 16 to 17, with maps of 4 and 38 million pixels.
pub(super) const MAP_PIXEL_BYTES: u64 = 20;
/// Length of the longest usual character. If a pixel has a size in mm, a depth map grows with its scan, whose length is
/// not known before it is read: a longer scan takes more memory than is reserved.
const USUAL_MM: f64 = 50.0;
/// Bytes needed per byte of a mesh file, including the file's content. Measured with one to two million vertices:
/// binary PLY 3.1, ASCII PLY 1.9, binary STL 2.6, ASCII STL 1.6, point clouds 2.5. For OBJ it is 1.8, or 5.7 with
/// normals or texture coordinates.
const MESH_FACTOR: f64 = 3.5;
const OBJ_FACTOR: f64 = 6.0;
/// Bytes needed per pixel of a print. Measured with grey and colour images: at most 27 with 1.9 million pixels, 1 to 6 besides
/// the file with 16 to 144 million, whose masks are smaller. A long, narrow print has masks of its own size.
const PIXEL_BYTES: u64 = 30;
/// Pixels assumed for each byte of an image file whose header cannot be read.
const PIXELS_PER_BYTE: u64 = 1;
const JPEG_PIXELS_PER_BYTE: u64 = 8;

/// Returns the memory in bytes for the maps and masks of a pair with these settings.
pub fn map_bytes(depth: &DepthParams) -> u64 {
    let more = depth
        .max_pixels(USUAL_MM)
        .saturating_sub(INCLUDED_MAP_PIXELS);
    PAIR_BYTES.saturating_add(more.saturating_mul(MAP_PIXEL_BYTES))
}

/// Estimates the memory in bytes for a mesh that is read as a whole.
pub fn mesh_bytes(mesh: &Input) -> u64 {
    let factor = match extension(mesh.path()).as_str() {
        "obj" => OBJ_FACTOR,
        _ => MESH_FACTOR,
    };
    (mesh.size() as f64 * factor) as u64
}

/// Estimates the memory in bytes for a mesh in memory, like that for its binary PLY file with floats of 32 bits.
pub fn mesh_bytes_of(vertices: usize, triangles: usize) -> u64 {
    ((12 * vertices as u64 + 13 * triangles as u64) as f64 * MESH_FACTOR) as u64
}

/// Estimates the memory in bytes for a print in memory.
pub const fn print_bytes_of(pixels: u64) -> u64 {
    pixels.saturating_mul(PIXEL_BYTES)
}

/// Estimates the memory in bytes for a print. At most `images.max_pixels` pixels count.
pub fn print_bytes(print: &Input, images: &raster::ImageLimits) -> u64 {
    let pixels = print_pixels(print).min(images.max_pixels);
    print_bytes_of(pixels).saturating_add(print.size())
}

/// Returns the pixel count in the header of an image, because a small file may hold many pixels. If the header cannot
/// be read, estimates it from the file size.
pub(super) fn print_pixels(print: &Input) -> u64 {
    let Ok(file) = print.open() else {
        return 0;
    };
    let size = file.metadata().map_or(0, |meta| meta.len());
    raster::header_pixel_count(BufReader::new(file)).unwrap_or_else(|| {
        size.saturating_mul(match extension(print.path()).as_str() {
            "jpg" | "jpeg" => JPEG_PIXELS_PER_BYTE,
            _ => PIXELS_PER_BYTE,
        })
    })
}

fn extension(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension.to_string_lossy().to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::{PIXEL_BYTES, mesh_bytes_of, print_bytes, print_bytes_of};
    use mocban_core::raster;
    use mocban_store::Input;

    #[test]
    fn the_pixels_of_a_small_file_are_read_from_its_header() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("white.png");
        let white = image::GrayImage::from_pixel(3000, 2000, image::Luma([255]));
        white.save(&path).expect("a file");
        let size = std::fs::metadata(&path).expect("a file").len();
        assert!(size < 100_000);
        let bytes = print_bytes(&Input::file(path), &raster::ImageLimits::SUGGESTED);
        assert_eq!(bytes, 6_000_000 * PIXEL_BYTES + size);
    }

    #[test]
    fn data_in_memory_counts_like_its_file() {
        assert_eq!(mesh_bytes_of(1000, 2000), 133_000);
        assert_eq!(print_bytes_of(8_000_000), 240_000_000);
    }
}
