//! Records, imports, lists and undoes people's verdicts on the results. Their log is append-only.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::error::{ProjectError, ProjectResult};
use crate::exit::Refusal;
use crate::files::{self, MAX_SHOWN, RefusedLine};
use crate::location::{Location, now};
use crate::reviewers;
use crate::selection;
use crate::verdict_file::{self, VerdictList};
use crate::verdict_row::VerdictRow;
use mocban_catalog::{
    Catalog, CatalogError, FaultyRow, ImportedVerdicts, ListedVerdict, NewVerdict, Shown,
    VerdictEvent, person_name,
};
use mocban_core::domain::{ContentHash, PairName, ReviewOrder, ThresholdMetric};
use mocban_results::consensus::is_open_conflict;

/// What became of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordedVerdict {
    /// It was recorded.
    New,
    /// The same one had been recorded before.
    Known,
    /// It is on another result than the current one, and was not recorded.
    Stale,
}

/// Records a verdict on the current result of a pair, which `verdict` makes for the name of that pair; with `judged`, only if it
/// is the hash of the current result of the metric. Returns the verdict, and what became of it. A new reviewer whose name is
/// similar to that of another is refused unless `is_new_allowed`.
///
/// # Errors
/// Returns an error if the pair does not exist or has no result, the verdict is invalid, the user of the database may not
/// record it, or the catalog fails.
pub async fn record(
    pair: &str,
    judged: Option<ContentHash>,
    verdict: impl FnOnce(PairName) -> NewVerdict,
    is_new_allowed: bool,
    location: &Location,
) -> ProjectResult<(NewVerdict, RecordedVerdict)> {
    let (_project, catalog) = location.open().await?;
    let verdict = verdict(selection::pair(&catalog, pair).await?);
    let verdict = checked(&catalog, verdict, is_new_allowed).await?;
    let listed = ListedVerdict {
        verdict: verdict.clone(),
        judged,
        day: None,
    };
    let counts = catalog
        .import_verdicts([Ok(listed)].into_iter(), now())
        .await?;
    catalog.close().await;
    let recorded = match counts {
        ImportedVerdicts { left_out: 1.., .. } => RecordedVerdict::Stale,
        ImportedVerdicts { recorded: 1.., .. } => RecordedVerdict::New,
        _ => RecordedVerdict::Known,
    };
    Ok((verdict, recorded))
}

/// Records a verdict that settles a conflict: on those current results of a pair that are in an open conflict, as
/// `review --adjudicate` does; with `judged`, only on the result with this hash. Returns the verdict, and the metrics of these
/// results: none, and nothing is recorded, if no current result has the hash.
///
/// # Errors
/// As for [`record`]; also if there is no such result, or the reviewer has judged it.
pub async fn settle(
    pair: &str,
    judged: Option<ContentHash>,
    verdict: impl FnOnce(PairName) -> NewVerdict,
    is_new_allowed: bool,
    location: &Location,
) -> ProjectResult<(NewVerdict, Vec<ThresholdMetric>)> {
    let (_project, catalog) = location.open().await?;
    let mut verdict = verdict(selection::pair(&catalog, pair).await?);
    verdict.context.review_order = Some(ReviewOrder::Adjudicate);
    let verdict = checked(&catalog, verdict, is_new_allowed).await?;
    let found = catalog.pair(&verdict.pair).await?;
    let records = found.into_iter().flat_map(|pair| pair.results.metrics);
    let meant = records.filter(|record| {
        let is_wanted = |wanted| wanted == record.outcome.metric;
        verdict.metric.is_none_or(is_wanted)
            && judged.is_none_or(|judged| judged == record.result_hash)
    });
    let meant: Vec<_> = meant.collect();
    if judged.is_some() && meant.is_empty() {
        catalog.close().await;
        return Ok((verdict, Vec::new()));
    }
    let open = meant.iter();
    let open = open.filter(|record| is_open_conflict(record, &verdict.reviewer));
    let open: Vec<_> = open
        .map(|record| (record.outcome.metric, record.result_hash))
        .collect();
    if open.is_empty() {
        let NewVerdict { pair, reviewer, .. } = &verdict;
        let text = format!(
            "{pair} has no open conflict that {reviewer} may settle, as a person without a verdict on it; `agreement` names the pairs"
        );
        return Err(Refusal::NothingSelected(text).into());
    }
    let metrics = open.iter().map(|(metric, _)| *metric).collect();
    let shown = Shown::Results(open);
    catalog.answer(verdict.clone(), shown, now()).await?;
    catalog.close().await;
    Ok((verdict, metrics))
}

/// Returns a verdict with the one spelling of the reviewer's name. Refuses values that no verdict has, a reviewer for whom the
/// user may not record it, and a new one whose name is similar to another unless `is_new_allowed`.
async fn checked(
    catalog: &Catalog,
    mut verdict: NewVerdict,
    is_new_allowed: bool,
) -> ProjectResult<NewVerdict> {
    let rights = catalog.review_rights().await?;
    verdict.reviewer = person_name(&verdict.reviewer);
    rights.require_verdicts(&verdict.reviewer)?;
    let checked = verdict.check(now());
    checked.map_err(|error| Refusal::Usage(error.to_string()))?;
    if !is_new_allowed {
        let reviewers = BTreeSet::from([verdict.reviewer.clone()]);
        reviewers::refuse_similar(catalog, &rights, &reviewers).await?;
    }
    Ok(verdict)
}

