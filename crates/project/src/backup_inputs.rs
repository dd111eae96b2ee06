//! Copies the scans and prints of a project to a folder beside its backup.

use std::collections::{HashMap, HashSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::byte_size::byte_size;
use crate::error::{ProjectResult, TaskStopped, WithContext as _};
use crate::exit::Refusal;
use crate::input_copy::{CopyOutcome, InputCopier};
use crate::input_list::{CopiedInput, INPUT_LIST, InputCopies, InputList, has_list, is_of_list};
use crate::input_names::InputNames;
use crate::location::Location;
use crate::wanted_inputs::{WantedInput, wanted_inputs};
use mocban_catalog::Catalog;
use mocban_core::domain::ContentHash;
use mocban_store::{Input, InputError, Project};
use mocban_system::platform;

/// Most inputs that are named because they are not in a backup.
const MAX_NAMED: usize = 1_000;

/// Scans and prints that were saved beside a backup.
#[derive(Debug, Clone)]
pub struct SavedInputs {
    /// What the folder holds of this project.
    pub copies: InputCopies,
    /// Number of files that were copied now; the others were there.
    pub copied: u64,
    /// Number of inputs that are not there although they should be.
    pub left_out: u64,
    /// The first of them.
    pub first_left_out: Vec<LeftOutInput>,
    /// Number of inputs in an object store, which are never copied.
    pub remote: u64,
}

/// An input that is not beside a backup, or only as it was before it changed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOutInput {
    /// Its path.
    pub path: String,
    /// Why it was not copied.
    pub reason: LeftOutReason,
}

/// Why an input was not copied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LeftOutReason {
    /// There is no such file.
    Missing,
    /// It has another content than a run has read.
    Changed,
    /// It cannot be read.
    Unreadable,
}

/// What a backup with scans and prints needs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct InputsSize {
    /// Number of files.
    pub files: u64,
    /// Their length together.
    pub bytes: u64,
    /// Length of the files that are not beside the backup yet.
    pub to_copy: u64,
    /// Number of inputs in an object store, which are never copied.
    pub remote: u64,
}

/// An input with the name of its copy.
#[derive(Debug)]
struct NamedInput {
    wanted: WantedInput,
    name: String,
}

/// Scans and prints that will be saved.
#[derive(Debug)]
pub(crate) struct InputSaver {
    project: Project,
    folder: PathBuf,
    inputs: Vec<NamedInput>,
    /// Earlier copies by stored path.
    earlier: HashMap<String, CopiedInput>,
}

/// Returns how much a project needs for a backup with scans and prints in a folder, which need not exist.
pub async fn inputs_size(folder: &Path, location: &Location) -> ProjectResult<InputsSize> {
    let (project, catalog) = location.open_read_only().await?;
    let inputs = named_inputs(&catalog).await;
    catalog.close().await;
    let (folder, inputs) = (folder.to_owned(), inputs?);
    let measure = move || size_of(&project, &folder, &inputs);
    let size = tokio::task::spawn_blocking(measure).await;
    Ok(size.map_err(TaskStopped)?)
}

/// Returns the inputs of a catalog with the names of their copies.
async fn named_inputs(catalog: &Catalog) -> ProjectResult<Vec<NamedInput>> {
    let mut names = InputNames::without(INPUT_LIST);
    let named = wanted_inputs(catalog).await?.into_iter();
    let named = named.map(|wanted| NamedInput {
        name: names.next(&wanted.stored),
        wanted,
    });
    Ok(named.collect())
}

fn size_of(project: &Project, folder: &Path, inputs: &[NamedInput]) -> InputsSize {
    let mut size = InputsSize::default();
    for NamedInput { wanted, name } in inputs {
        let input = project.input(&wanted.stored);
        if input.is_remote() {
            size.remote += 1;
            continue;
        }
        let bytes = input.size();
        let there = std::fs::metadata(folder.join(name)).map(|meta| meta.len());
        size.files += 1;
        size.bytes = size.bytes.saturating_add(bytes);
        if there.ok() != Some(bytes) {
            size.to_copy = size.to_copy.saturating_add(bytes);
        }
    }
    size
}

