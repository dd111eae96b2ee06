//! A scan, from arrays or a file.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::compute::{NativeCancel, compute};
use crate::failure::{raise, unreadable};
use crate::settings::NativeSettings;
use mocban_align::stages::Scan;
use mocban_core::domain::{LengthUnit, any_case};
use mocban_core::mesh::{Mesh, PositionSlice};
use mocban_project::align;

/// A scan, its unit and its file.
#[pyclass(frozen, module = "mocban._native")]
pub(crate) struct NativeMesh {
    pub(crate) scan: Arc<Scan>,
    pub(crate) unit: Option<LengthUnit>,
    #[pyo3(get)]
    pub(crate) path: Option<PathBuf>,
    /// Why the unit must be wrong, once that was asked for.
    wrong_unit: OnceLock<Option<String>>,
}

/// Parses the name of a unit, in any case.
pub(crate) fn unit(py: Python<'_>, name: Option<&str>) -> PyResult<Option<LengthUnit>> {
    let parsed = name.map(any_case).transpose();
    parsed.map_err(|text: String| raise(py, "UnitError", "unknown_unit", &text, None))
}

impl NativeMesh {
    fn new(scan: Scan, unit: Option<LengthUnit>, path: Option<PathBuf>) -> Self {
        Self {
            scan: Arc::new(scan),
            unit,
            path,
            wrong_unit: OnceLock::new(),
        }
    }
}

#[pymethods]
impl NativeMesh {
    /// Copies coordinates, three for each vertex, and indices, three for each face.
    #[new]
    fn from_arrays(
        py: Python<'_>,
        single: Option<PyReadonlyArray1<'_, f32>>,
        double: Option<PyReadonlyArray1<'_, f64>>,
        faces: Option<PyReadonlyArray1<'_, u32>>,
        unit_name: Option<&str>,
    ) -> PyResult<Self> {
        let unit = unit(py, unit_name)?;
        let faces = faces.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
        let faces = faces.unwrap_or_default().as_chunks::<3>().0;
        let mesh = match (&single, &double) {
            (Some(single), _) => Mesh::from_arrays(
                PositionSlice::Single(single.as_slice()?.as_chunks().0),
                faces,
            ),
            (None, Some(double)) => Mesh::from_arrays(
                PositionSlice::Double(double.as_slice()?.as_chunks().0),
                faces,
            ),
            (None, None) => Mesh::from_arrays(PositionSlice::Double(&[]), faces),
        };
        let mesh =
            mesh.map_err(|error| raise(py, "MeshError", "bad_input", &error.to_string(), None))?;
        Ok(Self::new(mesh.into(), unit, None))
    }

    /// Returns the coordinates, three for each vertex.
    fn vertices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.scan.mesh().vertices.to_flat())
    }

    /// Returns the indices, three for each face.
    fn faces<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_slice(py, self.scan.mesh().triangles.as_flattened())
    }

    /// Returns the numbers of vertices and faces.
    fn counts(&self) -> (usize, usize) {
        let mesh = self.scan.mesh();
        (mesh.vertices.len(), mesh.triangles.len())
    }

    /// Returns what may be wrong with the mesh.
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        if self.wrong_unit.get().is_none() {
            let (scan, unit) = (Arc::clone(&self.scan), self.unit);
            let found = compute(py, None, move || align::wrong_unit(&scan, unit))?;
            let _ = self.wrong_unit.set(found.map(|failure| failure.message));
        }
        Ok(self
            .wrong_unit
            .get()
            .cloned()
            .flatten()
            .into_iter()
            .collect())
    }

    /// Returns the name of the unit.
    fn unit(&self) -> Option<&'static str> {
        self.unit.map(LengthUnit::name)
    }
}

/// Reads the file of a scan.
#[pyfunction]
pub(crate) fn read_mesh(
    py: Python<'_>,
    path: PathBuf,
    unit_name: Option<&str>,
    settings: &NativeSettings,
    cancel: Option<&NativeCancel>,
) -> PyResult<NativeMesh> {
    let unit = unit(py, unit_name)?;
    let (file, limits) = (path.clone(), settings.limits);
    let read = compute(py, cancel, move || align::read_scan(&file, &limits))?;
    let content = read.map_err(|error| unreadable(py, "MeshError", &error, &path))?;
    let scan = content.map_err(|failure| {
        let class = failure.class.name();
        raise(py, "MeshError", class, &failure.message, Some(&path))
    })?;
    Ok(NativeMesh::new(scan, unit, Some(path)))
}
