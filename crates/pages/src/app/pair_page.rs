//! The page of a pair: its pictures, its numbers with their meaning, its files and its history.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::response::{Html, IntoResponse as _, Response};
use maud::{Markup, html};

use super::address::encoded;
use super::components::{NavSection, action_form, frame, scan_file, score, stored_message};
use super::failure::AppResult;
use super::state::AppState;
use super::visit::Visit;
use crate::view::{page as scan_page, scan_asset};
use mocban_catalog::{MetricRecord, PairDetail};
use mocban_core::domain::{FailureClass, JobStatus, PairName, ThresholdMetric, one_line};
use mocban_project::details::{self, Details, PairOverview};
use mocban_system::time_text::local;

/// Pictures that can be chosen, with their keys and names.
const LAYERS: [(&str, [&str; 2]); 5] = [
    ("print", ["Print", "Bản in"]),
    ("relief", ["Relief (depth)", "Mặt khắc (độ sâu)"]),
    ("print_mask", ["Ink of the print", "Mực của bản in"]),
    ("depth_mask", ["Strokes of the relief", "Nét của mặt khắc"]),
    ("overlay", ["Print with outline", "Bản in và đường viền"]),
];

/// Most events of the history that are shown.
const SHOWN_EVENTS: usize = 50;

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path((key, pair)): Path<(String, String)>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    if pair.parse::<PairName>().is_err() {
        return Err(super::failure::AppFailure::not_found());
    }
    let found = details::read(&pair, &open.catalog, &open.location()).await?;
    let Details::Pair(overview) = found else {
        return Err(super::failure::AppFailure::not_found());
    };
    let name = overview.detail.results.attributes.name.clone();
    let neighbours = open.catalog.pair_neighbours(&name).await?;
    let chosen = visit
        .query
        .parsed("metric")
        .unwrap_or(ThresholdMetric::DEFAULT);
    let record = overview.detail.results.metric(chosen);
    let record = record.or_else(|| overview.detail.results.metrics.first());
    let body = html! {
        (neighbour_links(&visit, &neighbours))
        (state_line(&visit, &overview))
        @if let Some(record) = record {
            (metric_links(&visit, &overview.detail, record.outcome.metric))
            (pictures(&visit, record.outcome.metric, true))
            (numbers(&visit, record))
        } @else {
            (pictures(&visit, chosen, false))
        }
        (files(&visit, &overview.detail))
        (history(&visit, &overview.detail))
        (pair_actions(&visit, &overview.detail))
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
    let page = scan_page::view(name, Some(visit.language));
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

fn state_line(visit: &Visit, overview: &PairOverview) -> Markup {
    let results = &overview.detail.results;
    html! {
        p {
            span.state.(results.status.name()) { (visit.status(results.status)) }
            @if let Some(block) = &results.attributes.block { " · " (visit.t("block", "ván")) " " (one_line(block)) }
            @if results.status == JobStatus::Done && overview.next_run.is_some() {
                " · " span.warn { (visit.t("settings or files have changed; the next run computes it again", "thiết lập hoặc tệp đã đổi; lần chạy sau sẽ tính lại")) }
            }
        }
        @if let Some(stored) = &results.failure {
            div.notice.bad {
                p { b { (visit.class(stored.failure.class)) } " (" (visit.stage(stored.stage)) "): " (stored_message(&stored.failure.message)) }
                p { (visit.remedy(stored.failure.class)) }
            }
        }
    }
}

fn metric_links(visit: &Visit, detail: &PairDetail, shown: ThresholdMetric) -> Markup {
    html! {
        p.views {
            (visit.t("Threshold", "Ngưỡng")) ": "
            @for record in &detail.results.metrics {
                @let metric = record.outcome.metric;
                a href={ "./" (visit.query.with("metric", metric.name()).text()) } aria-current=[(metric == shown).then_some("true")] {
                    (visit.metric(metric))
                } " "
            }
        }
    }
}

/// Returns the pictures. A pair without a result has only its print.
fn pictures(visit: &Visit, metric: ThresholdMetric, has_result: bool) -> Markup {
    let (shown, alt) = if has_result {
        let alt = visit.t(
            "Print with the outline of the aligned relief",
            "Bản in và đường viền của mặt khắc đã căn chỉnh",
        );
        ("overlay", alt)
    } else {
        ("print", visit.t("Print", "Bản in"))
    };
    let layers = &LAYERS[..if has_result { LAYERS.len() } else { 1 }];
    html! {
        section.viewer #viewer aria-label=(visit.t("Pictures", "Hình ảnh")) {
            div.stage { img #stage src={ "picture/" (shown) "-" (metric) } alt=(alt) width="640" height="640"; }
            div.controls {
                @if has_result {
                    button #blink type="button" aria-pressed="false" { (visit.t("Blink print and relief", "Nháy bản in và mặt khắc")) " " kbd { "B" } }
                    a.button href="3d/" { (visit.t("3D view", "Xem 3D")) }
                }
                @for (layer, names) in layers { (layer_button(visit, layer, names, metric, *layer == shown)) }
            }
        }
    }
}

/// Returns a small picture that is shown large when it is pressed.
fn layer_button(
    visit: &Visit,
    layer: &str,
    names: &[&str; 2],
    metric: ThresholdMetric,
    is_shown: bool,
) -> Markup {
    let picture = format!("picture/{layer}-{metric}");
    html! {
        figure {
            button.layer type="button" data-layer=(layer) data-src=(picture) aria-pressed=(is_shown.to_string()) {
                img src=(picture) alt="" loading="lazy" width="150" height="150";
                span { (names[visit.index()]) }
            }
        }
    }
}

/// Returns the rows of the table of numbers: name, value, meaning.
fn number_rows(visit: &Visit, record: &MetricRecord) -> Vec<(String, String, &'static str)> {
    let outcome = &record.outcome;
    let scores = &outcome.scores;
    let row = |name: &str, value: String, meaning| (name.to_owned(), value, meaning);
    let score = |value| score(Some(value));
    vec![
        row(
            visit.t("Confidence", "Độ tin cậy"),
            super::components::score(outcome.confidence),
            MEANINGS[6][visit.index()],
        ),
        row("IoU", score(scores.iou), MEANINGS[0][visit.index()]),
        row("Dice", score(scores.dice), MEANINGS[1][visit.index()]),
        row("SSIM", score(scores.ssim), MEANINGS[2][visit.index()]),
        row(
            visit.t("Rotation", "Góc xoay"),
            format!("{:.1}°", outcome.angle_deg),
            MEANINGS[3][visit.index()],
        ),
        row(
            visit.t("Scale", "Tỉ lệ"),
            format!("{:.3}", outcome.scale),
            MEANINGS[4][visit.index()],
        ),
        row(
            visit.t("Margin", "Khoảng cách điểm"),
            score(outcome.margin),
            MEANINGS[5][visit.index()],
        ),
    ]
}

/// What the numbers mean, in both languages.
const MEANINGS: [[&str; 2]; 7] = [
    [
        "Common part of the two stroke masks, divided by all of both. Ink spreads, so the true alignment stays below 1.",
        "Phần chung của hai mặt nạ nét chia cho toàn bộ hai mặt nạ. Mực loang nên căn chỉnh đúng vẫn dưới 1.",
    ],
    [
        "The same comparison, in which the common part counts twice.",
        "Phép so sánh tương tự, trong đó phần chung được tính hai lần.",
    ],
    [
        "Structural similarity of the two masks.",
        "Độ tương đồng cấu trúc của hai mặt nạ.",
    ],
    [
        "How far the relief is turned to lie on the print, clockwise.",
        "Mặt khắc được xoay bao nhiêu để khớp bản in, theo chiều kim đồng hồ.",
    ],
    [
        "Pixels of the print per pixel of the depth map.",
        "Số điểm ảnh của bản in trên một điểm ảnh của bản đồ độ sâu.",
    ],
    [
        "Score of this pose minus that of the best other pose. A small margin means a close decision.",
        "Điểm của tư thế này trừ điểm của tư thế tốt nhất còn lại. Khoảng cách nhỏ nghĩa là khó phân định.",
    ],
    [
        "Calibrated probability that this alignment is right. If it is low, look at the pictures yourself.",
        "Xác suất đã hiệu chuẩn rằng cách căn chỉnh này đúng. Nếu thấp, hãy tự xem hình.",
    ],
];

fn numbers(visit: &Visit, record: &MetricRecord) -> Markup {
    html! {
        section {
            h2 { (visit.t("Numbers", "Các con số")) }
            div.scroll tabindex="0" role="region" aria-label=(visit.t("Numbers", "Các con số")) {
                table.meanings { tbody { @for (name, value, meaning) in number_rows(visit, record) {
                    tr { th scope="row" { (name) } td.number { (value) } td.muted { (meaning) } }
                } } }
            }
            @for given in &record.verdicts {
                p {
                    span.verdict.(given.verdict.name()) { (visit.verdict(given.verdict)) }
                    " " (one_line(&given.reviewer))
                    @if let Some(reason) = given.reason { ": " (visit.reason(reason)) }
                }
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
                @for (name, value) in &attributes.meta {
                    dt { (one_line(name)) } dd { (one_line(&value.as_str().map_or_else(|| value.to_string(), str::to_owned))) }
                }
            }
        }
    }
}

fn history(visit: &Visit, detail: &PairDetail) -> Markup {
    let hidden = detail.attempts.len().saturating_sub(SHOWN_EVENTS);
    html! {
        section {
            details {
                summary { h2 { (visit.t("History", "Lịch sử")) } }
                ul.history {
                    @for attempt in detail.attempts.iter().skip(hidden) {
                        li {
                            (local(attempt.at)) " · " (visit.stage(attempt.stage)) " · "
                            @match &attempt.failure {
                                Some(failure) => span.bad { (visit.class(failure.class)) ": " (stored_message(&failure.message)) },
                                None => { (visit.t("done", "xong")) @if let Some(ms) = attempt.ms { " (" (ms) " ms)" } }
                            }
                        }
                    }
                    @for event in &detail.verdict_log {
                        li {
                            (local(event.at)) " · " (one_line(&event.reviewer)) " · " (visit.verdict(event.verdict))
                            " (" (visit.metric(event.metric)) ")"
                            @if event.undone_at.is_some() { " · " (visit.t("taken back", "đã rút lại")) }
                        }
                    }
                }
            }
        }
    }
}

fn pair_actions(visit: &Visit, detail: &PairDetail) -> Markup {
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
            @if failed && may_help {
                (action_form("../../actions/retry", "inline", &html! {
                    input type="hidden" name="pair" value=(name);
                    button { (visit.t("Let it run again", "Cho chạy lại")) }
                }))
            }
            (action_form("../../actions/retire", "inline", &html! {
                input type="hidden" name="pair" value=(name);
                button data-confirm=(visit.t("Take this pair out of every count? Its results and verdicts are kept.", "Đưa cặp này ra khỏi mọi thống kê? Kết quả và đánh giá của nó vẫn được giữ."))
                    { (visit.t("Take out of every count", "Đưa ra khỏi thống kê")) }
            }))
        }
    }
}
