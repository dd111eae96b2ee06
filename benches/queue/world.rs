//! A project with many pairs, made by `import` and removed in the end.

use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use mocban::catalog::{Catalog, Fingerprints};
use mocban::config::{Sources, load};
use mocban::runner;
use mocban::store::Project;

use super::fake::Fake;
use super::process::{self, Needed};

/// A project in a directory of its own. All its pairs have the same two small files.
pub(super) struct World {
    pub(super) project: Project,
    dir: tempfile::TempDir,
}

impl World {
    /// Writes a list of pairs and imports it by the program; also says what that needed.
    pub(super) fn import(pairs: usize) -> anyhow::Result<(Self, Needed)> {
        let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
        let path = dir.path();
        std::fs::write(path.join("mesh.stl"), "a mesh that nobody reads")?;
        std::fs::write(path.join("print.png"), "a print that nobody reads")?;
        let list = path.join("pairs.csv");
        write_list(&list, pairs)?;
        let needed = process::mocban(&[
            "-C".as_ref(),
            path.as_os_str(),
            "import".as_ref(),
            list.as_os_str(),
        ])?;
        std::fs::remove_file(list)?;
        let project = Project::open(path)?;
        Ok((Self { project, dir }, needed))
    }

    /// Runs the program on the project.
    pub(super) fn ask(&self, args: &[&str]) -> anyhow::Result<Needed> {
        let dir = self.dir.path().to_str().context("a path that is text")?;
        process::mocban(&[&["-C", dir], args].concat())
    }

    /// The catalog, open to write.
    pub(super) async fn catalog(&self) -> anyhow::Result<Catalog> {
        Ok(Catalog::open(&self.project.catalog_path()).await?)
    }

    /// Bytes of the catalog.
    pub(super) fn bytes(&self) -> anyhow::Result<u64> {
        Ok(std::fs::metadata(self.project.catalog_path())?.len())
    }
}

fn write_list(path: &Path, pairs: usize) -> anyhow::Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    writeln!(file, "id,mesh,print")?;
    for number in 0..pairs {
        writeln!(file, "p{number:08},mesh.stl,print.png")?;
    }
    Ok(file.flush()?)
}

/// The fingerprints of the settings that the program runs with, and one other setting of the last stage where asked for.
pub(super) fn fingerprints(set: Option<&str>) -> anyhow::Result<Fingerprints> {
    let loaded = load(&Sources {
        sets: set.into_iter().map(str::to_owned).collect(),
        ..Sources::default()
    })?;
    Ok(runner::fingerprints(&loaded.config.stages))
}

/// Takes so many pairs through all stages, with so many in hand at a time; asks as a run does, for all free slots.
pub(super) async fn work(
    world: &World,
    catalog: &Catalog,
    pairs: usize,
    in_hand: usize,
) -> anyhow::Result<Duration> {
    let fake = Arc::new(Fake::enter(&world.project, catalog, &fingerprints(None)?).await?);
    let start = Instant::now();
    let mut left = pairs;
    let mut tasks = tokio::task::JoinSet::new();
    while left > 0 || !tasks.is_empty() {
        let slots = left.min(in_hand - tasks.len());
        if slots > 0 {
            let leases = catalog.claim(fake.request(slots)).await?;
            anyhow::ensure!(leases.len() == slots, "{} pairs ready", leases.len());
            left -= slots;
            for lease in leases {
                let (fake, catalog) = (Arc::clone(&fake), catalog.clone());
                tasks.spawn(async move { fake.through(&catalog, lease).await });
            }
        }
        let mut ended = tasks.join_next().await;
        while let Some(one) = ended {
            one??;
            ended = tasks.try_join_next();
        }
    }
    let time = start.elapsed();
    catalog.end_worker(fake.worker, 2).await?;
    Ok(time)
}
