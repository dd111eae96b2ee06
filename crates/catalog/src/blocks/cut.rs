//! Stores the characters of a block and the pairs that were cut, with its last stage (`worker_requests.rs`).

use std::collections::BTreeSet;

use serde::Serialize;

use crate::Result;
use crate::blocks::characters;
use crate::blocks::model::{CutPair, NewCharacter};
use crate::db::conn::Conn;
use crate::db::query::{query_as, query_scalar};
use crate::db::rows::{json_array, names_json};
use crate::db::script::Script;
use crate::jobs::requeue::send_back;
use crate::jobs::retired;
use crate::queue::counters::Deltas;
use crate::queue::kind::StoredKind as _;
use crate::queue::pair_job::PairJob;
use crate::queue::provenance::InputVersions;
use crate::records::import::{ImportRow, ImportSummary, import_chunk};
use crate::records::similar_names;
use crate::records::status::in_force;
use mocban_core::domain::{BlockId, BlockName, PairId, PairName, RetireCause, Stage};

/// What the cut of a block changed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct CutSummary {
    /// Pairs that are new.
    pub added: u64,
    /// Pairs that changed and run again.
    pub changed: u64,
    /// Pairs that stay as they are.
    pub unchanged: u64,
    /// Pairs that were retired because their boxes are gone.
    pub retired: u64,
    /// Retired and changed pairs with verdicts.
    pub judged: u64,
    /// Retired pairs that came back with their boxes.
    pub restored: u64,
}

/// What became of the checkpoint of a cut.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CutReply {
    /// It was stored.
    Stored(CutSummary),
    /// Nothing was stored, because the lease was lost or the files were written too long ago.
    Refused,
    /// This pair was not cut from this block, and its name differs at most in upper and lower case from that of a pair
    /// that was, so that their files would fall together on Windows and macOS; nothing was stored.
    NameTaken(PairName),
}

const NAME: &str = "SELECT name FROM block WHERE id = ?1";

/// Selects the names of the pairs that were cut from the block before.
const OWN: &str = "
SELECT p.name FROM block_character AS c JOIN pair AS p ON p.id = c.pair WHERE c.block = ?1";

const PAIRS: &str = "
SELECT p.id, p.name FROM pair AS p WHERE p.name IN (SELECT atom FROM json_each(?1)) ORDER BY p.id";

/// Counts the pairs among `?1` that have a job and a verdict that nobody has undone or set apart.
const JUDGED: &str = concat!(
    "
SELECT count(*) FROM job AS j WHERE j.pair IN (SELECT CAST(atom AS bigint) FROM json_each(?1)) AND EXISTS (
    SELECT 1 FROM verdict AS v WHERE v.pair = j.pair
        AND ",
    in_force!("v"),
    ")"
);

/// The columns of a pair whose change does not affect its results.
const WITHOUT_EFFECT: [&str; 3] = ["character", "block", "metadata"];

/// Returns the name of a new pair that another pair has, or that differs from its name at most in upper and lower case. The
/// other pair's id is above `after`, and it was not cut from this block.
pub(crate) async fn taken_name(
    conn: &mut Conn,
    block: BlockId,
    found: &[NewCharacter],
    after: i64,
) -> Result<Option<PairName>> {
    let new = new_names(conn, block, found).await?;
    similar_names::taken(conn, block, &new, after).await
}

/// Stores the characters of a block, and a pair for each character that was cut.
pub(crate) async fn store_cut(
    conn: &mut Conn,
    block: BlockId,
    found: &[NewCharacter],
    at: i64,
) -> Result<CutSummary> {
    let name = query_scalar(NAME).bind(block.0);
    let name: BlockName = name.fetch_one(&mut *conn).await?;
    let rows = pair_rows(&name, found)?;
    let mut deltas = Deltas::default();
    let summary = store_pairs(conn, &rows, at, &mut deltas).await?;
    let gone = characters::store(conn, block, &name, found).await?;
    let judged = count_judged(conn, &gone).await?;
    let retired = retired::retire(conn, &gone, RetireCause::Labels, at, &mut deltas).await?;
    deltas.apply(conn).await?;
    Ok(CutSummary {
        retired,
        judged: summary.judged + judged,
        ..summary
    })
}

/// Counts the pairs among these that are not retired and have verdicts.
async fn count_judged(conn: &mut Conn, pairs: &[PairId]) -> Result<u64> {
    if pairs.is_empty() {
        return Ok(0);
    }
    let pairs = json_array(pairs.iter().map(|pair| pair.0));
    query_scalar(JUDGED).bind(pairs).fetch_one(conn).await
}

/// Returns the names of the pairs that a block does not have yet.
async fn new_names(
    conn: &mut Conn,
    block: BlockId,
    found: &[NewCharacter],
) -> Result<Vec<PairName>> {
    let name: BlockName = query_scalar(NAME)
        .bind(block.0)
        .fetch_one(&mut *conn)
        .await?;
    let own: Vec<PairName> = query_scalar(OWN)
        .bind(block.0)
        .fetch_all(&mut *conn)
        .await?;
    let own: BTreeSet<PairName> = own.into_iter().collect();
    let rows = pair_rows(&name, found)?.into_iter();
    let names = rows.map(|cut| cut.row.name);
    Ok(names.filter(|name| !own.contains(name)).collect())
}

/// A pair to import with the character that was cut.
struct CutRow<'c> {
    row: ImportRow,
    cut: &'c CutPair,
}

