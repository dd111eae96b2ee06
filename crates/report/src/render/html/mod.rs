//! The report as one HTML page, which includes its style and images and needs no script.

mod album;
mod markup;
mod plots;
mod sections;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use self::album::Album;
use self::markup::sentence;
use crate::model::Report;
use mocban_core::domain::visible;
use mocban_results::gallery::Gallery;

/// Maximum size of a page in bytes.
pub const MAX_PAGE_BYTES: usize = 10_000_000;
/// Bytes reserved for the sentences on how many images are shown, and because a translated page is longer, as a test of
/// the translation measures.
pub const RESERVED_BYTES: usize = 200_000;
const STYLE: &str = include_str!("../../../../../assets/report/report.css");
/// Forbids the page to load or run anything.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'";

/// The element by which a page is recognized.
pub(super) const GENERATOR: &str = "<meta name=\"generator\" content=\"mocban report\">";

/// Texts of the page besides the report.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Cover {
    /// Name of the project.
    pub project: Option<String>,
    /// The date, such as `2026-11-21`.
    pub date: Option<String>,
}

/// Returns the page. Images that do not fit into [`MAX_PAGE_BYTES`] are left out; the page states how many are shown.
pub fn page(report: &Report, gallery: &Gallery, cover: &Cover) -> String {
    let without_images = document(report, &Album::new(gallery, 0), cover).into_string();
    let max_image_bytes = MAX_PAGE_BYTES.saturating_sub(without_images.len() + RESERVED_BYTES);
    let mut page = document(report, &Album::new(gallery, max_image_bytes), cover).into_string();
    page.push('\n');
    visible(&page).into_owned()
}

