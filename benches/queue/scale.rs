//! Measures how the cost of queries grows with the number of pairs.

use std::io::Write as _;

use mocban::catalog::{Catalog, Fingerprints, RerunPolicy};

use super::claims::{self, MANY};
use super::fill;
use super::markdown::{Table, number};
use super::options::Options;
use super::process::{self, ProcessUsage};
use super::spread::Spread;
use super::world::{World, fingerprints, work};

/// Pairs that are left when most are done.
const LEFT: usize = 1_000;
/// Largest number of pairs of a catalog that are run. All further pairs get copies of the rows of a pair that ran.
const WORKED: usize = 20_000;
/// Pairs in progress while a catalog is filled.
const IN_PROGRESS: usize = 128;
/// A setting of the last stage that is not the default.
const OTHER: &str = "register.smoothing_px=1.3";

const IMPORT_NOTE: &str = "\
The whole process, from reading the list to the closed catalog. MiB: peak memory of the process.";
const FILL_NOTE: &str = "\
A pair is one claim and four checkpoints with four metrics, through the writer at synchronous=FULL, with 128 pairs in \
progress. At most 20,000 pairs are run in a catalog of the given size; the others get copies of their rows. MiB: peak \
memory meanwhile; the catalog's size is measured at the end.";
const CLAIM_NOTE: &str = "\
Milliseconds until a claim is stored and answered, median / 95th percentile of 200.";
const ASK_NOTE: &str = "\
Milliseconds, median / 95th percentile. Library: the query alone, on an open catalog. Process: the program from start to \
end; `run --dry-run` also compares every input file. MiB: peak memory of the process. Changed: a setting of the last \
stage differs from the stored results.";

/// The tables, in the order they are printed.
struct Tables {
    import: Table,
    fill: Table,
    claims: Table,
    queries: Table,
}

/// Measures catalogs of the configured sizes; returns the tables as text.
pub(super) async fn tables(options: &Options) -> anyhow::Result<Vec<String>> {
    let mut tables = Tables::new();
    for pairs in options.sizes() {
        size(options, pairs, &mut tables).await?;
    }
    Ok(vec![
        tables.import.render(IMPORT_NOTE),
        tables.fill.render(FILL_NOTE),
        tables.claims.render(CLAIM_NOTE),
        tables.queries.render(ASK_NOTE),
    ])
}

impl Tables {
    fn new() -> Self {
        let queries = ["pairs", "state", "what", "library", "process", "MiB"];
        let claims = ["pairs", "state", "one pair", "64 pairs"];
        let fill = ["pairs", "pairs/s", "jobs/s", "MiB", "catalog, MiB"];
        Self {
            import: Table::new("Import", &["pairs", "seconds", "rows/s", "MiB"]),
            fill: Table::new("Run with stages that compute nothing", &fill),
            claims: Table::new("Claim", &claims),
            queries: Table::new("Queries", &queries),
        }
    }
}

async fn size(options: &Options, pairs: usize, tables: &mut Tables) -> anyhow::Result<()> {
    let (world, needed) = World::import(pairs)?;
    let seconds = needed.time.as_secs_f64();
    let numbers = [(seconds, 2), (pairs as f64 / seconds, 0), (needed.mib, 0)];
    push(&mut tables.import, row(pairs, &numbers));
    let catalog = world.catalog().await?;
    at(options, &world, &catalog, pairs, "new", tables).await?;
    if options.import_only {
        catalog.close().await;
        return Ok(());
    }
    process::reset_peak();
    let (catalog, [rate, peak]) = filled(&world, catalog, pairs, WORKED).await?;
    let size = world.bytes()? as f64 / 1_048_576.0;
    let numbers = [(rate, 0), (rate * 4.0, 0), (peak, 0), (size, 0)];
    push(&mut tables.fill, row(pairs, &numbers));
    at(options, &world, &catalog, pairs, "mostly done", tables).await?;
    changed(&world, &catalog, pairs, tables).await?;
    catalog.close().await;
    Ok(())
}

