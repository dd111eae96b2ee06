//! The alignment by hand of a pair, as a line of `pairs.jsonl` tells it.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::catalog::{Catalog, CatalogError, StoredAlignment};
use crate::domain::{Affine2, PairName, PrintFromMesh, UnixMillis};

/// An alignment by hand that holds for the mesh and print there are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LineManualAlignment {
    /// Who made it.
    pub reviewer: String,
    /// When.
    pub at: UnixMillis,
    /// 3x4: mesh point to print pixel and height.
    pub print_from_mesh: PrintFromMesh,
    /// 3x3: depth-map pixel to print pixel; null where the depth map is another since.
    pub print_from_depth: Option<[[f64; 3]; 3]>,
    /// Intersection over union of the masks on the canvas of the line's scores.
    pub iou: f64,
    /// Dice coefficient of the same.
    pub dice: f64,
    /// In the reviewer's words.
    pub note: Option<String>,
}

impl LineManualAlignment {
    fn of(stored: StoredAlignment) -> Self {
        let made = stored.made;
        let Affine2([first, second]) = made.print_from_depth;
        Self {
            reviewer: made.reviewer,
            at: stored.at,
            print_from_mesh: made.print_from_mesh,
            print_from_depth: stored
                .on_current_depth
                .then_some([first, second, [0.0, 0.0, 1.0]]),
            iou: made.iou,
            dice: made.dice,
            note: made.note,
        }
    }
}

/// The newest alignment by hand of each pair, of those that hold and were not taken back.
///
/// # Errors
/// When the catalog refuses.
pub(super) async fn newest(
    catalog: &Catalog,
) -> Result<BTreeMap<PairName, LineManualAlignment>, CatalogError> {
    let newest = catalog.newest_hand_alignments().await?.into_iter();
    Ok(newest
        .map(|(pair, stored)| (pair, LineManualAlignment::of(stored)))
        .collect())
}
