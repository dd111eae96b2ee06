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
use super::import_heads::{FileHeads, LookedAtFiles, PlannedFiles, look};
use super::import_pictures::pictures_part;
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use mocban_core::domain::{LengthUnit, one_line};
use mocban_core::mesh::MeshExtent;
use mocban_project::file_heads::{ScanKind, ScanUnit, UnitOrigin};

/// Most pairs whose files are looked at for one request of the script.
const MOST: usize = 400;
/// How long files are looked at for one request of the script; the file that is read then is finished.
const STEP_TIME: Duration = Duration::from_millis(500);
/// How long the files of the shown pairs may take.
const SHOWN_TIME: Duration = Duration::from_mins(1);

/// Returns the places of the page that are filled from its files: a table, and the files that cannot be used.
pub(super) fn files_part(visit: &Visit) -> Markup {
    let query = visit.query.text();
    html! {
        h3 { (visit.t("What the files say", "Các tệp cho biết gì")) }
        div #import-files data-load={ (visit.root) "import/files" (query) } aria-live="polite" {
            p.muted { (visit.t("Reading the files…", "Đang đọc các tệp…")) }
        }
        div #file-problems data-address={ (visit.root) "import/problems" (query) } {
            p.muted role="status" {
                (visit.t("Pairs whose files were looked at", "Số cặp đã xem tệp")) ": " span #looked-at { "0" }
                " · " (visit.t("files that cannot be used", "tệp không dùng được")) ": " b #unusable { "0" }
            }
            ul #unusable-files {}
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
    let LookedAtFiles { heads, .. } =
        look(&state, chosen, from, SHOWN_PAIRS as usize, SHOWN_TIME).await?;
    let units: Vec<Option<ScanUnit>> = heads.iter().map(unit).collect();
    let part = html! {
        @if !heads.is_empty() { (table(&visit, &heads, &units)) }
        (pictures_part(&visit, &heads, from))
        @if let Some(guess) = common_guess(&units).filter(|_| !has_list) { (guess_part(&visit, guess)) }
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
    let LookedAtFiles { heads, total } = look(&state, chosen, after, MOST, STEP_TIME).await?;
    let next = after + heads.len() as u64;
    let problems: Vec<String> = heads
        .iter()
        .flat_map(refused)
        .map(|(files, why)| {
            let why = why.text(visit.language);
            one_line(&format!("{}: {why}", files.name)).into_owned()
        })
        .collect();
    let is_over = heads.is_empty() || next >= total;
    Ok(Json(json!({
        "problems": problems,
        "looked_at": next.min(total),
        "next": (!is_over).then_some(next),
    })))
}

/// Returns why files of a pair cannot be used.
fn refused(heads: &FileHeads) -> impl Iterator<Item = (&PlannedFiles, &Sentence)> {
    let whys = [heads.scan.as_ref().err(), heads.print.as_ref().err()];
    whys.into_iter()
        .flatten()
        .map(move |why| (&heads.files, why))
}

fn unit(heads: &FileHeads) -> Option<ScanUnit> {
    let extent = heads.scan.as_ref().ok()?;
    heads.files.kind.unit(extent, heads.files.unit)
}

/// Returns the unit that is guessed for all scans, if it is the same one.
fn common_guess(units: &[Option<ScanUnit>]) -> Option<LengthUnit> {
    let mut known = units.iter().flatten();
    let first = known.next()?;
    let is_same = |unit: &ScanUnit| unit.origin == UnitOrigin::Guess && unit.unit == first.unit;
    (is_same(first) && known.all(is_same)).then_some(first.unit)
}

fn guess_part(visit: &Visit, unit: LengthUnit) -> Markup {
    let query = visit.query.with("unit", unit.name()).text();
    html! {
        p.row {
            span { (visit.t("The scans are probably in", "Bản quét có lẽ có đơn vị")) " " b { (unit_name(visit, unit)) } "." }
            a.button #use-unit href={ "import" (query) } { (visit.t("Use this unit", "Dùng đơn vị này")) }
        }
    }
}

fn table(visit: &Visit, heads: &[FileHeads], units: &[Option<ScanUnit>]) -> Markup {
    let label = visit.t("Sizes of the files", "Kích thước của các tệp");
    let is_block = heads.iter().any(|one| one.files.kind == ScanKind::Block);
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
            tbody { @for (one, unit) in heads.iter().zip(units) { tr {
                th scope="row" { (one_line(&one.files.name)) }
                @match &one.scan {
                    Ok(extent) => {
                        td { (size(visit, extent, *unit)) }
                        td.muted { (why_unit(visit, one.files.kind, extent, *unit)) }
                    },
                    Err(why) => {
                        td.bad { (one_line(why.text(visit.language))) }
                        td {}
                    },
                }
                @match &one.print {
                    Ok([width, height]) => td { (grouped(u64::from(*width))) " × " (grouped(u64::from(*height))) " px" },
                    Err(why) => td.bad { (one_line(why.text(visit.language))) },
                }
            } } }
        } }
    }
}

/// Returns the lengths of a scan along its axes in mm, or in its own unit if that is not known.
fn size(visit: &Visit, extent: &MeshExtent, unit: Option<ScanUnit>) -> String {
    let Some(sides) = extent.sides else {
        return visit
            .t("no position found", "không tìm thấy vị trí nào")
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
        UnitOrigin::File => format!("{name}, {}", visit.t("as the file says", "theo tệp")),
        UnitOrigin::Guess => format!("{} {name}: {usual}", visit.t("probably", "có lẽ là")),
    };
    match likelier {
        None => said,
        Some(other) => format!(
            "{said}; {} {}: {usual}",
            visit.t("rather", "đúng hơn có lẽ là"),
            unit_name(visit, other)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::{common_guess, size, why_unit};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_core::domain::LengthUnit;
    use mocban_core::mesh::MeshExtent;
    use mocban_project::file_heads::ScanKind;

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
            "m, as chosen; rather mm: the longest side is then usual for a character"
        );
        let vietnamese = Visit::in_language(Language::Vietnamese);
        let parts = MeshExtent {
            is_exact: false,
            ..SCAN
        };
        assert_eq!(size(&vietnamese, &parts, None), "khoảng 42,0 × 30,0 × 4,25");
        assert_eq!(common_guess(&[guess, None]), Some(LengthUnit::Mm));
        assert_eq!(common_guess(&[guess, wrong]), None);
        assert_eq!(common_guess(&[None]), None);
    }
}
