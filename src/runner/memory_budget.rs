//! Memory: what a pair may need at once, told by the sizes of its files, and how much of it is given out.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use crate::catalog::PairAttributes;
use crate::domain::Stage;
use crate::raster;
use crate::store::Project;

/// What any pair takes besides its files: the maps and canvases of the stages.
const PAIR_BYTES: u64 = 32 << 20;
/// Bytes at work for each byte of a mesh file, the file itself included. Measured with one to two million vertices:
/// binary PLY 3.1, ASCII PLY 1.9, binary STL 2.6, ASCII STL 1.6, points 2.5, OBJ 1.8, and 5.7 where it is not plain.
const MESH_FACTOR: f64 = 3.5;
const OBJ_FACTOR: f64 = 6.0;
/// Bytes at work for each pixel of a print. Measured with 10 and 28 million pixels in grey and in colour: 32 to 39.
const PIXEL_BYTES: u64 = 50;
/// Most pixels that a byte of a print's file is expected to hold, where its header does not tell.
const PIXELS_PER_BYTE: u64 = 1;
const JPEG_PIXELS_PER_BYTE: u64 = 8;
/// Share of the memory that is free at the start.
const SHARE: f64 = 0.8;

/// Memory that is given out to pairs, in bytes by estimate.
#[derive(Debug)]
pub(super) struct MemoryBudget {
    limit: Option<u64>,
    given: u64,
}

impl MemoryBudget {
    /// Nothing given yet; `None` gives to everybody.
    pub(super) const fn new(limit: Option<u64>) -> Self {
        Self { limit, given: 0 }
    }

    /// Whether anything is held to it.
    pub(super) const fn is_limited(&self) -> bool {
        self.limit.is_some()
    }

    /// Gives a pair what it needs, if there is so much. One that needs more than all there is gets it when nobody else
    /// has any, and is alone until it gives it back.
    pub(super) fn give(&mut self, need: u64) -> bool {
        let given = self.given.saturating_add(need);
        let fits = self.given == 0 || self.limit.is_none_or(|limit| given <= limit);
        if fits {
            self.given = given;
        }
        fits
    }

    /// The limit, where a pair needs more than all there is.
    pub(super) fn exceeded_by(&self, need: u64) -> Option<u64> {
        self.limit.filter(|limit| need > *limit)
    }

    /// Takes back what a pair was given.
    pub(super) const fn take_back(&mut self, need: u64) {
        self.given = self.given.saturating_sub(need);
    }
}

/// What a pair may need at once from a stage on, in bytes. A file that is not there takes nothing: its pair fails soon.
pub(super) fn need(
    project: &Project,
    pair: &PairAttributes,
    from: Stage,
    images: &raster::ImageLimits,
) -> u64 {
    let mesh = match from {
        Stage::Fit | Stage::Depth => mesh_bytes(&project.input_path(&pair.mesh_path)),
        Stage::Normalize | Stage::Register => 0,
    };
    let print = match from {
        Stage::Fit | Stage::Depth | Stage::Normalize => {
            print_bytes(&project.input_path(&pair.print_path), images)
        }
        Stage::Register => 0,
    };
    PAIR_BYTES.saturating_add(mesh).saturating_add(print)
}

fn size(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |meta| meta.len())
}

fn mesh_bytes(path: &Path) -> u64 {
    let factor = if has_ending(path, &["obj"]) {
        OBJ_FACTOR
    } else {
        MESH_FACTOR
    };
    (size(path) as f64 * factor) as u64
}

