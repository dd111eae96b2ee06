//! The page of a pair: its pictures, its numbers with their meaning, its files and its history.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::response::{Html, IntoResponse as _, Response};
use maud::{Markup, html};

use super::address::encoded;
use super::components::{NavSection, action_form, frame, metadata, scan_file, stored_message};
use super::failure::AppResult;
use super::missing_names::no_pair;
use super::pair_history::{history, verdict_line};
use super::pair_numbers::numbers;
use super::paper_method::{PAPER, is_comparable};
use super::remedies::{MendedPairs, failed_part, import_address, pair_remedy, unit_link};
use super::retired_pairs::retired_band;
use super::scan_correction::ScanQuestion;
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::view::{page as scan_page, scan_asset};
use mocban_catalog::PairDetail;
use mocban_core::domain::{FailureClass, JobStatus, PairName, Stage, ThresholdMetric, one_line};
use mocban_project::details::{self, Details, PairOverview};
use mocban_project::input_warnings;

/// A picture: its key, and its name in both languages.
type Layer = (&'static str, [&'static str; 2]);

/// Pictures that can be chosen, with their keys and names.
const LAYERS: [Layer; 5] = [
    ("print", ["Print", "Bản in"]),
    ("relief", ["Relief (depth)", "Mặt khắc (độ sâu)"]),
    ("print_mask", ["Ink of the print", "Mực của bản in"]),
    ("depth_mask", ["Strokes of the relief", "Nét của mặt khắc"]),
    ("overlay", ["Print with outline", "Bản in và đường viền"]),
];

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path((key, pair)): Path<(String, String)>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let Ok(name) = pair.parse::<PairName>() else {
        return Err(no_pair(&pair));
    };
    if let Some(retired) = open.catalog.retired_pair(&name).await? {
        let neighbours = open.catalog.pair_neighbours(&name).await?;
        let log = open.catalog.verdict_log(Some(&name)).await?;
        let body = html! {
            (neighbour_links(&visit, &neighbours))
            (retired_band(&visit, &retired))
            @if !log.is_empty() {
                section {
                    h2 { (visit.t("Verdicts", "Các đánh giá")) }
                    ul.history { @for event in &log { (verdict_line(&visit, event)) } }
                }
            }
        };
        let title = one_line(name.as_str());
        return Ok(frame(&visit, &title, Some(&key), NavSection::Pairs, &body));
    }
    let unknown = open.catalog.unknown_names(std::slice::from_ref(&name));
    if !unknown.await?.is_empty() {
        return Err(no_pair(&pair));
    }
    let found = details::read(&pair, &open.catalog, &open.location()).await?;
    let Details::Pair(overview) = found else {
        return Err(no_pair(&pair));
    };
    let name = overview.detail.results.attributes.name.clone();
    let neighbours = open.catalog.pair_neighbours(&name).await?;
    let chosen = visit
        .query
        .parsed("metric")
        .unwrap_or(ThresholdMetric::DEFAULT);
    let record = overview.detail.results.metric(chosen);
    let record = record.or_else(|| overview.detail.results.metrics.first());
    let shown = record.map(|record| record.outcome.metric);
    let compared = visit.query.parsed::<ThresholdMetric>("compare");
    let compared = compared.filter(|other| Some(*other) != shown);
    let other = compared.and_then(|other| overview.detail.results.metric(other));
    let with_paper =
        visit.query.get("compare") == Some(PAPER) && is_comparable(&overview.detail.results);
    let body = html! {
        (neighbour_links(&visit, &neighbours))
        (state_line(&visit, &key, &overview))
        @if let Some(record) = record {
            @let (metric, other_metric) = (record.outcome.metric, other.map(|other| other.outcome.metric));
            (metric_links(&visit, &overview.detail, metric, other_metric))
            @if with_paper { (paper_part(&visit, metric)) }
            (pictures(&visit, &LAYERS, Some(metric), other_metric))
            (numbers(&visit, record, other))
        } @else {
            (pictures(&visit, &layers_without_result(&overview.detail), None, None))
        }
        (files(&visit, &overview.detail))
        (history(&visit, &overview))
        (pair_actions(&visit, &key, &overview.detail))
        script type="module" src={ (visit.root) "assets/pair.js" } {}
    };
    let title = match &overview.detail.results.attributes.character {
        Some(character) => format!("{} {}", one_line(name.as_str()), one_line(character)),
        None => one_line(name.as_str()).to_string(),
    };
    Ok(frame(&visit, &title, Some(&key), NavSection::Pairs, &body))
}

/// Responds with the page of the 3D view.
pub(super) async fn scan_view(
    State(state): State<Arc<AppState>>,
    Path((key, pair)): Path<(String, String)>,
    visit: Visit,
) -> AppResult<Response> {
    let open = state.open(&key).await?;
    let results = super::pictures::results(&open, &pair).await?;
    let name = results.attributes.name.as_str();
    let page = scan_page::view(name, Some(visit.language), Some("../"));
    Ok(Html(page).into_response())
}

