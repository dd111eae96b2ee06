//! Appends verdicts on current results, with a few statements for many verdicts.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

use serde_json::{Value, json};

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::query::{query_as, query_scalar};
use crate::db::row::from_row;
use crate::db::rows::json_array;
use crate::db::transaction::in_transaction;
use crate::records::checksums;
use crate::records::judged_results::{JudgedResult, current_results};
use crate::records::review_context::ReviewContext;
use crate::records::reviewer_names::{Spellings, person_name, to_store};
use crate::records::verdicts::NewVerdict;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{ContentHash, Reason, ReviewOrder, ThresholdMetric, UnixMillis, Verdict};

/// Number of verdicts that are appended together.
const CHUNK: usize = 1_000;

/// A verdict of a list.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedVerdict {
    /// The verdict.
    pub verdict: NewVerdict,
    /// The judged result, if the list names it.
    pub judged: Option<ContentHash>,
    /// The day on which it was given, from its first to its last millisecond, if the list names a day without a time.
    pub day: Option<RangeInclusive<UnixMillis>>,
}

/// Counts of an import of verdicts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ImportedVerdicts {
    /// Number of verdicts of which a row was appended.
    pub recorded: u64,
    /// Number of verdicts that were stored already.
    pub known: u64,
    /// Number of verdicts that name another result than the current one.
    pub left_out: u64,
    /// Number of verdicts of which a row was not appended, because its reviewer judged the same result later.
    pub older: u64,
    /// Position of the first of these in the list, from 0.
    pub first_older: Option<u64>,
}

/// Builds the condition that a row of `verdict` is on the result and by the reviewer of an item, and was not undone or
/// set apart. The first elements of an item are its number, pair, metric, reviewer and result.
macro_rules! is_of_item {
    () => {
        "v.pair = CAST(value ->> 1 AS bigint) AND v.metric = value ->> 2 AND v.reviewer = value ->> 3
        AND v.result_hash = unhex(value ->> 4)
        AND NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = v.act)
        AND NOT EXISTS (SELECT 1 FROM set_apart AS s WHERE s.record = 2 AND s.row = v.id)"
    };
}

/// Selects the numbers of items of which a verdict with the same values and an id up to `?2` is stored. For an item with a
/// day, this is one of a list or command on this day.
const STORED: &str = concat!(
    "
SELECT CAST(value ->> 0 AS bigint) FROM json_each(?1) AS item WHERE EXISTS (SELECT 1 FROM verdict AS v
    WHERE ",
    is_of_item!(),
    "
        AND v.verdict = value ->> 5 AND v.reason IS NOT DISTINCT FROM value ->> 6
        AND v.note IS NOT DISTINCT FROM value ->> 7 AND v.id <= ?2 AND (v.at = CAST(value ->> 8 AS bigint)
            OR v.event IS NULL AND v.at BETWEEN CAST(value ->> 14 AS bigint) AND CAST(value ->> 15 AS bigint)))"
);

/// Selects the newest verdict on the result of each item by its reviewer, in one spelling of the name.
const NEWEST: &str = concat!(
    "
SELECT CAST(value ->> 0 AS bigint) AS number, last.id, last.verdict, last.reason, last.note, last.at FROM json_each(?1) AS item
    JOIN verdict AS last ON last.id = (SELECT v.id FROM verdict AS v WHERE ",
    is_of_item!(),
    " ORDER BY v.id DESC LIMIT 1)"
);

/// Selects which of some events are stored for which metrics.
const EVENTS: &str =
    "SELECT event, metric FROM verdict WHERE event IN (SELECT atom FROM json_each(?1))";

/// Begins an action of each reviewer of a list.
const ACTS: &str = "
INSERT INTO review_act (reviewer) SELECT atom FROM json_each(?1) ORDER BY key RETURNING id, reviewer";

const INSERT: &str = "
INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, reason, note, at,
    event, seen, shown_ms, angle_read_deg, review_order)
SELECT CAST(value ->> 0 AS bigint), CAST(value ->> 1 AS bigint), value ->> 2, unhex(value ->> 4), value ->> 5, value ->> 3,
    value ->> 6, value ->> 7, CAST(value ->> 8 AS bigint), value ->> 9, unhex(value ->> 10),
    CAST(value ->> 11 AS bigint), CAST(value ->> 12 AS double precision), value ->> 13
