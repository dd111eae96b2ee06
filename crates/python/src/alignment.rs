//! The result of an alignment.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::json;

use crate::compute::{NativeCancel, compute};
use crate::failure::{project_failure, raise, wrong_argument};
use crate::mesh::NativeMesh;
use crate::print::NativePrint;
use crate::settings::NativeSettings;
use crate::state;
use mocban_align::stages::{AlignedPair, Print, ScanHints};
use mocban_core::domain::MetricOutcome;
use mocban_core::domain::spelling::hint;
use mocban_core::raster::{Mask, compact_rgb8, warp_mask};
use mocban_export::pictures::{PrintView, Rgb};
use mocban_project::align::{self, AlignFailure};
use mocban_project::verdict_words;
use mocban_system::failpoint::{self, Point};

/// An aligned pair.
#[pyclass(frozen, module = "mocban._native")]
pub(crate) struct NativeAlignment {
    pub(crate) pair: Arc<AlignedPair>,
    pub(crate) print: Arc<Print>,
}

/// A flat array of booleans.
type PyMask<'py> = Bound<'py, PyArray1<bool>>;

impl NativeAlignment {
    fn outcome(&self, py: Python<'_>, metric: &str) -> PyResult<(usize, &MetricOutcome)> {
        let wanted = verdict_words::metric(metric).ok();
        let mut metrics = self.pair.metrics().iter().enumerate();
        metrics
            .find(|(_, found)| Some(found.metric) == wanted)
            .ok_or_else(|| {
                let known = self.pair.metrics().iter();
                let known: Vec<&str> = known.map(|found| found.metric.name()).collect();
                let (names, hint) = (known.join(", "), hint(metric, known.iter().copied()));
                let text =
                    format!("there is no result of the metric {metric}, only of {names}{hint}");
                wrong_argument(py, &text)
            })
    }

    fn strokes(&self, outcome: &MetricOutcome) -> Mask {
        let rgb = &self.print.image().rgb;
        let strokes = self.pair.depth.stroke_mask(outcome.threshold_level);
        warp_mask(
            &strokes,
            &outcome.print_from_depth,
            rgb.width(),
            rgb.height(),
        )
    }

    fn picture(&self, outcome: &MetricOutcome) -> Rgb {
        let image = self.print.image();
        let view = PrintView::enlarged(image);
        let strokes = self.pair.depth.stroke_mask(outcome.threshold_level);
        let displaced = self.pair.registered.outcome.displaced.as_ref();
        let displaced = displaced.map(|part| (part, &strokes));
        view.overlay_on(view.print(image), &self.strokes(outcome), displaced)
    }
}

#[pymethods]
impl NativeAlignment {
    /// Restores an alignment from its state.
    #[new]
    fn restored(py: Python<'_>, numbers: &str, images: &[u8]) -> PyResult<Self> {
        let restored = py.detach(|| state::restore(numbers, images));
        let (pair, print) = restored.ok_or_else(|| {
            let text = "the pickled alignment is damaged";
            raise(py, "InputError", "damaged", text, None)
        })?;
        Ok(Self {
            pair: Arc::new(pair),
            print: Arc::new(print),
        })
    }

