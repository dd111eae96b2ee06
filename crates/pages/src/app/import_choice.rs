//! What a person has chosen to import, as the address and the form of the page of imports have it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;

use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::folder_picker::PickerRoots;
use super::import_matches::{changes, not_of_page};
use super::named_blocks::named_blocks;
use super::plan_cache::{KEPT_PAIRS, PlanCache};
use super::sentence::Sentence;
use mocban_core::domain::LengthUnit;
use mocban_core::domain::spelling::composed;
use mocban_lists::manifest::{
    ChosenColumns, ListHead, PairingChanges, ReadBlocks, is_named_like_mesh, is_named_like_print,
    read_head,
};
use mocban_project::ProjectError;
use mocban_project::files::is_jsonl;
use mocban_project::folder_files::list_below;
use mocban_project::import_blocks::{BlockSource, ImportedBlock, ListedItems};
use mocban_project::import_pairs::PairSource;
use mocban_project::import_plan::{ImportPlan, plan_import};
use mocban_project::location::Location;
use mocban_project::pair_choices::PairChoices;

/// Number of pairs that are shown at once before an import.
pub(super) const SHOWN_PAIRS: u64 = 20;
/// Longest name of a block that is typed.
pub(super) const BLOCK_CHARS: usize = 60;
/// Rows of a list that are shown to choose its columns.
const SHOWN_ROWS: usize = 3;

/// What the user has chosen, as the address has it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ImportChoice {
    /// Name of the project.
    pub(super) project: String,
    /// Folder of scans.
    pub(super) meshes: String,
    /// Folder of prints.
    pub(super) prints: String,
    /// A list.
    pub(super) list: String,
    pub(super) unit: String,
    /// The block of pairs for which none is named, or the name of the only whole block.
    pub(super) block: String,
    /// Whether files may be missing.
    pub(super) missing: String,
    /// Whether most known pairs may get other files.
    pub(super) changed: String,
    /// Changes of the pairs, in JSON.
    pub(super) matches: String,
    /// Hash of the pairs that were shown.
    pub(super) shown: String,
    /// The project with whose pairs the page has compared those of the list. `None` if no page has shown them.
    pub(super) compared: Option<String>,
    /// Whether the only scan and the only image are a whole block and its page.
    pub(super) whole_block: String,
    id_column: String,
    mesh_column: String,
    print_column: String,
    character_column: String,
    block_column: String,
    unit_column: String,
}

/// What would be imported.
#[derive(Debug)]
pub(super) enum Planned {
    /// Pairs. The page shows some from a position in the plan.
    Pairs(Arc<ImportPlan>, usize),
    /// Whole blocks, whose pairs a run finds, and the list that names them.
    Blocks(ReadBlocks, Option<PathBuf>),
}

/// What the page shows of a choice.
#[derive(Debug)]
pub(super) struct ImportPreview {
    /// The header of a list of pairs.
    pub(super) head: Option<ListHead>,
    /// A warning about how the list was read.
    pub(super) note: Option<String>,
    pub(super) planned: AppResult<Planned>,
    /// Position of the first pair that is shown.
    pub(super) from: u64,
}

impl ImportChoice {
    /// Reads the address.
    pub(super) fn of(query: &PageQuery) -> Self {
        let get = |name| query.get(name).unwrap_or_default().to_owned();
        Self {
            project: get("project"),
            meshes: get("meshes"),
            prints: get("prints"),
            list: get("list"),
            unit: get("unit"),
            block: get("block"),
            missing: get("missing"),
            changed: get("changed"),
            matches: get("matches"),
            whole_block: get("whole_block"),
            id_column: get("id_column"),
            mesh_column: get("mesh_column"),
            print_column: get("print_column"),
            character_column: get("character_column"),
            block_column: get("block_column"),
            unit_column: get("unit_column"),
            ..Self::default()
        }
    }

    /// Returns the columns of a list that are chosen, each with the name of its field in the address.
    pub(super) fn columns(&self) -> [(&'static str, &'static str, &str); 6] {
        [
            ("id", "id_column", &*self.id_column),
            ("mesh", "mesh_column", &*self.mesh_column),
            ("print", "print_column", &*self.print_column),
            ("character", "character_column", &*self.character_column),
            ("block", "block_column", &*self.block_column),
            ("unit", "unit_column", &*self.unit_column),
        ]
    }

    /// Returns the fields that an import needs beside those of its form.
    pub(super) fn hidden_fields(&self) -> Vec<(&'static str, &str)> {
        let columns = self.columns().map(|(_, name, value)| (name, value));
        let others = [
            ("meshes", &*self.meshes),
            ("prints", &*self.prints),
            ("list", &*self.list),
            ("matches", &*self.matches),
            ("whole_block", &*self.whole_block),
        ];
        let all = others.into_iter().chain(columns);
        all.filter(|(_, value)| !value.is_empty()).collect()
    }