/// What became of the verdicts of a file.
#[derive(Debug)]
pub struct VerdictFileImport {
    /// Numbers of verdicts.
    pub counts: ImportedVerdicts,
    /// Line of the first verdict that was left out because its reviewer judged the same result later.
    pub first_older: Option<usize>,
    /// Sentences about parts of the file that were not read.
    pub warnings: Vec<String>,
}

/// Records the verdicts of a list with this text in CSV or JSON; `file` is its path. If a line is refused, no verdict is
/// recorded. A new reviewer whose name is similar to another is refused unless `is_new_allowed`.
pub async fn import(
    file: &Path,
    bytes: Vec<u8>,
    is_new_allowed: bool,
    location: &Location,
) -> ProjectResult<VerdictFileImport> {
    let (_project, catalog) = location.open().await?;
    let outcome = "no verdict was recorded";
    let is_jsonl = files::is_jsonl(file, &bytes);
    let list = VerdictList::new(bytes, is_jsonl).map_err(|error| error.in_file(file, outcome))?;
    let (list, names) = with_known_names(list, &catalog).await?;
    let NamesInList {
        first_lines,
        unknown,
        decimal_names,
        reviewers,
        mut refused,
        unread,
        day_first,
    } = names;
    if !unknown.is_empty() {
        let known = catalog.pair_names().await?;
        refused.extend(verdict_file::unknown_pairs(&first_lines, &unknown, &known));
    }
    let retired = RetiredInList::read(&catalog, &list, &first_lines).await?;
    refused.extend(retired.refused);
    if let Some(refusal) = RefusedLine::all_in_file(refused, file, outcome) {
        return Err(refusal.into());
    }
    let rights = catalog.review_rights().await?;
    for reviewer in &reviewers {
        rights.require_verdicts(reviewer)?;
    }
    if !is_new_allowed {
        reviewers::refuse_similar(&catalog, &rights, &reviewers).await?;
    }
    let rows = list.rows_without(retired.pairs);
    // All rows were valid in the first pass.
    let listed = rows().map(|row| match row {
        Ok(row) => Ok(row.listed),
        Err(_) => Err(CatalogError::CutShort),
    });
    let mut counts = catalog.import_verdicts(listed, now()).await?;
    catalog.close().await;
    counts.known += retired.stored;
    let first_older = counts.first_older.and_then(|position| {
        let row = rows().nth(usize::try_from(position).ok()?)?;
        row.ok().map(|row| row.line)
    });
    let day_first = day_first.map(|line| {
        format!(
            "dates such as the one on line {line} are read with the day first, as in 21/11/2026"
        )
    });
    let unread = verdict_file::unread_fields(&unread);
    let read = [day_first, decimal_names, unread].into_iter().flatten();
    let read = read.map(|text| format!("{}: {text}", file.display()));
    Ok(VerdictFileImport {
        counts,
        first_older,
        warnings: read.collect(),
    })
}

/// Returns a list in which unknown names such as `117.0` stand for the known pairs that they mean, and its names.
async fn with_known_names(
    list: VerdictList,
    catalog: &Catalog,
) -> ProjectResult<(VerdictList, NamesInList)> {
    let mut names = NamesInList::read(&list);
    let listed: Vec<PairName> = names.first_lines.keys().cloned().collect();
    names.unknown = catalog.unknown_names(&listed).await?;
    let mut meant = verdict_file::without_decimals(&names.unknown);
    if meant.is_empty() {
        return Ok((list, names));
    }
    let wanted: Vec<PairName> = meant.values().cloned().collect();
    let absent: BTreeSet<PairName> = catalog.unknown_names(&wanted).await?.into_iter().collect();
    meant.retain(|_, name| !absent.contains(name));
    let mut unknown = names.unknown;
    unknown.retain(|name| !meant.contains_key(name));
    let decimal_names = verdict_file::decimal_names(&meant, &names.first_lines);
    let list = list.with_meant(meant);
    let names = NamesInList {
        unknown,
        decimal_names,
        ..NamesInList::read(&list)
    };
    Ok((list, names))
}

/// Names in a list of verdicts, and its refused lines.
#[derive(Debug, Default)]
struct NamesInList {
    /// The first line of each pair.
    first_lines: BTreeMap<PairName, usize>,
    /// Names that no pair has.
    unknown: Vec<PairName>,
    /// A warning about names such as `117.0` that are read as `117`.
    decimal_names: Option<String>,
    reviewers: BTreeSet<String>,
    refused: Vec<RefusedLine>,
    /// The first line of each field that is not read.
    unread: BTreeMap<String, usize>,
    /// The first line with a date that is read with the day first.
    day_first: Option<usize>,
}

