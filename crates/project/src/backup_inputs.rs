//! Copies the scans and prints of a project to a folder beside its backup.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::backup_checks::{
    check_folder, check_inputs_outside, check_no_links, check_room, free_beside,
};
use crate::blocking::blocking;
use crate::error::{ProjectResult, WithContext as _};
use crate::growing_list::{GrowingList, earlier_copies};
use crate::input_copy::{CopyOutcome, InputCopier};
use crate::input_list::{CopiedInput, INPUT_LIST, InputCopies, InputList};
use crate::location::Location;
use crate::named_inputs::{NamedInput, named_inputs};
use crate::wanted_inputs::{first_wanted_inputs, wanted_inputs};
use mocban_catalog::Catalog;
use mocban_core::domain::ContentHash;
use mocban_store::{Input, InputError, Project};
use mocban_system::platform;

/// Most inputs that are named because they are not in a backup.
const MAX_NAMED: usize = 1_000;
/// Most pairs whose files are measured for a page.
const SIZED_PAIRS: usize = 10_000;
/// Longest time for it.
const SIZING_TIME: Duration = Duration::from_secs(2);
/// Number of files after which the time is compared.
const SIZED_AT_A_TIME: usize = 64;
/// Longest list that is read for it, in bytes.
const SIZED_LIST_BYTES: u64 = 16 << 20;

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
    /// The folder can have no copy of its name or length.
    Unwritable,
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
    /// Whether there may be more, because measuring all would take long.
    pub is_partial: bool,
}

/// Scans and prints that will be saved.
#[derive(Debug)]
pub(crate) struct InputSaver {
    project: Project,
    folder: PathBuf,
    inputs: Vec<NamedInput>,
    list: GrowingList,
}

/// Returns how much a project needs for a backup with scans and prints in a folder, which need not exist. Counts only the first
/// files of a large project.
pub async fn inputs_size(folder: &Path, location: &Location) -> ProjectResult<InputsSize> {
    let (project, catalog) = location.open_read_only().await?;
    let wanted = first_wanted_inputs(&catalog, SIZED_PAIRS).await;
    catalog.close().await;
    let (folder, (wanted, is_cut)) = (folder.to_owned(), wanted?);
    let measure = move || {
        let until = Instant::now() + SIZING_TIME;
        let list = std::fs::metadata(folder.join(INPUT_LIST));
        let is_short = list.is_ok_and(|list| list.is_file() && list.len() <= SIZED_LIST_BYTES);
        // The names are nearly always the same without the list.
        let earlier = is_short.then(|| earlier_copies(&folder).unwrap_or_default());
        let inputs = named_inputs(wanted, &earlier.unwrap_or_default());
        let mut size = size_of(&project, &folder, &inputs, Some(until));
        size.is_partial |= is_cut;
        size
    };
    blocking(measure).await
}

/// Measures inputs. Counts only the first ones if that takes longer than `until`.
fn size_of(
    project: &Project,
    folder: &Path,
    inputs: &[NamedInput],
    until: Option<Instant>,
) -> InputsSize {
    let mut size = InputsSize::default();
    for (index, NamedInput { wanted, name }) in inputs.iter().enumerate() {
        let is_due = index % SIZED_AT_A_TIME == SIZED_AT_A_TIME - 1;
        if is_due && until.is_some_and(|until| Instant::now() >= until) {
            size.is_partial = true;
            break;
        }
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
    /// Refuses a folder of somebody else, one with inputs of the project, with links or with a list that cannot be read, and
    /// a disk without room.
    pub(crate) async fn plan(
        copy: &Path,
        project: &Project,
        folder: PathBuf,
    ) -> ProjectResult<Self> {
        check_folder(&folder)?;
        let earlier = earlier_copies(&folder)?;
        let catalog = Catalog::open_backup(copy).await?;
        let wanted = wanted_inputs(&catalog).await;
        catalog.close().await;
        let inputs = named_inputs(wanted?, &earlier);
        check_inputs_outside(project, &folder, &inputs)?;
        check_no_links(&folder, &inputs)?;
        let size = size_of(project, &folder, &inputs, None);
        check_room(size.to_copy, free_beside(&folder), &folder)?;
        Ok(Self {
            project: project.clone(),
            list: GrowingList::new(&folder, earlier, inputs.len()),
            folder,
            inputs,
        })
    }

    /// Creates the folder, so that a place that cannot be written to is found before the backup is replaced. Marks it as a
    /// folder of inputs, which the next backup continues.
    pub(crate) fn begin(&self) -> ProjectResult<InputCopier> {
        let failed = || format!("cannot write {}", self.folder.display());
        let copier = InputCopier::begin(&self.folder, INPUT_LIST).with_context(failed)?;
        if self.list.is_new() {
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
            copies: InputCopies {
                folder: self.folder.clone(),
                files: 0,
                bytes: 0,
            },
            copied: 0,
            left_out: 0,
            first_left_out: Vec::new(),
            remote: 0,
        };
        let inputs = std::mem::take(&mut self.inputs);
        let copied: ProjectResult<()> = inputs.iter().try_for_each(|input| {
            let copy = self.save_one(copier, input, &mut saved)?;
            self.list.add(&input.wanted.stored, copy)
        });
        let copied = copied.and_then(|()| {
            // The names of new folders have to survive a power cut, too.
            let synced = platform::sync_tree(&self.folder);
            synced.with_context(|| format!("cannot write {}", self.folder.display()))
        });
        let finished = self.list.finish(copied.is_ok());
        let list = copied.and(finished)?;
        saved.copies = list.copies(&self.folder);
        Ok(saved)
    }

    /// Saves an input. Returns its copy, which may be an earlier one.
    fn save_one(
        &self,
        copier: &InputCopier,
        NamedInput { wanted, name }: &NamedInput,
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
        let earlier = self.list.earlier(&wanted.stored);
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
            CopyOutcome::Other | CopyOutcome::Unread(InputError::Changed(_)) => {
                Some(LeftOutReason::Changed)
            }
            CopyOutcome::Unwritable => Some(LeftOutReason::Unwritable),
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

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Instant;

    use super::{SIZED_AT_A_TIME, size_of};
    use crate::input_list::inputs_folder;
    use crate::named_inputs::named_inputs;
    use crate::wanted_inputs::WantedInput;
    use mocban_store::Project;

    #[test]
    fn only_the_first_files_are_measured_if_the_time_is_over() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(dir.path());
        let stored = (0..100).map(|number| format!("{number}.stl"));
        let wanted = stored.map(|stored| {
            std::fs::write(dir.path().join(&stored), "scan").expect("written");
            WantedInput::unread(&stored)
        });
        let inputs = named_inputs(wanted.collect(), &[]);
        let measured = |until| {
            let size = size_of(&project, &dir.path().join("none"), &inputs, until);
            (size.files, size.to_copy, size.is_partial)
        };
        assert_eq!(measured(None), (100, 400, false));
        let first = SIZED_AT_A_TIME as u64 - 1;
        assert_eq!(measured(Some(Instant::now())), (first, first * 4, true));
    }

    #[test]
    fn the_folder_is_beside_a_backup_whose_name_ends_with_a_slash() {
        let folder = inputs_folder(Path::new("a/b.sqlite/"));
        assert_eq!(folder, Path::new("a/b.sqlite.inputs"));
        let folder = inputs_folder(Path::new("b.sqlite"));
        assert_eq!(folder, Path::new("b.sqlite.inputs"));
    }
}