FROM json_each(?1) ORDER BY key
RETURNING id";

/// What a verdict says.
type Content = (Verdict, Option<Reason>, Option<String>);

/// The newest verdict on the result of an item with this number.
struct NewestVerdictRow {
    number: i64,
    id: i64,
    verdict: Verdict,
    reason: Option<Reason>,
    note: Option<String>,
    at: UnixMillis,
}

from_row! { NewestVerdictRow { number, id, verdict, reason, note, at } }

/// What each reviewer's newest verdict on a result says, and its time, unless it is one without a time of the same list.
type NewestVerdicts = BTreeMap<(JudgedResult, String), (Content, Option<UnixMillis>)>;

/// A verdict on one result.
struct VerdictRowDraft<'v> {
    /// Position of the verdict in its part of the list.
    row: usize,
    new: &'v NewVerdict,
    day: Option<&'v RangeInclusive<UnixMillis>>,
    result: JudgedResult,
    /// The one spelling of the reviewer's name.
    reviewer: String,
}

impl VerdictRowDraft<'_> {
    /// Returns what two verdicts share if one of them can replace the other.
    fn key(&self) -> (JudgedResult, &str) {
        (self.result, &self.reviewer)
    }

    fn content(&self) -> Content {
        let new = self.new;
        (new.verdict, new.reason, new.note.clone())
    }

    /// Returns whether the verdict counts as stored if it equals the reviewer's newest one. Without a time, a verdict with
    /// a context, such as an angle, is always new.
    fn is_compared_with_newest(&self) -> bool {
        self.new.at.is_none() && self.new.context == ReviewContext::default()
    }

    /// Returns the item for a statement. `first` is its number, or the number of its action, and `reviewer` a spelling of the
    /// name.
    fn item(&self, first: i64, reviewer: &str, now: UnixMillis) -> Value {
        let Self {
            new, result, day, ..
        } = self;
        let context = &new.context;
        json!([
            first,
            result.pair,
            result.metric.name(),
            reviewer,
            result.hash,
            new.verdict.name(),
            new.reason.map(Reason::name),
            new.note,
            new.at.unwrap_or(now),
            context.event,
            context.seen,
            context.shown_ms,
            context.angle_read_deg,
            context.review_order.map(ReviewOrder::name),
            day.map(RangeInclusive::start),
            day.map(RangeInclusive::end),
        ])
    }
}

impl Catalog {
    /// Appends verdicts on the current results in one transaction. Skips a verdict whose `event` is already stored for
    /// the metric. Skips a verdict with `at` if a verdict with the same values, which was not undone, was stored before
    /// this call, or if the reviewer's newest verdict on the result is later. Skips a verdict without `at` and context if
    /// it equals the reviewer's newest one. Leaves out a verdict that names another result than the current one. Skips a
    /// verdict with a day if an equal one of a list or command on this day, which was not undone, was stored before this
    /// call. Reads the list in parts, so that it need not be in memory.
    ///
    /// # Errors
    /// Returns an error if a pair or the judged result does not exist, or if a database operation fails; also the first
    /// error of the list. In these cases nothing is stored.
    pub async fn import_verdicts<I>(&self, mut list: I, now: UnixMillis) -> Result<ImportedVerdicts>
    where
        I: Iterator<Item = Result<ListedVerdict>> + Send + 'static,
    {
        in_transaction!(self, |conn| {
            let newest = "SELECT coalesce(max(id), 0) FROM verdict";
            let newest: i64 = query_scalar(newest).fetch_one(&mut *conn).await?;
            let mut stored_names = Spellings::read(conn).await?;
            let mut counts = ImportedVerdicts::default();
            let mut position = 0;
            loop {
                let part: Vec<_> = list.by_ref().take(CHUNK).collect::<Result<_>>()?;
                if part.is_empty() {
                    return Ok(counts);
                }
                let of_part = append(conn, &part, &mut stored_names, newest, now).await?;
                counts.recorded += of_part.recorded;
                counts.known += of_part.known;
                counts.left_out += of_part.left_out;
                counts.older += of_part.older;
                let first_older = of_part.first_older.map(|row| position + row);
                counts.first_older = counts.first_older.or(first_older);
                position += part.len() as u64;
            }
        })
    }
}

