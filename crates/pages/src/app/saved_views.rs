//! Lists of pairs that are saved under a name. A file of the project keeps them, so that everyone who opens the project has them,
//! also after a restart.

use std::io::{self, ErrorKind};
use std::path::Path;
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::read_only::ReadOnlyPlace;
use super::sentence::Sentence;
use mocban_core::domain::spelling::fold_case;
use mocban_core::domain::{is_hidden, one_line};
use mocban_core::locked;
use mocban_project::files::small;
use mocban_project::own_files::VIEWS_FILE;
use mocban_store::{TargetLock, TargetLockError, write_atomic};

/// Most views of a project.
const MAX_VIEWS: usize = 100;
/// Longest name of a view, in characters.
pub(super) const NAME_CHARS: usize = 60;
/// Longest address of a list that is saved, in bytes.
const LIST_BYTES: usize = 2000;

/// Lets the changes of this process wait for each other.
static CHANGES: Mutex<()> = Mutex::new(());

/// A list of pairs with its name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SavedView {
    pub(super) name: String,
    /// The address of the list, such as `state=failed&sort=iou`.
    pub(super) list: String,
}

/// The content of the file.
#[derive(Debug, Serialize, Deserialize)]
struct StoredViews {
    views: Vec<SavedView>,
}

/// A change of the views of a project.
#[derive(Debug)]
pub(super) enum ViewChange {
    /// Saves a new view.
    Save(SavedView),
    /// Gives a view another name.
    Rename(SavedView, String),
    /// Removes a view.
    Remove(SavedView),
}

impl SavedView {
    /// Makes a view of what was typed and the address of a list.
    ///
    /// # Errors
    /// Returns an error if the name or the address cannot be kept.
    pub(super) fn new(typed: &str, list: &PageQuery) -> AppResult<Self> {
        let name = view_name(typed)?;
        let list = list.text().trim_start_matches('?').to_owned();
        if list.is_empty() {
            return Err(AppFailure::refused(Sentence::new(
                "this is the list of all pairs: choose a filter or an order, and then save it",
                "đây là danh sách mọi cặp: hãy chọn bộ lọc hoặc thứ tự rồi lưu",
            )));
        }
        if list.len() > LIST_BYTES {
            return Err(AppFailure::refused(Sentence::new(
                "this filter is too long to be saved: shorten the block or the character",
                "bộ lọc này quá dài nên không lưu được: hãy rút ngắn tên ván hoặc chữ",
            )));
        }
        Ok(Self { name, list })
    }

    /// Returns the address of the list.
    pub(super) fn query(&self) -> PageQuery {
        PageQuery::parse(&self.list)
    }

    /// Returns whether a name is that of the view, in upper or lower case.
    pub(super) fn is_named(&self, name: &str) -> bool {
        fold_case(&self.name) == fold_case(name)
    }

    fn is_valid(&self) -> bool {
        view_name(&self.name).is_ok_and(|name| name == self.name) && self.list.len() <= LIST_BYTES
    }
}

/// Returns the name of a view as it was typed, without blanks around it.
///
/// # Errors
/// Returns an error if the name is empty or too long, has characters that are not shown, or begins with a dot, which would
/// lead an address elsewhere.
pub(super) fn view_name(typed: &str) -> AppResult<String> {
    let name = typed.trim();
    let is_valid = (1..=NAME_CHARS).contains(&name.chars().count())
        && !name.contains(is_hidden)
        && !name.starts_with('.');
    if is_valid {
        return Ok(name.to_owned());
    }
    Err(AppFailure::refused(Sentence::new(
        format!(
            "a view needs a name of at most {NAME_CHARS} visible characters that does not begin with a dot"
        ),
        format!(
            "cần một tên có tối đa {NAME_CHARS} ký tự nhìn thấy được, không bắt đầu bằng dấu chấm"
        ),
    )))
}

/// Returns the views of the project in a folder, sorted by name.
pub(super) fn read(dir: &Path) -> AppResult<Vec<SavedView>> {
    let file = dir.join(VIEWS_FILE);
    let bytes = small(&file).map_err(|error| AppFailure::of(error, dir))?;
    let Some(bytes) = bytes else {
        return Ok(Vec::new());
    };
    let stored = serde_json::from_slice::<StoredViews>(&bytes).ok();
    let stored = stored.filter(|stored| {
        stored.views.len() <= MAX_VIEWS && stored.views.iter().all(SavedView::is_valid)
    });
    let stored = stored.ok_or_else(|| AppFailure::refused(damaged(&file)))?;
    Ok(stored.views)
}

