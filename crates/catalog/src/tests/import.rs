//! Imports that are streamed in chunks.

use super::blocks::{attributes, block};
use super::{World, name, row};
use crate::{CatalogError, ImportChunk, ImportRow};

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

/// Returns a row with files of its own.
fn row_with(id: &str, files: &str) -> ImportRow {
    ImportRow {
        mesh_path: format!("{files}.stl"),
        print_path: format!("{files}.png"),
        ..row(id)
    }
}

#[tokio::test]
async fn a_new_pair_whose_name_differs_from_a_known_one_only_in_case_is_refused() {
    let world = World::new(0).await;
    let known = ["A1", "đĩa 7", "a01"].map(|id| row_with(id, id)).to_vec();
    world
        .catalog
        .import(known.clone(), 1)
        .await
        .expect("new names");
    for (id, expected) in [
        (
            "a1",
            "pair a1 differs from pair A1 only in upper and lower case",
        ),
        (
            "Đĩa 7",
            "pair Đĩa 7 differs from pair đĩa 7 only in upper and lower case",
        ),
        (
            "A01",
            "pair A01 differs from pair a01 only in upper and lower case",
        ),
    ] {
        let rows = vec![row_with("b", "b"), row_with(id, "c")];
        let refused = world.catalog.import(rows, 2).await.expect_err(id);
        assert!(refused.to_string().starts_with(expected), "{refused}");
    }
    let again = world
        .catalog
        .import(known, 3)
        .await
        .expect("the same names");
    assert_eq!((again.added, again.unchanged), (0, 3));
    assert_eq!(world.catalog.pair_names().await.expect("names").len(), 3);
    world.assert_counters().await;
}

#[tokio::test]
async fn a_pair_that_lost_the_zeros_of_its_name_is_refused_with_its_name() {
    let world = World::new(0).await;
    let known = vec![row_with("0117", "stl/117"), row_with("0118", "stl/118")];
    world.catalog.import(known, 1).await.expect("new names");
    let refused = world
        .catalog
        .import(vec![row_with("117", "stl/117")], 2)
        .await;
    let text = refused.expect_err("the same files").to_string();
    assert!(
        text.starts_with("pair 117 has the mesh and the print of pair 0117,"),
        "{text}"
    );
    assert!(text.ends_with("write the id as 0117"), "{text}");
    // Other files make another pair.
    let added = world
        .catalog
        .import(vec![row_with("118", "b2/118")], 3)
        .await;
    assert_eq!(added.expect("another pair").added, 1);
}

#[tokio::test]
async fn a_block_whose_name_differs_only_in_case_is_refused() {
    let world = World::new(0).await;
    let catalog = &world.catalog;
    catalog
        .import_blocks(vec![attributes("B1")], 1)
        .await
        .expect("a new name");
    let refused = catalog.import_blocks(vec![attributes("b1")], 2).await;
    let text = refused.expect_err("the same name").to_string();
    assert!(
        text.starts_with("block b1 differs from block B1 only in"),
        "{text}"
    );
    assert_eq!(catalog.block_names().await.expect("names"), [block("B1")]);
}