/// Appends verdicts on the current results. Compares a verdict with a time only with rows up to the id `newest`, so that two
/// equal ones of one list are both stored.
///
/// # Errors
/// Returns an error if a pair or the judged result does not exist, or if a database operation fails.
async fn append(
    conn: &mut Conn,
    rows: &[ListedVerdict],
    stored_names: &mut Spellings,
    newest: i64,
    now: UnixMillis,
) -> Result<ImportedVerdicts> {
    let names = rows.iter().map(|row| row.verdict.pair.as_str()).collect();
    let results = current_results(conn, names).await?;
    let mut counts = ImportedVerdicts::default();
    let mut candidates = Vec::with_capacity(rows.len());
    for (row, listed) in rows.iter().enumerate() {
        let of_pair = results.get(&listed.verdict.pair);
        let results = judged(listed, of_pair.map(Vec::as_slice))?;
        counts.left_out += u64::from(results.is_none());
        candidates.extend(results.into_iter().flatten().map(|result| VerdictRowDraft {
            row,
            new: &listed.verdict,
            day: listed.day.as_ref(),
            result,
            reviewer: person_name(&listed.verdict.reviewer),
        }));
    }
    let (new, older) = without_stored(conn, candidates, stored_names, newest, now).await?;
    let written = written_names(conn, &new).await?;
    stored_names.add(written.values());
    let acts = begin_acts(conn, &new, &written).await?;
    counts.recorded = acts.len() as u64;
    counts.older = older.len() as u64;
    counts.first_older = older.first().map(|row| *row as u64);
    let only_older = older.iter().filter(|row| !acts.contains_key(row)).count();
    counts.known = rows.len() as u64 - counts.left_out - counts.recorded - only_older as u64;
    let items = new
        .iter()
        .filter_map(|new| Some(new.item(*acts.get(&new.row)?, &written[&new.reviewer], now)));
    let mut ids: Vec<i64> = query_scalar(INSERT)
        .bind(json_array(items))
        .fetch_all(&mut *conn)
        .await?;
    ids.sort_unstable();
    checksums::store(conn, ChecksummedTable::Verdict, &ids).await?;
    Ok(counts)
}

/// Returns the results that a verdict judges, or `None` if it names a result that is not current. `current` are the results
/// of its pair, if there is such a pair.
fn judged(
    listed: &ListedVerdict,
    current: Option<&[JudgedResult]>,
) -> Result<Option<Vec<JudgedResult>>> {
    let new = &listed.verdict;
    let Some(current) = current else {
        return Err(CatalogError::UnknownPair(new.pair.clone()));
    };
    let is_wanted =
        |result: &&JudgedResult| new.metric.is_none_or(|wanted| wanted == result.metric);
    let wanted: Vec<_> = current.iter().filter(is_wanted).copied().collect();
    if let Some(named) = listed.judged {
        let is_current = wanted.iter().any(|result| result.hash == named);
        return Ok(is_current.then_some(wanted));
    }
    match new.metric {
        _ if current.is_empty() => Err(CatalogError::NoResult(new.pair.clone())),
        Some(metric) if wanted.is_empty() => {
            Err(CatalogError::NoMetricResult(new.pair.clone(), metric))
        }
        Some(_) | None => Ok(Some(wanted)),
    }
}

/// Removes the verdicts that are stored already: with an event, if it is stored for the metric; with a time or a day, if the
/// same values are stored; without both and without a context, if they equal the reviewer's newest verdict on the result.
/// Also removes verdicts earlier than this newest one, and returns their rows.
async fn without_stored<'v>(
    conn: &mut Conn,
    candidates: Vec<VerdictRowDraft<'v>>,
    stored_names: &Spellings,
    newest: i64,
    now: UnixMillis,
) -> Result<(Vec<VerdictRowDraft<'v>>, BTreeSet<usize>)> {
    let mut events = stored_events(conn, &candidates).await?;
    let with_time = (0..).zip(&candidates);
    let with_time = with_time.filter(|(_, new)| new.new.at.is_some() || new.day.is_some());
    let items = json_array(with_time.flat_map(|(number, new)| {
        let spellings = stored_names.of(&new.reviewer);
        spellings.map(move |reviewer| new.item(number, reviewer, now))
    }));
    let stored = query_scalar(STORED).bind(items).bind(newest);
    let stored: BTreeSet<i64> = stored.fetch_all(&mut *conn).await?.into_iter().collect();
    let mut last = newest_contents(conn, &candidates, stored_names, now).await?;
    let mut new = Vec::with_capacity(candidates.len());
    let mut older = BTreeSet::new();
    for (number, candidate) in (0..).zip(candidates) {
        let of_result = (candidate.result, candidate.reviewer.clone());
        let (content, at) = (candidate.content(), candidate.new.at);
        let newest = last.get(&of_result);
        let is_known = stored.contains(&number)
            || candidate.is_compared_with_newest()
                && newest.is_some_and(|(newest, _)| *newest == content);
        let event = candidate.new.context.event.clone();
        if is_known || event.is_some_and(|event| !events.insert((event, candidate.result.metric))) {
            continue;
        }
        let newest_at = newest.and_then(|(_, at)| *at);
        if at.zip(newest_at).is_some_and(|(at, newest)| at < newest) {
            older.insert(candidate.row);
            continue;
        }
        last.insert(of_result, (content, at));
        new.push(candidate);
    }
    Ok((new, older))
}

