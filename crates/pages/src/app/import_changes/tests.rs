//! What an import changes in known pairs and blocks.

use super::ColumnChanges;
use crate::app::visit::Visit;
use crate::review::Language;
use mocban_catalog::{BlockAttributes, PairAttributes};
use mocban_core::domain::{BlockName, LengthUnit, PairName};
use mocban_project::column_hashes::{ColumnHasher, ColumnHashes};
use mocban_project::import_plan::PlannedPair;
use serde_json::{Map, Value};

fn pair() -> PairAttributes {
    PairAttributes {
        name: PairName::new("1").expect("a name"),
        mesh_path: "1.stl".to_owned(),
        print_path: "1.png".to_owned(),
        unit: Some(LengthUnit::Mm),
        scanned_face_down: None,
        character: Some("天".to_owned()),
        block: Some("Ván 1".to_owned()),
        meta: Map::new(),
        prior: None,
    }
}

/// Returns what an import of the same pair without other columns would store.
fn planned(old: &PairAttributes) -> PlannedPair {
    PlannedPair {
        name: old.name.clone(),
        mesh: "1.stl".into(),
        print: "1.png".into(),
        character: old.character.clone(),
        block: old.block.clone(),
        unit: old.unit,
        scanned_face_down: None,
        metadata: None,
        columns: Some(ColumnHashes::default()),
        missing: Vec::new(),
    }
}

/// Returns other columns with their values.
fn meta(columns: &[[&str; 2]]) -> Map<String, Value> {
    let columns = columns.iter();
    let columns = columns.map(|[name, value]| ((*name).to_owned(), Value::from(*value)));
    columns.collect()
}

#[test]
fn lost_and_other_values_are_counted() {
    let old = pair();
    let mut new = planned(&old);
    let mut changes = ColumnChanges::default();
    changes.add(&old, &new);
    assert_eq!(changes, ColumnChanges::default());
    new.block = None;
    changes.add(&old, &new);
    new.unit = Some(LengthUnit::Cm);
    changes.add(&old, &new);
    let shown = changes.part(&Visit::in_language(Language::Vietnamese));
    let shown = shown.into_string();
    for text in [
        "thay đổi: <b>2</b>",
        "mất tên ván: <b>2</b>",
        "đổi đơn vị: <b>1</b>",
    ] {
        assert!(shown.contains(text), "{shown}");
    }
}

#[test]
fn other_columns_of_pairs_are_named_that_are_lost_or_change() {
    let old = PairAttributes {
        meta: meta(&[["Ghi chú", "x"], ["Kho lưu", "R.12"], ["Năm", "1872"]]),
        ..pair()
    };
    let new = |columns: &[[&str; 2]]| PlannedPair {
        columns: ColumnHasher::default().hashes(&meta(columns)),
        ..planned(&old)
    };
    let mut changes = ColumnChanges::default();
    changes.add(
        &old,
        &new(&[["Ghi chú", "x"], ["Kho lưu", "R.12"], ["Năm", "1872"]]),
    );
    assert_eq!(changes, ColumnChanges::default());
    changes.add(
        &old,
        &new(&[["Ghi chú", "x"], ["Năm", "1873"], ["Dòng", "3"]]),
    );
    changes.add(&old, &new(&[["Năm", "1872"]]));
    for (language, texts) in [
        (
            Language::English,
            [
                "this import changes: <b>2</b>",
                "lose values of other columns: <b>2</b> (Ghi chú, Kho lưu)",
                "whose other columns change: <b>1</b> (Dòng, Năm)",
            ],
        ),
        (
            Language::Vietnamese,
            [
                "thay đổi: <b>2</b>",
                "mất giá trị ở các cột khác: <b>2</b> (Ghi chú, Kho lưu)",
                "có các cột khác bị đổi: <b>1</b> (Dòng, Năm)",
            ],
        ),
    ] {
        let shown = changes.part(&Visit::in_language(language)).into_string();
        for text in texts {
            assert!(shown.contains(text), "{text}: {shown}");
        }
    }
    // The columns of a list with very many are compared together.
    let unnamed = PlannedPair {
        columns: None,
        ..planned(&old)
    };
    let mut changes = ColumnChanges::default();
    changes.add(&old, &unnamed);
    let shown = changes.part(&Visit::in_language(Language::English));
    let shown = shown.into_string();
    assert!(
        shown.contains("lose values of other columns: <b>1</b></li>"),
        "{shown}"
    );
}

fn block() -> BlockAttributes {
    BlockAttributes {
        name: BlockName::new("b1").expect("a name"),
        mesh_path: "b1.stl".to_owned(),
        page_path: "b1.png".to_owned(),
        labels_path: Some("b1.json".to_owned()),
        unit: None,
        side: None,
        meta: None,
    }
}

#[test]
fn blocks_that_lose_their_labels_are_counted() {
    let old = block();
    let mut changes = ColumnChanges {
        are_blocks: true,
        ..ColumnChanges::default()
    };
    let mut new = old.clone();
    new.labels_path = Some("x/b1.json".to_owned());
    new.page_path = "./b1.png".to_owned();
    changes.add_block(&old, &new);
    assert!(!changes.may_change());
    new.labels_path = None;
    changes.add_block(&old, &new);
    assert!(changes.may_change());
    for (language, text) in [
        (Language::English, "Blocks that lose their labels: <b>1</b>"),
        (Language::Vietnamese, "Số ván mất nhãn: <b>1</b>"),
    ] {
        let shown = changes.part(&Visit::in_language(language)).into_string();
        assert!(shown.contains(text), "{shown}");
    }
}

#[test]
fn blocks_that_lose_other_columns_or_get_another_page_are_counted() {
    let meta = |columns: &[[&str; 2]]| Some(meta(columns));
    let old = BlockAttributes {
        meta: meta(&[["Ghi chú", "x"], ["Kho lưu", "R.12"]]),
        ..block()
    };
    let mut changes = ColumnChanges {
        are_blocks: true,
        ..ColumnChanges::default()
    };
    // Files without a list have no other columns.
    changes.add_block(&old, &block());
    assert!(!changes.may_change());
    let mut new = old.clone();
    new.meta = meta(&[["Ghi chú", "x"]]);
    new.page_path = "b2.png".to_owned();
    changes.add_block(&old, &new);
    new.meta = meta(&[["Ghi chú", "y"], ["Kho lưu", "R.12"]]);
    changes.add_block(&old, &new);
    let [english, vietnamese] = Language::ALL.map(|language| {
        let shown = changes.part(&Visit::in_language(language));
        shown.into_string()
    });
    for text in [
        "this import changes: <b>2</b>",
        "another scan or page: <b>2</b>",
        "lose values of other columns: <b>1</b> (Kho lưu)",
        "whose other columns change: <b>1</b> (Ghi chú)",
    ] {
        assert!(english.contains(text), "{english}");
    }
    for text in [
        "đổi bản quét hoặc trang in: <b>2</b>",
        "mất giá trị ở các cột khác: <b>1</b> (Kho lưu)",
        "có các cột khác bị đổi: <b>1</b> (Ghi chú)",
    ] {
        assert!(vietnamese.contains(text), "{vietnamese}");
    }
}
