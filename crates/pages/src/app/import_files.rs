//! The parts of the page of imports that say what the files say of themselves: sizes, units, and what cannot be used.

use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::extract::State;
use axum::response::Html;
use maud::{Markup, html};
use serde_json::{Value, json};

use super::components::{grouped, unit_name};
use super::failure::AppResult;
use super::import_choice::{ImportChoice, SHOWN_PAIRS};
use super::import_headers::{FileHeaders, InspectedFiles, PlannedFiles, UnreadFile, inspect};
use super::import_pictures::pictures_part;
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use mocban_core::domain::{LengthUnit, one_line};
use mocban_core::mesh::MeshExtent;
use mocban_project::file_headers::{ScanKind, ScanUnit, UnitOrigin, unit_of_page};

/// Most pairs whose files are looked at for one request of the script.
const MOST: usize = 400;
/// How long files are looked at for one request of the script; the file that is read then is finished.
const STEP_TIME: Duration = Duration::from_millis(500);
/// How long files of the shown pairs are looked at; the file that is read then is finished.
const SHOWN_TIME: Duration = Duration::from_secs(3);

/// Returns the places of the page that are filled from the files of a number of pairs or blocks: a table, and the files that
/// cannot be used.
pub(super) fn files_part(visit: &Visit, are_blocks: bool, total: u64) -> Markup {
    let query = visit.query.text();
    let [looked_at, others] = if are_blocks {
        [
            visit.t(
                "Blocks whose files were looked at",
                "Số ván đã kiểm tra tệp",
            ),
            visit.t(
                "The files of the other blocks are checked by the run.",
                "Tệp của các ván khác được kiểm tra khi căn chỉnh.",
            ),
        ]
    } else {
        [
            visit.t("Pairs whose files were looked at", "Số cặp đã kiểm tra tệp"),
            visit.t(
                "The files of the other pairs are checked by the run.",
                "Tệp của các cặp khác được kiểm tra khi căn chỉnh.",
            ),
        ]
    };
    html! {
        h3 { (visit.t("What the files say", "Các tệp cho biết gì")) }
        div #import-files data-load={ (visit.root) "import/files" (query) } aria-live="polite" {
            p.muted { (visit.t("Reading the files…", "Đang đọc các tệp…")) }
        }
        div #file-problems data-address={ (visit.root) "import/problems" (query) } {
            p.muted role="status" {
                (looked_at) ": " span #looked-at { "0 / " (grouped(total)) }
                " · " (visit.t("files that cannot be used", "tệp không dùng được")) ": " b #unusable { "0" }
            }
            ul #unusable-files {}
            p #more-unusable hidden { (visit.t("More files that cannot be used", "Số tệp không dùng được khác")) ": " b {} }
            p #other-pairs hidden { (others) }
            p.notice.warn #stopped-looking hidden role="alert" { (visit.t("Stopped before all files were looked at: reload the page to start again.", "Đã dừng trước khi kiểm tra hết các tệp: hãy tải lại trang để làm lại.")) }
        }
        script type="module" src={ (visit.root) "assets/import-files.js" } {}
    }
}

/// Responds with what the files of the shown pairs or blocks say.
pub(super) async fn part(
    State(state): State<Arc<AppState>>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let chosen = ImportChoice::of(&visit.query);
    let from: u64 = visit.query.parsed("from").unwrap_or_default();
    let has_list = !chosen.list.is_empty();
    let InspectedFiles { headers, asked, .. } =
        inspect(&state, chosen, from, SHOWN_PAIRS as usize, SHOWN_TIME).await?;
    let units: Vec<Option<ScanUnit>> = headers.iter().map(unit).collect();
    let part = html! {
        @if !headers.is_empty() { (table(&visit, &headers, &units)) }
        @if headers.len() < asked {
            p.muted { (visit.t("Reading takes long, so the table has only the first.", "Việc đọc mất nhiều thời gian nên bảng chỉ có các mục đầu tiên.")) }
        }
        (pictures_part(&visit, &headers, from))
        @if let Some(unit) = common_unit(&units).filter(|_| !has_list) { (unit_part(&visit, unit, &units)) }
    };
    Ok(Html(part.into_string()))
}

