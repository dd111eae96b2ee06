//! Manual alignments, in an append-only log. Each has the hashes of the mesh, print and depth map it was made for.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::left_out::is_counted;
use crate::db::query::{query_as, query_scalar};
use crate::db::row::from_row;
use crate::db::transaction::in_transaction;
use crate::records::checksums;
use crate::records::review_answers::pair_id;
use crate::records::reviewer_names::{of_row, to_store};
use crate::{Catalog, Result};
use mocban_core::domain::{Affine2, ContentHash, PairName, PrintFromMesh, UnixMillis};

/// A manual alignment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ManualAlignment {
    /// Idempotency key of the client: an alignment sent twice is stored once.
    pub event: String,
    /// The pair.
    pub pair: PairName,
    /// Who made it.
    pub reviewer: String,
    /// Map from depth-map pixels to print pixels, for the depth map of `depth_hash`.
    pub print_from_depth: Affine2,
    /// Map from mesh points to print pixels and heights. It remains valid if the depth map changes.
    pub print_from_mesh: PrintFromMesh,
    /// Content of the mesh.
    pub mesh_hash: ContentHash,
    /// Content of the print.
    pub print_hash: ContentHash,
    /// Result hash of the depth stage on which the alignment was made.
    pub depth_hash: ContentHash,
    /// Hash of what was shown when the correction began.
    pub seen: ContentHash,
    /// Intersection over union of the masks of relief and print under this alignment, on the canvas used for scores.
    pub iou: f64,
    /// Dice coefficient of the same masks.
    pub dice: f64,
    /// Note of the reviewer.
    pub note: Option<String>,
}

from_row! { ManualAlignment { event, pair, reviewer by of_row, print_from_depth, print_from_mesh, mesh_hash, print_hash, depth_hash, seen, iou, dice, note } }

/// A stored manual alignment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredAlignment {
    /// Number in the log.
    #[serde(skip)]
    pub id: i64,
    /// The alignment.
    #[serde(flatten)]
    pub made: ManualAlignment,
    /// When.
    pub at: UnixMillis,
    /// When it was undone, if it was.
    pub undone_at: Option<UnixMillis>,
    /// Whether the current results use the same mesh and print. Only then is `print_from_mesh` valid.
    pub holds: bool,
    /// Whether the current depth map has the hash `depth_hash`. Only then is `print_from_depth` valid.
    pub on_current_depth: bool,
}

from_row! { StoredAlignment { id, made in row, at, undone_at, holds, on_current_depth } }

const INSERT: &str = "
INSERT INTO manual_alignment (event, pair, mesh_hash, print_hash, depth_hash, seen, print_from_depth, print_from_mesh,
    iou, dice, reviewer, note, at)
SELECT ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13
WHERE NOT EXISTS (SELECT 1 FROM manual_alignment WHERE event = ?1)
RETURNING id";

/// Selects manual alignments with their undo and whether they hold, without the alignments of `?3` and the undos of `?4`;
/// the tables are in the order of the join.
macro_rules! select_alignments {
    ($from:literal, $condition:literal) => {
        concat!(
            "
SELECT a.id, a.event, p.name AS pair, a.reviewer, a.print_from_depth, a.print_from_mesh, a.mesh_hash, a.print_hash,
    a.depth_hash, a.seen, a.iou, a.dice, a.note, a.at, u.at AS undone_at,
    coalesce(d.mesh_hash = a.mesh_hash AND n.print_hash = a.print_hash, false) AS holds,
    coalesce(d.result_hash = a.depth_hash, false) AS on_current_depth
FROM ",
            $from,
            "
    LEFT JOIN manual_alignment_undo AS u ON u.alignment = a.id AND ",
            is_counted!("u.alignment", "?4"),
            "
    LEFT JOIN stage_result AS d ON d.pair = a.pair AND d.stage = 1
    LEFT JOIN stage_result AS n ON n.pair = a.pair AND n.stage = 2
WHERE ",
            is_counted!("a.id", "?3"),
            " AND ",
            $condition
        )
    };
}

const LOG: &str = select_alignments!(
    "manual_alignment AS a JOIN pair AS p ON p.id = a.pair",
    "a.id > ?1 ORDER BY a.id LIMIT ?2"
);