impl NamesInList {
    fn read(list: &VerdictList) -> Self {
        let mut names = Self::default();
        for row in list.rows() {
            let checked = row.and_then(|row| {
                verdict_file::check_values(&row, now())?;
                Ok(row)
            });
            match checked {
                Ok(VerdictRow {
                    line,
                    listed,
                    unread,
                    is_day_first,
                    ..
                }) => {
                    if is_day_first {
                        names.day_first.get_or_insert(line);
                    }
                    for field in unread {
                        // More than these are not shown, however many a file has.
                        if names.unread.len() < MAX_SHOWN {
                            names.unread.entry(field).or_insert(line);
                        }
                    }
                    let NewVerdict { pair, reviewer, .. } = listed.verdict;
                    names.first_lines.entry(pair).or_insert(line);
                    names.reviewers.insert(reviewer);
                }
                Err(error) => names.refused.push(error),
            }
        }
        names
    }
}

/// Retired pairs in a list of verdicts.
#[derive(Debug, Default)]
struct RetiredInList {
    pairs: BTreeSet<PairName>,
    /// Number of their verdicts that are stored already.
    stored: u64,
    /// The first line of each pair with a verdict that is not stored.
    refused: Vec<RefusedLine>,
}

impl RetiredInList {
    async fn read(
        catalog: &Catalog,
        list: &VerdictList,
        first_lines: &BTreeMap<PairName, usize>,
    ) -> ProjectResult<Self> {
        let mut logs = BTreeMap::new();
        for pair in catalog.retired_pairs().await? {
            if first_lines.contains_key(&pair.name) {
                let log = catalog.verdict_log(Some(&pair.name)).await?;
                logs.insert(pair.name.clone(), (log, selection::retired_text(&pair)));
            }
        }
        let mut found = Self::default();
        if logs.is_empty() {
            return Ok(found);
        }
        let mut refused = BTreeSet::new();
        for VerdictRow { line, listed, .. } in list.rows().flatten() {
            let pair = &listed.verdict.pair;
            let Some((log, reason)) = logs.get(pair) else {
                continue;
            };
            if log.iter().any(|event| is_event(&listed, event)) {
                found.stored += 1;
            } else if refused.insert(pair.clone()) {
                found.refused.push(RefusedLine::new(line, reason));
            }
        }
        found.pairs = logs.into_keys().collect();
        Ok(found)
    }
}

/// Returns whether a line of a log that was exported is this event, which was not undone.
fn is_event(listed: &ListedVerdict, event: &VerdictEvent) -> bool {
    let new = &listed.verdict;
    listed.judged == Some(event.result_hash)
        && event.undone_at.is_none()
        && new.metric.is_none_or(|metric| metric == event.metric)
        && new.at.is_none_or(|at| at == event.at)
        && new.reviewer == person_name(&event.reviewer)
        && (new.verdict, new.reason) == (event.verdict, event.reason)
        && new.note == event.note
}

/// The verdicts of a project or a pair.
#[derive(Debug)]
pub struct VerdictLog {
    /// All that were recorded, oldest first.
    pub events: Vec<VerdictEvent>,
    /// Damaged rows, which are not counted.
    pub damaged: Vec<FaultyRow>,
}

/// Returns the verdicts on a pair, which may be retired, or on all pairs.
pub async fn log(pair: Option<&str>, location: &Location) -> ProjectResult<VerdictLog> {
    let (_project, catalog) = location.open_read_only().await?;
    let pair = match pair {
        Some(typed) => {
            let pairs = selection::known_pairs(&catalog, &[typed.to_owned()]).await?;
            pairs.into_iter().next()
        }
        None => None,
    };
    let (sound, mut damaged) = catalog.without_faulty_rows().await?;
    let events = sound.verdict_log(pair.as_ref()).await?;
    catalog.close().await;
    if let Some(pair) = &pair {
        damaged.retain(|row| row.pair.as_deref() == Some(pair.as_str()));
    }
    damaged.retain(|row| row.table.is_of_verdicts());
    Ok(VerdictLog { events, damaged })
}

/// Undoes up to `last` of the newest verdicts of a reviewer, who need not be named if there is only one. The log keeps them,
/// marked as undone. Returns the undone verdicts on all metrics.
///
/// # Errors
/// Returns an error if there is none to undo, several people have verdicts and none is named, the user of the database may
/// not undo it, or the catalog fails.
pub async fn undo(
    reviewer: Option<&str>,
    last: u32,
    location: &Location,
) -> ProjectResult<Vec<VerdictEvent>> {
    let (_project, catalog) = location.open().await?;
    let rights = catalog.review_rights().await?;
    let reviewer = reviewer.or(rights.only_reviewer());
    rights.require_review(reviewer)?;
    if reviewer.is_none() {
        reviewers::refuse_several(&catalog).await?;
    }
    let mut undone = catalog.verdict_undo(reviewer, now()).await?;
    for _ in 1..last {
        match catalog.verdict_undo(reviewer, now()).await {
            Ok(earlier) => undone.extend(earlier),
            Err(CatalogError::NothingToUndo(_)) => break,
            Err(error) => {
                let before = format!("{} verdicts were undone before this", undone.len());
                return Err(ProjectError::from(error).context(before));
            }
        }
    }
    catalog.close().await;
    Ok(undone)
}
