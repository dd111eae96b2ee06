//! How much memory pairs need, and how many threads may run.

use std::path::PathBuf;

use pyo3::prelude::*;

use crate::compute::compute;
use crate::settings::NativeSettings;
use mocban_runner::memory_estimate::{
    map_bytes, mesh_bytes, mesh_bytes_of, print_bytes, print_bytes_of,
};
use mocban_store::Input;

/// Estimates the memory in bytes that a pair needs while it is aligned, as a run of a project does. Mesh and print are files,
/// or in memory: numbers of vertices, faces and pixels.
#[pyfunction]
pub(crate) fn pair_bytes(
    py: Python<'_>,
    mesh: Option<PathBuf>,
    counts: (usize, usize),
    print: Option<PathBuf>,
    pixels: u64,
    settings: &NativeSettings,
) -> PyResult<u64> {
    let (limits, maps) = (settings.limits.image, map_bytes(&settings.stages.depth));
    compute(py, None, move || {
        let mesh = mesh.map_or_else(
            || mesh_bytes_of(counts.0, counts.1),
            |path| mesh_bytes(&Input::file(path)),
        );
        let print = print.map_or_else(
            || print_bytes_of(pixels),
            |path| print_bytes(&Input::file(path), &limits),
        );
        maps.saturating_add(mesh).saturating_add(print)
    })
}

/// Returns how many threads this process may run at the same time, by its processors and its limits.
#[pyfunction]
pub(crate) fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
