//! What the preview of an import says of columns and choices.

use std::collections::BTreeMap;

use super::{SHOWN_COLUMNS, import_form, other_columns, renamed_text};
use crate::app::address::PageQuery;
use crate::app::import_choice::{ImportChoice, Planned};
use crate::app::visit::Visit;
use crate::review::Language;
use mocban_core::domain::BlockName;
use mocban_lists::manifest::{BlockRow, ReadBlocks};
use serde_json::Value;

#[test]
fn columns_have_the_names_of_the_page() {
    let line = "columns with other names were read: \"Khối\" as block, \"Ký hiệu, số\" as id, \"Bản quét\" as mesh";
    let of = |language, line| renamed_text(&Visit::in_language(language), line);
    assert_eq!(of(Language::English, line).as_deref(), Some(line));
    assert_eq!(
        of(Language::Vietnamese, line).as_deref(),
        Some("Đã hiểu các cột có tên khác: \"Khối\" là Ván, \"Ký hiệu, số\" là Mã")
    );
    let same = "columns with other names were read: \"bản quét\" as mesh, \"Mã\" as id";
    assert_eq!(of(Language::Vietnamese, same), None);
    assert_eq!(of(Language::English, same).as_deref(), Some(same));
    let line = "columns with other names were read: \"Trang\" as page, \"Tệp nhãn\" as labels";
    assert_eq!(
        of(Language::Vietnamese, line).as_deref(),
        Some("Đã hiểu các cột có tên khác: \"Trang\" là Trang in, \"Tệp nhãn\" là Nhãn")
    );
}

/// Returns a block with these columns beside the known ones.
fn block(columns: &[String]) -> BlockRow {
    let meta = columns.iter().map(|name| (name.clone(), Value::from("x")));
    BlockRow {
        line: 2,
        name: BlockName::new("b").expect("an id"),
        mesh: "b.stl".into(),
        page: "b.png".into(),
        labels: None,
        unit: None,
        side: None,
        meta: meta.collect::<BTreeMap<_, _>>(),
    }
}

#[test]
fn columns_of_blocks_that_are_not_used_are_named_once() {
    let columns = ["Ghi chú", "lables"].map(str::to_owned);
    let rows = [block(&columns), block(&columns[..1])];
    for (language, part) in [
        (Language::English, "but not used: Ghi chú, lables</p>"),
        (
            Language::Vietnamese,
            "nhưng không dùng đến: Ghi chú, lables</p>",
        ),
    ] {
        let visit = Visit::in_language(language);
        let shown = other_columns(&visit, &rows).into_string();
        assert!(shown.contains(part), "{shown}");
        assert_eq!(other_columns(&visit, &[block(&[])]).into_string(), "");
    }
    let many: Vec<String> = (0..=SHOWN_COLUMNS).map(|i| format!("c{i:02}")).collect();
    let visit = Visit::in_language(Language::English);
    let shown = other_columns(&visit, &[block(&many)]).into_string();
    assert!(shown.contains("c39, …</p>"), "{shown}");
}

#[test]
fn what_the_form_of_an_import_has_is_kept_in_the_address_of_its_page() {
    let chosen = ImportChoice::of(&PageQuery::parse("project=p&unit=cm&changed=yes"));
    let planned = Planned::Blocks(ReadBlocks::default(), None);
    let visit = Visit::in_language(Language::English);
    let shown = import_form(&visit, &chosen, &planned).into_string();
    assert_eq!(shown.matches(" data-in-address>").count(), 3, "{shown}");
    let part = "name=\"changed\" value=\"yes\" checked data-in-address>";
    assert!(shown.contains(part), "{shown}");
}

#[test]
fn the_only_whole_block_gets_a_name() {
    let planned = Planned::Blocks(ReadBlocks::default(), None);
    for (language, label) in [
        (
            Language::English,
            "Name of the block (empty: that of its file)",
        ),
        (Language::Vietnamese, "Tên của ván (để trống: theo tên tệp)"),
    ] {
        let visit = Visit::in_language(language);
        let of = |address| {
            let chosen = ImportChoice::of(&PageQuery::parse(address));
            import_form(&visit, &chosen, &planned).into_string()
        };
        let shown = of("whole_block=yes&block=b+7");
        for part in [label, "name=\"block\" value=\"b 7\""] {
            assert!(shown.contains(part), "{part}: {shown}");
        }
        let listed = of("list=blocks.csv");
        assert!(!listed.contains("name=\"block\""), "{listed}");
    }
}
