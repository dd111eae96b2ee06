//! What helps after failures of pairs and blocks, by their classes and by the files that their messages name.

use std::path::Path;

use maud::{Markup, html};

use super::address::encoded;
use super::scan_correction::ScanQuestion;
use super::visit::Visit;
use mocban_catalog::{BlockAttributes, PairAttributes, PairResults};
use mocban_core::domain::{BlockStage, FailureClass, NOT_THERE, Stage, one_line};

/// The failed pairs of which an import shall replace files.
#[derive(Debug, Clone, Copy)]
pub(super) enum MendedPairs<'p> {
    /// The pair with this name.
    Pair(&'p str),
    /// All pairs that failed with a class, without pairs that were cut from blocks.
    Class(FailureClass),
}

/// Where the files of pairs or blocks were named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FileOrigin {
    /// In a list.
    List,
    /// In a list, in folders or by themselves.
    Unknown,
    /// In a block from which the pairs were cut.
    Block,
}

impl FileOrigin {
    fn of_pair(pair: &PairAttributes) -> Self {
        match (&pair.prior, pair.is_listed()) {
            (Some(_), _) => Self::Block,
            (None, true) => Self::List,
            (None, false) => Self::Unknown,
        }
    }

    /// Returns what to correct; `None` if no import would help.
    const fn correction(self, visit: &Visit) -> Option<&'static str> {
        match self {
            Self::List => Some(visit.t(
                "If the list names a wrong file or unit, correct the list and import it again.",
                "Nếu danh sách ghi sai tệp hoặc đơn vị, hãy sửa danh sách rồi nhập lại.",
            )),
            Self::Unknown => Some(visit.t(
                "If another file or unit is right, import it again.",
                "Nếu cần tệp hoặc đơn vị khác, hãy nhập lại.",
            )),
            Self::Block => None,
        }
    }

    /// Returns what helps if a file does not exist.
    const fn missing(self, visit: &Visit) -> &'static str {
        match self {
            Self::List => visit.t(
                "The file is not there: put it there, or correct its path in the list and import the list again.",
                "Không có tệp này: hãy đặt tệp vào đó, hoặc sửa đường dẫn trong danh sách rồi nhập lại danh sách.",
            ),
            Self::Unknown => visit.t(
                "The file is not there: put it there, or import it again from where it is now.",
                "Không có tệp này: hãy đặt tệp vào đó, hoặc nhập lại từ chỗ hiện có tệp.",
            ),
            Self::Block => visit.t(
                "The file is not there. Run the block again: it cuts the pair anew.",
                "Không có tệp này. Hãy chạy lại ván: cặp này sẽ được cắt lại.",
            ),
        }
    }
}

/// Returns what helps after `number` failures of a class, of which some pairs are examples. `key` names the project.
pub(super) fn pair_remedy(
    visit: &Visit,
    key: &str,
    class: FailureClass,
    number: u64,
    examples: &[&PairResults],
) -> Markup {
    let mut origins = examples
        .iter()
        .map(|pair| FileOrigin::of_pair(&pair.attributes));
    let origin = origins.next().unwrap_or(FileOrigin::Unknown);
    let origin = if origins.all(|other| other == origin) {
        origin
    } else {
        FileOrigin::Unknown
    };
    let messages = examples.iter().filter_map(|pair| pair.failure.as_ref());
    let missing = messages.filter(|stored| stored.failure.message.ends_with(NOT_THERE));
    let missing = missing.count();
    let all_missing = missing > 0 && missing == examples.len();
    // Pairs that were cut from a block are mended with it.
    let mended = examples.iter().find(|pair| pair.attributes.prior.is_none());
    let mended = mended.map(|pair| match number {
        1 => MendedPairs::Pair(pair.attributes.name.as_str()),
        _ => MendedPairs::Class(class),
    });
    remedy(
        visit,
        &import_address(visit, key, mended),
        origin,
        class,
        (!all_missing).then(|| visit.remedy(class)),
        missing > 0,
    )
}

/// Returns the address of the import into a project, which says how files of pairs are replaced if some are given.
pub(super) fn import_address(visit: &Visit, key: &str, mended: Option<MendedPairs>) -> String {
    let address = format!("{}import?project={}", visit.root, encoded(key));
    match mended {
        Some(MendedPairs::Pair(pair)) => format!("{address}&mend={}", encoded(pair)),
        Some(MendedPairs::Class(class)) => format!("{address}&mend_class={class}"),
        None => address,
    }
}

/// Returns the link to the page that sets the unit of a pair's scan, if the pair failed because of it. A pair that was cut
/// from a block has the block's unit. `project` is the relative address of the project's pages.
pub(super) fn unit_link(visit: &Visit, project: &str, pair: &PairResults) -> Option<Markup> {
    let names_unit = (pair.failure.as_ref()).is_some_and(|stored| stored.failure.names_unit());
    if !names_unit || pair.attributes.prior.is_some() {
        return None;
    }
    let name = pair.attributes.name.as_str();
    let question = ScanQuestion::Unit;
    let title = question.title(visit, 1);
    Some(html! {
        a href={ (project) "correct?what=" (question.name()) "&pair=" (encoded(name)) } aria-label={ (title) ": " (one_line(name)) } { (title) }
    })
}

/// Returns what helps after a stage of a block failed. `key` names the project.
pub(super) fn block_remedy(
    visit: &Visit,
    key: &str,
    block: &BlockAttributes,
    stage: BlockStage,
    (class, message): (FailureClass, &str),
) -> Markup {
    let is_listed = block.meta.as_ref().is_some_and(|meta| !meta.is_empty());
    let origin = if is_listed {
        FileOrigin::List
    } else {
        FileOrigin::Unknown
    };
    let is_missing = message.ends_with(NOT_THERE);
    let general = (!is_missing).then(|| visit.block_remedy(stage, class));
    let import = import_address(visit, key, None);
    remedy(visit, &import, origin, class, general, is_missing)
}

