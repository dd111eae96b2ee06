//! The other columns of a list of blocks, which no result depends on.

use serde_json::{Value, json};

use super::blocks::{attributes, block, character, world};
use crate::BlockAttributes;

fn with_metadata(meta: &Value) -> BlockAttributes {
    BlockAttributes {
        meta: Some(meta.as_object().cloned().unwrap_or_default()),
        ..attributes("b")
    }
}

#[tokio::test]
async fn metadata_of_a_block_is_stored_updated_and_makes_nothing_stale() {
    let world = world().await;
    world.finish_block(vec![character("a", "a")]).await;
    let import = async |meta: &Value| {
        let rows = vec![with_metadata(meta)];
        let summary = world.catalog.import_blocks(rows, false, 2).await;
        summary.expect("imported")
    };
    let stored = async || {
        let detail = world.catalog.block(&block("b")).await.expect("a read");
        let meta = detail.expect("a block").state.attributes.meta;
        Value::Object(meta.expect("it is read"))
    };
    assert_eq!(stored().await, json!({}));
    let first = json!({ "Triều đại": "Nguyễn", "shelfmark": "R.12" });
    let second = json!({ "shelfmark": "R.13" });
    let steps = [
        (&first, None),
        (&second, Some("\"Triều đại\"")),
        (&Value::Null, Some("\"shelfmark\"")),
    ];
    for (meta, column) in steps {
        let changed = import(meta).await;
        assert_eq!(changed.changed, [(block("b"), vec!["metadata"])]);
        let lost = changed
            .lost
            .columns()
            .map(|(column, lost)| (column, lost.count));
        let expected = column.map(|column| (column, 1));
        assert_eq!(
            lost.collect::<Vec<_>>(),
            expected.into_iter().collect::<Vec<_>>()
        );
        assert_eq!(changed.other_files, 0);
        assert_eq!(import(meta).await.unchanged, 1);
        let expected = meta.as_object().cloned().unwrap_or_default();
        assert_eq!(stored().await, Value::Object(expected.clone()));
        assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
        assert_eq!(world.requeue_blocks([1; 4]).await, []);
        let others = attributes("b");
        let others = world.catalog.import_blocks(vec![others], false, 3).await;
        assert_eq!(others.expect("imported").unchanged, 1);
        assert_eq!(stored().await, Value::Object(expected), "none is given");
    }
    let known = world.catalog.known_blocks().await.expect("a read");
    assert_eq!(known[0].attributes.meta, None, "it is not read");
    let states = world.catalog.block_states().await.expect("a read");
    assert_eq!(states[0].attributes.meta, None, "it is not read");
}

#[tokio::test]
async fn named_blocks_are_read_with_their_metadata() {
    let world = world().await;
    let meta = json!({ "shelfmark": "R.12" });
    world.import_block(with_metadata(&meta)).await;
    let names = [block("b"), block("c")];
    let names: Vec<_> = names.iter().collect();
    let read = world.catalog.block_attributes(&names).await;
    assert_eq!(read.expect("a read"), [with_metadata(&meta)]);
    let mut other = with_metadata(&meta);
    other.mesh_path = format!("./{}", other.mesh_path);
    assert!(other.has_same_scan_and_page(&attributes("b")));
    other.page_path = "other.png".to_owned();
    assert!(!other.has_same_scan_and_page(&attributes("b")));
}
