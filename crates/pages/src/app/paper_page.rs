//! The part of the page of a pair that shows the result of the paper's method beside the stored one.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::http::header;
use axum::response::{Html, IntoResponse as _, Response};
use maud::{Markup, html};

use super::encoded_picture::JPEG;
use super::failure::{AppFailure, AppResult};
use super::pair_numbers::compared_numbers;
use super::paper_method::PaperAlignment;
use super::pictures::results;
use super::state::AppState;
use super::visit::Visit;
use mocban_core::domain::{MetricOutcome, ThresholdMetric, one_line};

/// Responds with the part of the page of a pair that compares both methods.
pub(super) async fn part(
    State(state): State<Arc<AppState>>,
    Path((key, pair)): Path<(String, String)>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let pair = results(&open, &pair).await?;
    let found = state.paper.of(&open, &pair).await?;
    let metric = visit.query.parsed("metric").unwrap_or_default();
    let stored = pair.metric(metric).or_else(|| pair.metrics.first());
    let stored = stored.ok_or_else(AppFailure::not_found)?;
    let part = match &*found {
        Ok(alignment) => comparison(&visit, &stored.outcome, alignment),
        Err(why) => html! {
            p.notice.warn {
                (visit.t("The paper's method finds no alignment: ", "Phương pháp của bài báo không tìm được cách căn chỉnh: "))
                (one_line(why.text(visit.language)))
            }
        },
    };
    Ok(Html(html! { (part) (not_stored(&visit)) }.into_string()))
}

/// Responds with the picture of a metric, such as `overlay-ensemble`.
pub(super) async fn picture(
    State(state): State<Arc<AppState>>,
    Path((key, pair, name)): Path<(String, String, String)>,
) -> AppResult<Response> {
    let metric = name.strip_prefix("overlay-");
    let metric = metric.and_then(|metric| metric.parse::<ThresholdMetric>().ok());
    let metric = metric.ok_or_else(AppFailure::not_found)?;
    let open = state.open(&key).await?;
    let pair = results(&open, &pair).await?;
    let found = state.paper.of(&open, &pair).await?;
    let drawn = match &*found {
        Ok(alignment) => alignment.of(metric),
        Err(_) => None,
    };
    let (_, bytes) = drawn.ok_or_else(AppFailure::not_found)?;
    Ok(([(header::CONTENT_TYPE, JPEG)], bytes.clone()).into_response())
}

/// Returns the pictures and the numbers of both results.
fn comparison(visit: &Visit, stored: &MetricOutcome, alignment: &PaperAlignment) -> Markup {
    let Some((paper, _)) = alignment.of(stored.metric) else {
        return html! {};
    };
    let titles = [
        (visit.t("This program", "Chương trình này"), stored.metric),
        (
            visit.t("The paper's method", "Phương pháp của bài báo"),
            paper.metric,
        ),
    ];
    let titles = titles.map(|(method, metric)| format!("{method}, {}", visit.metric(metric)));
    let pictures = [
        format!("picture/overlay-{}", stored.metric),
        format!("paper-method/overlay-{}", paper.metric),
    ];
    let alt = visit.t(
        "Print with the outline of the aligned relief",
        "Bản in và đường viền của mặt khắc đã căn chỉnh",
    );
    html! {
        div.methods {
            @for (picture, title) in pictures.iter().zip(&titles) {
                figure {
                    img src=(picture) alt={ (alt) ": " (title) } width="640" height="640";
                    figcaption { (title) }
                }
            }
        }
        @if stored.metric != paper.metric {
            p.muted { (visit.t(
                "The paper's method does not compute the metric of this page, so another one is shown.",
                "Phương pháp của bài báo không tính độ đo của trang này nên một độ đo khác được hiện.",
            )) }
        }
        (compared_numbers(visit, &titles[1], [stored, paper], [&titles[0], &titles[1]]))
    }
}

fn not_stored(visit: &Visit) -> Markup {
    html! {
        p.muted { (visit.t(
            "Computed now from the files of the pair with the settings of this project, and not stored. The numbers of each method are of its own masks, so compare the pictures first. To judge both methods, import the pairs into a second project and choose the paper's method there, under Settings.",
            "Vừa được tính từ các tệp của cặp với thiết lập của dự án này, và không được lưu. Các con số của mỗi phương pháp thuộc về mặt nạ của chính nó, vì vậy trước hết hãy so sánh hình. Để đánh giá cả hai phương pháp, hãy nhập các cặp vào một dự án thứ hai và chọn phương pháp của bài báo ở trang Thiết lập của dự án đó.",
        )) }
    }
}

#[cfg(test)]
mod tests {
    use super::comparison;
    use crate::app::paper_method::{PaperAlignment, is_comparable};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use axum::body::Bytes;
    use mocban_core::domain::ThresholdMetric;
    use mocban_results::test_fixtures;

    #[test]
    fn the_result_of_the_paper_is_beside_the_stored_one_in_both_languages() {
        let ours = test_fixtures::done("a", 0.75, &[]);
        assert!(is_comparable(&ours));
        let theirs = test_fixtures::done_by_paper("a", 0.5, &[]);
        assert!(!is_comparable(&theirs));
        let metrics = theirs.metrics.iter();
        let alignment = PaperAlignment {
            metrics: metrics
                .map(|record| (record.outcome, Bytes::new()))
                .collect(),
        };
        let shown = |language, metric| {
            let stored = ours.metric(metric).expect("a result").outcome;
            comparison(&Visit::in_language(language), &stored, &alignment).into_string()
        };
        let english = shown(Language::English, ThresholdMetric::Density);
        for part in [
            "src=\"picture/overlay-density\"",
            "src=\"paper-method/overlay-density\"",
            "<figcaption>The paper's method, Pixel density<",
            ">0.750<",
            ">0.500<",
            ">+0.250<",
        ] {
            assert!(english.contains(part), "{part}: {english}");
        }
        assert!(!english.contains("another one is shown"), "{english}");
        let other = shown(Language::Vietnamese, ThresholdMetric::Relief);
        for part in [
            "src=\"picture/overlay-relief\"",
            "src=\"paper-method/overlay-ensemble\"",
            "Phương pháp của bài báo, Kết hợp",
            "nên một độ đo khác được hiện",
            "+0,250",
        ] {
            assert!(other.contains(part), "{part}: {other}");
        }
    }
}
