//! Runs pairs without a catalog: the baseline for what the catalog costs.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use mocban::catalog::PairAttributes;
use mocban::mesh;
use mocban::raster;
use mocban::runner::RunOptions;
use mocban::stages::normalize::PrintMasks;
use mocban::stages::{Print, Scan, Settings, depth, pipeline};
use mocban::store::{NewArtifact, Project, open_input, read_input};
use tokio::runtime::Handle;
use tokio::task::JoinHandle;

/// Pairs that no thread has started yet.
type Queue = Arc<Mutex<std::vec::IntoIter<PairAttributes>>>;

/// Writes of artifacts in progress.
type Writes = Vec<JoinHandle<anyhow::Result<()>>>;

/// Computes all stages of the pairs and writes their artifacts, on as many threads as a run uses. Returns the time
/// spent on computing, summed over all threads.
pub(super) async fn run_without_catalog(
    project: &Project,
    settings: &Settings,
    options: &RunOptions,
    pairs: Vec<PairAttributes>,
) -> anyhow::Result<Duration> {
    mocban::page_vec::keep_memory(options.memory);
    let queue = Arc::new(Mutex::new(pairs.into_iter()));
    let compute = |_| {
        let worker = Worker {
            project: project.clone(),
            settings: settings.clone(),
            options: options.clone(),
            runtime: Handle::current(),
        };
        let queue = Arc::clone(&queue);
        std::thread::spawn(move || worker.compute_all(&queue))
    };
    let threads: Vec<_> = (0..options.workers.max(1)).map(compute).collect();
    let mut compute_time = Duration::ZERO;
    for thread in threads {
        let (elapsed, writes) = thread.join().ok().context("a thread panicked")??;
        compute_time += elapsed;
        for write in writes {
            write.await??;
        }
    }
    Ok(compute_time)
}

/// A thread that computes pairs.
struct Worker {
    project: Project,
    settings: Settings,
    options: RunOptions,
    runtime: Handle,
}

impl Worker {
    /// Computes pairs until none is left. Returns the time spent on computing, and the unfinished writes.
    fn compute_all(&self, queue: &Queue) -> anyhow::Result<(Duration, Writes)> {
        let (mut elapsed, mut writes) = (Duration::ZERO, Vec::new());
        loop {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some(pair) = next else {
                return Ok((elapsed, writes));
            };
            let start = Instant::now();
            self.compute(&pair, &mut writes)?;
            elapsed += start.elapsed();
        }
    }

    /// Computes the stages of a pair, and starts writing the artifacts of each stage.
    fn compute(&self, pair: &PairAttributes, writes: &mut Writes) -> anyhow::Result<()> {
        let (settings, meshes, images) = (
            &self.settings,
            &self.options.limits.mesh,
            &self.options.limits.image,
        );
        let input = self.project.input(&pair.mesh_path);
        let mut file = open_input(&input, meshes.max_bytes, "limits.mesh.max_bytes")?;
        let size = file.size();
        let scan: Scan = mesh::read_from(&mut file, size, &pair.mesh_path, meshes)?.into();
        file.finish()?;
        let input = self.project.input(&pair.print_path);
        let print = read_input(&input, images.max_bytes, "limits.image.max_bytes")?;
        let print = Print::from(raster::decode(&print.bytes, images)?);
        let fit = pipeline::fit(&scan, Some(&print), pair.scanned_face_down, None, settings)?;
        let depth = depth::depth(&scan, &fit, pair.unit, &settings.depth)?;
        drop(scan);
        writes.push(self.write(vec![raster::png_grey16(&depth.levels)]));
        let normalized = pipeline::normalize(&depth, &print, settings)?;
        let masks = normalized.prints.iter().map(PrintMasks::to_grey);
        writes.push(self.write(masks.map(|grey| raster::png_grey8(&grey)).collect()));
        let registered = pipeline::register(&depth, &normalized, None, settings)?;
        let canvases = [&registered.canvas_print].into_iter();
        let canvases = canvases.chain(&registered.canvas_depths);
        let mut files: Vec<Vec<u8>> = canvases.map(raster::png_mask).collect();
        let mut maps = registered.stroke_maps;
        maps.dedup();
        files.extend(maps.iter().map(raster::png_grey8));
        writes.push(self.write(files));
        Ok(())
    }

    /// Starts to write artifacts on a thread for blocking calls.
    fn write(&self, files: Vec<Vec<u8>>) -> JoinHandle<anyhow::Result<()>> {
        let project = self.project.clone();
        self.runtime.spawn_blocking(move || {
            let artifact = |bytes| NewArtifact::new("mask", "png", bytes);
            let files: Vec<_> = files.into_iter().map(artifact).collect();
            Ok(project.write_artifacts(&files, &|| {})?)
        })
    }
}
