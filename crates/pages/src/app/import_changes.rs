//! What an import would change in the columns of known pairs or blocks.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::components::grouped;
use super::failure::AppResult;
use super::import_choice::Planned;
use super::projects::OpenProject;
use super::visit::Visit;
use mocban_catalog::{BlockAttributes, PairAttributes};
use mocban_lists::manifest::BlockRow;
use mocban_project::import_plan::{PlannedPair, metadata_hash};

/// What may happen to each column, in English and Vietnamese: pairs lose its value, or get a first or another one.
const COLUMNS: [[[&str; 2]; 2]; 5] = [
    [
        ["Pairs that lose their block", "Số cặp mất tên ván"],
        [
            "Pairs that get a block or another one",
            "Số cặp được thêm hoặc đổi tên ván",
        ],
    ],
    [
        ["Pairs that lose their character", "Số cặp mất chữ"],
        [
            "Pairs that get a character or another one",
            "Số cặp được thêm hoặc đổi chữ",
        ],
    ],
    [
        ["Pairs that lose their unit", "Số cặp mất đơn vị"],
        [
            "Pairs that get a unit or another one",
            "Số cặp được thêm hoặc đổi đơn vị",
        ],
    ],
    [
        [
            "Pairs that lose their scanned side",
            "Số cặp không còn ghi mặt được quét",
        ],
        [
            "Pairs that get a scanned side or another one",
            "Số cặp được thêm hoặc đổi mặt được quét",
        ],
    ],
    [
        [
            "Pairs that lose all their other columns",
            "Số cặp mất mọi cột khác",
        ],
        [
            "Pairs whose other columns change",
            "Số cặp có các cột khác bị đổi",
        ],
    ],
];

/// What may happen to the columns of blocks. Their metadata is not compared.
const BLOCK_COLUMNS: [[[&str; 2]; 2]; 3] = [
    [
        ["Blocks that lose their labels", "Số ván mất nhãn"],
        [
            "Blocks that get labels for the first time",
            "Số ván được thêm nhãn lần đầu",
        ],
    ],
    [
        ["Blocks that lose their unit", "Số ván mất đơn vị"],
        [
            "Blocks that get a unit or another one",
            "Số ván được thêm hoặc đổi đơn vị",
        ],
    ],
    [
        [
            "Blocks that lose their side",
            "Số ván không còn ghi mặt trước hay mặt sau",
        ],
        [
            "Blocks that get a side or another one",
            "Số ván được ghi thêm hoặc đổi mặt trước, mặt sau",
        ],
    ],
];

/// How many known pairs or blocks would change.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct ColumnChanges {
    /// Number of pairs or blocks that change.
    count: u64,
    /// For each of [`COLUMNS`] or [`BLOCK_COLUMNS`], the numbers of pairs or blocks that lose its value and that get a first or
    /// another one.
    columns: [[u64; 2]; COLUMNS.len()],
    /// Whether there are further pairs, which were not compared.
    is_cut: bool,
    /// Whether they are blocks.
    are_blocks: bool,
}

impl ColumnChanges {
    /// Compares the pairs of a list, or the blocks that would be imported, with those of the project. Folders of pairs change no
    /// columns.
    pub(super) async fn find(planned: &Planned, open: &OpenProject) -> AppResult<Self> {
        let mut changes = Self::default();
        let plan = match planned {
            Planned::Pairs(plan, _) => plan,
            Planned::Blocks(read) => {
                changes.are_blocks = true;
                let known = open.catalog.block_states().await?;
                let known = known.iter().map(|block| &block.attributes);
                let known: BTreeMap<_, _> = known.map(|block| (&block.name, block)).collect();
                for block in &read.rows {
                    if let Some(old) = known.get(&block.name) {
                        changes.add_block(old, block);
                    }
                }
                return Ok(changes);
            }
        };
        let names: Vec<_> = plan.shown.iter().map(|pair| &pair.name).collect();
        let known = open.catalog.pair_attributes(&names).await?;
        let known: BTreeMap<_, _> = known.iter().map(|pair| (&pair.name, pair)).collect();
        for pair in &plan.shown {
            if let Some(old) = known.get(&pair.name) {
                changes.add(old, pair);
            }
        }
        changes.is_cut = plan.pairs > plan.shown.len() as u64;
        Ok(changes)
    }

    fn add(&mut self, old: &PairAttributes, new: &PlannedPair) {
        let columns = [
            change(old.block.as_ref(), new.block.as_ref()),
            change(old.character.as_ref(), new.character.as_ref()),
            change(old.unit, new.unit),
            change(old.scanned_face_down, new.scanned_face_down),
            change(metadata_hash(&old.meta), new.metadata),
        ];
        self.count_changes(&columns);
    }

    /// Adds a block. Its labels may be the same file under another path, so other labels are not counted.
    fn add_block(&mut self, old: &BlockAttributes, new: &BlockRow) {
        let labels = change(
            old.labels_path.is_some().then_some(true),
            new.labels.is_some().then_some(true),
        );
        self.count_changes(&[
            labels,
            change(old.unit, new.unit),
            change(old.side, new.side),
        ]);
    }

