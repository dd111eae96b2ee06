//! The answer of a report and its limits in sentences. The report itself is in English, so the Vietnamese ones are made here.

use super::number_text::{grouped, with_decimal_sign};
use super::sentence::without_commands;
use super::visit::Visit;
use crate::review::Language;
use mocban_core::domain::{MetricOutcome, ThresholdMetric, sanitize};
use mocban_report::{Basis, Comparison, MetricRow, Report};
use mocban_results::number_format::{format_p, format_rate};
use mocban_results::stats::SIGNIFICANCE_LEVEL;

/// Returns the paragraphs of the answer.
pub(super) fn headline(visit: &Visit, report: &Report) -> Vec<String> {
    match visit.language {
        Language::English => plain(&report.headline),
        Language::Vietnamese if report.pairs == 0 && report.retired > 0 => {
            let retired = grouped(report.retired);
            vec![format!(
                "Không có gì để báo cáo: mọi cặp của dự án ({retired}) đã được đưa ra khỏi thống kê."
            )]
        }
        Language::Vietnamese if report.pairs == 0 => vec![without_pairs(report)],
        Language::Vietnamese if report.progress.done == 0 => vec![aligned(report)],
        Language::Vietnamese => vec![
            aligned(report),
            [Some(accuracy(visit, report)), truth(visit, report)]
                .into_iter()
                .flatten()
                .collect::<Vec<String>>()
                .join(" "),
            differences(visit, report),
        ],
    }
}

/// Returns what limits the numbers.
pub(super) fn limits(visit: &Visit, report: &Report) -> Vec<String> {
    match visit.language {
        Language::English => plain(&report.warnings),
        Language::Vietnamese => vietnamese_limits(visit, report),
    }
}

fn plain(sentences: &[String]) -> Vec<String> {
    let sentences = sentences.iter();
    sentences
        .map(|sentence| without_commands(sentence))
        .collect()
}

fn vietnamese_number(text: String) -> String {
    with_decimal_sign(Language::Vietnamese, text)
}

/// Says why there are no pairs: blocks are not finished, or nothing was imported.
fn without_pairs(report: &Report) -> String {
    let blocks = report.block_progress.map(|blocks| {
        let known = [(blocks.failed, "bị lỗi"), (blocks.pending, "chưa xong")];
        let known = known.iter().filter(|(number, _)| *number > 0);
        let parts = known.map(|(number, what)| format!("{} ván {what}", grouped(*number)));
        parts.collect::<Vec<String>>().join(", ")
    });
    match blocks.filter(|text| !text.is_empty()) {
        Some(blocks) => format!("Dự án chưa có cặp nào: {blocks}."),
        None => "Dự án chưa có cặp nào: hãy thêm ở trang Nhập dữ liệu.".to_owned(),
    }
}

/// Says how many pairs are aligned, failed and not finished.
fn aligned(report: &Report) -> String {
    let progress = report.progress;
    let [pairs, done] = [report.pairs, progress.done].map(grouped);
    let mut text = format!("{done} trên {pairs} cặp đã được căn chỉnh");
    let row = report.row(ThresholdMetric::DEFAULT);
    if let Some(low) = row.and_then(|row| row.low_confidence) {
        let least = vietnamese_number(MetricOutcome::LOW_CONFIDENCE.to_string());
        let low = grouped(low);
        text.extend([format!(", trong đó {low} có độ tin cậy dưới {least}")]);
    }
    for (number, what) in [(progress.failed, "bị lỗi"), (progress.pending, "chưa xong")] {
        if number > 0 {
            text.extend([format!("; {} {what}", grouped(number))]);
        }
    }
    text + "."
}

/// Says how many results of the default metric, or of the first that has them, agree with the ground truth.
fn truth(visit: &Visit, report: &Report) -> Option<String> {
    let default = report.row(ThresholdMetric::DEFAULT).into_iter();
    let mut rows = default.chain(&report.rows);
    rows.find_map(|row| {
        let truth = row.truth.as_ref()?;
        Some(format!(
            "Theo dữ liệu đối chứng, {} trên {} kết quả của {} là đúng, {}.",
            grouped(truth.passed),
            grouped(truth.n),
            visit.metric(row.metric),
            vietnamese_number(format_rate(truth.acc?, truth.acc_ci95)),
        ))
    })
}