pub(crate) const OF_NAMES: &str = select_alignments!(
    "pair AS p CROSS JOIN manual_alignment AS a ON a.pair = p.id",
    "p.name BETWEEN ?1 AND ?2 ORDER BY a.id"
);

impl Catalog {
    /// Appends a manual alignment durably. Returns `false`, and stores nothing, if an alignment with this event exists.
    ///
    /// # Errors
    /// Returns an error if there is no such pair, or if a database operation fails.
    pub async fn store_manual_alignment(
        &self,
        made: ManualAlignment,
        now: UnixMillis,
    ) -> Result<bool> {
        in_transaction!(self, |conn| {
            let pair = pair_id(conn, &made.pair).await?;
            let stored: Option<i64> = query_scalar(INSERT)
                .bind(&made.event)
                .bind(pair)
                .bind(&made.mesh_hash.as_bytes()[..])
                .bind(&made.print_hash.as_bytes()[..])
                .bind(&made.depth_hash.as_bytes()[..])
                .bind(&made.seen.as_bytes()[..])
                .bind(serde_json::to_string(&made.print_from_depth)?)
                .bind(serde_json::to_string(&made.print_from_mesh)?)
                .bind(made.iou)
                .bind(made.dice)
                .bind(to_store(conn, &made.reviewer).await?)
                .bind(&made.note)
                .bind(now)
                .fetch_optional(&mut *conn)
                .await?;
            checksums::store(conn, ChecksummedTable::ManualAlignment, stored.as_slice()).await?;
            Ok(stored.is_some())
        })
    }

    /// Returns all manual alignments, including undone ones, oldest first.
    pub async fn manual_alignments(&self) -> Result<Vec<StoredAlignment>> {
        self.manual_alignment_page(0, i64::MAX as usize).await
    }

    /// Returns up to `limit` manual alignments with ids above `after`, including undone ones, oldest first.
    pub async fn manual_alignment_page(
        &self,
        after: i64,
        limit: usize,
    ) -> Result<Vec<StoredAlignment>> {
        let mut conn = self.read_conn().await?;
        let query = query_as(LOG).bind(after).bind(limit as i64);
        let query = query.bind(self.left_out.of(ChecksummedTable::ManualAlignment));
        let query = query.bind(self.left_out.of(ChecksummedTable::ManualAlignmentUndo));
        query.fetch_all(&mut conn).await
    }

    /// Returns the newest manual alignment of each pair. Ignores alignments that are undone or whose `holds` is false.
    pub async fn newest_manual_alignments(&self) -> Result<BTreeMap<PairName, StoredAlignment>> {
        Ok(newest(self.manual_alignments().await?))
    }

    /// Returns the newest manual alignment of each pair with a name from `first` to `last`, like
    /// [`Self::newest_manual_alignments`].
    pub async fn newest_manual_alignments_between(
        &self,
        first: &PairName,
        last: &PairName,
    ) -> Result<BTreeMap<PairName, StoredAlignment>> {
        Ok(newest(self.alignments_between(first, last).await?))
    }

    /// Returns the manual alignments of a pair, including undone ones, oldest first.
    pub async fn manual_alignments_of(&self, name: &PairName) -> Result<Vec<StoredAlignment>> {
        self.alignments_between(name, name).await
    }

    async fn alignments_between(
        &self,
        first: &PairName,
        last: &PairName,
    ) -> Result<Vec<StoredAlignment>> {
        let mut conn = self.read_conn().await?;
        let query = query_as(OF_NAMES).bind(first.as_str()).bind(last.as_str());
        let query = query.bind(self.left_out.of(ChecksummedTable::ManualAlignment));
        let query = query.bind(self.left_out.of(ChecksummedTable::ManualAlignmentUndo));
        query.fetch_all(&mut conn).await
    }
}

/// Returns the newest alignment of each pair that holds and is not undone.
fn newest(oldest_first: Vec<StoredAlignment>) -> BTreeMap<PairName, StoredAlignment> {
    let valid =
        (oldest_first.into_iter()).filter(|stored| stored.holds && stored.undone_at.is_none());
    valid
        .map(|stored| (stored.made.pair.clone(), stored))
        .collect()
}
