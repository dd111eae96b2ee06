//! Imports that are streamed in chunks.

use super::blocks::{attributes, block, character, inputs, version, world};
use super::{World, name, row};
use crate::{
    BlockAttributes, CatalogError, ImportChunk, ImportRow, ImportTerms, InputVersion,
    InputVersions, SameContents, SameFiles,
};
use mocban_core::domain::{PairId, Stage};

#[tokio::test]
async fn an_import_without_an_end_stores_nothing() {
    let world = World::new(1).await;
    let (sender, chunks) = tokio::sync::mpsc::channel(1);
    let rows = ImportChunk::Rows(vec![row("q0"), row("q1")]);
    sender.try_send(rows).expect("room for one");
    drop(sender);
    let outcome = world
        .catalog
        .import_all(chunks, ImportTerms::default(), 1)
        .await;
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
    let imported = world
        .catalog
        .import_all(chunks, ImportTerms::default(), 1)
        .await;
    let (summary, truths) = imported.expect("imported");
    assert_eq!((summary.added, summary.unchanged, truths), (2, 0, 0));
    assert_eq!(summary.changed[0].name, name("p0"));
    assert_eq!(summary.changed[0].fields, ["mesh"]);
    world.assert_counters().await;
}

#[tokio::test]
async fn a_pair_with_another_path_is_counted_until_its_file_is_read() {
    let world = World::new(2).await;
    world.finish_one().await;
    let other_files = async || {
        let status = world.catalog.status(&super::fingerprints([1; 4])).await;
        status.expect("a read").other_files
    };
    let mut moved = row("p0");
    moved.mesh_path = "elsewhere.stl".to_owned();
    let mut renamed = row("p1");
    renamed.character = Some("二".to_owned());
    for (expected, count) in [(1, 1), (0, 1)] {
        let rows = vec![moved.clone(), renamed.clone()];
        let summary = world.catalog.import(rows, 2).await.expect("imported");
        assert_eq!(summary.other_files, expected);
        assert_eq!(other_files().await, count);
    }
    let inputs = vec![(PairId(1), super::inputs(Stage::Normalize))];
    world.catalog.store_inputs(inputs).await.expect("stored");
    assert_eq!(other_files().await, 0);
    world.assert_counters().await;
}

#[tokio::test]
async fn a_block_with_another_path_is_counted_until_its_file_is_read() {
    let world = world().await;
    let other_files = async || {
        let states = world.catalog.block_states().await.expect("a read");
        states.iter().filter(|state| state.other_files).count()
    };
    let mut moved = attributes("b");
    moved.page_path = "elsewhere.png".to_owned();
    let unread = world.catalog.import_blocks(vec![moved], false, 1).await;
    assert_eq!(unread.expect("imported").other_files, 1);
    assert_eq!(other_files().await, 0, "the block is not done");
    world.finish_block(Vec::new()).await;
    for (expected, count) in [(1, 1), (0, 1)] {
        let moved = world
            .catalog
            .import_blocks(vec![attributes("b")], false, 2)
            .await;
        assert_eq!(moved.expect("imported").other_files, expected);
        assert_eq!(other_files().await, count);
    }
    let known = world.catalog.known_blocks().await.expect("a read");
    let read = vec![(known[0].block, inputs(["mesh", "page", "labels"]))];
    let stored = world.catalog.store_block_inputs(read).await;
    stored.expect("stored");
    assert_eq!(other_files().await, 0);
}

