//! What an import would change in the columns of known pairs or blocks.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use maud::{Markup, html};
use serde_json::{Map, Value};

use super::changed_columns::ColumnNames;
use super::components::grouped;
use super::failure::AppResult;
use super::import_choice::Planned;
use super::projects::OpenProject;
use super::visit::Visit;
use mocban_catalog::{BlockAttributes, Catalog, PairAttributes};
use mocban_core::domain::BlockName;
use mocban_lists::manifest::BlockRow;
use mocban_project::blocking::blocking;
use mocban_project::column_hashes::{ColumnHasher, ColumnHashes};
use mocban_project::import_blocks::rows_as_stored;
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
            "Pairs that lose values of other columns",
            "Số cặp mất giá trị ở các cột khác",
        ],
        [
            "Pairs whose other columns change",
            "Số cặp có các cột khác bị đổi",
        ],
    ],
];

/// Most known blocks that are compared: their files are looked for, and each may have a MiB of metadata.
const MAX_BLOCKS: usize = 2000;

/// What may happen to the files of blocks.
const OTHER_FILES: [&str; 2] = [
    "Blocks that get another scan or page",
    "Số ván được đổi bản quét hoặc trang in",
];

/// What may happen to the columns of blocks.
const BLOCK_COLUMNS: [[[&str; 2]; 2]; 4] = [
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
    [
        [
            "Blocks that lose values of other columns",
            "Số ván mất giá trị ở các cột khác",
        ],
        [
            "Blocks whose other columns change",
            "Số ván có các cột khác bị đổi",
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
    /// The other columns whose values are lost, and the columns that get a first or another one.
    names: [ColumnNames; 2],
    /// Number of blocks that get another scan or page.
    other_files: u64,
    /// Whether there are further pairs or blocks, which were not compared.
    is_cut: bool,
    /// Whether they are blocks.
    are_blocks: bool,
}

impl ColumnChanges {
    /// Compares the pairs of a list, or the blocks that would be imported, with those of the project. Folders of pairs change no
    /// columns.
    pub(super) async fn find(planned: &Planned, open: &OpenProject) -> AppResult<Self> {
        let plan = match planned {
            Planned::Pairs(plan, _) => plan,
            Planned::Blocks(read, list) => {
                return Self::of_blocks(&read.rows, list.as_deref(), open).await;
            }
        };
        let mut changes = Self::default();
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
            match &new.columns {
                Some(columns) => self.other_columns(&old.meta, columns),
                None => change(metadata_hash(&old.meta), new.metadata),
            },
        ];
        self.count_changes(&columns, false);
    }

    async fn of_blocks(
        rows: &[BlockRow],
        list: Option<&Path>,
        open: &OpenProject,
    ) -> AppResult<Self> {
        let known = open.catalog.block_names().await?.into_iter().collect();
        let (rows, is_cut) = known_rows(rows, &known);
        let mut changes = Self {
            is_cut,
            are_blocks: true,
            ..Self::default()
        };
        for rows in rows.chunks(Catalog::BLOCKS_AT_ONCE) {
            let names: Vec<&BlockName> = rows.iter().map(|row| &row.name).collect();
            let old = open.catalog.block_attributes(&names).await?;
            let (project, list) = (open.project.clone(), list.map(Path::to_owned));
            let rows: Vec<BlockRow> = rows.iter().copied().cloned().collect();
            let new = blocking(move || rows_as_stored(rows, list.as_deref(), &project));
            let new = new.await??;
            let new: BTreeMap<_, _> = new.iter().map(|block| (&block.name, block)).collect();
            for old in &old {
                if let Some(new) = new.get(&old.name) {
                    changes.add_block(old, new);
                }
            }
        }
        Ok(changes)
    }

    /// Adds a block. Its labels may be the same file under another path, so other labels are not counted.
    fn add_block(&mut self, old: &BlockAttributes, new: &BlockAttributes) {
        let labels = change(
            old.labels_path.is_some().then_some(true),
            new.labels_path.is_some().then_some(true),
        );
        let columns = [
            labels,
            change(old.unit, new.unit),
            change(old.side, new.side),
            self.other_columns_of_block(old, new),
        ];
        self.count_changes(&columns, !old.has_same_scan_and_page(new));
    }

    /// Returns whether other columns lose values, and whether they get first or other ones, and keeps their names.
    fn other_columns(&mut self, old: &Map<String, Value>, new: &ColumnHashes) -> [bool; 2] {
        let Some(old) = ColumnHasher::default().hashes(old) else {
            return [false, true];
        };
        let changes = old.changes(new);
        for (names, changed) in self.names.iter_mut().zip(&changes) {
            for name in changed {
                names.add(name);
            }
        }
        changes.map(|changed| !changed.is_empty())
    }

    /// Returns what happens to the other columns of a block. An import that has none keeps them.
    fn other_columns_of_block(
        &mut self,
        old: &BlockAttributes,
        new: &BlockAttributes,
    ) -> [bool; 2] {
        let Some(new) = &new.meta else {
            return [false; 2];
        };
        let none = Map::new();
        let old = old.meta.as_ref().unwrap_or(&none);
        match ColumnHasher::default().hashes(new) {
            Some(new) => self.other_columns(old, &new),
            None => [false, old != new],
        }
    }

    /// Counts a pair or block once, and each of its columns that changes.
    fn count_changes(&mut self, columns: &[[bool; 2]], has_other_files: bool) {
        self.other_files += u64::from(has_other_files);
        let is_changed = columns.as_flattened().contains(&true);
        self.count += u64::from(has_other_files || is_changed);
        let counts = self.columns.as_flattened_mut().iter_mut();
        for (count, is_changed) in counts.zip(columns.as_flattened()) {
            *count += u64::from(*is_changed);
        }
    }

    /// Returns whether something changes, or may change in pairs or blocks that were not compared.
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
        let named = self.names.each_ref().map(ColumnNames::text);
        // Only the last row, that of the other columns, has names.
        let unnamed = texts.len().saturating_sub(1);
        let names = std::iter::repeat_n("", 2 * unnamed).chain(named.iter().map(String::as_str));
        let counts = self.columns.as_flattened().iter();
        let lines = counts.zip(texts.as_flattened()).zip(names);
        let lines = lines.filter(|((number, _), _)| **number > 0);
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
                    ul {
                        @if self.other_files > 0 { li { (OTHER_FILES[visit.index()]) ": " b { (grouped(self.other_files)) } } }
                        @for ((number, texts), names) in lines { li { (texts[visit.index()]) ": " b { (grouped(*number)) } (names) } }
                    }
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

/// Returns the rows of known blocks that are compared, and whether there are more.
fn known_rows<'r>(rows: &'r [BlockRow], known: &BTreeSet<BlockName>) -> (Vec<&'r BlockRow>, bool) {
    let mut rows = rows.iter().filter(|row| known.contains(&row.name));
    let compared = rows.by_ref().take(MAX_BLOCKS).collect();
    (compared, rows.next().is_some())
}

/// Returns whether a value is lost, and whether there is a first or another one.
fn change<T: Copy + PartialEq>(old: Option<T>, new: Option<T>) -> [bool; 2] {
    let is_lost = old.is_some() && new.is_none();
    [is_lost, !is_lost && old != new]
}

#[cfg(test)]
mod tests;
