//! Times scores and PNG files of canvases.

use criterion::{BenchmarkId, Criterion};
use mocban::raster::{Grid, Mask, png_grey16};
use mocban::stages::score::{SsimReference, SsimWindow, score_masks};

/// Sides of the canvases.
const SIDES: [usize; 3] = [256, 512, 1024];

pub(super) fn measure(criterion: &mut Criterion) {
    let mut ssim = criterion.benchmark_group("scores");
    for side in SIDES {
        let print = SsimReference::new(&rings(side, 0.0), SsimWindow::Gaussian);
        let depth = rings(side, 0.4);
        ssim.bench_function(BenchmarkId::from_parameter(side), |b| {
            b.iter(|| score_masks(&print, &depth));
        });
    }
    ssim.finish();
    let mut png = criterion.benchmark_group("png_grey16");
    for side in SIDES {
        let heights = Grid::from_fn(side, side, |x, y| {
            let wave = (x as f64 * 0.05).sin() * (y as f64 * 0.07).cos();
            (32_768.0 + 20_000.0 * wave) as u16 + ((x * 7 + y * 13) % 40) as u16
        });
        png.bench_function(BenchmarkId::from_parameter(side), |b| {
            b.iter(|| png_grey16(&heights));
        });
    }
    png.finish();
}

/// Draws rings about as wide as strokes, moved to the right by `shift` times the width of a ring.
fn rings(side: usize, shift: f64) -> Mask {
    let width = side as f64 / 14.0;
    Mask::from_fn(side, side, |x, y| {
        let middle = side as f64 / 2.0;
        let radius = (x as f64 - middle - shift * width).hypot(y as f64 - middle);
        ((radius / width) as usize).is_multiple_of(2)
    })
}