/// Responds with a script or style of the 3D view.
pub(super) async fn scan_view_asset(
    Path((_, _, name)): Path<(String, String, String)>,
) -> Response {
    scan_asset(Path(name)).await
}

fn neighbour_links(visit: &Visit, neighbours: &[Option<PairName>; 2]) -> Markup {
    let [before, after] = neighbours;
    let link = |name: &Option<PairName>, rel: &str, text: &str| {
        html! {
            @if let Some(name) = name {
                a.button rel=(rel) href={ "../" (encoded(name.as_str())) "/" (visit.query.text()) } { (text) }
            }
        }
    };
    html! {
        nav.pager aria-label=(visit.t("Neighbours", "Cặp kề bên")) {
            (link(before, "prev", visit.t("← Previous pair", "← Cặp trước")))
            (link(after, "next", visit.t("Next pair →", "Cặp sau →")))
            a href="../../pairs" { (visit.t("All pairs", "Tất cả các cặp")) }
        }
    }
}

fn state_line(visit: &Visit, key: &str, overview: &PairOverview) -> Markup {
    let results = &overview.detail.results;
    html! {
        p {
            span.state.(results.status.name()) { (visit.status(results.status)) }
            @if let Some(block) = &results.attributes.block { " · " (visit.t("block", "ván:")) " " (one_line(block)) }
            @if results.status == JobStatus::Done && (overview.next_run.is_some() || !overview.changed_inputs.is_empty()) {
                " · " span.warn { (visit.t("settings or files have changed; the next run computes it again", "thiết lập hoặc tệp đã đổi; lần chạy sau sẽ tính lại")) }
            }
        }
        @if let Some(stored) = &results.failure {
            div.notice.bad {
                p { b { (visit.class(stored.failure.class)) } " (" (failed_part(visit, &results.attributes, stored.stage, &stored.failure.message)) "): " (stored_message(visit, &stored.failure.message)) }
                @if let Some(link) = unit_link(visit, "../../", results) {
                    p { (visit.t("If this unit is wrong, set another one. The pair is then computed again.", "Nếu đơn vị này sai, hãy đặt đơn vị khác. Sau đó cặp này được tính lại.")) }
                    p.row { (link) }
                } @else {
                    (pair_remedy(visit, key, stored.failure.class, 1, &[results]))
                }
            }
        }
        @for warning in input_warnings::of_pair(results) {
            div.notice.warn { p { (one_line(Sentence::of_program(&warning).text(visit.language))) } }
        }
    }
}

/// Returns the links that choose the metric, and another one to compare it with.
fn metric_links(
    visit: &Visit,
    detail: &PairDetail,
    shown: ThresholdMetric,
    other: Option<ThresholdMetric>,
) -> Markup {
    let metrics = detail.results.metrics.iter();
    let metrics: Vec<_> = metrics.map(|record| record.outcome.metric).collect();
    let has_paper = is_comparable(&detail.results);
    let with_paper = has_paper && visit.query.get("compare") == Some(PAPER);
    let link = |name: &str, value: &str, is_shown: bool, text: &str| {
        html! {
            a href={ "./" (visit.query.with(name, value).text()) } aria-current=[is_shown.then_some("true")] { (text) } " "
        }
    };
    html! {
        p.views {
            (visit.t("Threshold", "Ngưỡng")) ": "
            @for metric in &metrics { (link("metric", metric.name(), *metric == shown, visit.metric(*metric))) }
        }
        @if metrics.len() > 1 {
            p.views #compare {
                (visit.t("Compare with", "So sánh với")) ": "
                (link("compare", "", other.is_none() && !with_paper, visit.t("none", "không")))
                @for metric in metrics.iter().filter(|metric| **metric != shown) {
                    (link("compare", metric.name(), Some(*metric) == other, visit.metric(*metric)))
                }
                @if has_paper { (link("compare", PAPER, with_paper, visit.t("The paper's method", "Phương pháp của bài báo"))) }
            }
        }
    }
}

/// Returns the part that compares the result with that of the paper's method, which a script asks for, because it takes a while.
fn paper_part(visit: &Visit, metric: ThresholdMetric) -> Markup {
    html! {
        section #paper data-load={ "paper-method?metric=" (metric) } aria-live="polite" {
            div.notice {
                p { (visit.t("Aligning the pair by the paper's method…", "Đang căn chỉnh cặp này theo phương pháp của bài báo…")) }
                progress aria-label=(visit.t("Aligning", "Đang căn chỉnh")) {}
            }
        }
    }
}

/// Returns the pictures of a pair without a result: its print, and what its finished stages have made.
fn layers_without_result(detail: &PairDetail) -> Vec<Layer> {
    let has = |stage| detail.results.stage(stage).is_some();
    let shown = LAYERS.into_iter().filter(|(name, _)| match *name {
        "print" => true,
        "relief" => has(Stage::Depth),
        "print_mask" => has(Stage::Normalize),
        _ => false,
    });
    shown.collect()
}

