//! Settings of blocks that all workers of a run use.

use super::blocks::{settings, world};
use crate::{SharedSettings, WorkerSettings};

/// Only a catalog that several machines share holds the settings of a run.
#[tokio::test]
async fn a_worker_with_other_settings_of_blocks_is_refused_and_gets_no_block() {
    let world = world().await;
    if !world.catalog.is_shared() {
        return;
    }
    let with = |revision| WorkerSettings {
        fingerprints: world.fingerprints,
        blocks: settings(revision),
    };
    let (planned, other) = (with([1; 4]), with([1, 1, 2, 1]));
    let set = |settings: &WorkerSettings| world.catalog.set_run_settings(settings.clone());
    assert_eq!(set(&planned).await.expect("set"), SharedSettings::Same);
    let compared = world.catalog.compare_run_settings(&other).await;
    let SharedSettings::Other(changes) = compared.expect("compared") else {
        panic!("the settings differ");
    };
    let changes: Vec<String> = changes.iter().map(ToString::to_string).collect();
    assert_eq!(changes, ["boxes.revision: 1 -> 2"]);
    let leased = world.leased_block().await;
    let refused = set(&other).await.expect("compared");
    assert!(matches!(refused, SharedSettings::Other(_)), "{refused:?}");
    world
        .catalog
        .release_block(leased.0)
        .await
        .expect("released");
    assert_eq!(set(&other).await.expect("set"), SharedSettings::Same);
    assert!(world.claim_block(world.worker).await.is_none());
}