/// Runs at most `worked` pairs of a catalog and copies their rows until few pairs are left. Returns the catalog, the pairs
/// that were run in a second, and the peak memory meanwhile in MiB.
pub(super) async fn filled(
    world: &World,
    catalog: Catalog,
    pairs: usize,
    worked: usize,
) -> anyhow::Result<(Catalog, [f64; 2])> {
    let to_do = pairs - LEFT.min(pairs / 3);
    let worked = to_do.min(worked);
    let time = work(world, &catalog, worked, IN_PROGRESS).await?;
    let peak = process::peak_mib("self").unwrap_or(0.0);
    catalog.close().await;
    fill::copy(&world.project.catalog_path(), worked, to_do).await?;
    let rate = worked as f64 / time.as_secs_f64();
    Ok((world.catalog().await?, [rate, peak]))
}

/// Adds a row to a table and prints it immediately, because large catalogs take long and the bench may be interrupted.
fn push(table: &mut Table, cells: Vec<String>) {
    let _ = writeln!(std::io::stderr(), "{}", cells.join(" | "));
    table.push(cells);
}

fn row(pairs: usize, numbers: &[(f64, usize)]) -> Vec<String> {
    let cells = numbers.iter();
    let cells = cells.map(|(value, decimals)| number(Some(*value), *decimals));
    [pairs.to_string()].into_iter().chain(cells).collect()
}

/// Measures claims and queries in one state of the catalog.
async fn at(
    options: &Options,
    world: &World,
    catalog: &Catalog,
    pairs: usize,
    state: &str,
    tables: &mut Tables,
) -> anyhow::Result<()> {
    if pairs / 3 >= MANY {
        let [one, many] = claims::times(world, catalog).await?;
        let cells = vec![pairs.to_string(), state.to_owned(), one, many];
        push(&mut tables.claims, cells);
    }
    let now = fingerprints(None)?;
    let mut asked = |what: &str, (library, process): (Spread, (Spread, f64))| {
        let cells = line(pairs, state, what, library, process);
        push(&mut tables.queries, cells);
    };
    asked("status", status(world, catalog, &now, &["status"]).await?);
    let plan = plan(world, catalog, &now, &["run", "--dry-run"]).await?;
    asked("run --dry-run", plan);
    if pairs <= options.check_up_to {
        let check = time_command(world, &["check", "--quick"], 1)?;
        asked("check --quick", (Spread::default(), check));
    }
    Ok(())
}

/// Measures queries after a changed setting has made every completed pair stale.
async fn changed(
    world: &World,
    catalog: &Catalog,
    pairs: usize,
    tables: &mut Tables,
) -> anyhow::Result<()> {
    let now = fingerprints(Some(OTHER))?;
    let (library, process) = status(world, catalog, &now, &["--set", OTHER, "status"]).await?;
    let asked = line(pairs, "changed", "status", library, process);
    push(&mut tables.queries, asked);
    let args = ["--set", OTHER, "run", "--dry-run"];
    let (library, process) = plan(world, catalog, &now, &args).await?;
    let asked = line(pairs, "changed", "run --dry-run", library, process);
    push(&mut tables.queries, asked);
    Ok(())
}

fn line(
    pairs: usize,
    state: &str,
    what: &str,
    mut library: Spread,
    (mut process, mib): (Spread, f64),
) -> Vec<String> {
    let words = [pairs.to_string(), state.to_owned(), what.to_owned()];
    let numbers = [library.cell(), process.cell(), number(Some(mib), 0)];
    words.into_iter().chain(numbers).collect()
}

async fn status(
    world: &World,
    catalog: &Catalog,
    now: &Fingerprints,
    args: &[&str],
) -> anyhow::Result<(Spread, (Spread, f64))> {
    let library = Spread::of(20, async || catalog.status(now).await).await?;
    Ok((library, time_command(world, args, 10)?))
}

async fn plan(
    world: &World,
    catalog: &Catalog,
    now: &Fingerprints,
    args: &[&str],
) -> anyhow::Result<(Spread, (Spread, f64))> {
    let plan = async || catalog.plan(now, None, RerunPolicy::Changed).await;
    Ok((Spread::of(3, plan).await?, time_command(world, args, 1)?))
}

/// Returns times and peak memory of the program for a command.
fn time_command(world: &World, args: &[&str], times: usize) -> anyhow::Result<(Spread, f64)> {
    let (mut spread, mut mib) = (Spread::default(), 0.0_f64);
    for _ in 0..times {
        let ProcessUsage {
            time, mib: held, ..
        } = world.run(args)?;
        spread.add(time);
        mib = mib.max(held);
    }
    Ok((spread, mib))
}
