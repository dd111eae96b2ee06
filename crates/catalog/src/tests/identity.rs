//! The identity of a catalog, by which it owns a place of artifacts, and its workers, which a restored copy does not have.

use super::{CatalogPlace, World};
use crate::Catalog;
use mocban_core::domain::{ArtifactRef, ContentHash, Stage};

#[tokio::test]
async fn a_catalog_keeps_its_identity_and_a_copy_has_one_of_its_own() {
    let world = World::new(1).await;
    let identity = world.catalog.identity().await.expect("an identity");
    assert_eq!(identity.id.len(), 32);
    let again = world.place.open().await.expect("a catalog");
    assert_eq!(again.identity().await.expect("an identity"), identity);
    let target = CatalogPlace::new();
    let copy = target.create().await.expect("a catalog");
    let copied = world.catalog.copy_to(&copy, |_, _| {}).await;
    copied.expect("copied");
    let other = copy.identity().await.expect("an identity");
    assert_ne!(other.id, identity.id);
    assert!(!other.is_same_place(&identity), "{other:?} {identity:?}");
}

#[tokio::test]
async fn a_restored_backup_has_an_identity_of_its_own() {
    let world = World::new(1).await;
    let dir = tempfile::tempdir().expect("a temporary directory");
    let [backup, restored] = ["b.sqlite", "catalog.sqlite"].map(|name| dir.path().join(name));
    let saved = world.catalog.back_up(&backup, None).await;
    saved.expect("a backup");
    let settings = Catalog::restore_backup(&backup, &restored).await;
    assert!(settings.expect("restored").is_none());
    let restored = Catalog::open(&restored).await.expect("a catalog");
    let original = world.catalog.identity().await.expect("an identity");
    let other = restored.identity().await.expect("an identity");
    assert_ne!(other.id, original.id);
}

#[tokio::test]
async fn a_backup_during_a_run_is_restored_without_its_workers() {
    let world = World::new(1).await;
    assert_eq!(world.claim(1).await.len(), 1);
    let dir = tempfile::tempdir().expect("a temporary directory");
    let [backup, restored] = ["b.sqlite", "catalog.sqlite"].map(|name| dir.path().join(name));
    let saved = world.catalog.back_up(&backup, None).await;
    saved.expect("a backup");
    let settings = Catalog::restore_backup(&backup, &restored).await;
    settings.expect("restored");
    let restored = Catalog::open(&restored).await.expect("a catalog");
    let last = restored.last_worker().await.expect("read");
    let last = last.expect("the worker of the run");
    assert_eq!(last.ended, Some(last.heartbeat), "it was not killed");
    assert_eq!(last.leased, 1, "the next run takes the pair back");
    let original = world.catalog.last_worker().await.expect("read");
    assert_eq!(original.expect("a worker").ended, None);
}

#[tokio::test]
async fn artifacts_of_the_first_results_are_known() {
    let world = World::new(1).await;
    let found = world.catalog.first_artifacts(1).await.expect("read");
    assert!(found.is_empty());
    let lease = world.claim(1).await.remove(0);
    let mut stage = world.done(Stage::Fit);
    let artifact = ArtifactRef {
        hash: ContentHash::of(b"depth"),
        ext: "png".to_owned(),
        bytes: 5,
        pack: None,
    };
    stage.files.insert("depth.png".to_owned(), artifact.clone());
    let stored = world.catalog.checkpoint_now(lease, stage).await;
    stored.expect("stored");
    let found = world.catalog.first_artifacts(1).await.expect("read");
    assert_eq!(found, [artifact]);
}
