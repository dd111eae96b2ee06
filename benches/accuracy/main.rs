//! Accuracy and speed of the four stages on generated pairs with ground truth.
//!
//! ```text
//! cargo bench --bench accuracy
//! cargo bench --bench accuracy -- --tiers pose,hard --pairs 587 --seeds 7 --presets default,paper
//! cargo bench --bench accuracy -- --set register.window=uniform7 --worst 50 --sheets sheets --pairs-csv pairs.csv
//! cargo bench --bench accuracy -- --decoys
//! cargo bench --bench accuracy -- --tiers all --pairs 20
//! cargo bench --bench accuracy -- --tiers pose,hard --print-px 12
//! cargo bench --bench accuracy -- --fit-confidence --seeds 11,12 --held-out-seeds 13
//! cargo bench --bench accuracy -- --vertices 60000 --workers 1
//! ```
//!
//! The pairs equal those of `mocban demo`. They are generated in memory from tier, seed and index, and passed to the
//! stages as a binary STL and an image file. Unit and carved side are not given, which makes the task harder. The
//! tables are Markdown on standard output. `cargo test --all-targets` runs one pair per tier as a smoke test.

mod accuracy;
mod case;
mod certainty;
#[path = "../../tests/support/decoy.rs"]
mod decoy;
mod decoys;
mod fit_confidence;
mod kinds;
mod lines;
mod markdown;
mod method;
mod numbers;
mod options;
mod reliability;
mod run;
mod sheet;
mod small_print;
mod speed;
mod times;
mod trial;
mod workers;

use std::io::Write as _;

use clap::Parser as _;

use options::Options;

fn main() -> anyhow::Result<()> {
    let options = Options::parse().with_every_tier();
    let (methods, cases) = (options.methods()?, options.cases());
    if options.fit_confidence {
        let texts = methods
            .iter()
            .map(|method| fit_confidence::report(&options, method));
        let text = texts.collect::<anyhow::Result<Vec<_>>>()?.join("\n");
        return Ok(std::io::stdout().write_all(text.as_bytes())?);
    }
    let trials = trial::all(&cases, &methods, options.workers)?;
    let mut tables = vec![
        accuracy::table(&options.tiers, &methods, &trials),
        speed::table(&options.tiers, &methods, &trials),
    ];
    tables.extend(certainty::table(&options.tiers, &methods, &trials));
    tables.extend([
        kinds::table(&options.tiers, &methods, &trials, options.metric),
        reliability::tables(&methods, &trials),
    ]);
    let mut answers = Vec::new();
    if options.decoys {
        answers = decoys::all(&cases, &methods, &options)?;
        tables.push(decoys::table(&options, &methods, &trials, &answers));
    }
    if let Some(path) = &options.pairs_csv {
        lines::write(path, &trials, &answers)?;
    }
    if let Some(dir) = &options.sheets {
        sheet::write(dir, &options, &methods, &trials)?;
    }
    let text = tables.join("\n");
    Ok(std::io::stdout().write_all(text.as_bytes())?)
}