    /// Returns the address of the page that compares this choice with the pairs of a project before it is imported.
    pub(super) fn comparison(&self, project: &str) -> String {
        let others = [
            ("project", project),
            ("unit", &*self.unit),
            ("block", &*self.block),
            ("missing", &*self.missing),
            ("changed", &*self.changed),
            ("compare", "1"),
        ];
        let fields = others.into_iter().chain(self.hidden_fields());
        let query = fields.fold(PageQuery::default(), |query, (name, value)| {
            query.with(name, value)
        });
        format!("import{}", query.text())
    }

    /// Returns the changes of the pairs.
    ///
    /// # Errors
    /// Refuses a text that is not one of the page's.
    pub(super) fn changes(&self) -> AppResult<PairingChanges> {
        changes(&self.matches)
    }

    /// Returns whether the import changes columns of known pairs or blocks: that of folders of pairs does not.
    pub(super) fn has_columns(&self) -> bool {
        !self.list.is_empty() || !self.whole_block.is_empty()
    }

    /// Returns the choices for an import or its plan.
    ///
    /// # Errors
    /// Refuses changes or a hash that are not those of the page.
    pub(super) fn choices(&self) -> AppResult<PairChoices> {
        let mut columns = ChosenColumns::default();
        for (field, _, value) in self.columns() {
            columns.choose(field, value);
        }
        let shown = (!self.shown.is_empty()).then(|| self.shown.parse());
        Ok(PairChoices {
            columns,
            changes: self.changes()?,
            shown: shown.transpose().map_err(|_invalid| not_of_page())?,
            block: self.named_block()?,
        })
    }

    /// Returns the name of the block that was typed, if any.
    ///
    /// # Errors
    /// Refuses a name that is too long or has a line break.
    fn named_block(&self) -> AppResult<Option<String>> {
        let name = self.block.trim();
        if name.chars().count() > BLOCK_CHARS || name.chars().any(char::is_control) {
            return Err(AppFailure::refused(Sentence::new(
                format!("the name of a block has at most {BLOCK_CHARS} characters on one line"),
                format!("tên ván có tối đa {BLOCK_CHARS} ký tự trên một dòng"),
            )));
        }
        Ok((!name.is_empty()).then(|| composed(name).into_owned()))
    }

    /// Returns what is imported, once enough is chosen, and a warning about how a list was read.
    pub(super) fn items(
        &self,
        roots: &PickerRoots,
    ) -> AppResult<Option<(ListedItems, Option<String>)>> {
        if !self.list.is_empty() {
            let list = roots.allowed(Path::new(&self.list))?;
            let items = ListedItems::of(&list, None).map_err(AppFailure::from)?;
            return Ok(Some(items));
        }
        if self.meshes.is_empty() || self.prints.is_empty() {
            return Ok(None);
        }
        if !self.whole_block.is_empty() {
            let block = self.only_block(roots)?;
            let block = ListedItems::Blocks(BlockSource::One(block));
            return Ok(Some((block, None)));
        }
        let folders = PairSource::Folders {
            meshes: roots.allowed(Path::new(&self.meshes))?,
            prints: roots.allowed(Path::new(&self.prints))?,
            unit: self.unit.parse::<LengthUnit>().ok(),
        };
        Ok(Some((ListedItems::Pairs(folders), None)))
    }

    /// Returns the only scan of its folder with the only image of the other one, as a block with its page.
    ///
    /// # Errors
    /// Refuses folders with several scans or images.
    fn only_block(&self, roots: &PickerRoots) -> AppResult<ImportedBlock> {
        let only = |folder: &str, is_wanted: fn(&Path) -> bool| {
            let folder = roots.allowed(Path::new(folder))?;
            let mut files = list_below(&folder).map_err(ProjectError::from)?;
            files.retain(|file| is_wanted(file));
            match files.as_slice() {
                [only] => Ok(only.clone()),
                _ => Err(AppFailure::refused(Sentence::new(
                    "a whole block needs exactly one scan and one image of its page: import several with a list of blocks",
                    "một ván nguyên cần đúng một bản quét và một hình của trang in: hãy nhập nhiều ván bằng danh sách ván",
                ))),
            }
        };
        Ok(ImportedBlock {
            mesh: only(&self.meshes, is_named_like_mesh)?,
            page: only(&self.prints, is_named_like_print)?,
            labels: None,
            side: None,
            name: self.named_block()?,
            unit: self.unit.parse::<LengthUnit>().ok(),
        })
    }

