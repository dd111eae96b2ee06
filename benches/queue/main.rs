//! Times the catalog on many pairs: import, status, claims, checkpoints, plan, check and memory, compared with other
//! queues.
//!
//! ```text
//! cargo bench --bench queue
//! cargo bench --bench queue -- --pairs 10000,100000,1000000 --queue-pairs 5000
//! cargo build --release --manifest-path benches/peers-queue/Cargo.toml --target-dir target/peers-queue
//! cargo bench --bench queue -- --postgres postgres://me@localhost/bench --pairs 1000000
//! cargo bench --bench queue -- --postgres postgres://me@localhost/bench --pairs 300000 --hold-snapshot
//! cargo bench --bench queue -- --peer target/peers-queue/release/peers-queue
//! cargo bench --bench queue -- --pages --pairs 1000000
//! ```
//!
//! Catalogs are created in the target directory and removed afterwards. Stages are faked: they compute nothing, and
//! store the same rows as a run, with small outcomes and no artifacts. The catalog's writer runs at `synchronous=FULL`.
//! The tables say where the program is timed as a separate process. They are Markdown on standard output. `cargo test
//! --all-targets` runs a few pairs as a smoke test.

mod baseline;
mod claims;
mod fake;
mod fill;
mod loops;
#[path = "../accuracy/markdown.rs"]
mod markdown;
mod options;
mod pages;
mod postgres;
mod process;
mod queues;
mod scale;
mod share;
mod snapshot;
mod spread;
mod world;

use std::io::Write as _;

use clap::Parser as _;

use options::Options;

fn main() -> anyhow::Result<()> {
    let options = Options::parse();
    if let Some(url) = &options.postgres {
        // Several connections are used at the same time.
        let runtime = tokio::runtime::Runtime::new()?;
        let text = if options.hold_snapshot {
            runtime.block_on(snapshot::table(&options, url))?
        } else {
            runtime.block_on(postgres::table(&options, url))?
        };
        return Ok(std::io::stdout().write_all(text.as_bytes())?);
    }
    // The same runtime as for `mocban run`.
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = runtime.enable_all().build()?;
    if options.pages {
        let text = runtime.block_on(pages::table(&options))?;
        return Ok(std::io::stdout().write_all(text.as_bytes())?);
    }
    let mut tables = runtime.block_on(scale::tables(&options))?;
    tables.push(runtime.block_on(queues::table(&options))?);
    if let Some(pairs) = options.real_pairs() {
        tables.push(runtime.block_on(share::table(&options, pairs))?);
    }
    let text = tables.join("\n");
    Ok(std::io::stdout().write_all(text.as_bytes())?)
}
