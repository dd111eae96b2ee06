//! Writes the built-in dataset: `write_demo DIR TIER PAIRS SEED`.

use std::path::Path;

use mocban::demo::{DemoOptions, write_dataset};

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, dir, tier, pairs, seed] = arguments.as_slice() else {
        anyhow::bail!("usage: write_demo DIR TIER PAIRS SEED");
    };
    let options = DemoOptions {
        pairs: pairs.parse()?,
        seed: seed.parse()?,
        tier: tier.parse().map_err(anyhow::Error::msg)?,
    };
    std::fs::create_dir_all(dir)?;
    write_dataset(Path::new(dir), &options)?;
    Ok(())
}
