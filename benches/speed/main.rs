//! How long each reader, each stage and a whole pair take, by the size of the scan.
//!
//! ```text
//! cargo bench --bench speed
//! cargo bench --bench speed -- stages/fit
//! cargo bench --bench speed -- --save-baseline before
//! ```
//!
//! The scans are those of `mocban demo` in the tier `pose`, one a size, kept as files under `target/tmp/speed`, where
//! other programs can be given the same (`benches/peers`). One thread, in memory: files are read before the clock starts,
//! but for `read/raw`. `cargo test --all-targets` runs each once on the smallest, to see that the program works.

mod files;
mod readers;
mod scores;
mod stages;

use std::time::Duration;

use criterion::Criterion;

use files::Files;

/// About how many vertices the scans have, corners that triangles share counted once.
const SIZES: [(&str, u32); 3] = [("60k", 54_100), ("500k", 480_000), ("2M", 1_950_000)];

fn main() -> anyhow::Result<()> {
    // Without `--bench`, as `cargo test` calls it, everything runs once.
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
        let files = Files::kept(name, *vertices)?;
        readers::measure(&mut criterion, &files)?;
        stages::measure(&mut criterion, &files)?;
    }
    scores::measure(&mut criterion);
    criterion.final_summary();
    Ok(())
}