fn document(report: &Report, album: &Album<'_>, cover: &Cover) -> Markup {
    let title = cover.project.as_deref().unwrap_or("mocban");
    let sections = sections::all(report, album);
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                (PreEscaped(GENERATOR))
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                title { "Report on " (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                a.skip href="#main" { "Skip to the report" }
                header {
                    p.kind { "Report on aligned woodblock characters" }
                    h1 { (title) }
                    div.headline { @for text in &report.headline { p { (sentence(text)) } } }
                    @if let Some(date) = &cover.date { p.date { "Made on " (date) } }
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
                    p.hint { "Print this page to save it as PDF. Word opens the file, too, without its plots and pictures." }
                    p { "Made by mocban " (report.provenance.version) "." }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Cover, MAX_PAGE_BYTES, page};
    use crate::{Report, ReportAccumulator, test_fixtures};
    use mocban_catalog::{PairResults, SetApart};
    use mocban_core::domain::{FailureClass, PairName, ThresholdMetric, Verdict};
    use mocban_results::TruthEvaluation;
    use mocban_results::gallery::{Gallery, GalleryGroup, GalleryItem, GalleryReason};

    fn report() -> Report {
        let mut report = ReportAccumulator::default();
        for (i, name) in ["a", "b", "d", "e", "f", "g"].into_iter().enumerate() {
            let second = if i == 1 { Verdict::Fail } else { Verdict::Pass };
            let pair = test_fixtures::done(name, 0.75, &[Verdict::Pass, second]);
            report.add(&pair, &test_fixtures::truth(1.0, 2.0, 0.9));
        }
        let failed = test_fixtures::failed(
            "c",
            FailureClass::BadInput,
            "<script>alert(1)</script>.stl is empty",
        );
        report.add(&failed, &TruthEvaluation::default());
        report.finish()
    }

    fn item(name: &str, bytes: usize) -> GalleryItem {
        GalleryItem {
            pair: PairName::new(name).expect("test names are ids"),
            character: Some("<b>".to_owned()),
            files: ["a\"><img src=x>.stl".to_owned(), "a&b.png".to_owned()],
            metrics: ThresholdMetric::ALL.to_vec(),
            numbers: "IoU 0.8".to_owned(),
            verdicts: vec!["lan: fail (“<i>why</i>”)".to_owned()],
            images: [1_u8, 2, 3].map(|byte| Some(vec![byte; bytes])),
            problem: None,
        }
    }

    fn gallery(items: usize, bytes: usize) -> Gallery {
        let group = |reason| GalleryGroup {
            reason,
            total: 400,
            items: (0..items).map(|i| item(&format!("p{i}"), bytes)).collect(),
        };
        Gallery {
            seed: 11,
            groups: GalleryReason::ALL.map(group).to_vec(),
        }
    }

    #[test]
    fn a_page_never_exceeds_its_limit_and_says_how_many_images_it_shows() {
        for (items, bytes) in [(0, 0), (20, 20_000), (80, 60_000), (3, 4_000_000)] {
            let text = page(&report(), &gallery(items, bytes), &Cover::default());
            assert!(text.len() <= MAX_PAGE_BYTES, "{}", text.len());
            let shown = text.matches("<figure class=\"item\"").count();
            let groups = GalleryReason::ALL.len();
            let all_fit = groups * items * bytes * 4 < MAX_PAGE_BYTES;
            assert_eq!(
                shown == groups * items,
                all_fit,
                "{shown} of {items} x {bytes}"
            );
            let said: usize = (0..=items)
                .map(|n| n * text.matches(&format!(" {n} of 400 are shown")).count())
                .sum();
            assert_eq!(said, shown, "{items} x {bytes}");
        }
    }

    #[test]
    fn each_group_has_its_share_of_a_full_page() {
        let text = page(&report(), &gallery(80, 60_000), &Cover::default());
        for kind in [
            "failed",
            "conflict",
            "off-truth",
            "low-confidence",
            "random",
        ] {
            let group = text.split(&format!("id=\"images-{kind}\"")).nth(1);
            let group = group.expect(kind).split("<h3").next().expect(kind);
            let shown = group.matches("<figure").count();
            assert!((8..=9).contains(&shown), "{kind}: {shown}");
        }
    }

    #[test]
    fn plots_and_pictures_come_before_tables() {
        let text = page(&report(), &gallery(8, 9), &Cover::default());
        let at = |part: &str| text.find(part).expect("a part of the page");
        assert!(at("<svg") < at("<figure class=\"item\""));
        assert!(at("<figure class=\"item\"") < at("<table"));
        // Two of the eight results of each group are shown when the reader opens them.
        let opened = text.matches("<summary>2 more</summary>").count();
        assert_eq!(opened, GalleryReason::ALL.len());
    }

    #[test]
    fn a_page_says_what_to_do_without_commands() {
        let of = |pair: Option<PairResults>, retired| {
            let mut report = ReportAccumulator::default();
            if let Some(pair) = pair {
                report.add(&pair, &TruthEvaluation::default());
            }
            report.set_retired(retired);
            report.finish()
        };
        let failed = test_fixtures::failed("a", FailureClass::Io, "gone");
        for (mut report, said) in [
            (of(None, 0), "yet. In the app, the page Import adds them."),
            (
                of(None, 2),
                "retired. In the app, the page Pairs has the reason.",
            ),
            (
                of(Some(test_fixtures::pending("a")), 0),
                "yet. In the app, the page Run continues the work.",
            ),
            (of(Some(failed), 0), "yet. Failed pairs are listed below"),
            (
                of(Some(test_fixtures::done("a", 0.75, &[])), 0),
                "no Acc. In the app, results are judged on the page Review.",
            ),
        ] {
            assert!(
                report.headline.iter().any(|text| text.contains('`')),
                "{said}"
            );
            let set_apart = SetApart {
                count: 1,
                first: vec!["row 3".to_owned()],
            };
            let sentence = set_apart.sentence().expect("a row");
            report.warnings.push((sentence + ".").into());
            let page = page(&report, &Gallery::default(), &Cover::default());
            for said in [said, "row 3. In the app, the page Health lists them."] {
                assert!(page.contains(said), "{said}: {page}");
            }
            for command in ["`", "<code", "mocban status", "mocban review"] {
                assert!(!page.contains(command), "{command}: {page}");
            }
        }
    }

    #[test]
    fn names_notes_and_errors_cannot_add_markup() {
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
    fn the_page_loads_nothing_and_every_link_has_a_target() {
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
    fn tables_have_only_parts_that_word_processors_know() {
        let known = ["caption", "thead", "tbody", "tr", "th", "td", "span"];
        let text = page(&report(), &Gallery::default(), &Cover::default());
        let tables: Vec<&str> = text.split("<table>").skip(1).collect();
        assert!(tables.len() > 5);
        for table in tables {
            let table = table.split("</table>").next().expect("its end");
            for tag in table.split('<').skip(1) {
                let name = tag.trim_start_matches('/');
                let end = name.find([' ', '>']).unwrap_or(name.len());
                assert!(known.contains(&&name[..end]), "{tag}");
            }
        }
    }

    #[test]
    fn every_table_has_a_caption_and_headers_with_a_scope() {
        let text = page(&report(), &Gallery::default(), &Cover::default());
        let count = |part: &str| text.matches(part).count();
        assert!(count("<table") > 5);
        assert_eq!(count("<table"), count("<caption"));
        assert_eq!(count("<th"), count("<th scope=") + count("<thead"));
        assert_eq!(count("<svg"), count("<svg role=\"img\" aria-label=\""));
    }
}
