//! Blocks whose files an import moved. A run cuts such a block again only if the content of a file is different.

use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use mocban_catalog::{Catalog, KnownBlock};
use mocban_core::domain::{BlockName, ContentHash, InputVersion};
use mocban_core::locked;
use mocban_project::ProjectResult;
use mocban_project::block_status::BlockStatus;
use mocban_project::blocking::blocking;
use mocban_store::{Input, Project, hash_input, stat_input};

/// Most bytes of files that are hashed for a page. The others are hashed for later pages; a longer file is never compared.
const MAX_BYTES: u64 = 32 << 20;
/// Most versions of files that are kept.
const MAX_KEPT: usize = 10_000;

/// Versions of the moved files of a project, by path.
#[derive(Debug, Default)]
pub(super) struct MovedFiles(Mutex<HashMap<PathBuf, InputVersion>>);

/// Returns how many finished blocks have moved files that are known to have other content than when they were read.
pub(super) async fn changed_blocks(
    catalog: &Catalog,
    project: &Project,
    files: &Arc<MovedFiles>,
    blocks: &BlockStatus,
) -> ProjectResult<u64> {
    let moved = blocks.0.iter().filter(|state| state.other_files);
    let moved: BTreeSet<&BlockName> = moved.map(|state| &state.attributes.name).collect();
    if moved.is_empty() {
        return Ok(0);
    }
    let mut known = catalog.known_blocks().await?;
    known.retain(|block| moved.contains(&block.attributes.name));
    let (project, files) = (project.clone(), Arc::clone(files));
    blocking(move || files.changed(&project, &known)).await
}

impl MovedFiles {
    /// Returns how many blocks have moved files that are known to have other content.
    fn changed(&self, project: &Project, blocks: &[KnownBlock]) -> u64 {
        let mut left = MAX_BYTES;
        let changed = blocks
            .iter()
            .filter(|block| self.has_changed_file(project, block, &mut left));
        changed.count() as u64
    }

    /// Returns whether one of the moved files of a block is known to have other content.
    fn has_changed_file(&self, project: &Project, block: &KnownBlock, left: &mut u64) -> bool {
        let KnownBlock {
            attributes, inputs, ..
        } = block;
        if let Some(path) = &attributes.labels_path {
            let labels = project.input(path);
            let is_changed = match &inputs.labels {
                Some(known) => self.has_changed(&labels, known, left),
                // The block was finished without labels.
                None => !labels.is_remote() && stat_input(&labels).is_ok(),
            };
            if is_changed {
                return true;
            }
        }
        let files = [
            (&attributes.page_path, &inputs.page),
            (&attributes.mesh_path, &inputs.mesh),
        ];
        files.into_iter().any(|(path, known)| {
            let known = known.as_ref();
            known.is_some_and(|known| self.has_changed(&project.input(path), known, left))
        })
    }

    /// Returns whether a file was moved and is known to have other content.
    fn has_changed(&self, input: &Input, known: &InputVersion, left: &mut u64) -> bool {
        let is_other = |hash: ContentHash| hash != known.hash;
        known.has_new_path() && self.hash(input, left).is_some_and(is_other)
    }

    /// Returns the hash of a file. `None` if it cannot be read, is in an object store, or has more bytes than are left.
    fn hash(&self, input: &Input, left: &mut u64) -> Option<ContentHash> {
        if input.is_remote() {
            return None;
        }
        let stat = stat_input(input).ok()?;
        let kept = locked(&self.0)
            .get(input.path())
            .filter(|kept| kept.stat == stat)
            .map(|kept| kept.hash);
        if kept.is_some() {
            return kept;
        }
        *left = left.checked_sub(input.size())?;
        let read = hash_input(input).ok()?;
        let hash = read.hash;
        let mut all = locked(&self.0);
        if all.len() >= MAX_KEPT {
            all.clear();
        }
        all.insert(input.path().to_owned(), read);
        Some(hash)
    }
}

#[cfg(test)]
mod tests {
    use super::MovedFiles;
    use mocban_catalog::{BlockAttributes, BlockInputVersions, KnownBlock};
    use mocban_core::domain::{BlockId, ContentHash, InputVersion};
    use mocban_store::Project;

    /// Returns a block whose scan had this content and was moved, and whose page was not.
    fn block(mesh: &str, content: &str, labels: Option<&str>) -> KnownBlock {
        let version = |content: &str, stat: &str| {
            Some(InputVersion {
                hash: ContentHash::of(content.as_bytes()),
                stat: stat.to_owned(),
            })
        };
        KnownBlock {
            block: BlockId(1),
            attributes: BlockAttributes {
                name: "b".parse().expect("an id"),
                mesh_path: mesh.to_owned(),
                page_path: "p.png".to_owned(),
                labels_path: labels.map(str::to_owned),
                unit: None,
                side: None,
                meta: None,
            },
            inputs: BlockInputVersions {
                mesh: version(content, ""),
                page: version("an earlier page", "1:2:3"),
                labels: None,
            },
        }
    }

    #[test]
    fn only_moved_files_with_other_content_have_changed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let write = |name: &str, content: &str| {
            std::fs::write(dir.path().join(name), content).expect("written");
        };
        write("new.ply", "scan");
        write("p.png", "page");
        let (project, files) = (Project::at(dir.path()), MovedFiles::default());
        let changed = |blocks: &[KnownBlock]| files.changed(&project, blocks);
        assert_eq!(changed(&[block("new.ply", "scan", None)]), 0);
        let both = [
            block("new.ply", "scan", None),
            block("new.ply", "another scan", None),
        ];
        assert_eq!(changed(&both), 1);
        assert_eq!(changed(&[block("missing.ply", "scan", None)]), 0);
        let labelled = [block("new.ply", "scan", Some("l.json"))];
        assert_eq!(changed(&labelled), 0);
        write("l.json", "{}");
        assert_eq!(changed(&labelled), 1);
        write("new.ply", "a longer scan");
        assert_eq!(changed(&[block("new.ply", "scan", None)]), 1);
    }

    #[test]
    fn a_file_that_is_too_long_to_be_hashed_has_not_changed_as_far_as_known() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        std::fs::write(dir.path().join("new.ply"), "scan").expect("written");
        let (project, files) = (Project::at(dir.path()), MovedFiles::default());
        let block = block("new.ply", "another scan", None);
        let mut left = 3;
        assert!(!files.has_changed_file(&project, &block, &mut left));
        left = 4;
        assert!(files.has_changed_file(&project, &block, &mut left));
        assert_eq!(left, 0);
        assert!(files.has_changed_file(&project, &block, &mut left), "kept");
    }
}
