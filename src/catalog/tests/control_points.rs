//! Control points of blocks: what they make stale, and what keeps them.

use super::blocks::{attributes, block, character, version, world};
use crate::catalog::BlockReason;
use crate::domain::{BlockSide, BlockStage, ControlPoint, ControlPoints};

#[tokio::test]
async fn control_points_make_the_alignment_stale_only_for_their_files() {
    let world = world().await;
    world.finish_block(vec![character("c1", "1")]).await;
    let set = async |points: Option<&ControlPoints>| {
        let name = block("b");
        let known = world.catalog.set_control_points(&name, points).await;
        assert!(known.expect("stored"));
    };
    let chosen = |page: &str| ControlPoints {
        mesh: version("mesh").hash,
        page: version(page).hash,
        side: BlockSide::Back,
        points: vec![
            ControlPoint {
                mesh: [0.1, 2.0, -3.5],
                page: [10.25, 20.0],
            };
            3
        ],
    };
    set(Some(&chosen("another page"))).await;
    assert_eq!(world.requeue_blocks([1; 4]).await, []);
    set(Some(&chosen("page"))).await;
    let stale = [(BlockStage::Align, BlockReason::ControlPoints)];
    assert_eq!(world.requeue_blocks([1; 4]).await, stale);
    let (_, work) = world.leased_block().await;
    assert_eq!(work.control_points, Some(chosen("page")));
    // An import of the same files keeps them.
    world.import_block(attributes("b")).await;
    let states = world.catalog.block_states().await.expect("a read");
    assert_eq!(states[0].control_points, Some(chosen("page")));
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
    let unknown = world.catalog.set_control_points(&block("c"), None).await;
    assert!(!unknown.expect("a reply"));
}

#[tokio::test]
async fn a_block_that_was_aligned_from_control_points_is_current_until_they_are_removed() {
    let world = world().await;
    let points = ControlPoints {
        mesh: version("mesh").hash,
        page: version("page").hash,
        side: BlockSide::Front,
        points: Vec::new(),
    };
    let name = block("b");
    let set = world.catalog.set_control_points(&name, Some(&points)).await;
    assert!(set.expect("stored"));
    world.finish_block(vec![character("c1", "1")]).await;
    assert_eq!(world.requeue_blocks([1; 4]).await, []);
    let set = world.catalog.set_control_points(&name, None).await;
    assert!(set.expect("stored"));
    let stale = [(BlockStage::Align, BlockReason::ControlPoints)];
    assert_eq!(world.requeue_blocks([1; 4]).await, stale);
}
