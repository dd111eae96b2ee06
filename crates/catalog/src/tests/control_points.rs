//! Control points of blocks: what they make stale, and what keeps them.

use super::blocks::{attributes, block, character, version, world};
use crate::{BlockChange, BlockReason};
use mocban_core::domain::{BlockSide, BlockStage, ControlPoint, ControlPoints};

#[tokio::test]
async fn control_points_make_the_alignment_stale_only_for_their_files() {
    let world = world().await;
    world.finish_block(vec![character("c1", "1")]).await;
    let set = async |read, points| {
        let name = block("b");
        let stored = world.catalog.set_control_points(&name, read, points);
        assert_eq!(stored.await.expect("a reply"), BlockChange::Stored);
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
    let of_other_page = chosen("another page");
    set(None, Some(&of_other_page)).await;
    assert_eq!(world.requeue_blocks([1; 4]).await, []);
    set(Some(of_other_page.hash()), Some(&chosen("page"))).await;
    let stale = [(BlockStage::Align, BlockReason::ControlPoints)];
    assert_eq!(world.requeue_blocks([1; 4]).await, stale);
    let (_, work) = world.leased_block().await;
    assert_eq!(work.control_points, Some(chosen("page")));
    // An import of the same files keeps them.
    world.import_block(attributes("b")).await;
    let states = world.catalog.block_states().await.expect("a read");
    assert_eq!(states[0].control_points, Some(chosen("page")));
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
    let name = block("c");
    let unknown = world.catalog.set_control_points(&name, None, None).await;
    let unknown = unknown.expect("a reply");
    assert_eq!(unknown, BlockChange::NoBlock);
}

#[tokio::test]
async fn only_points_that_the_caller_has_read_are_replaced_or_removed() {
    let world = world().await;
    world.import_block(attributes("b")).await;
    let chosen = |x: f64| ControlPoints {
        mesh: version("mesh").hash,
        page: version("page").hash,
        side: BlockSide::Front,
        points: vec![ControlPoint {
            mesh: [x, 0.1 + 0.2, 1e-7],
            page: [0.5, 1.0 / 3.0],
        }],
    };
    let (first, second) = (chosen(1.0), chosen(2.0));
    let set = async |read: Option<&ControlPoints>, points: Option<&ControlPoints>| {
        let read = read.map(ControlPoints::hash);
        let name = block("b");
        let set = world.catalog.set_control_points(&name, read, points);
        set.await.expect("a reply")
    };
    let stored = async || {
        let states = world.catalog.block_states().await.expect("a read");
        states.into_iter().next().expect("a block").control_points
    };
    assert_eq!(set(None, Some(&first)).await, BlockChange::Stored);
    for (read, points) in [
        (None, Some(&second)),
        (Some(&second), Some(&first)),
        (None, None),
        (Some(&second), None),
    ] {
        assert_eq!(set(read, points).await, BlockChange::Outdated);
        assert_eq!(stored().await.as_ref(), Some(&first));
    }
    let replaced = set(Some(&first), Some(&second)).await;
    assert_eq!(replaced, BlockChange::Stored);
    assert_eq!(set(Some(&second), None).await, BlockChange::Stored);
    assert_eq!(stored().await, None);
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
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
    let set = world.catalog.set_control_points(&name, None, Some(&points));
    assert_eq!(set.await.expect("a reply"), BlockChange::Stored);
    world.finish_block(vec![character("c1", "1")]).await;
    assert_eq!(world.requeue_blocks([1; 4]).await, []);
    let read = Some(points.hash());
    let set = world.catalog.set_control_points(&name, read, None);
    assert_eq!(set.await.expect("a reply"), BlockChange::Stored);
    let stale = [(BlockStage::Align, BlockReason::ControlPoints)];
    assert_eq!(world.requeue_blocks([1; 4]).await, stale);
}