/// Returns the pairs to import, each with its files.
fn pair_rows<'c>(block: &BlockName, found: &'c [NewCharacter]) -> Result<Vec<CutRow<'c>>> {
    let cut = found.iter();
    let cut = cut.filter_map(|one| Some((one, one.cut.as_ref().ok()?)));
    cut.map(|(one, cut)| {
        let row = ImportRow {
            name: characters::pair_name(block, &one.label)?,
            mesh_path: cut.mesh_path.clone(),
            print_path: cut.print_path.clone(),
            unit: cut.unit,
            scanned_face_down: cut.scanned_face_down,
            character: one.character.clone(),
            block: Some(block.as_str().to_owned()),
            meta: serde_json::Map::new(),
            prior: cut.prior.clone(),
        };
        Ok(CutRow { row, cut })
    })
    .collect()
}

/// Adds and updates pairs. Sends those whose files or attributes changed back to the first stage.
async fn store_pairs(
    conn: &mut Conn,
    rows: &[CutRow<'_>],
    now: i64,
    deltas: &mut Deltas,
) -> Result<CutSummary> {
    let mut imported: Vec<ImportRow> = rows.iter().map(|cut| cut.row.clone()).collect();
    let mut summary = ImportSummary::default();
    import_chunk(conn, &mut imported, false, now, (&mut summary, deltas)).await?;
    let names: Vec<PairName> = imported.into_iter().map(|row| row.name).collect();
    let stored = query_as(PAIRS).bind(names_json(&names));
    let stored: Vec<(PairId, PairName)> = stored.fetch_all(&mut *conn).await?;
    let versions: Vec<(PairId, InputVersions)> = stored
        .iter()
        .filter_map(|(id, name)| {
            let found = rows.iter().find(|cut| cut.row.name == *name)?;
            let versions = InputVersions {
                mesh: Some(found.cut.mesh.clone()),
                print: Some(found.cut.print.clone()),
            };
            Some((*id, versions))
        })
        .collect();
    let mut script = Script::default();
    PairJob::add_inputs(&mut script, versions.iter().map(|(id, seen)| (*id, seen)))?;
    script.run(conn).await?;
    let changed: BTreeSet<&PairName> = summary
        .changed
        .iter()
        .filter(|change| {
            let fields = change.fields.iter();
            fields.clone().any(|field| !WITHOUT_EFFECT.contains(field))
        })
        .map(|change| &change.name)
        .collect();
    let again = stored.iter().filter(|(_, name)| changed.contains(name));
    // The workers that hold their leases read the old files.
    let from_start = again.clone().map(|(id, _)| (*id, Stage::Fit));
    send_back::<PairJob>(conn, from_start, deltas).await?;
    let all = names.len() as u64;
    let again: Vec<PairId> = again.map(|(id, _)| *id).collect();
    let judged = count_judged(conn, &again).await?;
    let changed = again.len() as u64;
    Ok(CutSummary {
        added: summary.added,
        changed,
        unchanged: all - summary.added - changed,
        retired: 0,
        judged,
        restored: summary.restored,
    })
}
