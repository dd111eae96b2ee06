//! Builds the report of a project.

use std::collections::BTreeSet;
use std::path::Path;

use crate::error::ProjectResult;
use crate::events::{Listener, LongWork, warn, warn_about_set_apart};
use crate::location::{Location, now};
use crate::own_files::{refuse_foreign_report, refuse_used_file};
use crate::status::warn_about_stale;
use mocban_config::{Sources, load};
use mocban_export::{GallerySelection, draw_gallery};
use mocban_report::{
    Cover, Report, ReportFormat, build, build_with, is_changed, is_continued, is_report, page,
    render,
};
use mocban_results::IntervalMethod;
use mocban_store::Project;
use mocban_system::time_text::day;

/// Seed of the random choice of images; the HTML page states it.
const IMAGE_SEED: u64 = 1;

/// What to report, and how.
#[derive(Debug, Clone, Copy)]
pub struct ReportOptions {
    /// The format.
    pub format: ReportFormat,
    /// Confidence intervals of Acc.
    pub interval: IntervalMethod,
    /// Whether to include computing times, as HTML always does.
    pub with_times: bool,
}

/// A report as data and in its format.
#[derive(Debug)]
pub struct RenderedReport {
    /// The numbers.
    pub report: Report,
    /// The same in the format.
    pub text: String,
    /// Whether no image and no true alignment is missing.
    pub is_complete: bool,
}

/// Builds the report of a project. `output` is the file that it will be written to; a file that the project needs is refused,
/// and so is every file that is not an earlier report as it was written.
pub async fn report(
    options: ReportOptions,
    output: Option<&Path>,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<RenderedReport> {
    let (project, catalog) = location.open_read_only().await?;
    if let Some(path) = output {
        refuse_used_file(path, &project, &catalog).await?;
        refuse_foreign_report(path, is_report, is_changed, is_continued)?;
    }
    warn_about_stale(&catalog, location, listener).await?;
    let _work = LongWork::begin(listener, "reading the results");
    let is_page = options.format == ReportFormat::Html;
    let mut pictures = GallerySelection::new(IMAGE_SEED);
    let report = if is_page {
        build_with(&catalog, &project, |pair, truth| pictures.add(pair, truth)).await?
    } else {
        build(&catalog, &project).await?
    };
    let mut report = with_defaults(report)?.with_interval(options.interval);
    if !options.with_times && !is_page {
        report = report.without_times();
    }
    if let Some(problem) = &report.unusable_truth {
        let text = format!("the report lacks the true alignment of {problem}");
        warn(listener, text);
    }
    warn_about_set_apart(listener, &report.set_apart);
    let has_truth = report.unusable_truth.is_none();
    let (text, has_images) = if is_page {
        let limits = location.settings()?.config.limits.image;
        let gallery = draw_gallery(pictures, &catalog, &project, limits).await?;
        let items = gallery.groups.iter().flat_map(|group| &group.items);
        let problems: BTreeSet<String> = items
            .filter_map(|item| Some(format!("{}: {}", item.pair, item.problem.as_ref()?)))
            .collect();
        for problem in &problems {
            warn(listener, format!("the report lacks images of {problem}"));
        }
        (
            page(&report, &gallery, &cover(&project)),
            problems.is_empty(),
        )
    } else {
        (render(&report, options.format), true)
    };
    catalog.close().await;
    Ok(RenderedReport {
        report,
        text,
        is_complete: has_truth && has_images,
    })
}

/// Returns the numbers of a project's report, without warnings and computing times.
pub async fn read(location: &Location) -> ProjectResult<Report> {
    let (project, catalog) = location.open_read_only().await?;
    let report = build(&catalog, &project).await?.without_times();
    catalog.close().await;
    with_defaults(report)
}

fn cover(project: &Project) -> Cover {
    let dir = std::path::absolute(project.dir()).unwrap_or_else(|_| project.dir().to_owned());
    let name = dir.file_name().map(|name| name.to_string_lossy().into());
    Cover {
        project: name,
        date: Some(day(now())),
    }
}

/// Names the settings of the results that are not the default ones.
fn with_defaults(mut report: Report) -> ProjectResult<Report> {
    let defaults = load(&Sources::default())?.config.stages;
    let fields = |stage| defaults.fingerprint_fields(stage);
    report.provenance.compare_with(fields);
    Ok(report)
}
