//! Refuses places where scans and prints cannot be saved or restored: folders of others, links, and full disks.

use std::io::ErrorKind;
use std::path::Path;

use crate::byte_size::byte_size;
use crate::error::{ProjectResult, WithContext as _};
use crate::exit::Refusal;
use crate::input_copy::link_below;
use crate::input_list::{INPUT_LIST, has_list, is_of_list};
use crate::named_inputs::NamedInput;
use mocban_store::Project;
use mocban_system::platform;

/// Returns how many bytes the disk has room for, of a folder that need not exist.
pub fn free_beside(folder: &Path) -> Option<u64> {
    let absolute = std::path::absolute(folder).ok()?;
    let mut folders = absolute.ancestors();
    platform::free_bytes(folders.find(|folder| folder.is_dir())?)
}

/// Refuses a place that something else has.
pub(crate) fn check_folder(folder: &Path) -> ProjectResult<()> {
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
pub(crate) fn check_inputs_outside(
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

/// Refuses links at the places of copies and of their list: a copy must not be a name of the file itself, and nothing is
/// written outside the folder.
pub(crate) fn check_no_links(folder: &Path, inputs: &[NamedInput]) -> ProjectResult<()> {
    let names = inputs.iter().map(|input| input.name.as_str());
    let mut links = std::iter::once(INPUT_LIST).chain(names);
    match links.find_map(|name| link_below(folder, name)) {
        None => Ok(()),
        Some(link) => {
            let link = link.display();
            let text = format!(
                "{link} is a link, and a backup needs a copy there; remove the link, or name another file for the backup"
            );
            Err(Refusal::Usage(text).into())
        }
    }
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