/// Returns the pictures of the result of a metric, and of another one beside it. Without a result, the relief is not
/// aligned.
fn pictures(
    visit: &Visit,
    layers: &[Layer],
    metric: Option<ThresholdMetric>,
    other: Option<ThresholdMetric>,
) -> Markup {
    let (shown, alt) = if metric.is_some() {
        let alt = visit.t(
            "Print with the outline of the aligned relief",
            "Bản in và đường viền của mặt khắc đã căn chỉnh",
        );
        ("overlay", alt)
    } else {
        ("print", visit.t("Print", "Bản in"))
    };
    let blink = match other {
        Some(_) => visit.t("Blink the two metrics", "Xem luân phiên hai độ đo"),
        None => visit.t(
            "Blink print and relief",
            "Xem luân phiên bản in và mặt khắc",
        ),
    };
    let first = metric.unwrap_or(ThresholdMetric::DEFAULT);
    html! {
        section.viewer #viewer aria-label=(visit.t("Pictures", "Hình ảnh")) {
            div.stages {
                (stage(visit, "stage", shown, alt, first, other.is_some()))
                @if let Some(other) = other { (stage(visit, "other-stage", shown, alt, other, true)) }
            }
            div.controls {
                @if layers.len() > 1 {
                    button #blink type="button" aria-pressed="false" { (blink) " " kbd { "B" } }
                }
                a.button href="3d/" { (visit.t("3D view", "Xem 3D")) }
                @for (layer, names) in layers { (layer_button(visit, layer, names, [Some(first), other], *layer == shown)) }
            }
        }
    }
}

/// Returns a large picture, with its metric below it if there are two.
fn stage(
    visit: &Visit,
    id: &str,
    shown: &str,
    alt: &str,
    metric: ThresholdMetric,
    is_named: bool,
) -> Markup {
    html! {
        figure.stage {
            img id=(id) src={ "picture/" (shown) "-" (metric) } alt=(alt) width="640" height="640";
            @if is_named { figcaption { (visit.metric(metric)) } }
        }
    }
}

/// Returns a small picture that is shown large when it is pressed, also under another metric.
fn layer_button(
    visit: &Visit,
    layer: &str,
    names: &[&str; 2],
    metrics: [Option<ThresholdMetric>; 2],
    is_shown: bool,
) -> Markup {
    let [picture, other] =
        metrics.map(|metric| metric.map(|metric| format!("picture/{layer}-{metric}")));
    html! {
        figure {
            button.layer type="button" data-layer=(layer) data-src=[&picture] data-other=[other] aria-pressed=(is_shown.to_string()) {
                img src=[picture] alt="" loading="lazy" width="150" height="150";
                span { (names[visit.index()]) }
            }
        }
    }
}

fn files(visit: &Visit, detail: &PairDetail) -> Markup {
    let attributes = &detail.results.attributes;
    html! {
        section {
            h2 { (visit.t("Files", "Các tệp")) }
            dl {
                (scan_file(visit, &attributes.mesh_path, attributes.unit))
                dt { (visit.t("Print", "Bản in")) } dd { code { (one_line(&attributes.print_path)) } }
                (metadata(&attributes.meta))
            }
        }
    }
}

fn pair_actions(visit: &Visit, key: &str, detail: &PairDetail) -> Markup {
    let name = detail.results.attributes.name.as_str();
    let failed = detail.results.status == JobStatus::Quarantined;
    let class = detail
        .results
        .failure
        .as_ref()
        .map(|stored| stored.failure.class);
    let may_help = class.is_some_and(|class| class != FailureClass::BadInput);
    html! {
        section.actions {
            @if failed {
                a.button #mend href=(import_address(visit, key, Some(MendedPairs::Pair(name)))) {
                    (visit.t("Replace the scan or the print", "Thay bản quét hoặc bản in"))
                }
            }
            @if failed && may_help {
                (action_form("../../actions/retry", "inline", &html! {
                    input type="hidden" name="pair" value=(name);
                    button { (visit.t("Let it run again", "Cho chạy lại")) }
                }))
            }
            @if detail.results.attributes.prior.is_none() {
                @for question in ScanQuestion::ALL {
                    a.button href={ "../../correct?what=" (question.name()) "&pair=" (encoded(name)) } { (question.title(visit, 1)) }
                }
            }
            (action_form("../../actions/retire", "inline", &html! {
                input type="hidden" name="pair" value=(name);
                button data-confirm=(visit.t("Take this pair out of every count? Its results and verdicts are kept.", "Đưa cặp này ra khỏi mọi thống kê? Kết quả và đánh giá của nó vẫn được giữ."))
                    { (visit.t("Take out of every count", "Đưa ra khỏi thống kê")) }
            }))
        }
    }
}