/// Responds with the files from a position on that cannot be used, and with the position that follows.
pub(super) async fn problems(
    State(state): State<Arc<AppState>>,
    visit: Visit,
) -> AppResult<Json<Value>> {
    let chosen = ImportChoice::of(&visit.query);
    let after: u64 = visit.query.parsed("after").unwrap_or_default();
    let InspectedFiles {
        headers,
        reachable,
        total,
        ..
    } = inspect(&state, chosen, after, MOST, STEP_TIME).await?;
    let next = after + headers.len() as u64;
    let problems: Vec<String> = headers
        .iter()
        .flat_map(unusable)
        .map(|(files, why)| {
            let why = why.text(visit.language);
            one_line(&format!("{}: {why}", files.name)).into_owned()
        })
        .collect();
    let is_over = headers.is_empty() || next >= reachable;
    Ok(Json(json!({
        "problems": problems,
        "looked_at": next.min(reachable),
        "total": total,
        "next": (!is_over).then_some(next),
    })))
}

/// Returns why files of a pair or of a block cannot be used.
fn unusable(headers: &FileHeaders) -> impl Iterator<Item = (&PlannedFiles, &Sentence)> {
    let labels = headers.labels.as_ref();
    let whys = [
        headers.scan.as_ref().err(),
        headers.print.as_ref().err(),
        labels.and_then(|labels| labels.as_ref().err()),
    ];
    whys.into_iter().flatten().filter_map(move |why| match why {
        UnreadFile::Unusable(why) => Some((&headers.files, why)),
        UnreadFile::Outside => None,
    })
}

fn unit(headers: &FileHeaders) -> Option<ScanUnit> {
    let extent = headers.scan.as_ref().ok()?;
    headers.files.kind.unit(extent, headers.files.unit)
}

/// Returns the unit that all scans have that are known, if none is given.
fn common_unit(units: &[Option<ScanUnit>]) -> Option<LengthUnit> {
    let mut known = units.iter().flatten();
    let first = known.next()?;
    let is_same = |unit: &ScanUnit| unit.origin != UnitOrigin::Given && unit.unit == first.unit;
    (is_same(first) && known.all(is_same)).then_some(first.unit)
}

/// Offers a unit for all pairs of the import, with the number of scans that show it.
fn unit_part(visit: &Visit, unit: LengthUnit, units: &[Option<ScanUnit>]) -> Markup {
    let query = visit.query.with("unit", unit.name()).text();
    let [known, shown] = [units.iter().flatten().count(), units.len()].map(|n| grouped(n as u64));
    html! {
        p.row {
            span { (visit.t("The scans are probably in", "Đơn vị của bản quét có lẽ là")) " " b { (unit_name(visit, unit)) } ": "
                (known) " / " (shown) " " (visit.t("of the scans shown here. The button sets it for all pairs.", "bản quét ở đây. Nút này đặt đơn vị cho mọi cặp.")) }
            a.button #use-unit href={ "import" (query) } { (visit.t("Use this unit", "Dùng đơn vị này")) }
        }
    }
}

fn table(visit: &Visit, headers: &[FileHeaders], units: &[Option<ScanUnit>]) -> Markup {
    let label = visit.t("Sizes of the files", "Kích thước của các tệp");
    let is_block = headers.iter().any(|one| one.files.kind == ScanKind::Block);
    let print = if is_block {
        visit.t("Page", "Trang in")
    } else {
        visit.t("Print", "Bản in")
    };
    html! {
        div.scroll tabindex="0" role="region" aria-label=(label) { table {
            thead { tr {
                @for title in [visit.t("Id", "Mã"), visit.t("Scan", "Bản quét"), visit.t("Unit", "Đơn vị"), print] {
                    th scope="col" { (title) }
                }
            } }
            tbody { @for (one, unit) in headers.iter().zip(units) { tr {
                th scope="row" { (one_line(&one.files.name)) }
                @match &one.scan {
                    Ok(extent) => {
                        td { (size(visit, extent, *unit)) }
                        td.muted.reason {
                            (why_unit(visit, one.files.kind, extent, *unit))
                            @if let Some(other) = other_unit(one, *unit) {
                                "; " (visit.t("as long as its page if the unit is", "dài bằng trang in nếu đơn vị là")) " " (unit_name(visit, other))
                            }
                        }
                    },
                    Err(why) => {
                        (unread(visit, why))
                        td {}
                    },
                }
                @match &one.print {
                    Ok([width, height]) => td {
                        (grouped(u64::from(*width))) " × " (grouped(u64::from(*height))) " px"
                        @if let Some(mm) = one.page_mm { " · " (visit.decimal(mm, 0)) " mm" }
                    },
                    Err(why) => (unread(visit, why)),
                }
            } } }
        } }
    }
}