    /// Returns the numbers and the images.
    fn state<'py>(&self, py: Python<'py>) -> (String, Bound<'py, PyBytes>) {
        let (numbers, images) = py.detach(|| state::save(&self.pair, &self.print));
        (numbers, PyBytes::new(py, &images))
    }

    /// Returns the result as `align --json` prints it.
    fn json(&self) -> String {
        align::aligned_json(&self.pair, &self.print).to_string()
    }

    /// Returns the results of all stages in JSON.
    fn outcomes(&self) -> String {
        let pair = &self.pair;
        json!({"fit": pair.fit, "scale": pair.depth.scale, "register": pair.registered.outcome})
            .to_string()
    }

    /// Returns the map of a metric in JSON.
    fn print_from_mesh(&self, py: Python<'_>, metric: &str) -> PyResult<[[f64; 4]; 3]> {
        Ok(self.pair.print_from_mesh(self.outcome(py, metric)?.1).0)
    }

    /// Returns width, height and levels of the depth map.
    fn levels<'py>(&self, py: Python<'py>) -> (usize, usize, Bound<'py, PyArray1<u16>>) {
        let levels = &self.pair.depth.levels;
        (
            levels.width(),
            levels.height(),
            PyArray1::from_slice(py, levels.data()),
        )
    }

    /// Estimates the memory that the alignment and its print take, in bytes.
    fn held_bytes(&self) -> usize {
        state::held_bytes(&self.pair, &self.print)
    }

    /// Returns width and height of the print.
    fn print_size(&self) -> (usize, usize) {
        let rgb = &self.print.image().rgb;
        (rgb.width(), rgb.height())
    }

    /// Returns the pixels of the print that are ink.
    fn print_mask<'py>(&self, py: Python<'py>) -> PyMask<'py> {
        let masks = &self.pair.normalized.prints[self.pair.registered.outcome.ink];
        let ink = py.detach(|| masks.ink_of_print());
        PyArray1::from_slice(py, ink.data())
    }

    /// Returns the stroke mask of a metric in the frame of the depth map.
    fn mask<'py>(&self, py: Python<'py>, metric: &str) -> PyResult<PyMask<'py>> {
        let (_, outcome) = self.outcome(py, metric)?;
        let mask = py.detach(|| self.pair.depth.stroke_mask(outcome.threshold_level));
        Ok(PyArray1::from_slice(py, mask.data()))
    }

    /// Returns the stroke mask of a metric in the frame of the print.
    fn aligned_mask<'py>(&self, py: Python<'py>, metric: &str) -> PyResult<PyMask<'py>> {
        let (_, outcome) = self.outcome(py, metric)?;
        let mask = py.detach(|| self.strokes(outcome));
        Ok(PyArray1::from_slice(py, mask.data()))
    }

    /// Returns the side of the canvas, and where mask and ink of a metric disagree on it.
    fn stroke_map<'py>(
        &self,
        py: Python<'py>,
        metric: &str,
    ) -> PyResult<(usize, Bound<'py, PyArray1<u8>>)> {
        let (place, _) = self.outcome(py, metric)?;
        let map = self.pair.registered.stroke_maps.get(place);
        let map = map.ok_or_else(|| wrong_argument(py, "this method has no stroke maps"))?;
        Ok((map.width(), PyArray1::from_slice(py, map.data())))
    }

    /// Returns width, height and colours of the print with the edges of a metric's strokes.
    fn overlay<'py>(
        &self,
        py: Python<'py>,
        metric: &str,
    ) -> PyResult<(usize, usize, Bound<'py, PyArray1<u8>>)> {
        let (_, outcome) = self.outcome(py, metric)?;
        let picture = py.detach(|| self.picture(outcome));
        let data = PyArray1::from_slice(py, picture.data().as_flattened());
        Ok((picture.width(), picture.height(), data))
    }

    /// Returns the same picture as a PNG file.
    fn overlay_png<'py>(&self, py: Python<'py>, metric: &str) -> PyResult<Bound<'py, PyBytes>> {
        let (_, outcome) = self.outcome(py, metric)?;
        let file = py.detach(|| compact_rgb8(&self.picture(outcome)));
        Ok(PyBytes::new(py, &file))
    }

    /// Writes the files of `mocban align -o`. Returns a warning if earlier files could not be removed.
    fn save(&self, py: Python<'_>, dir: PathBuf) -> PyResult<Option<String>> {
        let (pair, print, folder) = (Arc::clone(&self.pair), Arc::clone(&self.print), dir.clone());
        let written = compute(py, None, move || {
            align::write_alignment(&folder, &pair, &print)
        })?;
        let left = written.map_err(|error| project_failure(py, &error, &dir))?;
        Ok(left.map(|(path, error)| {
            let path = path.display();
            format!("the earlier files were replaced but could not be removed from {path}: {error}")
        }))
    }
}

/// Class and message of a refusal, and whether the print is its cause.
type RefusalParts = (&'static str, String, bool);

/// Aligns a pair. Returns the alignment or why it is refused.
#[pyfunction]
pub(crate) fn align_pair(
    py: Python<'_>,
    mesh: &NativeMesh,
    print: &NativePrint,
    settings: &NativeSettings,
    scanned_face_down: Option<bool>,
    cancel: Option<&NativeCancel>,
) -> PyResult<(Option<NativeAlignment>, Option<RefusalParts>)> {
    let hints = ScanHints {
        unit: mesh.unit,
        scanned_face_down,
    };
    let (scan, image, stages) = (
        Arc::clone(&mesh.scan),
        print.image(),
        Arc::clone(&settings.stages),
    );
    let found = compute(py, cancel, move || {
        let print = image();
        let pair = align::align_pair(&scan, &print, hints, &stages)?;
        failpoint::hit("align", Point::Computed, None);
        Ok((state::needed(pair), print))
    })?;
    Ok(match found {
        Ok((pair, print)) => {
            let alignment = NativeAlignment {
                pair: Arc::new(pair),
                print,
            };
            (Some(alignment), None)
        }
        Err(AlignFailure {
            class,
            message,
            is_of_print,
        }) => (None, Some((class.name(), message, is_of_print))),
    })
}
