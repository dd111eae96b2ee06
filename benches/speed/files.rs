//! A scan and its print as files, generated once.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use mocban::demo::{PairGenerator, Tier};
use mocban::mesh::write::MeshFormat;

/// Seed of the pair.
const SEED: u64 = 61;

/// Extensions and formats of the mesh files.
pub(super) const MESHES: [(&str, MeshFormat); 3] = [
    ("stl", MeshFormat::StlBinary),
    ("ply", MeshFormat::PlyLittleEndian),
    ("obj", MeshFormat::Obj),
];

/// A pair of one size.
pub(super) struct Files {
    /// The size in the names of benchmarks.
    pub(super) size: &'static str,
    dir: PathBuf,
}

impl Files {
    /// Opens the folder of a size; generates its files if it does not exist.
    pub(super) fn open_or_generate(size: &'static str, vertices: u32) -> anyhow::Result<Self> {
        let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed");
        let dir = root.join(size);
        if !dir.exists() {
            let pair = PairGenerator::new(Tier::Pose, SEED)
                .with_vertices(Some(vertices))
                .pair(0)?;
            // Under another name until it is complete.
            let partial = root.join(format!("{size}.partial"));
            std::fs::create_dir_all(&partial)?;
            for (extension, format) in MESHES {
                std::fs::write(
                    partial.join(format!("scan.{extension}")),
                    format.encode(&pair.mesh),
                )?;
            }
            std::fs::write(partial.join("print.png"), &pair.print)?;
            std::fs::rename(&partial, &dir)?;
        }
        Ok(Self { size, dir })
    }

    /// Returns the path of the mesh with an extension.
    pub(super) fn mesh(&self, extension: &str) -> PathBuf {
        self.dir.join(format!("scan.{extension}"))
    }

    /// Returns the path of the print.
    pub(super) fn print(&self) -> PathBuf {
        self.dir.join("print.png")
    }
}

/// Reads a file.
pub(super) fn bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    std::fs::read(path).with_context(|| path.display().to_string())
}
