//! Times claims.

use std::time::Instant;

use mocban::catalog::Catalog;

use super::fake::Fake;
use super::spread::Spread;
use super::world::{World, fingerprints};

/// Pairs in a large claim.
pub(super) const MANY: usize = 64;
/// Number of claims that are measured.
const TIMES: usize = 200;

/// Measures claims of one pair and of [`MANY`] pairs, each until the claim is stored and answered. Releases all leases.
pub(super) async fn times(world: &World, catalog: &Catalog) -> anyhow::Result<[String; 2]> {
    let fake = Fake::register(&world.project, catalog, &fingerprints(None)?).await?;
    let mut cells = [String::new(), String::new()];
    for (cell, slots) in cells.iter_mut().zip([1, MANY]) {
        let mut spread = Spread::default();
        for _ in 0..TIMES {
            let start = Instant::now();
            let leases = catalog.claim(fake.request(slots)).await?;
            spread.since(start);
            anyhow::ensure!(leases.len() == slots, "{} pairs ready", leases.len());
            for lease in leases {
                catalog.release(lease).await?;
            }
        }
        *cell = spread.cell();
    }
    catalog.end_worker(fake.worker, 2, None).await?;
    Ok(cells)
}
