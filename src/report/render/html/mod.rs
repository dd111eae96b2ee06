//! The report as one page that holds its style and pictures, and needs no script.

mod album;
mod markup;
mod plots;
mod sections;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use self::album::Album;
use super::table;
use crate::report::gallery::Gallery;
use crate::report::model::Report;

/// Most bytes of a page.
pub const MOST_BYTES: usize = 10_000_000;
/// Room left for what is said of how many pictures are shown.
const SLACK: usize = 10_000;
const STYLE: &str = include_str!("../../../../assets/report/report.css");
/// Nothing is fetched, and nothing runs.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'";

/// What stands on the page beside its numbers.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Cover {
    /// Name of the project.
    pub project: Option<String>,
    /// When it was made, such as `2026-11-21`.
    pub date: Option<String>,
}

/// The page, at most [`MOST_BYTES`] long: where there are more pictures, fewer are shown, and it says of how many.
pub fn page(report: &Report, gallery: &Gallery, cover: &Cover) -> String {
    let bare = document(report, &Album::new(gallery, 0), cover).into_string();
    let room = MOST_BYTES.saturating_sub(bare.len() + SLACK);
    let mut page = document(report, &Album::new(gallery, room), cover).into_string();
    page.push('\n');
    page
}

fn document(report: &Report, album: &Album, cover: &Cover) -> Markup {
    let title = cover.project.as_deref().unwrap_or("mocban");
    let sections = sections::all(report, album);
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                title { "Report on " (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                a.skip href="#main" { "To the report" }
                header {
                    p.kind { "Report of aligned woodblock characters" }
                    h1 { (title) }
                    p { (table::headline(report)) @if let Some(date) = &cover.date { " · made " (date) } }
                }
                nav aria-label="Contents" {
                    ol { @for section in &sections { li { a href={ "#" (section.id) } { (section.title) } } } }
                }
                main #main {
                    @for section in &sections {
                        section aria-labelledby=(section.id) {
                            h2 #(section.id) { (section.title) }
                            (section.body)
                        }
                    }
                }
                footer {
                    p { "Made by mocban " (env!("CARGO_PKG_VERSION")) ". The same numbers in full: "
                        code { "mocban report --format json" } "." }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Cover, MOST_BYTES, page};
    use crate::domain::{PairName, ThresholdMetric, Verdict};
    use crate::report::gallery::{Gallery, GalleryGroup, GalleryItem, GalleryReason};
    use crate::report::{Report, ReportAccumulator, TruthEvaluation, test_fixtures};

    fn report() -> Report {
        let mut tally = ReportAccumulator::default();
        for (name, second) in [("a", Verdict::Pass), ("b", Verdict::Fail)] {
            let pair = test_fixtures::done(name, 0.75, &[Verdict::Pass, second]);
            tally.add(&pair, &test_fixtures::truth(1.0, 2.0, 0.9));
        }
        let class = crate::domain::FailureClass::BadInput;
        let failed = test_fixtures::failed("c", class, "<script>alert(1)</script>.stl is empty");
        tally.add(&failed, &TruthEvaluation::default());
        tally.finish()
    }

    fn shot(name: &str, bytes: usize) -> GalleryItem {
        GalleryItem {
            pair: PairName::new(name).expect("test names are ids"),
            character: Some("<b>".to_owned()),
            files: ["a\"><img src=x>.stl".to_owned(), "a&b.png".to_owned()],
            metrics: ThresholdMetric::ALL.to_vec(),
            numbers: "IoU 0.8".to_owned(),
            said: vec!["lan: fail (“<i>why</i>”)".to_owned()],
            pictures: [1_u8, 2, 3].map(|byte| Some(vec![byte; bytes])),
            trouble: None,
        }
    }

    fn gallery(shots: usize, bytes: usize) -> Gallery {
        let group = |kind| GalleryGroup {
            kind,
            of: 400,
            shots: (0..shots).map(|i| shot(&format!("p{i}"), bytes)).collect(),
        };
        Gallery {
            seed: 11,
            groups: GalleryReason::ALL.map(group).to_vec(),
        }
    }

    #[test]
    fn a_page_never_exceeds_ten_megabytes_and_says_how_many_are_shown() {
        for (shots, bytes) in [(0, 0), (20, 20_000), (80, 60_000), (3, 4_000_000)] {
            let text = page(&report(), &gallery(shots, bytes), &Cover::default());
            assert!(text.len() <= MOST_BYTES, "{}", text.len());
            let shown = text.matches("<figure class=\"shot\"").count();
            let all_fit = shots * bytes * 4 < 6_000_000;
            assert_eq!(shown == 4 * shots, all_fit, "{shown} of {shots} x {bytes}");
            let said: usize = (0..=shots)
                .map(|n| n * text.matches(&format!(" {n} of 400 are shown")).count())
                .sum();
            assert_eq!(said, shown, "{shots} x {bytes}");
        }
    }

    #[test]
    fn where_few_fit_each_kind_has_its_share() {
        let text = page(&report(), &gallery(80, 60_000), &Cover::default());
        for kind in ["failed", "conflict", "off-truth", "lot"] {
            let group = text.split(&format!("id=\"pictures-{kind}\"")).nth(1);
            let group = group.expect(kind).split("</ul>").next().expect(kind);
            let shown = group.matches("<figure").count();
            assert!((10..=11).contains(&shown), "{kind}: {shown}");
        }
    }

    #[test]
    fn names_notes_and_errors_cannot_leave_their_place() {
        let cover = Cover {
            project: Some("</title><script>".to_owned()),
            date: None,
        };
        let text = page(&report(), &gallery(1, 9), &cover);
        for part in ["<script", "<img src=x", "<i>why", "a&b.png", "</b>", "<b>"] {
            assert!(!text.contains(part), "{part}");
        }
        assert!(text.contains("&lt;script&gt;alert(1)&lt;/script&gt;.stl is empty"));
    }

    #[test]
    fn nothing_comes_from_outside_and_every_link_leads_somewhere() {
        let text = page(&report(), &gallery(1, 9), &Cover::default());
        for attribute in ["src=\"", "href=\""] {
            for rest in text.split(attribute).skip(1) {
                let value = rest.split('"').next().expect("a value");
                let inside = value
                    .strip_prefix('#')
                    .is_some_and(|id| text.contains(&format!(" id=\"{id}\"")) && !id.is_empty());
                assert!(
                    inside || value.starts_with("data:image/jpeg;base64,"),
                    "{value}"
                );
            }
        }
        for outside in ["url(", "@import", "http://", "https://"] {
            assert!(!text.contains(outside), "{outside}");
        }
    }

    #[test]
    fn every_table_has_a_caption_and_heads_with_a_scope() {
        let text = page(&report(), &Gallery::default(), &Cover::default());
        let count = |part: &str| text.matches(part).count();
        assert!(count("<table") > 5);
        assert_eq!(count("<table"), count("<caption"));
        assert_eq!(count("<th"), count("<th scope=") + count("<thead"));
        assert_eq!(count("<svg"), count("<svg role=\"img\" aria-label=\""));
    }
}
