//! The report: the answer, the table of the paper with links to the pairs, and its files.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::response::{Html, Response};
use maud::{Markup, html};

use super::address::{PageQuery, encoded};
use super::attachment::attachment;
use super::components::{
    NavSection, empty, figure, frame, grouped, number_table, score, stored_message,
};
use super::failure::{AppFailure, AppResult};
use super::linked_counts::linked_sentences;
use super::pair_query::{
    ALIGNED_PAIRS, ALL_PAIRS, FAILED_PAIRS, LOW_CONFIDENCE_PAIRS, RETIRED_PAIRS, UNFINISHED_PAIRS,
};
use super::run_blocks::failed_blocks_part;
use super::state::AppState;
use super::visit::Visit;
use crate::on_thread::read_in_turn;
use crate::report_language::report_page;
use crate::review::Language;
use mocban_catalog::JointVerdict;
use mocban_core::domain::{ReviewOrder, ThresholdMetric, one_line};
use mocban_project::ProjectError;
use mocban_project::location::now;
use mocban_project::report::{ReportOptions, read, report};
use mocban_report::{
    CommandPage, CountedPairs, CountedText, MetricRow, Report, ReportFormat, TextPart, command_page,
};
use mocban_results::IntervalMethod;

/// Formats that can be saved: format, extension, content type and name.
const DOWNLOADS: [(ReportFormat, &str, &str, &str); 5] = [
    (
        ReportFormat::Html,
        "html",
        "text/html; charset=utf-8",
        "HTML",
    ),
    (ReportFormat::Csv, "csv", "text/csv; charset=utf-8", "CSV"),
    (ReportFormat::Latex, "tex", "application/x-tex", "LaTeX"),
    (
        ReportFormat::Markdown,
        "md",
        "text/markdown; charset=utf-8",
        "Markdown",
    ),
    (ReportFormat::Json, "json", "application/json", "JSON"),
];

/// Shows the page at once; a script then asks for the numbers, which may take long for a large project.
pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    state.open(&key).await?;
    let body = html! {
        p.row.not-on-paper {
            (visit.t("Save as", "Lưu thành")) ": "
            @for (_, extension, _, name) in DOWNLOADS {
                a.button href={ "report/file/report." (extension) } download { (name) }
            }
            @if visit.language == Language::Vietnamese { span.muted #file-language { "(HTML bằng tiếng Việt, các tệp khác bằng tiếng Anh)" } " " }
            // The numbers of the page are loaded first.
            button #print type="button" data-print disabled { (visit.t("Print or save as PDF", "In hoặc lưu thành PDF")) }
        }
        p.on-paper { (one_line(&key)) " · " (visit.time(now())) }
        div #numbers data-load="report/numbers" aria-live="polite" {
            div.notice { p { (visit.t("Reading the results…", "Đang đọc kết quả…")) } progress aria-label=(visit.t("Reading", "Đang đọc")) {} }
        }
    };
    let title = visit.t("Report", "Báo cáo");
    Ok(frame(&visit, title, Some(&key), NavSection::Report, &body))
}

/// Responds with the numbers as a part of the page.
pub(super) async fn numbers(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let location = open.location();
    let found = read_in_turn(open.reports(), async move || read(&location).await).await?;
    let found = found.map_err(|error| AppFailure::of(error, &open.dir))?;
    Ok(Html(numbers_part(&visit, &key, &found).into_string()))
}