/// Returns which events of the candidates are stored for which metrics.
async fn stored_events(
    conn: &mut Conn,
    candidates: &[VerdictRowDraft<'_>],
) -> Result<BTreeSet<(String, ThresholdMetric)>> {
    let events: BTreeSet<_> = candidates
        .iter()
        .filter_map(|new| new.new.context.event.as_deref())
        .collect();
    if events.is_empty() {
        return Ok(BTreeSet::new());
    }
    let found = query_as(EVENTS).bind(json_array(events));
    Ok(found.fetch_all(conn).await?.into_iter().collect())
}

/// Returns the newest verdicts by the reviewers on the results that need a comparison with them.
async fn newest_contents(
    conn: &mut Conn,
    candidates: &[VerdictRowDraft<'_>],
    stored_names: &Spellings,
    now: UnixMillis,
) -> Result<NewestVerdicts> {
    let compared: BTreeMap<_, _> = candidates
        .iter()
        .filter(|new| new.new.at.is_some() || new.is_compared_with_newest())
        .map(|new| (new.key(), new))
        .collect();
    let compared: Vec<_> = compared.into_values().collect();
    let items = (0..).zip(&compared);
    let items = json_array(items.flat_map(|(number, new)| {
        let spellings = stored_names.of(&new.reviewer);
        spellings.map(move |reviewer| new.item(number, reviewer, now))
    }));
    let mut found: Vec<NewestVerdictRow> = query_as(NEWEST).bind(items).fetch_all(conn).await?;
    // The newest of all spellings replaces the others.
    found.sort_unstable_by_key(|row| row.id);
    let found = found.into_iter().map(|row| {
        let new = compared[row.number as usize];
        let of_result = (new.result, new.reviewer.clone());
        let content = (row.verdict, row.reason, row.note);
        (of_result, (content, (row.at != now).then_some(row.at)))
    });
    Ok(found.collect())
}

/// Returns the spelling in which each reviewer's name is stored.
async fn written_names(
    conn: &mut Conn,
    new: &[VerdictRowDraft<'_>],
) -> Result<BTreeMap<String, String>> {
    let mut written = BTreeMap::new();
    for new in new {
        if !written.contains_key(&new.reviewer) {
            let name = to_store(conn, &new.reviewer).await?;
            written.insert(new.reviewer.clone(), name);
        }
    }
    Ok(written)
}

/// Begins an action for each verdict with a new row. Returns the actions by position of the verdict.
async fn begin_acts(
    conn: &mut Conn,
    new: &[VerdictRowDraft<'_>],
    written: &BTreeMap<String, String>,
) -> Result<BTreeMap<usize, i64>> {
    let reviewers: BTreeMap<usize, &str> = new
        .iter()
        .map(|new| (new.row, written[&new.reviewer].as_str()))
        .collect();
    let begun = query_as(ACTS).bind(json_array(reviewers.values().copied()));
    let begun: Vec<(i64, String)> = begun.fetch_all(conn).await?;
    // The database may return the actions in any order.
    let mut of_reviewer: BTreeMap<String, BTreeSet<i64>> = BTreeMap::new();
    for (id, reviewer) in begun {
        of_reviewer.entry(reviewer).or_default().insert(id);
    }
    let acts = reviewers.into_iter().filter_map(|(row, reviewer)| {
        let first = of_reviewer.get_mut(reviewer)?.pop_first()?;
        Some((row, first))
    });
    Ok(acts.collect())
}
