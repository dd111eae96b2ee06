//! The native part of the Python package `mocban`, whose Python part is `python/mocban`.
//!
//! - `compute.rs`: runs work without the GIL until it ends or Python gets a signal
//! - `failure.rs`: raises the exceptions of `mocban._errors`
//! - `mesh.rs`, `print.rs`, `settings.rs`: inputs, from arrays and files; `memory.rs`: the memory that they need
//! - `alignment.rs`: the result of a pair; `state.rs`: the same as bytes; `stages.rs`: single stages
//! - `project.rs`: a project; `stored_pair.rs`: a pair of it; `stored_block.rs`: a block of it
//! - `python_events.rs`: events of a project for Python; `log.rs`: messages for Python's `logging`, also those of panics
//!
//! Classes here hold data and convert arrays of exactly one kind. The Python part checks and converts everything else, and
//! has the documentation.
//!
//! **Invariant:** while the GIL is held, arrays are copied, but nothing is computed and no file is read; no work begins after a
//! fork.

#![expect(
    clippy::needless_pass_by_value,
    reason = "PyO3 hands arguments over by value"
)]

mod alignment;
mod compute;
mod failure;
mod log;
mod memory;
mod mesh;
mod print;
mod project;
mod python_events;
mod settings;
mod stages;
mod state;
mod stored_block;
mod stored_pair;

use pyo3::pymodule;

#[pymodule]
mod _native {
    use pyo3::prelude::{Bound, PyModule, PyModuleMethods, PyResult};

    #[pymodule_export]
    use super::alignment::{NativeAlignment, align_pair};
    #[pymodule_export]
    use super::compute::{NativeCancel, forked};
    #[pymodule_export]
    use super::memory::{available_threads, pair_bytes};
    #[pymodule_export]
    use super::mesh::{NativeMesh, read_mesh};
    #[pymodule_export]
    use super::print::{NativePrint, read_print};
    #[pymodule_export]
    use super::project::NativeProject;
    #[pymodule_export]
    use super::settings::NativeSettings;
    #[pymodule_export]
    use super::stages::{depth_map, fit_surface};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::log::install();
        module.add("HAS_FAILPOINTS", cfg!(debug_assertions))?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