impl InputSaver {
    /// Plans to save the inputs of a backup that is written at `copy`. Checks what can refuse it, and writes nothing.
    ///
    /// # Errors
    /// Refuses a folder of somebody else, one with inputs of the project, and a disk without room.
    pub(crate) async fn plan(
        copy: &Path,
        project: &Project,
        folder: PathBuf,
    ) -> ProjectResult<Self> {
        check_folder(&folder)?;
        let catalog = Catalog::open_backup(copy).await?;
        let inputs = named_inputs(&catalog).await;
        catalog.close().await;
        let inputs = inputs?;
        check_inputs_outside(project, &folder, &inputs)?;
        let size = size_of(project, &folder, &inputs);
        check_room(size.to_copy, free_beside(&folder), &folder)?;
        // Without a list that can be read, copies are still compared with the inputs.
        let earlier = InputList::read(&folder).ok().flatten();
        let earlier = earlier.map_or_else(Vec::new, |list| list.files).into_iter();
        Ok(Self {
            project: project.clone(),
            earlier: earlier.map(|copy| (copy.stored.clone(), copy)).collect(),
            folder,
            inputs,
        })
    }

    /// Creates the folder, so that a place that cannot be written to is found before the backup is replaced. Marks it as a
    /// folder of inputs, which the next backup continues.
    pub(crate) fn begin(&self) -> ProjectResult<InputCopier> {
        let failed = || format!("cannot write {}", self.folder.display());
        let copier = InputCopier::begin(&self.folder, INPUT_LIST).with_context(failed)?;
        if self.earlier.is_empty() {
            InputList::new(Vec::new()).write(&self.folder)?;
        }
        Ok(copier)
    }

    /// Copies all inputs, and writes their list. A file that cannot be copied is named, and the others are copied.
    ///
    /// # Errors
    /// Returns an error if the disk fails. What was copied until then is in the list.
    pub(crate) fn save(mut self, copier: &InputCopier) -> ProjectResult<SavedInputs> {
        let mut saved = SavedInputs {
            copies: InputList::new(Vec::new()).copies(&self.folder),
            copied: 0,
            left_out: 0,
            first_left_out: Vec::new(),
            remote: 0,
        };
        let mut listed: Vec<CopiedInput> = Vec::new();
        let inputs = std::mem::take(&mut self.inputs);
        let copied: ProjectResult<()> = inputs.iter().try_for_each(|input| {
            let earlier = self.earlier.remove(&input.wanted.stored);
            listed.extend(self.save_one(copier, input, earlier.as_ref(), &mut saved)?);
            Ok(())
        });
        let copied = copied.and_then(|()| {
            // The names of new folders have to survive a power cut, too.
            let synced = platform::sync_tree(&self.folder);
            synced.with_context(|| format!("cannot write {}", self.folder.display()))
        });
        if copied.is_err() {
            // Copies of inputs that were not reached are still there.
            let names: HashSet<String> = listed.iter().map(|copy| copy.name.clone()).collect();
            let others = self.earlier.drain().map(|(_, copy)| copy);
            listed.extend(others.filter(|copy| !names.contains(&copy.name)));
        }
        let list = InputList::new(listed);
        let written = list.write(&self.folder);
        copied.and(written)?;
        saved.copies = list.copies(&self.folder);
        Ok(saved)
    }

    /// Saves an input. Returns its copy, which may be an earlier one.
    fn save_one(
        &self,
        copier: &InputCopier,
        NamedInput { wanted, name }: &NamedInput,
        earlier: Option<&CopiedInput>,
        saved: &mut SavedInputs,
    ) -> ProjectResult<Option<CopiedInput>> {
        let input = self.project.input(&wanted.stored);
        if input.is_remote() {
            saved.remote += 1;
            return Ok(None);
        }
        let entry = |bytes, hash| {
            Ok(Some(CopiedInput {
                stored: wanted.stored.clone(),
                name: name.clone(),
                bytes,
                hash,
            }))
        };
        let there = copier.hash_of(name);
        let is_earlier = |hash: ContentHash| earlier.is_some_and(|copy| copy.hash == hash);
        // A copy that is worth keeping if the input is lost.
        let good =
            there.filter(|hash| wanted.was(*hash) || wanted.is_unread() && is_earlier(*hash));
        if let Some(hash) = good.filter(|hash| wanted.is_still(*hash, &input)) {
            return entry(copier.len_of(name)?, hash);
        }
        let reason = match copier.copy(&input, name, there, |hash| wanted.may_be(hash))? {
            CopyOutcome::There {
                bytes,
                hash,
                was_there,
            } => {
                saved.copied += u64::from(!was_there);
                return entry(bytes, hash);
            }
            CopyOutcome::Other => Some(LeftOutReason::Changed),
            CopyOutcome::Unread(_) if good.is_some() => None,
            CopyOutcome::Unread(InputError::NotThere(_)) => Some(LeftOutReason::Missing),
            CopyOutcome::Unread(_) => Some(LeftOutReason::Unreadable),
        };
        if let Some(reason) = reason {
            saved.leave_out(&input, reason);
        }
        match good {
            None => Ok(None),
            Some(hash) => entry(copier.len_of(name)?, hash),
        }
    }
}

