//! Counts of images whose colour profile could not be applied.

use serde_json::json;

use super::World;
use super::blocks::{continued, done};
use crate::{IgnoredProfiles, ProfileCount, StageCheckpoint};
use mocban_core::domain::{BlockStage, Stage};

fn count(id: &str, count: u64) -> ProfileCount {
    ProfileCount {
        id: id.to_owned(),
        count,
    }
}

#[tokio::test]
async fn prints_with_an_ignored_profile_are_counted_while_their_pairs_are() {
    let world = World::new(3).await;
    let profiles = async || world.catalog.ignored_profiles().await.expect("a read");
    assert_eq!(profiles().await, IgnoredProfiles::default());
    for is_ignored in [false, true, true] {
        let set_outcome = |done: &mut StageCheckpoint| {
            if is_ignored && done.stage == Stage::Normalize {
                done.outcome = json!({ "ignored_profile": "test" }).to_string();
            }
        };
        world.finish_with(set_outcome).await;
    }
    assert_eq!(profiles().await.pairs, Some(count("p1", 2)));
    world.retire("p1", 3).await;
    let found = profiles().await;
    assert_eq!(found.pairs, Some(count("p2", 1)));
    let sentence = "prints with a colour profile that cannot be applied: 1, first of p2; `show` names the profile";
    assert_eq!(found.sentences(), [sentence]);
}

#[tokio::test]
async fn pages_with_an_ignored_profile_are_counted() {
    let world = super::blocks::world().await;
    let profiles = async || world.catalog.ignored_profiles().await.expect("a read");
    let (mut lease, work) = world.leased_block().await;
    // A warning of a later stage is about labels.
    for (stage, expected) in [
        (BlockStage::Face, None),
        (BlockStage::Align, Some(count("b", 1))),
        (BlockStage::Boxes, Some(count("b", 1))),
    ] {
        let mut done = done(&work, stage);
        if stage != BlockStage::Face {
            done.outcome = json!({ "warnings": ["a sentence"] }).to_string();
        }
        let stored = world.catalog.checkpoint_block(lease, done).await;
        lease = continued(stored.expect("stored"));
        assert_eq!(profiles().await.blocks, expected, "{stage}");
    }
}
