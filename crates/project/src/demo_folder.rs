//! The folder of a demo: what it may replace, and how it is written without leaving half of it.

use std::path::Path;

use crate::blocking::blocking;
use crate::error::{ProjectResult, WithContext as _};

use crate::exit::Refusal;
use crate::files;
use crate::new_project::check_new_folder;
use mocban_core::domain::shell::shell_quoted;
use mocban_demo::block::{BlockOptions, block_options};
use mocban_demo::{DatasetError, DemoOptions};
use mocban_runner::Stop;
use mocban_store::{CATALOG_FILE, ReplacementFolder};

const NOTE: &str = "README.txt";
const NOTE_TEXT: &str = "The built-in dataset of mocban: carved glyphs and their prints, with the true \
alignments.\nCreated by `mocban demo`, which creates it again if it is incomplete; do not put your own files here.\n";

/// Message if a signal stopped the writing.
pub const STOPPED: &str = "stopped while the files were being written; nothing was imported, and the same command starts again";

/// What a demo contains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DemoContent {
    /// Pairs.
    Pairs(DemoOptions),
    /// A whole block.
    Block(BlockOptions),
}

impl DemoContent {
    /// Returns what the data of a demo contain, if they are complete.
    fn of(data: &Path) -> ProjectResult<Option<Self>> {
        let stamp = files::small(&data.join("dataset.json"))?;
        let pairs = stamp.and_then(|bytes| serde_json::from_slice::<DemoOptions>(&bytes).ok());
        Ok(match pairs {
            Some(options) => Some(Self::Pairs(options)),
            None => block_options(data).map(Self::Block),
        })
    }

    /// Returns the words that identify the content to its user.
    fn described(&self) -> String {
        match self {
            Self::Pairs(DemoOptions { tier, seed, .. }) => {
                format!("the demo of tier {tier} and seed {seed}")
            }
            Self::Block(BlockOptions {
                kind,
                seed,
                spacing_mm,
            }) => format!("the demo of a {kind} block, seed {seed} and spacing {spacing_mm} mm"),
        }
    }
}

/// Refuses a directory that holds another demo, another project or foreign data, so that nothing is overwritten.
pub fn check_directory(dir: &Path, data: &Path, wanted: &DemoContent) -> ProjectResult<()> {
    check_new_folder(dir)?;
    let refuse = |reason: &str| {
        let shown = dir.display();
        let text = format!("{shown} {reason}; name another directory for this demo");
        Err(Refusal::Usage(text).into())
    };
    let exists = |path: &Path| {
        let found = path.try_exists();
        found.with_context(|| format!("cannot read {}", path.display()))
    };
    let (is_project, has_data) = (exists(&dir.join(CATALOG_FILE))?, exists(data)?);
    let continue_hint = || {
        if !is_project {
            return String::new();
        }
        let dir = shell_quoted(&dir.to_string_lossy());
        format!("; `mocban -C {dir} run` continues it")
    };
    let Some(found) = DemoContent::of(data)? else {
        return if has_data && !has_note(data)? {
            refuse("has a data directory that no demo created")
        } else if is_project && !has_data {
            refuse("is another project")
        } else {
            Ok(())
        };
    };
    match (found, *wanted) {
        (DemoContent::Pairs(found), DemoContent::Pairs(wanted))
            if found.tier == wanted.tier && found.seed == wanted.seed =>
        {
            if found.pairs <= wanted.pairs {
                return Ok(());
            }
            let hint = continue_hint();
            refuse(&format!(
                "already holds a demo of {} pairs{hint}",
                found.pairs
            ))
        }
        (found, wanted) if found == wanted => Ok(()),
        (found, _) => refuse(&format!("holds {}{}", found.described(), continue_hint())),
    }
}

/// Returns whether a directory has the note of a demo. Compares the text, because any project may have a `README.txt`.
fn has_note(data: &Path) -> ProjectResult<bool> {
    let note = files::small(&data.join(NOTE))?;
    Ok(note.is_some_and(|text| text == NOTE_TEXT.as_bytes()))
}

