//! Labels of blocks that are replaced on their page.

use super::blocks::{attributes, block, character, world};
use crate::BlockChange;
use mocban_core::domain::BlockStage;

#[tokio::test]
async fn only_labels_that_the_caller_has_read_are_replaced() {
    let world = world().await;
    let set = async |name: &str, read: Option<&str>, labels: Option<&str>| {
        let name = block(name);
        let set = world.catalog.set_block_labels(&name, read, labels);
        set.await.expect("a reply")
    };
    let stored = async || {
        let states = world.catalog.block_states().await.expect("a read");
        let state = states.into_iter().next().expect("a block");
        state.attributes.labels_path
    };
    let (first, second) = (Some("b.json"), Some("labels/b-1.json"));
    for read in [None, second] {
        let outdated = set("b", read, second).await;
        assert_eq!(outdated, BlockChange::Outdated);
        assert_eq!(stored().await.as_deref(), first);
    }
    assert_eq!(set("c", None, second).await, BlockChange::NoBlock);
    for [read, labels] in [[first, second], [second, None], [None, first]] {
        let stored_now = set("b", read, labels).await;
        assert_eq!(stored_now, BlockChange::Stored);
        assert_eq!(stored().await.as_deref(), labels);
    }
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
}

#[tokio::test]
async fn a_block_without_labels_has_its_boxes_found_again() {
    let world = world().await;
    world.finish_block(vec![character("c1", "1")]).await;
    assert_eq!(world.requeue_blocks([1; 4]).await, []);
    let (name, read) = (block("b"), attributes("b").labels_path);
    let set = world.catalog.set_block_labels(&name, read.as_deref(), None);
    assert_eq!(set.await.expect("a reply"), BlockChange::Stored);
    let stale = world.requeue_blocks([1; 4]).await;
    let stages: Vec<BlockStage> = stale.into_iter().map(|(stage, _)| stage).collect();
    assert_eq!(stages, [BlockStage::Boxes]);
}