fn numbers_part(visit: &Visit, key: &str, report: &Report) -> Markup {
    let sentences = |text: &CountedText| {
        html! { (linked_sentences(visit, text)) (settle_link(visit, text)) (remedy_link(visit, key, text)) }
    };
    html! {
        @for text in &report.headline { p { (sentences(text)) } }
        @if report.pairs + report.retired > 0 { (counts(visit, report)) }
        (failed_blocks_part(visit, "./", report.block_progress.map_or(0, |blocks| blocks.failed)))
        @if report.rows.iter().all(|row| row.n == 0) {
            (empty(visit.t("There are no results yet.", "Chưa có kết quả."), &html! { a.button href="./" { (visit.t("Run", "Căn chỉnh")) } }))
        } @else {
            (table(visit, report))
            p.muted { (visit.t(
                "Acc is the share of passed results among those that reviewers passed or failed. SSIM, IoU and Dice are means over n pairs.",
                "Acc là tỉ lệ kết quả đạt trong số kết quả được đánh giá đạt hoặc không đạt. SSIM, IoU và Dice là trung bình trên n cặp.",
            )) }
        }
        (reasons(visit, report))
        @if !report.warnings.is_empty() {
            h2 { (visit.t("What limits these numbers", "Những giới hạn của các con số này")) }
            ul { @for text in &report.warnings { li { p { (sentences(text)) } } } }
        }
    }
}

/// Returns the link to the page that does what a command in sentences of the report does, if they name one that is not on the
/// page anyway. Addresses are relative to that of the report.
fn remedy_link(visit: &Visit, key: &str, text: &str) -> Markup {
    let link = match command_page(text) {
        Some(CommandPage::Review) => Some(("review".to_owned(), visit.t("Review", "Đánh giá"))),
        Some(CommandPage::Import) => Some((
            format!("../../import?project={}", encoded(key)),
            visit.t("Import", "Nhập dữ liệu"),
        )),
        Some(CommandPage::Retired) => {
            Some((RETIRED_PAIRS.to_owned(), visit.t("See why", "Xem lý do")))
        }
        Some(CommandPage::Health) => Some(("health".to_owned(), visit.t("Health", "Tình trạng"))),
        Some(CommandPage::Run | CommandPage::Failures) | None => None,
    };
    html! { @if let Some((address, name)) = link { " " a href=(address) { (name) } } }
}

/// Returns the link to the review that settles the disagreements that sentences count. Its address is relative to that of the
/// report.
fn settle_link(visit: &Visit, text: &CountedText) -> Markup {
    let parts = text.parts();
    let counted = parts.iter().flat_map(|part| match part {
        TextPart::Count(_, pairs) => *pairs,
        TextPart::Words(_) => &[],
    });
    let metrics: Vec<ThresholdMetric> = counted
        .filter_map(|pairs| match pairs {
            CountedPairs::Judged(metric, JointVerdict::Conflict) => Some(*metric),
            _ => None,
        })
        .collect();
    // With all metrics, an image that several of them gave is shown once.
    let metric = match metrics.as_slice() {
        [metric] => metric.name(),
        _ => "",
    };
    let settle = PageQuery::default()
        .with("order", ReviewOrder::Adjudicate.name())
        .with("metric", metric);
    html! {
        @if !metrics.is_empty() {
            // With several metrics, it follows their links.
            (if metrics.len() > 1 { " · " } else { " " })
            a href={ "review" (settle.text()) } { (visit.t("Settle the disagreements", "Giải quyết bất đồng")) }
        }
    }
}

/// Returns the numbers of pairs that the sentences above have, with links to these pairs.
fn counts(visit: &Visit, report: &Report) -> Markup {
    let progress = report.progress;
    let row = report.row(ThresholdMetric::DEFAULT);
    let low = row.and_then(|row| row.low_confidence);
    html! {
        div.figures #counts {
            (figure(report.pairs, visit.form(report.pairs, ["pair", "pairs"], "cặp"), Some(ALL_PAIRS), ""))
            (figure(progress.done, visit.t("aligned", "đã căn chỉnh"), Some(ALIGNED_PAIRS), "good"))
            @if let Some(low) = low {
                (figure(low, visit.t("low confidence", "độ tin cậy thấp"), Some(LOW_CONFIDENCE_PAIRS), "warn"))
            }
            (figure(progress.failed, visit.t("failed", "lỗi"), Some(FAILED_PAIRS), "bad"))
            (figure(progress.pending, visit.t("not finished", "chưa xong"), Some(UNFINISHED_PAIRS), ""))
            @if report.retired > 0 {
                (figure(report.retired, visit.t("retired", "đã đưa ra khỏi thống kê"), Some(RETIRED_PAIRS), ""))
            }
        }
    }
}