/// Writes the data of a demo next to `data` and then replaces `data`, so that a project never sees half of them. Calls
/// `write` on another thread. The paths that it returns lie in a folder that was moved since. Returns `None` if `write`
/// was stopped, and otherwise a warning if the earlier data could not be removed.
pub async fn replace_data<T: Send + 'static>(
    data: &Path,
    stop: &Stop,
    write: impl FnOnce(&Path, &Stop) -> Result<T, DatasetError> + Send + 'static,
) -> ProjectResult<Option<(T, Option<String>)>> {
    let folder = ReplacementFolder::begin(data)?;
    let note = folder.path().join(NOTE);
    std::fs::write(&note, NOTE_TEXT).with_context(|| format!("cannot write {}", note.display()))?;
    let (target, stop) = (folder.path().to_owned(), stop.clone());
    let written = match blocking(move || write(&target, &stop)).await? {
        Err(DatasetError::Stopped) => return Ok(None),
        written => written?,
    };
    let warning = folder.finish()?.map(|(path, error)| {
        format!(
            "the earlier data could not be removed from {}: {error}; the next demo that writes data removes them",
            path.display()
        )
    });
    Ok(Some((written, warning)))
}

#[cfg(test)]
mod tests {
    use super::{DemoContent, NOTE, NOTE_TEXT, check_directory};
    use mocban_demo::block::{BlockKind, BlockOptions};
    use mocban_demo::{DemoOptions, Tier};

    const OPTIONS: DemoOptions = DemoOptions {
        pairs: 4,
        seed: 1,
        tier: Tier::Pose,
    };
    const BLOCK: BlockOptions = BlockOptions {
        kind: BlockKind::Notes,
        seed: 1,
        spacing_mm: 0.3,
    };

    #[test]
    fn directory_with_other_files_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let data = dir.path().join("data");
        let check_content = |content| check_directory(dir.path(), &data, &content).is_ok();
        let check = |options| check_content(DemoContent::Pairs(options));
        assert!(check(OPTIONS));
        std::fs::create_dir(&data).expect("a folder");
        assert!(!check(OPTIONS));
        std::fs::write(data.join(NOTE), "my scans").expect("a small file");
        assert!(!check(OPTIONS));
        std::fs::write(data.join(NOTE), NOTE_TEXT).expect("a small file");
        assert!(check(OPTIONS));
        let stamp = serde_json::to_vec(&OPTIONS).expect("plain values");
        std::fs::write(data.join("dataset.json"), stamp).expect("a small file");
        assert!(check(OPTIONS));
        assert!(check(DemoOptions {
            pairs: 9,
            ..OPTIONS
        }));
        assert!(!check(DemoOptions {
            pairs: 3,
            ..OPTIONS
        }));
        assert!(!check(DemoOptions { seed: 2, ..OPTIONS }));
        assert!(!check_content(DemoContent::Block(BLOCK)));
    }

    #[test]
    fn directory_of_another_block_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let data = dir.path().join("data");
        std::fs::create_dir(&data).expect("a folder");
        let stamp = "{\"schema\":1,\"revision\":1,\"kind\":\"notes\",\"seed\":1,\"spacing_mm\":0.3,\
            \"page\":\"page.png\",\"triangles\":9,\"characters\":2}";
        std::fs::write(data.join("block.json"), stamp).expect("a small file");
        let check = |content| check_directory(dir.path(), &data, &content);
        assert!(check(DemoContent::Block(BLOCK)).is_ok());
        let finer = BlockOptions {
            spacing_mm: 0.2,
            ..BLOCK
        };
        for content in [DemoContent::Block(finer), DemoContent::Pairs(OPTIONS)] {
            let error = check(content).expect_err("another demo").to_string();
            assert!(
                error.contains("a notes block, seed 1 and spacing 0.3 mm"),
                "{error}"
            );
        }
    }
}