    /// Returns what decides about a plan that begins at a position, beside the files.
    fn plan_key(&self, dir: &Path, start: u64) -> String {
        let source = [
            &self.list,
            &self.meshes,
            &self.prints,
            &self.matches,
            &self.whole_block,
            &self.block,
        ];
        format!("{:?}", (dir, start, source, self.columns()))
    }

    /// Returns the plan that a preview has kept for these choices and the project in `dir`, and the place of a position in it.
    pub(super) fn kept_plan(
        &self,
        dir: &Path,
        from: u64,
        plans: &PlanCache,
    ) -> Option<(Arc<ImportPlan>, usize)> {
        let start = kept_start(from);
        let plan = plans.kept(&self.plan_key(dir, start))?;
        Some((plan, (from - start) as usize))
    }

    /// Returns what an import to the project in `dir` would store; `None` if not enough is chosen. Pairs are shown from the
    /// position `from`, or from the last page if there are fewer.
    pub(super) fn preview(
        &self,
        dir: &Path,
        roots: &PickerRoots,
        from: u64,
        plans: &PlanCache,
    ) -> Option<ImportPreview> {
        let (mut head, mut note, items) = (None, None, self.items(roots).transpose()?);
        let planned = items.and_then(|(items, warning)| {
            note = warning;
            let source = match items {
                ListedItems::Blocks(source) => {
                    let read = named_blocks(&source)?;
                    let list = match source {
                        BlockSource::List { file, .. } => Some(file),
                        BlockSource::One(_) => None,
                    };
                    return Ok(Planned::Blocks(read, list));
                }
                ListedItems::Pairs(source) => source,
            };
            let choices = self.choices()?;
            if let PairSource::List { file, bytes } = &source {
                let table = bytes.as_ref().filter(|bytes| !is_jsonl(file, bytes));
                head = table.and_then(|bytes| read_head(bytes, &choices.columns, SHOWN_ROWS));
            }
            let start = kept_start(from);
            let shown = start..start.saturating_add(KEPT_PAIRS);
            let key = self.plan_key(dir, start);
            let location = Location::new(dir);
            let plan = plans.plan(source, &key, |source| {
                plan_import(source, &choices, &location, &shown)
            });
            let plan = plan.map_err(AppFailure::from)?;
            Ok(Planned::Pairs(plan, (from - start) as usize))
        });
        let last = match &planned {
            Ok(Planned::Pairs(plan, _)) => plan.pairs.saturating_sub(1) / SHOWN_PAIRS * SHOWN_PAIRS,
            Ok(Planned::Blocks(..)) | Err(_) => from,
        };
        if from > last {
            return self.preview(dir, roots, last, plans);
        }
        Some(ImportPreview {
            head,
            note,
            planned,
            from,
        })
    }
}

/// Returns the position of the first pair of the plan that is kept for a position.
const fn kept_start(from: u64) -> u64 {
    if from < KEPT_PAIRS { 0 } else { from }
}

#[cfg(test)]
mod tests {
    use super::{BLOCK_CHARS, ImportChoice};
    use crate::app::address::PageQuery;

    #[test]
    fn only_what_is_chosen_is_sent_with_an_import() {
        let query = PageQuery::parse("meshes=/a&prints=/b&id_column=Nr&path=/c&matches=");
        let chosen = ImportChoice::of(&query);
        let fields = chosen.hidden_fields();
        assert_eq!(
            fields,
            [("meshes", "/a"), ("prints", "/b"), ("id_column", "Nr")]
        );
    }

    #[test]
    fn the_name_of_a_block_is_one_line_and_not_long() {
        let named = |text: &str| {
            let chosen = ImportChoice {
                block: text.to_owned(),
                ..ImportChoice::default()
            };
            chosen.choices().map(|choices| choices.block).ok()
        };
        assert_eq!(named(" "), Some(None));
        assert_eq!(named(" Ván 1 "), Some(Some("Ván 1".to_owned())));
        assert_eq!(named("a\nb"), None);
        assert_eq!(named(&"ơ".repeat(BLOCK_CHARS + 1)), None);
    }

    #[test]
    fn the_page_that_compares_a_list_keeps_what_the_form_allows() {
        let chosen = ImportChoice {
            list: "/a/list.csv".to_owned(),
            missing: "yes".to_owned(),
            changed: "yes".to_owned(),
            block: "Ván 1".to_owned(),
            ..ImportChoice::default()
        };
        let address = chosen.comparison("p 1");
        let (page, query) = address.split_once('?').expect("a query");
        let kept = ImportChoice::of(&PageQuery::parse(query));
        let project = "p 1".to_owned();
        assert_eq!((page, kept), ("import", ImportChoice { project, ..chosen }));
    }
}