/// No more than the largest print that is read. A small file may hold many pixels, so its header is asked first.
fn print_bytes(path: &Path, images: &raster::ImageLimits) -> u64 {
    let size = size(path);
    // What has no size may be a pipe, which would keep us waiting.
    let of_header = (size > 0).then(|| File::open(path).ok()).flatten();
    let pixels = of_header
        .and_then(|file| raster::header_pixel_count(BufReader::new(file)))
        .unwrap_or_else(|| {
            let is_jpeg = has_ending(path, &["jpg", "jpeg"]);
            size.saturating_mul(if is_jpeg {
                JPEG_PIXELS_PER_BYTE
            } else {
                PIXELS_PER_BYTE
            })
        });
    let pixels = pixels.min(images.max_pixels);
    pixels.saturating_mul(PIXEL_BYTES).saturating_add(size)
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().and_then(std::ffi::OsStr::to_str);
    ending.is_some_and(|ending| {
        endings
            .iter()
            .any(|wanted| ending.eq_ignore_ascii_case(wanted))
    })
}

/// What a run takes of the machine where nothing else is said: a share of the memory that is free now, or of what the
/// process's group may have. `None` where neither can be told.
pub fn free_memory() -> Option<u64> {
    let meminfo = std::fs::read_to_string("/proc/meminfo").ok();
    let group = std::fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let free = [
        meminfo.as_deref().and_then(available),
        group.and_then(|text| text.trim().parse().ok()),
    ];
    let least = free.into_iter().flatten().min()?;
    Some((least as f64 * SHARE) as u64)
}

/// `MemAvailable` of `/proc/meminfo`, in bytes (`proc_meminfo(5)`).
fn available(meminfo: &str) -> Option<u64> {
    let line = meminfo
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::{MemoryBudget, PAIR_BYTES, PIXEL_BYTES, available, need, print_bytes};
    use crate::catalog::PairAttributes;
    use crate::domain::Stage;
    use crate::raster;
    use crate::report::test_fixtures;
    use crate::store::Project;

    #[test]
    fn what_is_given_stays_within_the_limit_but_for_one_that_is_too_large() {
        let mut budget = MemoryBudget::new(Some(10));
        assert!(budget.give(4) && budget.give(6));
        assert!(!budget.give(1));
        budget.take_back(4);
        assert!(!budget.give(11), "others still have some");
        budget.take_back(6);
        assert!(budget.give(11));
        assert!(!budget.give(1), "it is alone");
        budget.take_back(11);
        assert!(budget.give(1));
        assert_eq!(budget.exceeded_by(11), Some(10));
        assert_eq!(budget.exceeded_by(10), None);
    }

    #[test]
    fn without_a_limit_everybody_gets_what_they_need() {
        let mut budget = MemoryBudget::new(None);
        assert!(budget.give(u64::MAX) && budget.give(u64::MAX));
    }

    #[test]
    fn a_small_file_of_many_pixels_is_told_by_its_header() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("white.png");
        let white = image::GrayImage::from_pixel(3000, 2000, image::Luma([255]));
        white.save(&path).expect("a file");
        let size = std::fs::metadata(&path).expect("a file").len();
        assert!(size < 100_000);
        let bytes = print_bytes(&path, &raster::ImageLimits::SUGGESTED);
        assert_eq!(bytes, 6_000_000 * PIXEL_BYTES + size);
    }

    #[test]
    fn need_follows_the_files_that_the_stages_left_will_read() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let write = |name: &str, bytes: usize| {
            std::fs::write(dir.path().join(name), vec![0; bytes]).expect("a file");
        };
        write("1.obj", 1000);
        write("1.jpg", 100);
        let attributes = PairAttributes {
            mesh_path: "1.obj".to_owned(),
            print_path: "1.jpg".to_owned(),
            ..test_fixtures::pending("1").attributes
        };
        let few = raster::ImageLimits {
            max_pixels: 10,
            ..raster::ImageLimits::SUGGESTED
        };
        let from = |stage, limits| need(&project, &attributes, stage, limits) - PAIR_BYTES;
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
    fn free_memory_is_read_from_its_line() {
        let text = "MemTotal:       24000 kB\nMemAvailable:   12 kB\n";
        assert_eq!(available(text), Some(12 * 1024));
        assert_eq!(available("MemTotal: 1 kB\n"), None);
    }
}