fn table(visit: &Visit, report: &Report) -> Markup {
    let link = |query: String, number: u64| {
        html! { @if number > 0 { a href={ "pairs?" (query) } { (grouped(number)) } } @else { "0" } }
    };
    let titles = [
        visit.t("Metric", "Độ đo"),
        "n",
        visit.t("judged", "đã đánh giá"),
        visit.t("passed", "đạt"),
        visit.t("failed", "không đạt"),
        "Acc %",
        visit.t("95 % interval", "khoảng 95 %"),
        "SSIM",
        "IoU",
        "Dice",
    ];
    let rows = html! {
        @for row in &report.rows {
            @let metric = row.metric.name();
            tr {
                th scope="row" { (visit.metric(row.metric)) }
                td.number { (link(format!("state=aligned&metric={metric}"), row.n)) }
                td.number { (link(format!("verdict=judged&metric={metric}"), row.judged)) }
                td.number { (link(format!("verdict=joint-pass&metric={metric}"), row.passed)) }
                td.number { (link(format!("verdict=joint-fail&metric={metric}"), row.failed)) }
                td.number { (percent(visit, row.acc)) }
                td.number { (interval(visit, row)) }
                td.number { (score(visit, row.ssim)) } td.number { (score(visit, row.iou)) } td.number { (score(visit, row.dice)) }
            }
        }
    };
    number_table(visit.t("Scores", "Điểm số"), &titles, &rows)
}

fn percent(visit: &Visit, share: Option<f64>) -> String {
    share.map_or_else(|| "–".to_owned(), |share| visit.decimal(100.0 * share, 1))
}

fn interval(visit: &Visit, row: &MetricRow) -> String {
    row.acc_ci95.map_or_else(
        || "–".to_owned(),
        |bounds| {
            bounds
                .map(|bound| visit.decimal(100.0 * bound, 1))
                .join(" – ")
        },
    )
}

/// Returns the failed pairs by class, with links to them.
fn reasons(visit: &Visit, report: &Report) -> Markup {
    html! {
        @if !report.failures.is_empty() {
            h2 { (visit.t("Pairs without a result", "Các cặp không có kết quả")) }
            ul { @for group in &report.failures {
                li { p {
                    a href={ "pairs?view=table&state=failed&class=" (group.class) } { (grouped(group.count)) }
                    " · " (visit.class(group.class))
                    @if let Some(first) = group.pairs.first() { span.muted { " (" @if group.count > 1 { (visit.t("for example", "ví dụ")) ": " } (stored_message(visit, &first.error)) ")" } }
                } }
            } }
        }
    }
}

/// Responds with the report as a file.
pub(super) async fn download(
    State(state): State<Arc<AppState>>,
    Path((key, file)): Path<(String, String)>,
    visit: Visit,
) -> AppResult<Response> {
    let open = state.open(&key).await?;
    let known = DOWNLOADS
        .iter()
        .find(|(_, extension, ..)| file == format!("report.{extension}"));
    let (format, _, kind, _) = *known.ok_or_else(AppFailure::not_found)?;
    let options = ReportOptions {
        format,
        interval: IntervalMethod::default(),
        with_times: false,
    };
    let location = open.location();
    let language = visit.language;
    let render = async move || {
        let mut rendered = report(options, None, &location, &()).await?;
        if format == ReportFormat::Html {
            rendered.text = report_page(rendered.text, language);
        }
        Ok::<_, ProjectError>(rendered)
    };
    let rendered = read_in_turn(open.reports(), render).await?;
    let rendered = rendered.map_err(|error| AppFailure::of(error, &open.dir))?;
    Ok(attachment(&file, kind, rendered.text.into_bytes()))
}

