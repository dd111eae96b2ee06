//! Writes a world to disk: mesh, page, labels and truth.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::kind::BlockOptions;
use super::world::BlockWorld;
use crate::dataset::{DatasetError, at};

/// Increased whenever the same options produce different bytes.
const REVISION: u32 = 1;
/// Written last; its presence marks a complete world.
const STAMP_FILE: &str = "block.json";
/// Bytes of the mesh that are collected before they are written.
const BUFFER: usize = 1 << 20;

/// Paths and size of a written world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlockFiles {
    /// The mesh, binary PLY.
    pub mesh: PathBuf,
    /// The image of the page.
    pub page: PathBuf,
    /// The boxes of the characters, as a VIA 2 project.
    pub labels: PathBuf,
    /// The true alignment.
    pub truth: PathBuf,
    /// Number of triangles of the mesh.
    pub triangles: usize,
    /// Number of characters of the printed side.
    pub characters: usize,
    /// Whether nothing was written because the same world existed.
    pub already_existed: bool,
}

impl BlockFiles {
    /// Returns the paths after the folder of the world was moved.
    #[must_use]
    pub fn moved_to(self, dir: &Path) -> Self {
        let moved = |path: PathBuf| dir.join(path.file_name().unwrap_or_default());
        Self {
            mesh: moved(self.mesh),
            page: moved(self.page),
            labels: moved(self.labels),
            truth: moved(self.truth),
            ..self
        }
    }
}

/// Content of `block.json`.
#[derive(Debug, Serialize, Deserialize)]
struct BlockStamp {
    schema: u32,
    revision: u32,
    #[serde(flatten)]
    options: BlockOptions,
    page: String,
    triangles: usize,
    characters: usize,
}

impl BlockStamp {
    fn files(self, dir: &Path, already_existed: bool) -> BlockFiles {
        BlockFiles {
            mesh: dir.join("block.ply"),
            page: dir.join(&self.page),
            labels: dir.join("labels.json"),
            truth: dir.join("truth.json"),
            triangles: self.triangles,
            characters: self.characters,
            already_existed,
        }
    }
}

/// Returns the options of the world below `dir`, if there is one.
pub fn block_options(dir: &Path) -> Option<BlockOptions> {
    read_stamp(dir).map(|stamp| stamp.options)
}

/// Returns the world below `dir` if it is complete and has these options.
pub fn find_block(dir: &Path, options: &BlockOptions) -> Option<BlockFiles> {
    let stamp = read_stamp(dir)?;
    (stamp.revision == REVISION && stamp.options == *options).then(|| stamp.files(dir, true))
}

fn read_stamp(dir: &Path) -> Option<BlockStamp> {
    let bytes = fs::read(dir.join(STAMP_FILE)).ok()?;
    serde_json::from_slice(&bytes).ok()
}

/// Writes a world below `dir`, unless it is already there. Writes `block.ply`, the page, `labels.json` and
/// `truth.json`, then `block.json`. Calls `is_stopped` before each write to the mesh.
///
/// # Errors
/// Returns an error if a file cannot be written or `is_stopped` returns true.
pub fn write_block(
    dir: &Path,
    options: &BlockOptions,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<BlockFiles, DatasetError> {
    if let Some(files) = find_block(dir, options) {
        return Ok(files);
    }
    fs::create_dir_all(dir).map_err(at(dir))?;
    let world = BlockWorld::new(*options);
    let truth = world.truth();
    let stamp = BlockStamp {
        schema: 1,
        revision: REVISION,
        options: *options,
        page: world.page_name(),
        triangles: world.triangles(),
        characters: truth.characters.len(),
    };
    let stamp_file = dir.join(STAMP_FILE);
    let stamp_bytes = serde_json::to_vec(&stamp).map_err(at(&stamp_file))?;
    let files = stamp.files(dir, false);
    write_mesh(&world, &files.mesh, is_stopped)?;
    let truth = serde_json::to_vec(&truth).map_err(at(&files.truth))?;
    fs::write(&files.page, &world.page().bytes).map_err(at(&files.page))?;
    fs::write(&files.labels, world.labels_via()).map_err(at(&files.labels))?;
    fs::write(&files.truth, truth).map_err(at(&files.truth))?;
    fs::write(&stamp_file, stamp_bytes).map_err(at(&stamp_file))?;
    Ok(files)
}

fn write_mesh(
    world: &BlockWorld,
    path: &Path,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<(), DatasetError> {
    let file = File::create(path).map_err(at(path))?;
    let mut out = StoppableWriter {
        inner: BufWriter::with_capacity(BUFFER, file),
        is_stopped,
    };
    let written = world.write_mesh(&mut out).and_then(|()| out.flush());
    if is_stopped() {
        return Err(DatasetError::Stopped);
    }
    written.map_err(at(path))
}

/// Fails as soon as a stop is requested.
struct StoppableWriter<'a, W> {
    inner: W,
    is_stopped: &'a (dyn Fn() -> bool + Sync),
}

impl<W: Write> Write for StoppableWriter<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if (self.is_stopped)() {
            return Err(io::Error::other("stopped"));
        }
        self.inner.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::{BlockOptions, block_options, find_block, write_block};
    use crate::DatasetError;
    use crate::block::{BlockKind, BlockTruth};
    use mocban_core::mesh::{MeshLimits, read};

    const OPTIONS: BlockOptions = BlockOptions {
        kind: BlockKind::Mixed,
        seed: 4,
        spacing_mm: 2.0,
    };

    #[test]
    fn complete_world_is_found_and_not_written_again() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let data = dir.path().join("data");
        assert_eq!(find_block(&data, &OPTIONS), None);
        let calls = AtomicU32::new(0);
        let stopped = || calls.fetch_add(1, Ordering::Relaxed) > 3;
        let outcome = write_block(&data, &OPTIONS, &stopped);
        assert!(matches!(outcome, Err(DatasetError::Stopped)));
        assert_eq!(find_block(&data, &OPTIONS), None);
        let written = write_block(&data, &OPTIONS, &|| false).expect("a disk");
        let mesh = std::fs::read(&written.mesh).expect("the mesh");
        let mesh = read(&mesh, "block.ply", &MeshLimits::SUGGESTED).expect("a mesh");
        assert_eq!(mesh.triangles.len(), written.triangles);
        let truth = std::fs::read(&written.truth).expect("the truth");
        let truth: BlockTruth = serde_json::from_slice(&truth).expect("JSON");
        assert_eq!(truth.characters.len(), written.characters);
        assert!(truth.characters.iter().any(|character| character.part.note));
        let found = write_block(&data, &OPTIONS, &|| true).expect("nothing to write");
        assert!(found.already_existed && found.page == written.page && found.page.exists());
        let other = BlockOptions { seed: 5, ..OPTIONS };
        assert_eq!(find_block(&data, &other), None);
        assert_eq!(block_options(&data), Some(OPTIONS));
    }
}
