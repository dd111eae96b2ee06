//! The Vietnamese report on every kind of content, so that no sentence stays in English.

use std::collections::BTreeMap;

use super::vietnamese_report;
use crate::messages::stage_words::stage_in_vietnamese;
use mocban_catalog::{PairResults, SetApart};
use mocban_core::domain::Verdict::{Fail, Pass, Unsure};
use mocban_core::domain::{
    ContentHash, FailureClass, PairName, Reason, Stage, ThresholdMetric, Verdict,
};
use mocban_report::{
    BlockAccuracy, BlockCounts, ChangedSetting, Cover, Report, ReportAccumulator, UsedSettings,
};
use mocban_results::gallery::{Gallery, GalleryGroup, GalleryItem, GalleryReason};
use mocban_results::{
    AttentionCheckRates, IntervalMethod, ManualErrors, Rate, TruthEvaluation, test_fixtures,
};

/// Words that only English sentences have.
const ENGLISH: [&str; 24] = [
    " the ",
    "The ",
    " of ",
    " and ",
    " is ",
    " are ",
    " by ",
    " for ",
    " not ",
    " than ",
    " was ",
    "esult",
    " with ",
    "eviewer",
    "erdict",
    "onfidence",
    "pair",
    "block",
    "etric",
    "Each ",
    "ground",
    "shown",
    "unknown",
    "reason",
];
/// Attributes with texts.
const ATTRIBUTES: [&str; 3] = [" aria-label=\"", " alt=\"", " title=\""];

/// Returns what a page says, a text or a description each, without commands.
fn said(page: &str) -> Vec<String> {
    let (before, rest) = page.split_once("<style>").expect("a style sheet");
    let (_, after) = rest.split_once("</style>").expect("its end");
    let body = [before, after].concat();
    let described = (ATTRIBUTES.iter()).fold(body, |text, name| text.replace(name, ">"));
    let parts = described.split('>');
    let texts = parts.filter_map(|part| part.split(['<', '"']).next());
    let texts = texts.map(str::trim);
    let texts = texts.filter(|text| !text.is_empty() && !text.starts_with("mocban "));
    texts.map(str::to_owned).collect()
}

/// Checks that the Vietnamese page of a report has no English sentence, and the same parts as the English one.
fn check(report: &Report, gallery: &Gallery) {
    let cover = Cover {
        project: Some("Kiều".to_owned()),
        date: Some("2026-11-21".to_owned()),
    };
    let page = mocban_report::page(report, gallery, &cover);
    let vietnamese = vietnamese_report(&page);
    for text in said(&vietnamese) {
        let found = ENGLISH.iter().find(|word| text.contains(**word));
        assert_eq!(found, None, "{text}");
    }
    assert_eq!(said(&page).len(), said(&vietnamese).len());
    assert_eq!(page.matches('<').count(), vietnamese.matches('<').count());
}

/// Adds finished pairs without ground truth.
fn of_pairs(pairs: impl IntoIterator<Item = PairResults>) -> ReportAccumulator {
    let mut report = ReportAccumulator::default();
    for pair in pairs {
        report.add(&pair, &TruthEvaluation::default());
    }
    report
}

/// Reports `n` pairs whose verdicts `given` chooses, by pair and metric.
fn judged(n: usize, given: impl Fn(usize, ThresholdMetric) -> &'static [Verdict]) -> Report {
    let pairs = (0..n).map(|i| {
        let mut pair = test_fixtures::done(&format!("p{i:02}"), 0.8, &[]);
        for record in &mut pair.metrics {
            let metric = record.outcome.metric;
            *record = test_fixtures::metric(metric, 0.8, given(i, metric));
        }
        pair
    });
    of_pairs(pairs).finish()
}

#[test]
fn states_of_pairs_and_blocks() {
    let none = Gallery::default();
    for retired in 0..=2 {
        let mut report = ReportAccumulator::default();
        report.set_retired(retired);
        check(&report.finish(), &none);
    }
    for [failed, pending] in [[1, 0], [0, 1], [2, 3]] {
        for pairs in 0..=1 {
            let mut report = of_pairs((0..pairs).map(|_| test_fixtures::done("p", 0.8, &[])));
            report.set_block_progress(Some(BlockCounts {
                done: 1,
                failed,
                pending,
            }));
            check(&report.finish(), &none);
        }
    }
    for confidence in [None, Some(0.4), Some(0.9)] {
        for [done, failed, pending] in [
            [1, 0, 0],
            [0, 1, 0],
            [0, 0, 1],
            [0, 1, 2],
            [1, 1, 0],
            [1, 0, 2],
            [2, 0, 0],
            [2, 2, 1],
            [3, 0, 0],
        ] {
            let done = (0..done).map(|i| {
                let name = format!("a{i}");
                confidence.map_or_else(
                    || test_fixtures::done(&name, 0.8, &[]),
                    |confidence| test_fixtures::with_confidence(&name, confidence),
                )
            });
            let failed = (0..failed).map(|i| {
                test_fixtures::failed(&format!("b{i}"), FailureClass::Io, "x.png is not there")
            });
            let pending = (0..pending).map(|i| test_fixtures::pending(&format!("c{i}")));
            check(&of_pairs(done.chain(failed).chain(pending)).finish(), &none);
        }
    }
}