/// Returns what helps, with a link to the import at an address if it helps.
fn remedy(
    visit: &Visit,
    import: &str,
    origin: FileOrigin,
    class: FailureClass,
    general: Option<&str>,
    is_missing: bool,
) -> Markup {
    let is_input = matches!(class, FailureClass::BadInput | FailureClass::NoSolution);
    let correction = origin.correction(visit).filter(|_| is_input);
    let has_import = correction.is_some() || (is_missing && origin != FileOrigin::Block);
    html! {
        @if let Some(general) = general { p { (general) } }
        @if is_missing { p { (origin.missing(visit)) } }
        @if let Some(correction) = correction { p { (correction) } }
        @if has_import {
            p.row { a href=(import) { (visit.t("Import", "Nhập dữ liệu")) } }
        }
    }
}

/// Returns the part of a pair that failed: the file that the message names, or else the stage.
pub(super) fn failed_part(
    visit: &Visit,
    pair: &PairAttributes,
    stage: Stage,
    message: &str,
) -> &'static str {
    let is_named = |path: &str| {
        let name = Path::new(path).file_name();
        name.and_then(|name| name.to_str())
            .is_some_and(|name| message.contains(name))
    };
    match [&pair.mesh_path, &pair.print_path].map(|path| is_named(path)) {
        [true, false] => visit.t("scan", "bản quét"),
        [false, true] => visit.t("print", "bản in"),
        [true, true] | [false, false] => visit.stage(stage),
    }
}

#[cfg(test)]
mod tests {
    use super::{FileOrigin, failed_part, import_address, pair_remedy, remedy};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_catalog::PairAttributes;
    use mocban_core::domain::{FailureClass, PairName, Stage};
    use mocban_results::test_fixtures as fixtures;
    use serde_json::Map;

    fn attributes(character: Option<&str>) -> PairAttributes {
        PairAttributes {
            name: PairName::new("1").expect("a name"),
            mesh_path: "stl/1.stl".to_owned(),
            print_path: "print/1.png".to_owned(),
            unit: None,
            scanned_face_down: None,
            character: character.map(str::to_owned),
            block: None,
            meta: Map::new(),
            prior: None,
        }
    }

    #[test]
    fn only_pairs_of_a_list_are_told_of_a_list() {
        let origins = [Some("天"), None].map(|text| FileOrigin::of_pair(&attributes(text)));
        assert_eq!(origins, [FileOrigin::List, FileOrigin::Unknown]);
        let cases = [
            (FailureClass::BadInput, false),
            (FailureClass::NoSolution, false),
            (FailureClass::Io, true),
        ];
        for (language, word) in [
            (Language::English, "list"),
            (Language::Vietnamese, "danh sách"),
        ] {
            let visit = Visit::in_language(language);
            let import = import_address(&visit, "a b", None);
            for (class, is_missing) in cases {
                let [listed, unknown] = origins.map(|origin| {
                    remedy(&visit, &import, origin, class, None, is_missing).into_string()
                });
                assert!(listed.contains(word), "{listed}");
                assert!(!unknown.contains(word), "{unknown}");
                for shown in [listed, unknown] {
                    assert!(shown.contains("import?project=a%20b"), "{shown}");
                }
            }
        }
    }

    #[test]
    fn an_import_for_failed_pairs_says_how_a_file_is_replaced() {
        let message = "1.png: the image is empty";
        let failed = fixtures::failed("chữ 1", FailureClass::BadInput, message);
        let mut cut = failed.clone();
        cut.attributes.prior = Some("{}".to_owned());
        let visit = Visit::in_language(Language::English);
        for (number, examples, mended) in [
            (1, &[&failed][..], Some("mend=ch%E1%BB%AF%201")),
            (2, &[&failed, &failed], Some("mend_class=bad_input")),
            (7, &[&cut, &failed], Some("mend_class=bad_input")),
            (2, &[&cut, &cut], None),
        ] {
            let shown = pair_remedy(&visit, "a b", FailureClass::BadInput, number, examples);
            let shown = shown.into_string();
            let links: Vec<&str> = shown.split("href=\"").skip(1).collect();
            match mended {
                Some(mended) => {
                    let link = format!("./import?project=a%20b&amp;{mended}\"");
                    assert!(links.len() == 1 && links[0].starts_with(&link), "{shown}");
                }
                None => assert!(links.is_empty(), "{shown}"),
            }
        }
    }

    #[test]
    fn what_was_typed_in_the_app_makes_no_list() {
        let mut typed = attributes(None);
        typed.block = Some("Ván 9".to_owned());
        typed.scanned_face_down = Some(true);
        assert_eq!(FileOrigin::of_pair(&typed), FileOrigin::Unknown);
        typed.meta.insert("folio".to_owned(), "3a".into());
        assert_eq!(FileOrigin::of_pair(&typed), FileOrigin::List);
        typed.prior = Some("{}".to_owned());
        assert_eq!(FileOrigin::of_pair(&typed), FileOrigin::Block);
        assert!(!typed.is_listed(), "it was cut from a block");
    }

    #[test]
    fn a_failure_names_its_file_or_its_stage() {
        let visit = Visit::in_language(Language::Vietnamese);
        let pair = attributes(None);
        let of = |message| failed_part(&visit, &pair, Stage::Fit, message);
        assert_eq!(of("print/1.png: the image is empty"), "bản in");
        assert_eq!(of("/a/stl/1.stl is not there"), "bản quét");
        assert_eq!(of("no plane"), "khớp mặt khắc");
    }
}
