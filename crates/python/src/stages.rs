//! Single stages of the method.

use std::path::Path;
use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use serde_json::json;

use crate::compute::compute;
use crate::failure::raise;
use crate::mesh::NativeMesh;
use crate::print::NativePrint;
use crate::settings::NativeSettings;
use mocban_align::stages::depth::depth;
use mocban_align::stages::pipeline::fit;
use mocban_core::domain::{FailureClass, FitOutcome};

/// Makes the exception of a stage that finds no result for a scan.
fn no_result(py: Python<'_>, class: FailureClass, text: &str, path: Option<&Path>) -> PyErr {
    let name = path.map_or("the mesh".to_owned(), |path| path.display().to_string());
    raise(
        py,
        "MeshError",
        class.name(),
        &format!("{name}: {text}"),
        path,
    )
}

/// Fits the surface of a scan. Returns the result in JSON.
#[pyfunction]
pub(crate) fn fit_surface(
    py: Python<'_>,
    mesh: &NativeMesh,
    print: Option<&NativePrint>,
    settings: &NativeSettings,
    scanned_face_down: Option<bool>,
) -> PyResult<String> {
    let (scan, stages) = (Arc::clone(&mesh.scan), Arc::clone(&settings.stages));
    let image = print.map(NativePrint::image);
    let fitted = compute(py, None, move || {
        let image = image.map(|image| image());
        fit(&scan, image.as_deref(), scanned_face_down, None, &stages)
    })?;
    let fitted = fitted
        .map_err(|error| no_result(py, error.class(), &error.to_string(), mesh.path.as_deref()))?;
    Ok(json!(fitted).to_string())
}

/// Renders the depth map of a scan over a surface. Returns width, height, levels, and their scale in JSON.
#[pyfunction]
pub(crate) fn depth_map<'py>(
    py: Python<'py>,
    mesh: &NativeMesh,
    surface: &str,
    settings: &NativeSettings,
) -> PyResult<(usize, usize, Bound<'py, PyArray1<u16>>, String)> {
    let surface: FitOutcome = serde_json::from_str(surface).map_err(|error| {
        raise(
            py,
            "InputError",
            "damaged",
            &format!("the surface is damaged: {error}"),
            None,
        )
    })?;
    let (scan, stages, unit) = (
        Arc::clone(&mesh.scan),
        Arc::clone(&settings.stages),
        mesh.unit,
    );
    let map = compute(py, None, move || {
        depth(&scan, &surface, unit, &stages.depth)
    })?;
    let map = map
        .map_err(|error| no_result(py, error.class(), &error.to_string(), mesh.path.as_deref()))?;
    let (levels, scale) = (&map.levels, json!(map.scale).to_string());
    Ok((
        levels.width(),
        levels.height(),
        PyArray1::from_slice(py, levels.data()),
        scale,
    ))
}
