//! Limits the memory of a block and all running pairs together. The memory of a pair is estimated from its input files.

use std::fmt;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use super::input_reads::ReadItem;
use mocban_align::stages::depth::DepthParams;
use mocban_catalog::PairAttributes;
use mocban_core::domain::Stage;
use mocban_core::raster;
use mocban_store::{Input, Project};

/// Bytes reserved for each pair's maps and masks, in addition to its mesh and print, with a depth map of up to
/// [`INCLUDED_MAP_PIXELS`].
pub(super) const PAIR_BYTES: u64 = 32 << 20;
const INCLUDED_MAP_PIXELS: u64 = 512 * 512;
/// Bytes needed for each further pixel of the depth map. Measured: 16 to 17, with maps of 4 and 38 million pixels.
const MAP_PIXEL_BYTES: u64 = 20;
/// Length of the longest usual character. If a pixel has a size in mm, a depth map grows with its scan, whose length is
/// not known before it is read: a longer scan takes more memory than is reserved.
const USUAL_MM: f64 = 50.0;
/// Bytes needed per byte of a mesh file, including the file's content. Measured with one to two million vertices:
/// binary PLY 3.1, ASCII PLY 1.9, binary STL 2.6, ASCII STL 1.6, point clouds 2.5. For OBJ it is 1.8, or 5.7 with
/// normals or texture coordinates.
const MESH_FACTOR: f64 = 3.5;
const OBJ_FACTOR: f64 = 6.0;
/// Bytes needed per pixel of a print. Measured: 32 to 39, with grey and colour images of 10 and 28 million pixels.
const PIXEL_BYTES: u64 = 50;
/// Pixels assumed for each byte of an image file whose header cannot be read.
const PIXELS_PER_BYTE: u64 = 1;
const JPEG_PIXELS_PER_BYTE: u64 = 8;

/// Returns the memory in bytes for the maps and masks of a pair with these settings.
pub(super) fn map_bytes(depth: &DepthParams) -> u64 {
    let more = depth
        .max_pixels(USUAL_MM)
        .saturating_sub(INCLUDED_MAP_PIXELS);
    PAIR_BYTES.saturating_add(more.saturating_mul(MAP_PIXEL_BYTES))
}

/// Memory that is reserved for running pairs and a block, in estimated bytes.
#[derive(Debug)]
pub(super) struct MemoryBudget {
    limit: Option<u64>,
    reserved: u64,
}

impl MemoryBudget {
    /// Nothing is reserved yet. With `None` there is no limit.
    pub(super) const fn new(limit: Option<u64>) -> Self {
        Self { limit, reserved: 0 }
    }

    /// Returns whether there is a limit.
    pub(super) const fn is_limited(&self) -> bool {
        self.limit.is_some()
    }

    /// Reserves bytes for a pair or a block. Returns `false` if the limit does not allow it. One that needs more than
    /// the limit is accepted if nothing else is reserved.
    pub(super) fn reserve(&mut self, bytes: u64) -> bool {
        let reserved = self.reserved.saturating_add(bytes);
        let fits = self.reserved == 0 || self.limit.is_none_or(|limit| reserved <= limit);
        if fits {
            self.reserved = reserved;
        }
        fits
    }

    /// Returns the limit, if a pair or a block needs more than it allows in total.
    fn exceeded_by(&self, bytes: u64) -> Option<u64> {
        self.limit.filter(|limit| bytes > *limit)
    }

    /// Warns if a pair or a block needs more than the limit allows in total.
    pub(super) fn warn_if_exceeded(&self, what: fmt::Arguments<'_>, bytes: u64) {
        if let Some(limit) = self.exceeded_by(bytes) {
            let (need, limit) = (bytes >> 20, limit >> 20);
            tracing::warn!(
                "{what} may need {need} MiB, more than the {limit} MiB of --memory: it runs with no other pair beside it"
            );
        }
    }

    /// Ends a reservation.
    pub(super) const fn release(&mut self, bytes: u64) {
        self.reserved = self.reserved.saturating_sub(bytes);
    }
}

/// A pair whose memory is estimated.
pub(super) struct EstimatedPair {
    pub(super) project: Project,
    pub(super) attributes: PairAttributes,
    /// Next stage.
    pub(super) from: Stage,
    pub(super) limits: raster::ImageLimits,
    /// Memory for its maps and masks.
    pub(super) map_bytes: u64,
}

impl ReadItem for EstimatedPair {
    type Output = u64;

    fn read(&self) -> u64 {
        let inputs = input_bytes(&self.project, &self.attributes, self.from, &self.limits);
        self.map_bytes.saturating_add(inputs)
    }

    fn path(&self) -> PathBuf {
        self.project.input_path(&self.attributes.mesh_path)
    }
}

