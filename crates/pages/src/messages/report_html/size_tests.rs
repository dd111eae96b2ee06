//! The size of a report that has everything, in both languages.

use super::vietnamese_report;
use mocban_core::domain::Verdict::{Fail, Pass};
use mocban_core::domain::{FailureClass, PairName, ThresholdMetric};
use mocban_report::{Cover, MAX_PAGE_BYTES, RESERVED_BYTES, Report, ReportAccumulator};
use mocban_results::gallery::{Gallery, GalleryGroup, GalleryItem, GalleryReason};
use mocban_results::{ManualErrors, TruthEvaluation, test_fixtures};

/// Results of a group, as many as a report takes at most.
const ITEMS: usize = 80;
/// Numbers of a result with everything that is measured.
const NUMBERS: &str = "IoU 0.700, confidence 0.500, off the truth by 1.0° and 2.0 % of the height, IoU with the true stroke tops 0.9";
/// Bytes of an image with which nearly all results fit into a page.
const IMAGE_BYTES: usize = 6_000;

/// Returns a report with verdicts, ground truth and manual alignments, and with as many failed pairs as are listed.
fn full_report() -> Report {
    let mut report = ReportAccumulator::default();
    for i in 0..40 {
        let verdicts = [if i % 3 == 0 { Fail } else { Pass }, Pass];
        let pair = test_fixtures::done(&format!("p{i:02}"), 0.8, &verdicts);
        report.add(&pair, &test_fixtures::truth(1.0, 1.0, 0.9));
        let errors = ManualErrors::of(1.0, 2.0, 0.5);
        report.add_manual_errors(&ThresholdMetric::ALL.map(|metric| (metric, errors)).into());
    }
    for class in FailureClass::ALL {
        for i in 0..=100 {
            let message = format!("p/data/meshes/{i}.ply is not there");
            let failed = test_fixtures::failed(&format!("{class}{i}"), class, &message);
            report.add(&failed, &TruthEvaluation::default());
        }
    }
    report.finish()
}

/// Returns results with images and long captions, a few more than fit into a page.
fn full_gallery() -> Gallery {
    let item = |i: usize| GalleryItem {
        pair: PairName::new(&format!("p{i}")).expect("an id"),
        character: Some("明".to_owned()),
        files: ["meshes/1.ply".to_owned(), "prints/1.png".to_owned()],
        metrics: ThresholdMetric::ALL.to_vec(),
        numbers: NUMBERS.to_owned(),
        verdicts: (0..9)
            .map(|reviewer| format!("r{reviewer}: fail, background included"))
            .collect(),
        images: [1_u8, 2, 3].map(|byte| Some(vec![byte; IMAGE_BYTES])),
        problem: None,
    };
    let group = |reason| GalleryGroup {
        reason,
        total: 4000,
        items: (0..ITEMS).map(item).collect(),
    };
    Gallery {
        seed: 11,
        groups: GalleryReason::ALL.map(group).to_vec(),
    }
}

#[test]
fn a_full_page_keeps_to_its_limit_in_both_languages() {
    let (report, cover) = (full_report(), Cover::default());
    let page = mocban_report::page(&report, &full_gallery(), &cover);
    let figures = page.matches("<figure").count();
    let most = GalleryReason::ALL.len() * ITEMS;
    assert!(figures < most && figures > most / 2, "{figures} of {most}");
    for bytes in [page.len(), vietnamese_report(&page).len()] {
        assert!(bytes <= MAX_PAGE_BYTES, "{bytes}");
    }
    // The texts beside the images, which are counted with their translation.
    let bare = mocban_report::page(&report, &Gallery::default(), &cover);
    let translated = vietnamese_report(&bare);
    let needed = translated.len().saturating_sub(bare.len());
    assert!(needed > 0 && needed <= RESERVED_BYTES / 2, "{needed}");
}
