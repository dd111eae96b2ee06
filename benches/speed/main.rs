//! Times each reader, each stage and a complete pair by the size of the scan.
//!
//! ```text
//! cargo bench --bench speed
//! cargo bench --bench speed -- stages/fit
//! cargo bench --bench speed -- --save-baseline before
//! ```
//!
//! The scans are generated as by `mocban demo` in the tier `pose`, one of each size. They are stored under
//! `target/tmp/speed`, so that `benches/peers` can give them to other programs. Each benchmark uses one thread. Files
//! are read before the clock starts, except in `read/raw` and `read/file`. `cargo test --all-targets` runs each
//! benchmark once on the smallest scan.

mod files;
mod readers;
mod scores;
mod stages;

use std::time::Duration;

use criterion::Criterion;

use files::Files;

/// Approximate numbers of vertices. Corners that triangles share count once.
const SIZES: [(&str, u32); 3] = [("60k", 54_100), ("500k", 480_000), ("2M", 1_950_000)];

fn main() -> anyhow::Result<()> {
    // `cargo test` starts this program without `--bench`: everything runs once.
    let sizes = if std::env::args().any(|arg| arg == "--bench") {
        &SIZES[..]
    } else {
        &SIZES[..1]
    };
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    for (name, vertices) in sizes {
        let files = Files::open_or_generate(name, *vertices)?;
        readers::measure(&mut criterion, &files)?;
        stages::measure(&mut criterion, &files)?;
    }
    scores::measure(&mut criterion);
    criterion.final_summary();
    Ok(())
}