/// Changes the views of the project in a folder. Changes of several pages and processes follow one another, so that none is
/// lost.
pub(super) fn change(dir: &Path, change: ViewChange) -> AppResult<()> {
    let file = dir.join(VIEWS_FILE);
    let _turn = locked(&CHANGES);
    let _lock = TargetLock::acquire(&file).map_err(|error| match error {
        TargetLockError::InUse { .. } => AppFailure::conflict(in_use()),
        TargetLockError::Io { source, .. } => not_written(source, dir),
    })?;
    let mut views = read(dir)?;
    change.apply(&mut views)?;
    views.sort_by_cached_key(|view| fold_case(&view.name));
    let text = serde_json::to_vec_pretty(&StoredViews { views });
    let text = text.map_err(|error| AppFailure::of(error, dir))?;
    write_atomic(&file, &text).map_err(|error| not_written(error, dir))
}

impl ViewChange {
    fn apply(self, views: &mut Vec<SavedView>) -> AppResult<()> {
        match self {
            Self::Save(new) => {
                if let Some(known) = views.iter().find(|known| known.is_named(&new.name)) {
                    // A request that was sent twice.
                    if known.list == new.list {
                        return Ok(());
                    }
                    return Err(AppFailure::refused(taken(&known.name)));
                }
                if views.len() >= MAX_VIEWS {
                    return Err(AppFailure::refused(full()));
                }
                views.push(new);
            }
            Self::Rename(view, name) => {
                let at = place(views, &view)?;
                let mut others = views.iter().enumerate().filter(|(other, _)| *other != at);
                if let Some((_, known)) = others.find(|(_, other)| other.is_named(&name)) {
                    return Err(AppFailure::refused(taken(&known.name)));
                }
                views[at].name = name;
            }
            Self::Remove(view) => {
                let at = place(views, &view)?;
                views.remove(at);
            }
        }
        Ok(())
    }
}

/// Returns the place of a view. Another one may have its name since the page was shown.
fn place(views: &[SavedView], view: &SavedView) -> AppResult<usize> {
    let found = views.iter().position(|known| known == view);
    found.ok_or_else(|| AppFailure::refused(gone(&view.name)))
}

/// Explains why the file was not written.
fn not_written(error: io::Error, dir: &Path) -> AppFailure {
    match error.kind() {
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            AppFailure::refused(ReadOnlyPlace::Project.sentence())
        }
        _ => AppFailure::of(error, dir),
    }
}

/// Says that a project has no view of this name, or not with this list.
pub(super) fn gone(name: &str) -> Sentence {
    let name = one_line(name);
    Sentence::new(
        format!(
            "there is no saved view \"{name}\" any more: it was renamed, changed or deleted; open the page Pairs again"
        ),
        format!(
            "không còn danh sách đã lưu \"{name}\": nó đã được đổi tên, thay đổi hoặc xóa; hãy mở lại trang Các cặp"
        ),
    )
}

fn taken(name: &str) -> Sentence {
    let name = one_line(name);
    Sentence::new(
        format!(
            "there is a saved view \"{name}\" with another list: choose another name, or delete that view first"
        ),
        format!(
            "đã có danh sách đã lưu \"{name}\" với nội dung khác: hãy chọn tên khác, hoặc xóa danh sách đó trước"
        ),
    )
}

fn full() -> Sentence {
    Sentence::new(
        format!("at most {MAX_VIEWS} views can be saved: delete one that is not used any more"),
        format!("chỉ lưu được tối đa {MAX_VIEWS} danh sách: hãy xóa một danh sách không dùng nữa"),
    )
}

fn in_use() -> Sentence {
    Sentence::new(
        "another program is saving a view of this project: try again",
        "một chương trình khác đang lưu danh sách của dự án này: hãy thử lại",
    )
}

fn damaged(file: &Path) -> Sentence {
    let file = file.display().to_string();
    let file = one_line(&file);
    Sentence::new(
        format!(
            "the saved views cannot be read, so none is shown and none can be saved: correct or remove the file {file}"
        ),
        format!(
            "không đọc được các danh sách đã lưu nên không hiện và không lưu được: hãy sửa hoặc xóa tệp {file}"
        ),
    )
}

#[cfg(test)]
mod tests;