#[cfg(test)]
mod tests {
    use super::{reasons, remedy_link, settle_link};
    use crate::app::visit::Visit;
    use crate::messages;
    use crate::review::Language;
    use mocban_catalog::PairResults;
    use mocban_core::domain::{FailureClass, Verdict};
    use mocban_report::{CommandPage, NAMED_COMMANDS, Report, ReportAccumulator};
    use mocban_results::TruthEvaluation;
    use mocban_results::test_fixtures::{done, failed};

    fn report(pairs: &[PairResults]) -> Report {
        let mut report = ReportAccumulator::default();
        for pair in pairs {
            report.add(pair, &TruthEvaluation::default());
        }
        report.finish()
    }

    #[test]
    fn counted_disagreements_lead_to_the_review_that_settles_them() {
        let [pass, fail] = [Verdict::Pass, Verdict::Fail];
        let report = report(&[done("a", 0.75, &[pass]), done("b", 0.75, &[pass, fail])]);
        let visit = Visit::in_language(Language::English);
        let links = |text| settle_link(&visit, text).into_string();
        let of_one = "review?order=adjudicate&amp;metric=ensemble\">Settle the disagreements";
        let headline = links(&report.headline[1]);
        assert!(headline.contains(of_one), "{headline}");
        assert_eq!(links(&report.headline[0]), "");
        let of_all = "review?order=adjudicate\">";
        let warnings: String = report.warnings.iter().map(links).collect();
        assert!(warnings.contains(of_all), "{warnings}");
    }

    #[test]
    fn the_reason_of_one_of_several_pairs_is_an_example() {
        let error = |name: &str| failed(name, FailureClass::BadInput, "1.png has no ink");
        for (language, example) in [
            (Language::English, " (for example: "),
            (Language::Vietnamese, " (ví dụ: "),
        ] {
            let visit = Visit::in_language(language);
            let of = |pairs: &[PairResults]| reasons(&visit, &report(pairs)).into_string();
            let one = of(&[error("a")]);
            assert!(!one.contains(example), "{one}");
            let two = of(&[error("a"), error("b")]);
            assert!(two.contains(example), "{two}");
        }
    }

    #[test]
    fn a_sentence_with_a_command_has_a_link_instead() {
        let of = |language, text| {
            remedy_link(&Visit::in_language(language), "ván 4", text).into_string()
        };
        let unjudged = "There is no Acc (`mocban review --reviewer NAME` starts judging).";
        assert_eq!(
            of(Language::English, unjudged),
            " <a href=\"review\">Review</a>"
        );
        assert_eq!(
            of(Language::Vietnamese, unjudged),
            " <a href=\"review\">Đánh giá</a>"
        );
        let retired = of(
            Language::English,
            "all are retired; `mocban status --retired` says why.",
        );
        assert_eq!(retired, " <a href=\"pairs?state=retired\">See why</a>");
        let empty = of(
            Language::English,
            "The project has no pairs yet; `mocban import` adds them.",
        );
        assert!(empty.contains("../../import?project="), "{empty}");
        let damaged = of(
            Language::English,
            "1 stored row that is damaged or missing is set apart and not counted, first: row 3; `check` lists them.",
        );
        assert_eq!(damaged, " <a href=\"health\">Health</a>");
        assert_eq!(of(Language::English, "All 2 pairs are aligned."), "");
    }

    #[test]
    fn what_a_sentence_says_without_its_command_is_translated_and_linked() {
        for command in NAMED_COMMANDS {
            let said = command.without.trim_start_matches(". ");
            assert_ne!(messages::report_text(said), said);
            let link = remedy_link(&Visit::in_language(Language::English), "p", command.clause);
            let is_on_page = [CommandPage::Run, CommandPage::Failures].contains(&command.page);
            assert_eq!(link.into_string().is_empty(), is_on_page, "{command:?}");
        }
    }
}