#[test]
fn failures_of_every_class() {
    let mut report = ReportAccumulator::default();
    for class in FailureClass::ALL {
        for i in 0..102 {
            let failed =
                test_fixtures::failed(&format!("{class}{i:03}"), class, "x.png is not there");
            report.add(&failed, &TruthEvaluation::default());
        }
    }
    check(&report.finish(), &Gallery::default());
}

#[test]
fn verdicts_and_comparisons() {
    use ThresholdMetric::{Density, Ensemble};
    const KINDS: [&[Verdict]; 6] = [
        &[Pass],
        &[Fail],
        &[Unsure],
        &[Pass, Fail],
        &[],
        &[Pass, Pass],
    ];
    let fails_if = |is_failed: bool| KINDS[usize::from(is_failed)];
    let of_ensemble =
        |metric: ThresholdMetric, others: usize| KINDS[if metric == Ensemble { 0 } else { others }];
    let reports = [
        judged(3, |_, _| &[Pass]),
        judged(3, |_, _| &[Unsure]),
        judged(3, |_, _| &[Pass, Fail]),
        judged(3, |i, _| KINDS[2 + i % 2]),
        judged(6, |i, _| KINDS[i]),
        judged(3, |_, metric| of_ensemble(metric, 4)),
        judged(3, |_, metric| of_ensemble(metric, 2)),
        judged(24, |_, _| &[Pass]),
        // Significant differences, all or some of them.
        judged(40, |i, metric| fails_if(metric != Ensemble && i < 20)),
        judged(40, |i, metric| fails_if(metric == Density && i < 20)),
        // No significant difference: few pairs, equal numbers, and several comparisons.
        judged(10, |i, metric| fails_if(metric == Density && i == 0)),
        judged(30, |i, metric| {
            fails_if(metric == Density && i == 0 || metric == Ensemble && i == 1)
        }),
        judged(30, |i, metric| {
            fails_if(metric == Density && i < 5 || metric == Ensemble && i == 6)
        }),
        judged(40, |i, metric| fails_if(metric == Density && i < 6)),
    ];
    for report in reports {
        check(&report, &Gallery::default());
        let exact = report.with_interval(IntervalMethod::Exact);
        check(&exact, &Gallery::default());
    }
}

#[test]
fn reasons_and_verdicts_on_earlier_results() {
    let mut older = test_fixtures::done("p", 0.8, &[]);
    for record in &mut older.metrics {
        record.older_verdicts = 1;
    }
    check(&of_pairs([older]).finish(), &Gallery::default());
    let failed = Reason::ALL.into_iter().map(Some).chain([None]);
    let failed = failed.enumerate().map(|(i, reason)| {
        let mut pair = test_fixtures::done(&format!("p{i}"), 0.8, &[Fail]);
        for given in pair.metrics.iter_mut().flat_map(|one| &mut one.verdicts) {
            given.reason = reason;
        }
        pair
    });
    check(&of_pairs(failed).finish(), &Gallery::default());
}

#[test]
fn ground_truth_manual_alignments_and_scores() {
    let mut report = ReportAccumulator::default();
    for i in 0..40_u32 {
        let mut pair = test_fixtures::done(&format!("p{i:02}"), 0.8, &[Pass]);
        pair.attributes.block = Some((i / 3).to_string());
        pair.stages = Stage::ALL
            .map(|stage| test_fixtures::stage(stage, 10))
            .to_vec();
        for (k, record) in (0_u32..).zip(&mut pair.metrics) {
            let scores = &mut record.outcome.scores;
            scores.iou = 0.6 + f64::from(k * (1 + i % 3)) / 40.0;
            // More than this IoU allows.
            scores.dice = if k == 0 { 0.99 } else { scores.iou };
            record.outcome.confidence = Some(f64::from(i) / 40.0);
        }
        let mut truth = test_fixtures::truth(if i < 3 { 170.0 } else { 1.0 }, 1.0, 0.9);
        for errors in truth.errors.values_mut().filter(|_| i == 0) {
            errors.mirrored = true;
        }
        report.add(&pair, &truth);
        let errors = ManualErrors::of(1.0, 2.0, 0.5);
        report.add_manual_errors(&ThresholdMetric::ALL.map(|metric| (metric, errors)).into());
    }
    let unusable = TruthEvaluation {
        errors: BTreeMap::new(),
        problem: Some("x.png is not there".to_owned()),
    };
    report.add(&test_fixtures::done("q", 0.8, &[]), &unusable);
    let mut report = report.finish();
    report.blocks.push(BlockAccuracy {
        block: "1".to_owned(),
        characters: 3,
        found: 3,
        right: 2,
        tight: 1,
        boxes: None,
    });
    for (changed, pairs) in [
        (None, 2),
        (Some(Vec::new()), 1),
        (
            Some(vec![ChangedSetting {
                name: "fit.x".to_owned(),
                value: 0.5.into(),
                default: 1.into(),
            }]),
            4700,
        ),
    ] {
        report.provenance.settings.push(UsedSettings {
            fingerprint: ContentHash::of(b"settings"),
            pairs,
            stages: BTreeMap::new(),
            changed,
        });
    }
    check(&report, &Gallery::default());
}