/// Estimates the memory in bytes that mesh and print of a pair need if it continues at stage `from`. A missing file counts
/// as empty, because its pair soon fails.
fn input_bytes(
    project: &Project,
    pair: &PairAttributes,
    from: Stage,
    images: &raster::ImageLimits,
) -> u64 {
    let mesh = match from {
        Stage::Fit | Stage::Depth => mesh_bytes(&project.input(&pair.mesh_path)),
        Stage::Normalize | Stage::Register => 0,
    };
    let print = match from {
        Stage::Fit | Stage::Depth | Stage::Normalize => {
            print_bytes(&project.input(&pair.print_path), images)
        }
        Stage::Register => 0,
    };
    mesh.saturating_add(print)
}

/// Estimates the memory in bytes for a mesh that is read as a whole.
pub(super) fn mesh_bytes(mesh: &Input) -> u64 {
    let factor = match extension(mesh.path()).as_str() {
        "obj" => OBJ_FACTOR,
        _ => MESH_FACTOR,
    };
    (mesh.size() as f64 * factor) as u64
}

/// Estimates the memory in bytes for a print. At most `images.max_pixels` pixels count.
fn print_bytes(print: &Input, images: &raster::ImageLimits) -> u64 {
    let pixels = print_pixels(print).min(images.max_pixels);
    pixels
        .saturating_mul(PIXEL_BYTES)
        .saturating_add(print.size())
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
    use super::{
        EstimatedPair, MAP_PIXEL_BYTES, MemoryBudget, PAIR_BYTES, PIXEL_BYTES, input_bytes,
        map_bytes, print_bytes,
    };
    use crate::input_reads::ReadItem as _;
    use crate::tests::values;
    use mocban_align::stages::depth::{DepthParams, ResolutionBy};
    use mocban_core::domain::Stage;
    use mocban_core::raster;
    use mocban_store::{Input, Project};

    #[test]
    fn reservations_stay_within_the_limit_except_for_one_pair_that_exceeds_it() {
        let mut budget = MemoryBudget::new(Some(10));
        assert!(budget.reserve(4) && budget.reserve(6));
        assert!(!budget.reserve(1));
        budget.release(4);
        assert!(!budget.reserve(11), "others still hold some");
        budget.release(6);
        assert!(budget.reserve(11));
        assert!(!budget.reserve(1), "the large pair runs with no other");
        budget.release(11);
        assert!(budget.reserve(1));
        assert_eq!(budget.exceeded_by(11), Some(10));
        assert_eq!(budget.exceeded_by(10), None);
    }

    #[test]
    fn without_a_limit_every_reservation_is_granted() {
        let mut budget = MemoryBudget::new(None);
        assert!(budget.reserve(u64::MAX) && budget.reserve(u64::MAX));
    }

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
    fn the_estimate_follows_the_files_that_the_remaining_stages_read() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let write = |name: &str, bytes: usize| {
            std::fs::write(dir.path().join(name), vec![0; bytes]).expect("a file");
        };
        write("1.obj", 1000);
        write("1.jpg", 100);
        let attributes = values::pair_attributes("1.obj", "1.jpg");
        let few = raster::ImageLimits {
            max_pixels: 10,
            ..raster::ImageLimits::SUGGESTED
        };
        let from = |stage, limits| input_bytes(&project, &attributes, stage, limits);
        let print = 100 * 8 * 50 + 100;
        assert_eq!(
            from(Stage::Fit, &raster::ImageLimits::SUGGESTED),
            6000 + print
        );
        assert_eq!(
            from(Stage::Normalize, &raster::ImageLimits::SUGGESTED),
            print
        );
        assert_eq!(from(Stage::Normalize, &few), 10 * 50 + 100);
        assert_eq!(from(Stage::Register, &few), 0);
    }

    #[test]
    fn the_estimate_follows_the_size_of_the_depth_map() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let estimate = |depth: &DepthParams| {
            let pair = EstimatedPair {
                project: Project::create(dir.path()).expect("a project"),
                attributes: values::pair_attributes("none.obj", "none.jpg"),
                from: Stage::Register,
                limits: raster::ImageLimits::SUGGESTED,
                map_bytes: map_bytes(depth),
            };
            pair.read()
        };
        let by_side = |longest_px| DepthParams {
            resolution_by: ResolutionBy::LongestSide,
            longest_px,
            px_per_mm: 40.0,
        };
        for (longest_px, pixels) in [(512, 512_u64.pow(2)), (16_384, 1 << 28)] {
            let more = (pixels - 512 * 512) * MAP_PIXEL_BYTES;
            assert_eq!(estimate(&by_side(longest_px)), PAIR_BYTES + more);
        }
        let by_mm = DepthParams {
            resolution_by: ResolutionBy::PxPerMm,
            ..by_side(512)
        };
        let more = (2003_u64.pow(2) - 512 * 512) * MAP_PIXEL_BYTES;
        assert_eq!(estimate(&by_mm), PAIR_BYTES + more);
    }
}
