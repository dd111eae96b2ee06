//! Places in which nothing can be stored, so that pages say it before anybody types.

use std::path::{Component, Path};

use super::sentence::Sentence;
use super::state::AppState;
use mocban_store::CATALOG_FILE;
use mocban_system::platform;

/// A place in which nothing can be stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ReadOnlyPlace {
    /// The folder of the projects.
    Folder,
    /// The folder of a project, or its catalog.
    Project,
    /// The database of a project, for this user.
    Database,
}

impl ReadOnlyPlace {
    /// Finds out whether a project, or the folder of all projects, is such a place. Opens no project. A project in a database
    /// is examined only after it was opened.
    pub(super) async fn find(state: &AppState, project: Option<&str>) -> Option<Self> {
        let folder = &state.options.folder;
        let of_all = || (!platform::may_write(folder)).then_some(Self::Folder);
        let Some(key) = project else {
            return of_all();
        };
        let of_folder = folder.join(CATALOG_FILE);
        let below = Path::new(key);
        let is_below = below
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        let catalog = if of_folder.is_file() || !is_below {
            of_folder
        } else {
            folder.join(below).join(CATALOG_FILE)
        };
        if catalog.is_file() {
            let dir = catalog.parent().unwrap_or(folder);
            let may_write = platform::may_write(&catalog) && platform::may_write(dir);
            return (!may_write).then_some(Self::Project);
        }
        let Some(open) = state.known(key) else {
            // An import may make a project of this name.
            return of_all();
        };
        let rights = open.catalog.review_rights().await.ok()?;
        (!rights.may_store()).then_some(Self::Database)
    }

    /// Says what cannot be done, and what to do.
    pub(super) fn sentence(self) -> Sentence {
        match self {
            Self::Folder => Sentence::new(
                "This folder is read-only, so no project and no file can be added to it: change its rights, or start the program in a folder where you may write.",
                "Thư mục này chỉ đọc được nên không thể thêm dự án hay tệp nào: hãy đổi quyền của thư mục, hoặc mở chương trình trong một thư mục mà bạn có quyền ghi.",
            ),
            Self::Project => Sentence::new(
                "This project is read-only, so no answer and no change can be stored: change the rights of its folder, or copy the folder to a place where you may write.",
                "Dự án này chỉ đọc được nên không thể lưu câu trả lời hay thay đổi nào: hãy đổi quyền của thư mục dự án, hoặc sao chép thư mục đến nơi bạn có quyền ghi.",
            ),
            Self::Database => Sentence::new(
                "You may only read the database of this project, so no answer and no change can be stored: ask its administrator for the right to write.",
                "Bạn chỉ được đọc cơ sở dữ liệu của dự án này nên không thể lưu câu trả lời hay thay đổi nào: hãy xin người quản trị quyền ghi.",
            ),
        }
    }
}
