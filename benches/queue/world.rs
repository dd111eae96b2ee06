//! A temporary project with many pairs, created by `import`.

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
use super::process::{self, ProcessUsage};

/// A project in a temporary directory. All its pairs share the same two small files.
pub(super) struct World {
    pub(super) project: Project,
    dir: tempfile::TempDir,
}

impl World {
    /// Writes a list of pairs and imports the list with the program. Returns the project, and the time and memory of
    /// the process.
    pub(super) fn import(pairs: usize) -> anyhow::Result<(Self, ProcessUsage)> {
        let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
        let path = dir.path();
        // Longer than pointers of Git LFS, which an import opens.
        for (name, content) in [("mesh.stl", "a mesh"), ("print.png", "a print")] {
            std::fs::write(path.join(name), content.repeat(500))?;
        }
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
    pub(super) fn run(&self, args: &[&str]) -> anyhow::Result<ProcessUsage> {
        let dir = self.dir.path().to_str().context("a path in UTF-8")?;
        process::mocban(&[&["-C", dir], args].concat())
    }

    /// Opens the catalog.
    pub(super) async fn catalog(&self) -> anyhow::Result<Catalog> {
        Ok(Catalog::open(&self.project.catalog_path()).await?)
    }

    /// Returns the size of the catalog in bytes.
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

/// Returns the fingerprints of the default settings, optionally with one changed setting.
pub(super) fn fingerprints(set: Option<&str>) -> anyhow::Result<Fingerprints> {
    let loaded = load(&Sources {
        sets: set.into_iter().map(str::to_owned).collect(),
        ..Sources::default()
    })?;
    Ok(runner::fingerprints(&loaded.config.stages))
}

/// Runs `pairs` pairs through all stages, `in_progress` at a time. Claims pairs for all free slots together, as a run
/// does.
pub(super) async fn work(
    world: &World,
    catalog: &Catalog,
    pairs: usize,
    in_progress: usize,
) -> anyhow::Result<Duration> {
    let fake = Arc::new(Fake::register(&world.project, catalog, &fingerprints(None)?).await?);
    // Commits are not delayed, so each checkpoint is durable before the same pair's next checkpoint.
    let _waiting = catalog.waiting().await?;
    let start = Instant::now();
    let mut left = pairs;
    let mut tasks = tokio::task::JoinSet::new();
    while left > 0 || !tasks.is_empty() {
        let slots = left.min(in_progress - tasks.len());
        if slots > 0 {
            let leases = catalog.claim(fake.request(slots)).await?;
            anyhow::ensure!(leases.len() == slots, "{} pairs ready", leases.len());
            left -= slots;
            for lease in leases {
                let (fake, catalog) = (Arc::clone(&fake), catalog.clone());
                tasks.spawn(async move { fake.finish(&catalog, lease).await });
            }
        }
        let mut ended = tasks.join_next().await;
        while let Some(one) = ended {
            one??;
            ended = tasks.try_join_next();
        }
    }
    let time = start.elapsed();
    catalog.end_worker(fake.worker, 2, None).await?;
    Ok(time)
}