/// Returns a cell that says why nothing is known of a file.
fn unread(visit: &Visit, why: &UnreadFile) -> Markup {
    let sentence = why.sentence();
    let said = one_line(sentence.text(visit.language));
    html! {
        @match why {
            UnreadFile::Unusable(_) => td.bad { (said) },
            UnreadFile::Outside => td.muted { (said) },
        }
    }
}

/// Returns the lengths of a scan along its axes in mm, or in its own unit if that is not known.
fn size(visit: &Visit, extent: &MeshExtent, unit: Option<ScanUnit>) -> String {
    let Some(sides) = extent.sides else {
        return visit
            .t("not known before the run", "chưa biết trước khi căn chỉnh")
            .to_owned();
    };
    let mm = unit.map(|unit| unit.unit.mm());
    let lengths = sides.map(|side| {
        let length = side * mm.unwrap_or(1.0);
        let digits = if length < 10.0 { 2 } else { 1 };
        visit.decimal(length, digits)
    });
    let about = if extent.is_exact {
        ""
    } else {
        visit.t("about ", "khoảng ")
    };
    let name = if mm.is_some() { " mm" } else { "" };
    format!("{about}{}{name}", lengths.join(" × "))
}

/// Returns the unit in which the scan of a block is as long as its page, if it is another one.
fn other_unit(heads: &FileHeaders, unit: Option<ScanUnit>) -> Option<LengthUnit> {
    let length = heads.scan.as_ref().ok()?.longest()?;
    unit_of_page(length, unit?.unit, heads.page_mm?)
}