    fn count_changes(&mut self, columns: &[Option<usize>]) {
        self.count += u64::from(columns.iter().any(Option::is_some));
        for (counts, found) in self.columns.iter_mut().zip(columns) {
            if let Some(what) = *found {
                counts[what] += 1;
            }
        }
    }

    /// Returns whether something changes, or may change in pairs that were not compared.
    pub(super) const fn may_change(&self) -> bool {
        self.count > 0 || self.is_cut
    }

    /// Says how many pairs or blocks change, and in which columns.
    pub(super) fn part(&self, visit: &Visit) -> Markup {
        let texts = if self.are_blocks {
            BLOCK_COLUMNS.as_slice()
        } else {
            COLUMNS.as_slice()
        };
        let counts = self.columns.iter().zip(texts);
        let lines = counts.flat_map(|(counts, texts)| counts.iter().zip(texts));
        let lines = lines.filter(|(number, _)| **number > 0);
        let loses = self.columns.iter().any(|[lost, _]| *lost > 0);
        html! {
            @if self.count > 0 {
                div.notice.warn #column-changes {
                    p {
                        @if self.are_blocks { (visit.t("Known blocks that this import changes", "Số ván đã có bị lần nhập này thay đổi")) }
                        @else { (visit.t("Known pairs that this import changes", "Số cặp đã có bị lần nhập này thay đổi")) }
                        ": "
                        @if self.is_cut { (visit.t("at least", "ít nhất")) " " }
                        b { (grouped(self.count)) }
                    }
                    ul { @for (number, texts) in lines { li { (texts[visit.index()]) ": " b { (grouped(*number)) } } } }
                    @if loses && self.are_blocks {
                        p { (visit.t(
                            "What the import does not name is emptied. To keep it, import a list of blocks with these columns.",
                            "Những gì lần nhập không nêu sẽ bị xóa. Để giữ lại, hãy nhập danh sách ván có các cột này.",
                        )) }
                    } @else if loses {
                        p { (visit.t(
                            "A column that the list lacks is emptied. If the list has it under another name, choose it under Columns of the list.",
                            "Cột mà danh sách không có sẽ bị xóa giá trị. Nếu danh sách có cột đó với tên khác, hãy chọn nó ở phần Các cột của danh sách.",
                        )) }
                    }
                }
            }
        }
    }
}

/// Returns 0 if a value is lost, and 1 if there is a first or another one.
fn change<T: Copy + PartialEq>(old: Option<T>, new: Option<T>) -> Option<usize> {
    match (old, new) {
        (Some(_), None) => Some(0),
        _ => (old != new).then_some(1),
    }
}

#[cfg(test)]
mod tests {
    use super::ColumnChanges;
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_catalog::{BlockAttributes, PairAttributes};
    use mocban_core::domain::{BlockName, LengthUnit, PairName};
    use mocban_lists::manifest::parse_blocks;
    use mocban_project::import_plan::PlannedPair;
    use serde_json::Map;

    #[test]
    fn lost_and_other_values_are_counted() {
        let old = PairAttributes {
            name: PairName::new("1").expect("a name"),
            mesh_path: "1.stl".to_owned(),
            print_path: "1.png".to_owned(),
            unit: Some(LengthUnit::Mm),
            scanned_face_down: None,
            character: Some("天".to_owned()),
            block: Some("Ván 1".to_owned()),
            meta: Map::new(),
            prior: None,
        };
        let mut new = PlannedPair {
            name: old.name.clone(),
            mesh: "1.stl".into(),
            print: "1.png".into(),
            character: old.character.clone(),
            block: old.block.clone(),
            unit: old.unit,
            scanned_face_down: None,
            metadata: None,
            missing: Vec::new(),
        };
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
    fn blocks_that_lose_their_labels_are_counted() {
        let old = BlockAttributes {
            name: BlockName::new("b1").expect("a name"),
            mesh_path: "b1.stl".to_owned(),
            page_path: "b1.png".to_owned(),
            labels_path: Some("b1.json".to_owned()),
            unit: None,
            side: None,
            meta: None,
        };
        let row = |list: &str| parse_blocks(list.as_bytes()).expect("a list").remove(0);
        let mut changes = ColumnChanges {
            are_blocks: true,
            ..ColumnChanges::default()
        };
        changes.add_block(
            &old,
            &row("block,mesh,page,labels\nb1,b1.stl,b1.png,x/b1.json\n"),
        );
        assert!(!changes.may_change());
        changes.add_block(&old, &row("block,mesh,page\nb1,b1.stl,b1.png\n"));
        assert!(changes.may_change());
        for (language, text) in [
            (Language::English, "Blocks that lose their labels: <b>1</b>"),
            (Language::Vietnamese, "Số ván mất nhãn: <b>1</b>"),
        ] {
            let shown = changes.part(&Visit::in_language(language)).into_string();
            assert!(shown.contains(text), "{shown}");
        }
    }
}
