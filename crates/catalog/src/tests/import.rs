//! Imports that are streamed in chunks.

use super::{World, name, row};
use crate::{CatalogError, ImportChunk};

#[tokio::test]
async fn an_import_without_an_end_stores_nothing() {
    let world = World::new(1).await;
    let (sender, chunks) = tokio::sync::mpsc::channel(1);
    let rows = ImportChunk::Rows(vec![row("q0"), row("q1")]);
    sender.try_send(rows).expect("room for one");
    drop(sender);
    let outcome = world.catalog.import_all(chunks, Vec::new(), 1).await;
    assert!(
        matches!(outcome, Err(CatalogError::CutShort)),
        "{outcome:?}"
    );
    let names = world.catalog.pair_names().await.expect("names");
    assert_eq!(names, [name("p0")]);
    world.assert_counters().await;
}

#[tokio::test]
async fn chunks_of_an_import_are_counted_together() {
    let world = World::new(1).await;
    let (sender, chunks) = tokio::sync::mpsc::channel(3);
    let mut other = row("p0");
    other.mesh_path = "other.stl".to_owned();
    for chunk in [vec![row("q0")], vec![other, row("q1")]] {
        sender.try_send(ImportChunk::Rows(chunk)).expect("room");
    }
    sender.try_send(ImportChunk::End).expect("room");
    let imported = world.catalog.import_all(chunks, Vec::new(), 1).await;
    let (summary, truths) = imported.expect("imported");
    assert_eq!((summary.added, summary.unchanged, truths), (2, 0, 0));
    assert_eq!(summary.changed[0].name, name("p0"));
    assert_eq!(summary.changed[0].fields, ["mesh"]);
    world.assert_counters().await;
}