/// Says where a unit comes from, and why it may be another one.
fn why_unit(visit: &Visit, kind: ScanKind, extent: &MeshExtent, unit: Option<ScanUnit>) -> String {
    let usual = match kind {
        ScanKind::Character => visit.t(
            "the longest side is then usual for a character",
            "khi đó cạnh dài nhất là bình thường đối với một chữ",
        ),
        ScanKind::Block => visit.t(
            "the longest side is then usual for a block",
            "khi đó cạnh dài nhất là bình thường đối với một ván",
        ),
    };
    let Some(ScanUnit {
        unit,
        origin,
        likelier,
    }) = unit
    else {
        return match extent.sides {
            Some(_) => visit
                .t(
                    "not known: the size is unusual in every unit",
                    "không rõ: kích thước bất thường ở mọi đơn vị",
                )
                .to_owned(),
            None => String::new(),
        };
    };
    let name = unit_name(visit, unit);
    let said = match origin {
        UnitOrigin::Given => format!("{name}, {}", visit.t("as chosen", "như đã chọn")),
        UnitOrigin::File => format!(
            "{name}, {}",
            visit.t(
                "as the file says; not used unless it is chosen",
                "theo tệp; chỉ được dùng nếu bạn chọn",
            )
        ),
        UnitOrigin::Guess => format!("{} {name}: {usual}", visit.t("probably", "có lẽ là")),
    };
    match likelier {
        None => said,
        Some(other) => format!(
            "{said}; {} {}: {usual}",
            visit.t("more likely", "nhiều khả năng là"),
            unit_name(visit, other)
        ),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::{common_unit, files_part, size, table, unit, unusable, why_unit};
    use crate::app::import_headers::{FileHeaders, PlannedFiles, UnreadFile};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_core::domain::LengthUnit;
    use mocban_core::mesh::MeshExtent;
    use mocban_project::file_headers::ScanKind;

    const SCAN: MeshExtent = MeshExtent {
        sides: Some([42.0, 30.0, 4.25]),
        is_exact: true,
        unit: None,
    };

    #[test]
    fn sizes_and_reasons_are_said_in_the_language_of_the_page() {
        let kind = ScanKind::Character;
        let guess = kind.unit(&SCAN, None);
        let wrong = kind.unit(&SCAN, Some(LengthUnit::M));
        let english = Visit::in_language(Language::English);
        assert_eq!(size(&english, &SCAN, guess), "42.0 × 30.0 × 4.25 mm");
        assert_eq!(
            why_unit(&english, kind, &SCAN, guess),
            "probably mm: the longest side is then usual for a character"
        );
        assert_eq!(
            why_unit(&english, kind, &SCAN, wrong),
            "m, as chosen; more likely mm: the longest side is then usual for a character"
        );
        let vietnamese = Visit::in_language(Language::Vietnamese);
        let parts = MeshExtent {
            is_exact: false,
            ..SCAN
        };
        assert_eq!(size(&vietnamese, &parts, None), "khoảng 42,0 × 30,0 × 4,25");
        assert_eq!(common_unit(&[guess, None]), Some(LengthUnit::Mm));
        assert_eq!(common_unit(&[guess, wrong]), None);
        assert_eq!(common_unit(&[None]), None);
        let named = MeshExtent {
            unit: Some(LengthUnit::Cm),
            ..SCAN
        };
        let named = kind.unit(&named, None);
        assert_eq!(common_unit(&[named, named]), Some(LengthUnit::Cm));
        assert_eq!(common_unit(&[named, guess]), None);
        let said = why_unit(&english, kind, &SCAN, named);
        assert!(
            said.starts_with("cm, as the file says; not used unless it is chosen"),
            "{said}"
        );
    }

    /// Returns a block in a unit whose page is 400 mm long.
    fn block(unit: LengthUnit) -> FileHeaders {
        FileHeaders {
            files: PlannedFiles {
                name: "b".to_owned(),
                kind: ScanKind::Block,
                scan: PathBuf::new(),
                print: PathBuf::new(),
                labels: None,
                unit: Some(unit),
            },
            scan: Ok(SCAN),
            print: Ok([4000, 2000]),
            page_mm: Some(400.0),
            labels: None,
        }
    }

    #[test]
    fn a_block_whose_page_has_another_length_has_its_likelier_unit() {
        let visit = Visit::in_language(Language::English);
        let [doubted, fitting] = [LengthUnit::Mm, LengthUnit::Cm].map(|given| {
            let heads = block(given);
            let units = [unit(&heads)];
            table(&visit, &[heads], &units).into_string()
        });
        assert!(doubted.contains(" px · 400 mm"), "{doubted}");
        // The column is wide enough for several words a line.
        assert!(doubted.contains("class=\"muted reason\""), "{doubted}");
        assert!(
            doubted.contains("; as long as its page if the unit is cm"),
            "{doubted}"
        );
        assert!(!fitting.contains("as long as its page"), "{fitting}");
    }

    #[test]
    fn labels_that_cannot_be_used_are_counted_with_the_files_of_blocks() {
        let mut heads = block(LengthUnit::Mm);
        assert_eq!(unusable(&heads).count(), 0);
        heads.labels = Some(Err(UnreadFile::of_program("b.json cannot be opened")));
        assert_eq!(unusable(&heads).count(), 1);
        for (language, of_pairs, of_blocks) in [
            (
                Language::English,
                "Pairs whose files were looked at",
                "Blocks whose files were looked at",
            ),
            (
                Language::Vietnamese,
                "Số cặp đã kiểm tra tệp",
                "Số ván đã kiểm tra tệp",
            ),
        ] {
            let visit = Visit::in_language(language);
            let [pairs, blocks] = [false, true].map(|are_blocks| {
                let part = files_part(&visit, are_blocks, 1200);
                part.into_string()
            });
            for part in [&pairs, &blocks] {
                let counter = "<span id=\"looked-at\">0 / 1\u{202f}200</span>";
                assert!(part.contains(counter), "{part}");
            }
            assert!(pairs.contains(of_pairs), "{pairs}");
            assert!(blocks.contains(of_blocks), "{blocks}");
        }
    }
}
