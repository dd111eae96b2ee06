//! Passes over the triangles of a block's scan: a binary STL is streamed, other formats are read into memory.

use std::fs::File;
use std::io::{self, BufReader, Read as _, Seek as _, SeekFrom};
use std::sync::atomic::{AtomicBool, Ordering};

use super::failure::{StopRequested, failed};
use crate::block_stages::{BlockFile, BlockStageError};
use mocban_align::block::BlockError;
use mocban_core::domain::MeshLosses;
use mocban_core::mesh::{
    self, FarValues, Mesh, MeshLimits, MeshReadError, STL_HEAD, Triangle, TriangleStream,
    binary_stl_triangles, far_values_of_stl, pass_over_binary_stl,
};

/// Bytes that are read at a time.
const BUFFER: usize = 1 << 20;

/// The scan of a block.
pub(crate) struct ScanStream<'a> {
    source: ScanSource,
    /// What was left out of the mesh, or of the last pass.
    losses: MeshLosses,
    limits: &'a MeshLimits,
    stop: &'a AtomicBool,
}

enum ScanSource {
    /// A binary STL, its number of triangles, and what stands for missing positions in it.
    Stl(File, u32, FarValues),
    /// All triangles.
    Mesh(Mesh),
}

impl<'a> ScanStream<'a> {
    /// Opens the scan of a block.
    ///
    /// # Errors
    /// Returns an error if it cannot be read, is no mesh, or has no faces.
    pub(crate) fn open(
        scan: &BlockFile,
        limits: &'a MeshLimits,
        stop: &'a AtomicBool,
    ) -> Result<Self, BlockStageError> {
        let mut file = scan.open()?;
        let mut losses = MeshLosses::default();
        let read = || -> Result<ScanSource, MeshReadError> {
            let mut head = Vec::with_capacity(STL_HEAD);
            Stoppable(&mut file, stop)
                .take(STL_HEAD as u64)
                .read_to_end(&mut head)?;
            if let Some(count) = binary_stl_triangles(&head, scan.size(), scan.name())? {
                let far_values = far_values_of_stl(&mut file, count)?;
                return Ok(ScanSource::Stl(file, count, far_values));
            }
            file.seek(SeekFrom::Start(0))?;
            let mut source = BufReader::with_capacity(BUFFER, Stoppable(&mut file, stop));
            let read = mesh::read_from(&mut source, scan.size(), scan.name(), limits)?;
            losses = read.losses;
            Ok(ScanSource::Mesh(read.mesh))
        };
        let source = { read }().map_err(|error| failed(scan, BlockError::Mesh(error)))?;
        if let ScanSource::Mesh(mesh) = &source
            && mesh.triangles.is_empty()
        {
            let points = mesh.vertices.len();
            return Err(failed(scan, BlockError::NoFaces { points }));
        }
        Ok(Self {
            source,
            losses,
            limits,
            stop,
        })
    }

    /// Returns what was left out.
    pub(crate) const fn losses(&self) -> MeshLosses {
        self.losses
    }
}

impl TriangleStream for ScanStream<'_> {
    fn pass(
        &mut self,
        visit: &mut dyn FnMut(&[Triangle]) -> Result<(), MeshReadError>,
    ) -> Result<(), MeshReadError> {
        match &mut self.source {
            ScanSource::Stl(file, count, far_values) => {
                file.seek(SeekFrom::Start(STL_HEAD as u64))?;
                let mut source = Stoppable(file, self.stop);
                let missing =
                    pass_over_binary_stl(&mut source, *count, far_values, self.limits, visit)?;
                self.losses.missing_vertices = missing;
                Ok(())
            }
            ScanSource::Mesh(mesh) => {
                let mut mesh = &*mesh;
                mesh.pass(visit)
            }
        }
    }
}

/// A file whose reads fail once the run stops.
struct Stoppable<'a>(&'a mut File, &'a AtomicBool);

impl io::Read for Stoppable<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.1.load(Ordering::Relaxed) {
            return Err(io::Error::other(StopRequested));
        }
        self.0.read(bytes)
    }
}