/// Says how often reviewers passed results of the default metric, or of the first that they judged.
fn accuracy(visit: &Visit, report: &Report) -> String {
    let default = report.row(ThresholdMetric::DEFAULT).into_iter();
    let mut rows = default.chain(&report.rows);
    let known = |row: &MetricRow| {
        Some(
            format!(
                "Acc của {} là {}: người đánh giá cho đạt {} trên {} kết quả.",
                visit.metric(row.metric),
                vietnamese_number(format_rate(row.acc?, row.acc_ci95)),
                grouped(row.passed),
                grouped(row.passed + row.failed),
            ) + &undecided(row),
        )
    };
    let found = rows.find_map(known);
    found.unwrap_or_else(|| {
        if report.has_verdicts() {
            let sum = |count: fn(&MetricRow) -> u64| report.rows.iter().map(count).sum::<u64>();
            let [conflicts, unsure] = [sum(|row| row.conflicts), sum(|row| row.unsure)];
            let why = match conflicts {
                0 => "mọi kết quả đã đánh giá đều được ghi là chưa chắc",
                all if all == unsure => "người đánh giá bất đồng về mọi kết quả đã đánh giá",
                _ => "mọi kết quả đã đánh giá đều được ghi là chưa chắc hoặc có bất đồng",
            };
            format!("Chưa có Acc, vì {why}.")
        } else if report.rows.iter().any(|row| row.stale > 0) {
            "Chưa có Acc, vì mọi đánh giá đều cho kết quả của lần tính trước.".to_owned()
        } else {
            "Chưa ai đánh giá kết quả nào, nên chưa có Acc: hãy bắt đầu ở trang Đánh giá."
                .to_owned()
        }
    })
}

/// Says how many judged results count neither as passed nor as failed. Empty if there are none.
fn undecided(row: &MetricRow) -> String {
    let parts = [
        (row.conflicts, "kết quả có bất đồng"),
        (row.unsure - row.conflicts, "kết quả chưa chắc"),
    ];
    let parts = parts.into_iter().filter(|(number, _)| *number > 0);
    let parts: Vec<String> = parts
        .map(|(number, what)| format!("{} {what}", grouped(number)))
        .collect();
    match parts.as_slice() {
        [] => String::new(),
        parts => format!(" Không tính: {}.", parts.join(", ")),
    }
}

/// Says which metrics are right more often than others.
fn differences(visit: &Visit, report: &Report) -> String {
    let of = |basis| -> Vec<&Comparison> {
        let compared = report.comparisons.iter();
        compared.filter(|found| found.basis == basis).collect()
    };
    let mut families = Basis::ALL.into_iter().map(|basis| (basis, of(basis)));
    let Some((basis, family)) = families.find(|(_, family)| !family.is_empty()) else {
        return "Chưa đủ đánh giá để so sánh các độ đo.".to_owned();
    };
    let basis = match basis {
        Basis::Verdicts => "đánh giá",
        Basis::Truth => "dữ liệu đối chứng",
    };
    let significant = family.iter().filter_map(|found| {
        let p = found.p_holm.filter(|p| *p < SIGNIFICANCE_LEVEL)?;
        let is_a = found.a_only > found.b_only;
        let [better, worse] = if is_a {
            [found.a, found.b]
        } else {
            [found.b, found.a]
        };
        let [better, worse] = [better, worse].map(|metric| visit.metric(metric));
        Some(format!(
            "{better} đúng nhiều hơn {worse} ({})",
            vietnamese_number(format_p(p))
        ))
    });
    let significant: Vec<String> = significant.collect();
    if significant.is_empty() {
        return format!("Theo {basis}, không có khác biệt có ý nghĩa giữa các độ đo.");
    }
    format!(
        "Theo {basis}, khác biệt có ý nghĩa: {}.",
        significant.join("; ")
    )
}

fn vietnamese_limits(visit: &Visit, report: &Report) -> Vec<String> {
    let mut limits = Vec::new();
    if report.set_apart.count > 0 {
        limits.push(format!(
            "{} dòng dữ liệu bị hỏng hoặc mất được để riêng và không tính: hãy bấm Kiểm tra ngay ở trang Tình trạng.",
            grouped(report.set_apart.count)
        ));
    }
    let progress = report.progress;
    let missing = progress.failed + progress.pending;
    if missing > 0 {
        let [missing, all] = [missing, missing + progress.done].map(grouped);
        limits.push(format!(
            "{missing} trên {all} cặp không có trong bảng, vì bị lỗi hoặc chưa xong."
        ));
    }
    for row in &report.rows {
        let metric = visit.metric(row.metric);
        let mirrored = row.truth.as_ref().map_or(0, |truth| truth.mirrored);
        for (number, what) in [
            (row.stale, "kết quả chỉ có đánh giá cho lần tính trước"),
            (
                row.conflicts,
                "kết quả chưa chắc vì người đánh giá bất đồng",
            ),
            (mirrored, "kết quả bị lật gương"),
        ] {
            if number > 0 {
                limits.push(format!("{metric}: {} {what}.", grouped(number)));
            }
        }
    }
    let checks = report.attention_checks.iter();
    for (reviewer, rate) in checks.flat_map(|rates| rates.inattentive()) {
        limits.push(format!(
            "{} chỉ nhận ra {} trên {} lỗi cài sẵn. Hãy để người khác đánh giá cùng các kết quả đó, hoặc luyện tập rồi đánh giá lại.",
            sanitize(reviewer, 60),
            grouped(rate.count),
            grouped(rate.n)
        ));
    }
    if let Some(problem) = &report.unusable_truth {
        limits.push(format!("Không dùng được dữ liệu đối chứng của {problem}."));
    }
    limits
}