#[tokio::test]
async fn a_restored_pair_has_other_files_only_if_a_list_named_them() {
    let world = World::new(2).await;
    world.finish_one().await;
    let mut changed = super::inputs(Stage::Normalize);
    changed.mesh = Some(super::blocks::version("other bytes"));
    let inputs = vec![(PairId(1), changed)];
    world.catalog.store_inputs(inputs).await.expect("stored");
    let other_files = async || {
        let status = world.catalog.status(&super::fingerprints([1; 4])).await;
        status.expect("a read").other_files
    };
    let restore = async || {
        let keep = |path: &str| Some(path.to_owned());
        let kept = world.catalog.replace_input_paths(keep).await;
        assert_eq!(kept.expect("replaced"), [""; 0]);
        let known = world.catalog.known_inputs(None, 1, None).await;
        known.expect("a page")[0].mesh.clone().expect("a mesh").stat
    };
    assert_eq!(
        (restore().await.as_str(), other_files().await),
        ("restored", 0)
    );
    let mut moved = row("p0");
    moved.mesh_path = "elsewhere.stl".to_owned();
    world
        .catalog
        .import(vec![moved], 2)
        .await
        .expect("imported");
    assert_eq!((restore().await.as_str(), other_files().await), ("", 1));
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
        .import_blocks(vec![attributes("B1")], false, 1)
        .await
        .expect("a new name");
    let refused = catalog
        .import_blocks(vec![attributes("b1")], false, 2)
        .await;
    let text = refused.expect_err("the same name").to_string();
    assert!(
        text.starts_with("block b1 differs from block B1 only in"),
        "{text}"
    );
    assert_eq!(catalog.block_names().await.expect("names"), [block("B1")]);
}

#[tokio::test]
async fn an_import_that_gives_most_known_pairs_other_files_is_refused_unless_asked_for() {
    let world = World::new(0).await;
    let catalog = &world.catalog;
    let rows = |folder: &str, ids: std::ops::Range<usize>| {
        let row = |k: usize| row_with(&k.to_string(), &format!("{folder}/{k}"));
        ids.map(row).collect::<Vec<_>>()
    };
    catalog
        .import(rows("b1", 1..9), 1)
        .await
        .expect("new pairs");
    let refused = catalog
        .import(rows("b2", 3..12), 2)
        .await
        .expect_err("other files");
    let text = refused.to_string();
    assert!(
        text.starts_with("6 of the 6 pairs in it that the project has would get another mesh and another print, such as 3:"),
        "{text}"
    );
    // A few corrections among many, and one other file each, are changes.
    let mut few = rows("b1", 1..9);
    few.splice(0..4, rows("b2", 1..5));
    assert_eq!(
        catalog
            .import(few, 3)
            .await
            .expect("four of eight")
            .changed
            .len(),
        4
    );
    let mut prints = rows("b1", 1..9);
    for row in &mut prints {
        row.print_path += ".tif";
    }
    assert_eq!(
        catalog
            .import(prints, 4)
            .await
            .expect("other prints")
            .changed
            .len(),
        8
    );
    let (sender, chunks) = tokio::sync::mpsc::channel(2);
    for chunk in [ImportChunk::Rows(rows("moved", 1..9)), ImportChunk::End] {
        sender.try_send(chunk).expect("room");
    }
    let terms = ImportTerms {
        changed_files: true,
        ..ImportTerms::default()
    };
    let (summary, _) = catalog
        .import_all(chunks, terms, 5)
        .await
        .expect("asked for");
    assert_eq!(summary.changed.len(), 8);
    world.assert_counters().await;
}

#[tokio::test]
async fn a_block_with_another_scan_and_another_page_is_refused_unless_asked_for() {
    let world = World::new(0).await;
    let catalog = &world.catalog;
    catalog
        .import_blocks(vec![attributes("scan")], false, 1)
        .await
        .expect("new");
    let mut other = attributes("scan");
    other.mesh_path = "b2/scan.stl".to_owned();
    catalog
        .import_blocks(vec![other.clone()], false, 2)
        .await
        .expect("another scan");
    other.mesh_path = "b3/scan.stl".to_owned();
    other.page_path = "b3/scan.png".to_owned();
    let refused = catalog.import_blocks(vec![other.clone()], false, 3).await;
    let text = refused.expect_err("other files").to_string();
    assert!(
        text.starts_with("1 of the 1 blocks in it that the project has would get another scan and another page, such as scan:"),
        "{text}"
    );
    let changed = catalog.import_blocks(vec![other], true, 4).await;
    assert_eq!(changed.expect("asked for").changed.len(), 1);
}