#[test]
fn stages_have_the_names_of_the_pages() {
    let mut pair = test_fixtures::done("p", 0.8, &[]);
    pair.stages = Stage::ALL
        .map(|stage| test_fixtures::stage(stage, 10))
        .to_vec();
    let failed = Stage::ALL.into_iter().map(|stage| {
        let mut pair = test_fixtures::failed(stage.name(), FailureClass::Io, "x.png is not there");
        if let Some(stored) = &mut pair.failure {
            stored.stage = stage;
        }
        pair
    });
    let report = of_pairs([pair].into_iter().chain(failed)).finish();
    let page = mocban_report::page(&report, &Gallery::default(), &Cover::default());
    let vietnamese = vietnamese_report(&page);
    for stage in Stage::ALL {
        let known = stage_in_vietnamese(stage);
        let row = format!("<th scope=\"row\">{known}</th>");
        assert!(vietnamese.contains(&row), "{row}: {vietnamese}");
        let failure = format!("<strong>{stage}</strong>, {known}: ");
        assert!(vietnamese.contains(&failure), "{failure}: {vietnamese}");
    }
}

#[test]
fn attention_checks_and_damaged_rows() {
    for reviewers in [&["lan"][..], &["lan", "minh"]] {
        let mut report = of_pairs([test_fixtures::done("p", 0.8, &[Pass])]);
        report.set_attention_checks(AttentionCheckRates {
            all: Rate::new(2, 10),
            by_kind: ["turned", "threshold"]
                .map(|kind| (kind, Rate::new(1, 5)))
                .into(),
            by_reviewer: (reviewers.iter())
                .map(|name| ((*name).to_owned(), Rate::new(1, 5)))
                .collect(),
        });
        let mut report = report.finish();
        let set_apart = SetApart {
            count: reviewers.len() as u64,
            first: vec!["row 3 of the table undo differs from its checksum".to_owned()],
        };
        let sentence = set_apart.sentence().expect("a row");
        report.warnings.push((sentence + ".").into());
        check(&report, &Gallery::default());
    }
}

/// Returns groups of images whose names are terms of the report.
fn gallery() -> Gallery {
    let item = |problem: Option<&str>, i: usize| {
        GalleryItem {
        pair: PairName::new(["all", "Relief", "1.5"][i % 3]).expect("an id"),
        character: Some("print".to_owned()),
        files: ["angle".to_owned(), "1.5.png".to_owned()],
        metrics: ThresholdMetric::ALL.to_vec(),
        numbers: "IoU 0.700, confidence 0.500, off the truth by 1.0° and 2.0 % of the height, IoU with the true stroke tops 0.9"
            .to_owned(),
        verdicts: vec!["true: fail, strokes lost (“all, 1.5”)".to_owned()],
        images: [Some(vec![1]), None, problem.is_none().then(|| vec![2])],
        problem: problem.map(str::to_owned),
    }
    };
    let group = |reason| GalleryGroup {
        reason,
        total: 4000,
        items: (0..8)
            .map(|i| item((i == 0).then_some("x.png is not there"), i))
            .collect(),
    };
    Gallery {
        seed: 11,
        groups: GalleryReason::ALL.map(group).to_vec(),
    }
}

#[test]
fn images_of_every_group() {
    let report = judged(3, |_, _| &[Pass]);
    check(&report, &gallery());
}

#[test]
fn names_notes_and_files_stay() {
    let cover = Cover {
        project: Some("Scores. Relief".to_owned()),
        date: None,
    };
    let mut report = judged(3, |_, _| &[Pass]);
    report.blocks.push(BlockAccuracy {
        block: "all".to_owned(),
        characters: 1,
        found: 1,
        right: 1,
        tight: 1,
        boxes: None,
    });
    let failed = test_fixtures::failed("angle", FailureClass::Io, "1.5.png is not there");
    report.failures.extend(of_pairs([failed]).finish().failures);
    let page = mocban_report::page(&report, &gallery(), &cover);
    let vietnamese = vietnamese_report(&page);
    for part in [
        "<html lang=\"vi\">",
        "<title>Báo cáo về Scores. Relief</title>",
        "<h1>Scores. Relief</h1>",
        "<strong>all</strong>",
        "alt=\"Relief: bản in\"",
        "alt=\"1.5: bản in\"",
        ">print</span>",
        "<span class=\"files\">angle · 1.5.png</span>",
        "<span class=\"verdict\">true: không đạt, mất nét (“all, 1.5”)</span>",
        "<span class=\"verdict\">không vẽ được: không có tệp x.png</span>",
        "<strong>angle</strong>, khớp mặt khắc: không có tệp 1.5.png</li>",
        "<th scope=\"row\">all</th>",
        "<th scope=\"row\">Kết hợp</th>",
        "người đánh giá cho đạt",
    ] {
        assert!(vietnamese.contains(part), "{part}: {vietnamese}");
    }
}
