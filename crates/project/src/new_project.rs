//! Imports into a project, which is created if there is none.

use std::path::{Path, PathBuf};

use crate::error::ProjectResult;
use crate::events::{Listener, warn};
use crate::exit::Refusal;
use crate::own_files::{is_project, project_role};
use mocban_catalog::{Catalog, NewCatalog};
use mocban_core::domain::spelling::quoted;
use mocban_lists::relative_path::RelativePath;
use mocban_store::Project;

/// Returns the missing directories of a path, the deepest first.
fn missing_dirs(dir: &Path) -> Vec<PathBuf> {
    let missing = dir.ancestors().take_while(|dir| !dir.exists());
    missing
        .filter(|dir| !dir.as_os_str().is_empty())
        .map(ToOwned::to_owned)
        .collect()
}

/// Refuses the folder of a new project among the files of another one, and a new folder whose name begins or ends with
/// white space, because it looks like another one.
pub(crate) fn check_new_folder(dir: &Path) -> Result<(), Refusal> {
    if !is_project(dir)
        && let Some(reason) = project_role(dir)
    {
        let shown = dir.display();
        let text = format!("{shown} {reason}; name another folder for the new project");
        return Err(Refusal::Usage(text));
    }
    let mut names = missing_dirs(dir).into_iter();
    let is_odd = |dir: &PathBuf| {
        let name = dir.file_name().unwrap_or_default().to_string_lossy();
        name.trim() != name
    };
    match names.find(is_odd) {
        None => Ok(()),
        Some(dir) => Err(Refusal::Usage(format!(
            "the name of the new folder \"{}\" begins or ends with white space and would look like another name; name it without",
            dir.display()
        ))),
    }
}

/// Returns a warning about a new folder whose name no folder on Windows can have, because a project may be copied there. It is
/// no error, because a path that a command names may be meant, and may never leave this computer.
pub fn name_warning(dir: &Path) -> Option<String> {
    let new = missing_dirs(dir);
    let mut names = new.iter().filter_map(|dir| dir.file_name());
    names.find_map(|name| {
        let name = name.to_string_lossy();
        let fault = RelativePath::new(&name).err()?;
        Some(format!(
            "the project in the new folder {} cannot be copied to Windows, because {fault}; another name avoids that",
            quoted(&name)
        ))
    })
}

/// Warns about the name of a new folder like [`name_warning`].
pub(crate) fn warn_about_name(dir: &Path, listener: &dyn Listener) {
    if let Some(warning) = name_warning(dir) {
        warn(listener, warning);
    }
}

/// Folders that an import creates. They are removed when this is dropped, unless the import succeeded.
struct NewFolders(Vec<PathBuf>);

impl Drop for NewFolders {
    fn drop(&mut self) {
        // Fails, as it should, if another process put something there.
        let _ = self.0.iter().try_for_each(std::fs::remove_dir);
    }
}

/// Calls `import` with the catalog of a project. A new project appears only when `import` has succeeded, and not if the future
/// is dropped before; a new catalog on a server is created before.
pub(crate) async fn import_with<T>(
    project: &Project,
    url: Option<&str>,
    import: impl AsyncFn(&Catalog) -> ProjectResult<T>,
) -> ProjectResult<T> {
    check_new_folder(project.dir())?;
    let mut new_folders = NewFolders(missing_dirs(project.dir()));
    let stored = store(project, url, import).await?;
    new_folders.0.clear();
    Ok(stored)
}

async fn store<T>(
    project: &Project,
    url: Option<&str>,
    import: impl AsyncFn(&Catalog) -> ProjectResult<T>,
) -> ProjectResult<T> {
    if let Some(url) = url {
        Project::create(project.dir())?;
        let catalog = Catalog::connect_or_create(url).await?;
        let stored = import(&catalog).await;
        catalog.close().await;
        return stored;
    }
    while let Some(new) = begin(project).await? {
        let stored = import(new.catalog()).await;
        if stored.is_err() {
            new.discard().await;
            return stored;
        }
        if new.place().await? {
            return stored;
        }
        // Another process created the project meanwhile, so the list is imported into that project.
    }
    let catalog = Catalog::create(&project.catalog_path()).await?;
    let stored = import(&catalog).await;
    catalog.close().await;
    stored
}

/// Begins a catalog if the project has none. Tries again if a failing import removes the project directory meanwhile.
async fn begin(project: &Project) -> ProjectResult<Option<NewCatalog>> {
    const ATTEMPTS: usize = 20;
    for _ in 1..ATTEMPTS {
        let begun = try_begin(project).await;
        if begun.is_ok() || project.dir().exists() {
            return begun;
        }
    }
    try_begin(project).await
}

async fn try_begin(project: &Project) -> ProjectResult<Option<NewCatalog>> {
    Project::create(project.dir())?;
    Ok(NewCatalog::begin(&project.catalog_path()).await?)
}

#[cfg(test)]
mod tests {
    use unicode_normalization::UnicodeNormalization as _;

    use super::{check_new_folder, name_warning};
    use crate::location::Location;

    #[test]
    fn new_folders_that_windows_cannot_have_are_warned_about() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let warning = |name: &str| name_warning(&dir.path().join(name));
        assert_eq!(warning("dự án 1"), None);
        for (name, why) in [
            (
                "con",
                "\"con\" cannot be copied to Windows, because its name is that of a device",
            ),
            ("aux/project", "\"aux\" cannot"),
            ("a?", "because its name has '?'"),
            ("ván.", "ends with a space or a dot"),
        ] {
            let said = warning(name).expect(name);
            assert!(said.contains(why), "{said}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_that_exists_is_not_warned_about() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let device = dir.path().join("nul");
        std::fs::create_dir(&device).expect("a folder");
        assert_eq!(name_warning(&device), None);
    }

    #[test]
    fn folders_that_look_like_another_are_not_created() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = dir.path().join("dự án 1");
        check_new_folder(&project).expect("a plain name");
        std::fs::create_dir(&project).expect("a folder");
        for name in ["dự án 1 ", " dự án 1", "dự án 2\u{a0}/project"] {
            let refused = check_new_folder(&dir.path().join(name)).expect_err("a blank");
            assert!(refused.to_string().contains("white space"), "{refused}");
        }
        let odd = dir.path().join("odd ");
        std::fs::create_dir(&odd).expect("a folder");
        check_new_folder(&odd).expect("it exists");
        let decomposed: String = "dự án 1".nfd().collect();
        let found = Location::new(dir.path().join(decomposed)).dir;
        assert_eq!(found, project);
    }
}