impl SavedInputs {
    fn leave_out(&mut self, input: &Input, reason: LeftOutReason) {
        self.left_out += 1;
        if self.first_left_out.len() < MAX_NAMED {
            let path = input.path().display().to_string();
            self.first_left_out.push(LeftOutInput { path, reason });
        }
    }
}

/// Returns how many bytes the disk has room for, of a folder that need not exist.
pub fn free_beside(folder: &Path) -> Option<u64> {
    let absolute = std::path::absolute(folder).ok()?;
    let mut folders = absolute.ancestors();
    platform::free_bytes(folders.find(|folder| folder.is_dir())?)
}

/// Refuses a place that something else has.
fn check_folder(folder: &Path) -> ProjectResult<()> {
    let shown = folder.display();
    let refuse = |found: &str| {
        let text = format!("{shown} {found}; rename it, or name another file for the backup");
        Err(Refusal::Usage(text).into())
    };
    let failed = || format!("cannot read {shown}");
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) if error.kind() == ErrorKind::NotADirectory => {
            return refuse("is a file, and scans and prints need a folder there");
        }
        entries => entries.with_context(failed)?,
    };
    if has_list(folder) {
        return Ok(());
    }
    for entry in entries {
        if !is_of_list(&entry.with_context(failed)?.file_name()) {
            return refuse("exists, and is not a folder of scans and prints of a backup");
        }
    }
    Ok(())
}

/// Refuses a folder that holds inputs of the project: they would be copied onto themselves.
fn check_inputs_outside(
    project: &Project,
    folder: &Path,
    inputs: &[NamedInput],
) -> ProjectResult<()> {
    let Ok(real) = folder.canonicalize() else {
        return Ok(());
    };
    for NamedInput { wanted, .. } in inputs {
        let input = project.input(&wanted.stored);
        let path = input.path().canonicalize();
        if !input.is_remote() && path.is_ok_and(|path| path.starts_with(&real)) {
            let (input, folder) = (input.path().display(), folder.display());
            let text = format!(
                "the project reads {input}, which is in {folder}; name another file for the backup"
            );
            return Err(Refusal::Usage(text).into());
        }
    }
    Ok(())
}

/// Refuses to copy more than the disk has room for.
pub(crate) fn check_room(needed: u64, free: Option<u64>, folder: &Path) -> ProjectResult<()> {
    match free {
        Some(free) if free < needed => {
            let [needed, free] = [needed, free].map(byte_size);
            let folder = folder.display();
            let text = format!(
                "the scans and prints need {needed} in {folder}, and the disk has {free}; make room, or name another disk"
            );
            Err(Refusal::Usage(text).into())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{check_folder, check_room};
    use crate::input_list::InputList;

    #[test]
    fn a_disk_without_room_is_refused_before_anything_is_written() {
        let folder = Path::new("b.sqlite.inputs");
        for (needed, free) in [(0, Some(0)), (12, Some(12)), (12, None)] {
            check_room(needed, free, folder).expect("there is room");
        }
        let refused = check_room(12_300_000_000, Some(80_000_000), folder);
        let text = refused.expect_err("too little").to_string();
        let parts = ["need 12.3 GB in b.sqlite.inputs", "has 80.0 MB"];
        assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    }

    #[test]
    fn only_a_folder_of_a_backup_is_written_to() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let folder = dir.path().join("b.inputs");
        check_folder(&folder).expect("there is none");
        std::fs::create_dir(&folder).expect("a folder");
        check_folder(&folder).expect("it is empty");
        let left = folder.join(".mocban-inputs.json.12-0.mocban-partial");
        std::fs::create_dir(left).expect("a folder");
        check_folder(&folder).expect("of an interrupted backup");
        let file = folder.join("thesis.docx");
        std::fs::write(&file, "ten years").expect("written");
        for place in [&folder, &file] {
            let refused = check_folder(place).expect_err("of somebody else");
            assert!(
                refused.to_string().contains("name another file"),
                "{refused}"
            );
        }
        InputList::new(Vec::new()).write(&folder).expect("written");
        check_folder(&folder).expect("of a backup");
    }
}
