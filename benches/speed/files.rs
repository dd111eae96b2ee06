//! A scan and its print as files, made once.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use mocban::demo::{PairGenerator, Tier};
use mocban::mesh::write::MeshFormat;

/// Seed of the pair.
const SEED: u64 = 61;

/// The files' names without the size, and how the mesh is written in each.
pub(super) const MESHES: [(&str, MeshFormat); 3] = [
    ("stl", MeshFormat::StlBinary),
    ("ply", MeshFormat::PlyLittleEndian),
    ("obj", MeshFormat::Obj),
];

/// A pair of one size.
pub(super) struct Files {
    /// The size as it stands in the benchmarks' names.
    pub(super) size: &'static str,
    dir: PathBuf,
}

impl Files {
    /// The scan of a size from its folder, made if it is not there.
    pub(super) fn kept(size: &'static str, vertices: u32) -> anyhow::Result<Self> {
        let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed");
        let dir = root.join(size);
        if !dir.exists() {
            let pair = PairGenerator::new(Tier::Pose, SEED)
                .with_vertices(Some(vertices))
                .pair(0)?;
            // Under another name until all of it is there.
            let half = root.join(format!("{size}.half"));
            std::fs::create_dir_all(&half)?;
            for (ending, format) in MESHES {
                std::fs::write(
                    half.join(format!("scan.{ending}")),
                    format.encode(&pair.mesh),
                )?;
            }
            std::fs::write(half.join("print.png"), &pair.print)?;
            std::fs::rename(&half, &dir)?;
        }
        Ok(Self { size, dir })
    }

    /// Path of the mesh in a format, by its ending.
    pub(super) fn mesh(&self, ending: &str) -> PathBuf {
        self.dir.join(format!("scan.{ending}"))
    }

    /// Path of the print.
    pub(super) fn print(&self) -> PathBuf {
        self.dir.join("print.png")
    }
}

/// The bytes of a file.
pub(super) fn bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    std::fs::read(path).with_context(|| path.display().to_string())
}
