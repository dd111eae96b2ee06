//! Estimates the memory that a block needs, so that it shares one limit with the pairs.

use std::io::Read as _;
use std::path::PathBuf;

use crate::input_reads::{ReadItem, ReadLimits, read_each};
use crate::memory_estimate::{mesh_bytes, print_pixels};
use crate::options::RunOptions;
use crate::run_context::RunContext;
use crate::stop::StopLevel;
use mocban_align::block::MAX_MAP_PIXELS;
use mocban_catalog::BlockAttributes;
use mocban_core::mesh::{STL_HEAD, binary_stl_triangles};
use mocban_core::raster;
use mocban_store::{Input, Project};

/// Bytes reserved for the height maps of both sides, their relief and the search for the page. Measured: 120 MB.
const BLOCK_BYTES: u64 = 160 << 20;
/// Part of the length of a streamed scan that the meshes of its characters take while they are cut. Measured: 1/18,
/// with scans of 0.25 and 1.3 GB.
const STREAMED_SHARE: u64 = 16;
/// Bytes needed per pixel of a page. Measured: 10, with pages of 6 and 24 million pixels.
const PAGE_PIXEL_BYTES: u64 = 16;

/// Bytes for each pixel of a height map while both sides of a block are drawn and their faces are found.
const MAP_PIXEL_BYTES: u64 = 16;

/// Returns the memory for the height maps of a block in a run with a limit: a quarter of it, but not more than the
/// largest maps take.
fn map_bytes(memory: Option<u64>) -> u64 {
    let largest = MAX_MAP_PIXELS as u64 * MAP_PIXEL_BYTES;
    memory.map_or(largest, |bytes| largest.min(bytes / 4))
}

/// Returns the size of the largest height map, in pixels, that fits the memory for it.
pub(crate) fn max_map_pixels(memory: Option<u64>) -> usize {
    (map_bytes(memory) / MAP_PIXEL_BYTES) as usize
}

/// What the estimates of a run have in common.
pub(crate) struct BlockMemory {
    limits: raster::ImageLimits,
    /// Memory for the height maps of a block, whose size is known only when its scan is read.
    map_bytes: u64,
}

impl BlockMemory {
    pub(crate) fn new(options: &RunOptions) -> Self {
        Self {
            limits: options.limits.image,
            map_bytes: map_bytes(options.memory),
        }
    }

    /// Estimates the memory that a block needs, in bytes. Reads the headers of its files.
    pub(crate) async fn estimate(&self, context: &RunContext, attributes: &BlockAttributes) -> u64 {
        let block = EstimatedBlock {
            project: context.project.clone(),
            attributes: attributes.clone(),
            limits: self.limits,
            map_bytes: self.map_bytes,
        };
        let limits = ReadLimits {
            timeout: context.timing.read_timeout(),
            stop: context.stop.clone(),
            until: StopLevel::Drain,
        };
        let estimated = read_each(vec![block], &limits).await;
        let estimated = estimated.into_iter().flatten().next();
        estimated.unwrap_or(BLOCK_BYTES)
    }
}

/// A block whose memory is estimated.
struct EstimatedBlock {
    project: Project,
    attributes: BlockAttributes,
    limits: raster::ImageLimits,
    map_bytes: u64,
}

impl ReadItem for EstimatedBlock {
    type Output = u64;

    fn read(&self) -> u64 {
        let mesh = self.project.input(&self.attributes.mesh_path);
        let page = self.project.input(&self.attributes.page_path);
        let pixels = print_pixels(&page).min(self.limits.max_pixels);
        BLOCK_BYTES
            .max(self.map_bytes)
            .saturating_add(scan_bytes(&mesh))
            .saturating_add(pixels.saturating_mul(PAGE_PIXEL_BYTES))
    }

    fn path(&self) -> PathBuf {
        self.project.input_path(&self.attributes.mesh_path)
    }
}

/// Estimates the memory in bytes for a scan. A binary STL is streamed; other formats are read into memory as a whole.
fn scan_bytes(scan: &Input) -> u64 {
    let mut head = Vec::with_capacity(STL_HEAD);
    let Ok(file) = scan.open() else {
        return 0;
    };
    let length = file.metadata().map_or(0, |meta| meta.len());
    let read = file.take(STL_HEAD as u64).read_to_end(&mut head);
    let name = scan.path().to_string_lossy();
    match read.map(|_| binary_stl_triangles(&head, length, &name)) {
        Ok(Ok(Some(_))) => length / STREAMED_SHARE,
        // Without a mesh, the block soon fails.
        Ok(Err(_)) | Err(_) => 0,
        Ok(Ok(None)) => mesh_bytes(scan),
    }
}

#[cfg(test)]
mod tests {
    use super::{
        BLOCK_BYTES, EstimatedBlock, PAGE_PIXEL_BYTES, STREAMED_SHARE, map_bytes, max_map_pixels,
    };
    use crate::input_reads::ReadItem as _;
    use crate::tests::values;
    use mocban_align::block::MAX_MAP_PIXELS;
    use mocban_core::raster::ImageLimits;
    use mocban_store::Project;

    #[test]
    fn a_streamed_scan_needs_little_and_another_format_its_whole_length() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let page = image::GrayImage::from_pixel(300, 200, image::Luma([255]));
        page.save(dir.path().join("page.png")).expect("a file");
        let triangles = 1000_u32;
        let mut stl = vec![0; 84 + 50 * triangles as usize];
        stl[80..84].copy_from_slice(&triangles.to_le_bytes());
        std::fs::write(dir.path().join("scan.stl"), &stl).expect("a file");
        std::fs::write(dir.path().join("scan.ply"), vec![b'#'; 1000]).expect("a file");
        let estimate = |mesh: &str| {
            let block = EstimatedBlock {
                project: project.clone(),
                attributes: values::block_attributes(mesh, "page.png"),
                limits: ImageLimits::SUGGESTED,
                map_bytes: map_bytes(Some(600 << 20)),
            };
            block.read() - BLOCK_BYTES - 60_000 * PAGE_PIXEL_BYTES
        };
        assert_eq!(estimate("scan.stl"), stl.len() as u64 / STREAMED_SHARE);
        assert_eq!(estimate("scan.ply"), 3500);
        assert_eq!(estimate("none.stl"), 0);
    }

    #[test]
    fn height_maps_take_at_most_a_quarter_of_the_memory() {
        assert_eq!(max_map_pixels(None), MAX_MAP_PIXELS);
        assert_eq!(max_map_pixels(Some(u64::MAX)), MAX_MAP_PIXELS);
        assert_eq!(max_map_pixels(Some(256 << 20)), 4 << 20);
        assert!(map_bytes(None) > BLOCK_BYTES);
    }
}