#[tokio::test]
async fn a_path_that_is_written_differently_is_the_same_file() {
    let world = World::new(2).await;
    let other = |id: &str| {
        let mut other = row(id);
        other.mesh_path = format!("lists/../{id}.stl");
        other.print_path = format!("./{id}.png");
        other
    };
    let rows = vec![other("p0"), other("p1")];
    let summary = world.catalog.import(rows, 2).await.expect("imported");
    assert_eq!((summary.unchanged, summary.other_files), (2, 0));
    assert!(summary.changed.is_empty(), "{summary:?}");
    world.assert_counters().await;
    let blocks = super::blocks::world().await;
    let mut other = attributes("b");
    for path in [&mut other.mesh_path, &mut other.page_path] {
        path.insert_str(0, "lists/../");
    }
    other.labels_path = Some("x/./../b.json".to_owned());
    let summary = blocks.catalog.import_blocks(vec![other], false, 2).await;
    let summary = summary.expect("imported");
    assert_eq!((summary.unchanged, summary.other_files), (1, 0));
}

#[tokio::test]
async fn new_pairs_and_blocks_with_the_files_of_earlier_ones_are_counted() {
    let world = World::new(2).await;
    let again = |id: &str, known: &str| ImportRow {
        name: name(id),
        ..row(known)
    };
    let import = async |rows: Vec<ImportRow>| {
        let summary = world.catalog.import(rows, 2).await.expect("imported");
        summary.same_files
    };
    assert_eq!(import(vec![row("p0"), row("q")]).await, None);
    let same = |id: &str, known: &str, count: u64| {
        Some(SameFiles {
            id: id.to_owned(),
            known: known.to_owned(),
            count,
        })
    };
    let rows = vec![again("a", "p1"), row("r"), again("b", "q")];
    assert_eq!(import(rows).await, same("a", "p1", 2));
    // What is in no count is not counted twice.
    world.retire("p0", 3).await;
    assert_eq!(import(vec![again("c", "p0")]).await, None);
    let blocks = super::blocks::world().await;
    let again = BlockAttributes {
        name: block("c"),
        ..attributes("b")
    };
    let summary = blocks
        .catalog
        .import_blocks(vec![attributes("b"), again], false, 2)
        .await;
    assert_eq!(summary.expect("imported").same_files, same("c", "b", 1));
}

#[tokio::test]
async fn pairs_and_blocks_with_the_contents_of_earlier_ones_are_counted_after_they_were_read() {
    let world = World::new(6).await;
    let same = async || world.catalog.same_contents().await.expect("a read");
    assert_eq!(same().await, SameContents::default());
    let read = [
        (version("mesh"), version("print")),
        (version("mesh"), version("another")),
        (InputVersion::gone(), InputVersion::gone()),
        (InputVersion::gone(), InputVersion::gone()),
        (version("mesh"), version("print")),
        (version("mesh"), version("print")),
    ];
    let read = (1..).zip(read).map(|(pair, (mesh, print))| {
        let inputs = InputVersions {
            mesh: Some(mesh),
            print: Some(print),
        };
        (PairId(pair), inputs)
    });
    let stored = world.catalog.store_inputs(read.collect()).await;
    stored.expect("stored");
    let found = |id: &str, count: u64| {
        Some(SameFiles {
            id: id.to_owned(),
            known: "p0".to_owned(),
            count,
        })
    };
    assert_eq!(same().await.pairs, found("p4", 2));
    // A copy that is in no count is no longer counted.
    world.retire("p4", 3).await;
    assert_eq!(same().await.pairs, found("p5", 1));

    let blocks = super::blocks::world().await;
    let again = BlockAttributes {
        name: block("c"),
        ..attributes("b")
    };
    let imported = blocks.catalog.import_blocks(vec![again], false, 2).await;
    imported.expect("imported");
    let known = blocks.catalog.known_blocks().await.expect("a read");
    let read = known
        .iter()
        .map(|known| (known.block, inputs(["mesh", "page", "labels"])));
    let stored = blocks.catalog.store_block_inputs(read.collect()).await;
    stored.expect("stored");
    let same = async || blocks.catalog.same_contents().await.expect("a read");
    let sentence = "blocks with the same scan and page as an earlier one: 1, first c, as b; `retire` takes a copy out of every count";
    assert_eq!(same().await.sentences(), [sentence]);
    for content in ["1", "2"] {
        let cut = vec![character("x", content)];
        assert_eq!(
            blocks.finish_block(cut).await,
            super::blocks::stored(1, 0, 0, 0)
        );
    }
    assert_eq!(same().await.sentences(), [sentence]);
    blocks.retire("c_x", 3).await;
    assert_eq!(same().await, SameContents::default());
}
