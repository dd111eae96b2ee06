//! Corrections of what is known of the scans of pairs: their unit, and which of their sides is carved.

use crate::db::dialect::Sql;
use crate::db::query::{query, query_scalar};
use crate::db::row::{FromRow as _, Row};
use crate::db::rows::names_json;
use crate::db::transaction::in_transaction;
use crate::queue::counters::Deltas;
use crate::records::import::{ImportRow, ImportSummary, import_chunk};
use crate::records::model::PairAttributes;
use crate::{Catalog, Result};
use mocban_core::domain::{
    FailureClass, FitOutcome, LengthUnit, PairName, UNIT_CLAUSES, UnixMillis,
};

/// Number of pairs in one statement.
const CHUNK: usize = 2_000;

/// Pairs that failed with a class, in the order of import. With `?2`, only those whose messages have one of the clauses `?5` to
/// `?7`. The first `?3` failures of the class are searched. Pairs that were cut from a block have its unit and its side.
const FAILED_SCANS: &str = "
SELECT p.name FROM (SELECT pair, message FROM failure WHERE class = ?1 ORDER BY pair LIMIT ?3) AS f
    CROSS JOIN job AS j ON j.pair = f.pair CROSS JOIN pair AS p ON p.id = f.pair
WHERE j.status = 4 AND (?2 = 0 OR f.message LIKE ?5 OR f.message LIKE ?6 OR f.message LIKE ?7)
    AND NOT EXISTS (SELECT 1 FROM block_character AS c WHERE c.pair = f.pair)
ORDER BY f.pair LIMIT ?4";

/// Builds the statement that selects the pairs that can be corrected, each with its result of `fit`, from the condition on the
/// name.
macro_rules! scans {
    ($has_name:literal) => {
        concat!(
            "
SELECT p.name, p.mesh_path, p.print_path, p.unit, p.scanned_face_down, p.character, p.block, p.meta, p.prior, r.outcome AS fit
FROM pair AS p JOIN job AS j ON j.pair = p.id LEFT JOIN stage_result AS r ON r.pair = p.id AND r.stage = 0
WHERE NOT EXISTS (SELECT 1 FROM block_character AS c WHERE c.pair = p.id) AND ",
            $has_name
        )
    };
}

/// With `IN`, PostgreSQL may read all pairs while it has no statistics.
const SCANS: Sql = Sql::pair(
    scans!("p.name IN (SELECT atom FROM json_each(?1))"),
    scans!("p.name = ANY (ARRAY(SELECT atom FROM json_each(?1)))"),
);

/// What a person says of the scans of pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScanCorrection {
    /// They have this unit, or none that is known.
    Unit(Option<LengthUnit>),
    /// The carved side is the other one than `fit` has found. If it has found none, the other one than the list says, or the
    /// lower one.
    OtherSide,
}

impl Catalog {
    /// Returns pairs that failed with a class, up to `limit`, in the order of import. With `names_unit`, only those whose
    /// messages have one of the [`UNIT_CLAUSES`]. Searches only the first `searched` failures. Leaves out pairs that were cut
    /// from blocks.
    pub async fn failed_scans(
        &self,
        class: FailureClass,
        names_unit: bool,
        [searched, limit]: [usize; 2],
    ) -> Result<Vec<PairName>> {
        let mut conn = self.read_conn().await?;
        let mut names = query_scalar(FAILED_SCANS)
            .bind(class.name())
            .bind(i64::from(names_unit))
            .bind(searched as i64)
            .bind(limit as i64);
        for clause in UNIT_CLAUSES {
            names = names.bind(format!("%{clause}%"));
        }
        names.fetch_all(&mut conn).await
    }

    /// Changes what is known of the scans of pairs as an import of a list does: results of other attributes are stale. Retired
    /// pairs and pairs that were cut from blocks stay as they are. Returns the number of changed pairs.
    pub async fn correct_scans(
        &self,
        names: Vec<PairName>,
        correction: ScanCorrection,
        now: UnixMillis,
    ) -> Result<u64> {
        in_transaction!(self, |conn| {
            let mut summary = ImportSummary::default();
            let mut deltas = Deltas::default();
            for chunk in names.chunks(CHUNK) {
                let found = query(SCANS).bind(names_json(chunk));
                let found = found.fetch_all(&mut *conn).await?;
                let rows = found.iter().map(|row| corrected(row, correction));
                let mut rows = rows.collect::<Result<Vec<_>>>()?;
                let counts = (&mut summary, &mut deltas);
                import_chunk(conn, &mut rows, false, now, counts).await?;
            }
            deltas.apply(conn).await?;
            Ok(summary.changed.len() as u64)
        })
    }
}

/// Returns the row that an import of a corrected list would have.
fn corrected(row: &Row, correction: ScanCorrection) -> Result<ImportRow> {
    let mut pair = PairAttributes::from_row(row)?;
    match correction {
        ScanCorrection::Unit(unit) => pair.unit = unit,
        ScanCorrection::OtherSide => {
            let fit: Option<String> = row.get("fit")?;
            // A result of another version of the program may not be readable.
            let fit = fit.and_then(|fit| serde_json::from_str::<FitOutcome>(&fit).ok());
            let found_down = fit.map(|fit| fit.plane_from_mesh.0[2][2] < 0.0);
            let down = found_down.or(pair.scanned_face_down).unwrap_or_default();
            pair.scanned_face_down = Some(!down);
        }
    }
    Ok(pair)
}
