//! Memory of a run: all pairs with large prints together stay within `--memory`.

use std::path::Path;

use mocban::domain::JobStatus;
use mocban::raster::{Grid, ImageLimits, decode, jpeg_rgb8};
use mocban::store::Project;

use crate::crowd::watched;
use crate::resume::{copy, pairs, project};

/// Pairs with large prints.
const PAIRS: u64 = 4;
/// Most pixels of each print; each has only a few less. Masks of more pixels would be smaller than the print.
const PIXELS: usize = 1_900_000;
/// Memory limit of a run. A pair is estimated to need 30 bytes per pixel, 32 MiB and the memory of its mesh, so one pair
/// fits, but not two.
const MEMORY_MIB: u64 = 170;

/// Scales a print up to nearly the given number of pixels.
pub(crate) fn enlarge(path: &Path, pixels: usize) {
    let bytes = std::fs::read(path).expect("a print");
    let small = decode(&bytes, &ImageLimits::SUGGESTED)
        .expect("a picture")
        .rgb
        .map(|colour| colour.map(|channel| (channel >> 8) as u8));
    let times = (pixels / (small.width() * small.height())).isqrt();
    let [width, height] = [small.width() * times, small.height() * times];
    // A whole row at a time, because tests are compiled without optimization.
    let mut large = Vec::with_capacity(width * height);
    for y in 0..small.height() {
        let colours = small.row(y).iter();
        let row: Vec<[u8; 3]> = colours
            .flat_map(|colour| std::iter::repeat_n(*colour, times))
            .collect();
        (0..times).for_each(|_| large.extend_from_slice(&row));
    }
    let large = Grid::from_vec(width, height, large).expect("as many pixels");
    std::fs::write(path, jpeg_rgb8(&large, 90)).expect("written");
}

/// Runs a project with one worker per pair. Returns the peak memory in MiB.
fn peak_mib(project: &Project, memory: &str) -> u64 {
    let jobs = PAIRS.to_string();
    let small = ["--set", "depth.longest_px=96"];
    let run = ["-q", "run", "-j", &jobs, "--memory", memory];
    let (ended, kib) = watched(project.dir(), &[&run[..], &small].concat());
    ended.expect(0);
    let done = |pair: &mocban::catalog::PairDetail| pair.results.status == JobStatus::Done;
    assert!(pairs(project).iter().all(done));
    kib >> 10
}

#[test]
fn pairs_with_large_prints_stay_within_the_memory_limit_together() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let bounded = project(dir.path(), "bounded", &PAIRS.to_string());
    for pair in pairs(&bounded) {
        enlarge(
            &bounded.input_path(&pair.results.attributes.print_path),
            PIXELS,
        );
    }
    let free = copy(&bounded, &dir.path().join("free"));
    let within = peak_mib(&bounded, &format!("{MEMORY_MIB}M"));
    let beyond = peak_mib(&free, "64G");
    assert!(within <= MEMORY_MIB, "{within} MiB");
    assert!(
        beyond > MEMORY_MIB,
        "{beyond} MiB without a limit: the limit was not tested"
    );
    eprintln!("{MEMORY_MIB} MiB allowed: {within} MiB; no limit: {beyond} MiB");
}
