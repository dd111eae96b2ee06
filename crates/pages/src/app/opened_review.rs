//! The pages of one reviewer, opened with a new reading of the queue.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::number_text::grouped;
use super::projects::OpenProject;
use super::sentence::Sentence;
use crate::on_thread::read_on_thread;
use crate::review::{CheckRates, PictureWork, QueueOptions, ReviewOptions, ReviewPages, key_map};
use mocban_catalog::{Catalog, CatalogError, MetricRecord};
use mocban_core::domain::{JobStatus, PairName, ReviewOrder, ThresholdMetric};
use mocban_project::block_status::BlockStatus;
use mocban_project::location::{Location, now};
use mocban_project::{ProjectResult, Refusal};
use mocban_results::consensus::{Consensus, partition_verdicts};
use mocban_results::pair_artifacts::group_identical;

/// Shortest time that an image is shown before a verdict is accepted, as in `review`.
const MIN_VIEW_MS: u64 = 250;

/// Number of pairs that are read from the catalog at a time.
const PAGE_PAIRS: usize = 256;

/// Where a reviewer judges: in this app, or as a guest with an invitation.
#[derive(Debug)]
pub(super) struct ReviewPlace {
    /// The command line that names the project.
    pub(super) command: Option<String>,
    /// Returns the sentence that explains an error of the catalog.
    pub(super) explain: fn(&CatalogError, &Path) -> String,
    /// Relative address of the pages of the project.
    pub(super) project_page: Option<&'static str>,
    /// The threads and the rendered images of all reviews of the app.
    pub(super) work: Arc<PictureWork>,
}

impl ReviewPlace {
    /// Returns the place of a guest, whose page has the language of the browser and names no file and no command.
    pub(super) fn of_guest(work: Arc<PictureWork>) -> Self {
        Self {
            command: None,
            explain: |_error, _dir| {
                "the project cannot be read now: tell the person who invited you, and keep this page open".to_owned()
            },
            project_page: None,
            work,
        }
    }
}

/// Opens the pages of a reviewer, with the results of some pairs or of all. Those of chosen pairs come without attention
/// checks.
pub(super) async fn open_review(
    open: &OpenProject,
    reviewer: &str,
    query: &PageQuery,
    place: ReviewPlace,
    pairs: Option<BTreeSet<PairName>>,
) -> AppResult<ReviewPages> {
    let (location, name) = (open.location(), reviewer.to_owned());
    let (reviewer, metric) = (name.clone(), query.parsed("metric"));
    let is_settling = query.parsed("order") == Some(ReviewOrder::Adjudicate);
    let query = query.clone();
    let opened =
        read_on_thread(async move || review_pages(&location, place, reviewer, &query, pairs).await);
    let pages = opened
        .await
        .map_err(|error| AppFailure::of(error, &open.dir))?;
    if pages.counts().items > 0 {
        return Ok(pages);
    }
    Err(AppFailure::refused(if is_settling {
        match own_conflicts(&open.catalog, &name, metric).await? {
            0 => Sentence::new(
                "no two reviewers disagree on a result of this metric",
                "không có hai người đánh giá nào bất đồng về kết quả của độ đo này",
            ),
            own => {
                let own = grouped(own as u64);
                Sentence::new(
                    format!(
                        "you have judged these results yourself ({own}): a third person must settle them, under another name"
                    ),
                    format!(
                        "chính bạn đã đánh giá các kết quả này ({own}): một người thứ ba phải quyết định, với tên khác"
                    ),
                )
            }
        }
    } else {
        nothing_to_judge(&open.catalog).await?
    }))
}

/// Returns on how many results a reviewer and others disagree, which look the same counted once.
async fn own_conflicts(
    catalog: &Catalog,
    reviewer: &str,
    metric: Option<ThresholdMetric>,
) -> AppResult<usize> {
    let is_own = |record: &&MetricRecord| {
        let (_, alone) = partition_verdicts(record);
        Consensus::of(record) == Consensus::Conflict
            && metric.is_none_or(|metric| metric == record.outcome.metric)
            && alone.iter().any(|given| given.reviewer == reviewer)
    };
    let (mut own, mut pages) = (0, catalog.judged_pages(PAGE_PAIRS).await?);
    while let Some(page) = pages.next().await? {
        let pairs = page.iter();
        own += pairs
            .map(|pair| group_identical(pair.metrics.iter().filter(is_own)).len())
            .sum::<usize>();
    }
    Ok(own)
}

/// Says why there is no result to judge: blocks or pairs failed, or nothing was aligned yet.
async fn nothing_to_judge(catalog: &Catalog) -> AppResult<Sentence> {
    let blocks = BlockStatus(catalog.block_states().await?);
    let failed = blocks.number(&[JobStatus::Quarantined]);
    if failed > 0 && blocks.waiting() + blocks.leased() == 0 {
        let failed = grouped(failed);
        return Ok(Sentence::new(
            format!(
                "there is no result to judge, because blocks failed ({failed}): the page Blocks says why"
            ),
            format!(
                "chưa có kết quả nào để đánh giá vì có ván bị lỗi ({failed}): trang Các ván cho biết lý do"
            ),
        ));
    }
    Ok(Sentence::new(
        "there is no result to judge yet: press Align on the page Run first",
        "chưa có kết quả nào để đánh giá: trước hết hãy bấm Căn chỉnh ở trang Căn chỉnh",
    ))
}

async fn review_pages(
    location: &Location,
    place: ReviewPlace,
    reviewer: String,
    query: &PageQuery,
    pairs: Option<BTreeSet<PairName>>,
) -> ProjectResult<ReviewPages> {
    let settings = location.settings()?;
    let keys = key_map(&settings.config.review.keys);
    let keys = keys.map_err(|error| Refusal::Usage(error.to_string()))?;
    let (project, catalog) = location.open().await?;
    let rights = catalog.review_rights().await?;
    rights.require_review(Some(&reviewer))?;
    let (catalog, _) = catalog.without_faulty_rows().await?;
    let options = ReviewOptions {
        command: place.command,
        project_page: place.project_page,
        // The app adds the chosen language to the address of the page; a guest has that of the browser.
        language: None,
        keys,
        min_view_ms: MIN_VIEW_MS,
        opens_guide: true,
        limits: settings.config.limits,
        explain: place.explain,
        now,
        queue: QueueOptions {
            reviewer,
            metrics: query.parsed("metric").into_iter().collect(),
            order: query.parsed("order").unwrap_or(ReviewOrder::Random),
            rates: match &pairs {
                None => CheckRates::default(),
                Some(_) => CheckRates {
                    faults: 0.0,
                    duplicates: 0.0,
                },
            },
            pairs,
            seed: QueueOptions::DEFAULT_SEED,
            sample: query.parsed::<usize>("sample").filter(|sample| *sample > 0),
        },
    };
    Ok(ReviewPages::open(catalog, project, options, place.work).await?)
}
